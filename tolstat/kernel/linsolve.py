"""Direct solution of the tangent system along the joint's structure.

Four chains pin - arm hang on the hub; the arms of the output fork also hang on psi. Arms are eliminated into pins and
psi, pins into hub and psi, and a 7 x 7 system remains. Bushing stiffness stands on every diagonal, so the blocks are
factorised without pivoting; a zero or NaN pivot is reported.
"""

from tolstat.kernel._jit import njit
from tolstat.kernel.rotation import unspin
from tolstat.kernel.topology import ARM, ARM_OF_PIN, HUB, N_LUMPS, PIN, PSI


@njit
def factorise_block(blocks, b, n):
    """Replace the n x n matrix `b` by its factors L (unit diagonal) and U; the diagonal of U is inverted.

    Returns
    -------
    bool
        False when a pivot is zero or not finite.
    """
    good = True
    for k in range(n):
        pivot = 1 / blocks[b, k, k]
        good = good & (abs(pivot) < 1e300)
        blocks[b, k, k] = pivot
        for i in range(k + 1, n):
            factor = blocks[b, i, k] * pivot
            blocks[b, i, k] = factor
            for j in range(k + 1, n):
                blocks[b, i, j] -= factor * blocks[b, k, j]
    return good


@njit
def solve_block(blocks, b, n, x, first):
    """Solve matrix `b` for the right-hand side ``x[first : first + n]``, in place."""
    for i in range(1, n):
        for j in range(i):
            x[first + i] -= blocks[b, i, j] * x[first + j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[first + i] -= blocks[b, i, j] * x[first + j]
        x[first + i] *= blocks[b, i, i]


@njit
def solve_columns(blocks, b, columns, c):
    """Solve the 6 x 6 matrix `b` for all columns of ``columns[c]``, in place."""
    for i in range(1, 6):
        for j in range(i):
            factor = blocks[b, i, j]
            for k in range(6):
                columns[c, i, k] -= factor * columns[c, j, k]
    for i in range(5, -1, -1):
        for j in range(i + 1, 6):
            factor = blocks[b, i, j]
            for k in range(6):
                columns[c, i, k] -= factor * columns[c, j, k]
        pivot = blocks[b, i, i]
        for k in range(6):
            columns[c, i, k] *= pivot


@njit
def solve_row(blocks, b, rows, r, scratch):
    """Solve the 6 x 6 matrix `b` for the right-hand side ``rows[r]``, in place."""
    for i in range(6):
        scratch[i] = rows[r, i]
    solve_block(blocks, b, 6, scratch, 0)
    for i in range(6):
        rows[r, i] = scratch[i]


@njit
def subtract_product(out, o, left, a, right, b):
    """out[o] -= left[a] right[b], all 6 x 6 (``out[o]`` may be larger)."""
    for i in range(6):
        for k in range(6):
            factor = left[a, i, k]
            for j in range(6):
                out[o, i, j] -= factor * right[b, k, j]


@njit
def factorise(work):
    """Eliminate arms and pins and factorise what remains; all in place.

    Returns
    -------
    bool
        False when a block is singular or not finite.
    """
    d, core = work.lump_block, work.core
    good = True
    for i in range(6):
        core[0, i, 6] = core[0, 6, i] = 0.0
    for p in range(4):
        pin, a = PIN + p, ARM_OF_PIN[p]
        arm = ARM + a
        good = good & factorise_block(d, arm, 6)
        solve_columns(d, arm, work.arm_pin, p)
        for i in range(6):
            work.pin_psi[p, i] = work.psi_pin[p, i] = 0.0
        subtract_product(d, pin, work.pin_arm, p, work.arm_pin, p)
        if a >= 2:  # output fork
            solve_row(d, arm, work.arm_psi, a, work.solution)
            for i in range(6):
                core[0, 6, 6] -= work.psi_arm[a, i] * work.arm_psi[a, i]
            for i in range(6):
                for k in range(6):
                    work.pin_psi[p, i] -= work.pin_arm[p, i, k] * work.arm_psi[a, k]
                    work.psi_pin[p, i] -= work.psi_arm[a, k] * work.arm_pin[p, k, i]
        good = good & factorise_block(d, pin, 6)
        solve_columns(d, pin, work.pin_hub, p)
        subtract_product(d, HUB, work.hub_pin, p, work.pin_hub, p)
        if a >= 2:
            solve_row(d, pin, work.pin_psi, p, work.solution)
            for i in range(6):
                core[0, 6, 6] -= work.psi_pin[p, i] * work.pin_psi[p, i]
            for i in range(6):
                for k in range(6):
                    core[0, i, 6] -= work.hub_pin[p, i, k] * work.pin_psi[p, k]
                    core[0, 6, i] -= work.psi_pin[p, k] * work.pin_hub[p, k, i]
    for i in range(6):
        for j in range(6):
            core[0, i, j] = d[HUB, i, j]
    return good & factorise_block(core, 0, 7)


@njit
def solve(q, work):
    """Solve the factorised system for ``work.solution``, in place; the result is an increment of the unknowns.

    Increments of attitude are converted to increments of the rotation vectors in `q`, shape (55,).
    """
    x, d = work.solution, work.lump_block
    rest = x[PSI]
    for p in range(4):
        pin, a = 6 * (PIN + p), ARM_OF_PIN[p]
        arm = 6 * (ARM + a)
        solve_block(d, ARM + a, 6, x, arm)
        for i in range(6):
            for k in range(6):
                x[pin + i] -= work.pin_arm[p, i, k] * x[arm + k]
        if a >= 2:
            for k in range(6):
                rest -= work.psi_arm[a, k] * x[arm + k]
        solve_block(d, PIN + p, 6, x, pin)
        for i in range(6):
            for k in range(6):
                x[i] -= work.hub_pin[p, i, k] * x[pin + k]
            rest -= work.psi_pin[p, i] * x[pin + i]
    # the core is 7 long: hub, then psi, which takes the place of pin 1's first unknown meanwhile
    kept = x[6]
    x[6] = rest
    solve_block(work.core, 0, 7, x, 0)
    x[PSI] = x[6]
    x[6] = kept
    for p in range(4):
        pin, a = 6 * (PIN + p), ARM_OF_PIN[p]
        arm = 6 * (ARM + a)
        for i in range(6):
            for k in range(6):
                x[pin + i] -= work.pin_hub[p, i, k] * x[k]
            x[pin + i] -= work.pin_psi[p, i] * x[PSI]
        for i in range(6):
            for k in range(6):
                x[arm + i] -= work.arm_pin[p, i, k] * x[pin + k]
            if a >= 2:
                x[arm + i] -= work.arm_psi[a, i] * x[PSI]
    for body in range(N_LUMPS):
        i = 6 * body + 3
        x[i], x[i + 1], x[i + 2] = unspin((q[i], q[i + 1], q[i + 2]), (x[i], x[i + 1], x[i + 2]))
