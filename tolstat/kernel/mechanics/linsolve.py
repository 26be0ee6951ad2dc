"""Direct solution of the tangent system by block elimination along the joint's structure.

Four chains pin - arm are connected to the hub; the arms of the output fork also to psi. Arms are eliminated into pins
and psi, pins into hub and psi, and the hub and psi remain. Each 6 x 6 block on the diagonal is inverted: a product with
the inverse is six independent sums, while substitutions are one long chain of dependent operations. Every diagonal has
bushing stiffness, so the blocks are inverted without pivoting; a zero or NaN pivot is reported.
"""

from tolstat.kernel.mechanics.rotation import unspin
from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, HUB, N_LUMPS, PIN, PSI
from tolstat.kernel.mechanics.work import PSI_COLUMN, PSI_PSI, PSI_ROW
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import fma


@njit
def six(x, i):
    """Entries `i` to `i` + 5 of a vector."""
    return (x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5])


@njit
def put_six(x, i, a):
    """Write `a` to entries `i` to `i` + 5 of a vector."""
    x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5] = a


@njit
def row(m, b, i):
    """Row `i` of matrix `b` of `m`, shape (n, 6, 6)."""
    return (m[b, i, 0], m[b, i, 1], m[b, i, 2], m[b, i, 3], m[b, i, 4], m[b, i, 5])


@njit
def put_row(m, b, i, a):
    """Write `a` to row `i` of matrix `b` of `m`."""
    m[b, i, 0], m[b, i, 1], m[b, i, 2], m[b, i, 3], m[b, i, 4], m[b, i, 5] = a


@njit
def column(m, b, j):
    """Column `j` of matrix `b` of `m`."""
    return (m[b, 0, j], m[b, 1, j], m[b, 2, j], m[b, 3, j], m[b, 4, j], m[b, 5, j])


@njit
def put_column(m, b, j, a):
    """Write `a` to column `j` of matrix `b` of `m`."""
    m[b, 0, j], m[b, 1, j], m[b, 2, j], m[b, 3, j], m[b, 4, j], m[b, 5, j] = a


@njit
def dot(a, b):
    """Scalar product of two vectors of six."""
    low = fma(a[2], b[2], fma(a[1], b[1], a[0] * b[0]))
    return low + fma(a[5], b[5], fma(a[4], b[4], a[3] * b[3]))


@njit
def of_row(m, b, i, a, c):
    """Row `i` of matrix `b` of `m` times `a`, plus `c`."""
    low = fma(m[b, i, 2], a[2], fma(m[b, i, 1], a[1], fma(m[b, i, 0], a[0], c)))
    return fma(m[b, i, 5], a[5], fma(m[b, i, 4], a[4], fma(m[b, i, 3], a[3], low)))


@njit
def product(m, b, a):
    """Matrix `b` of `m` times `a`."""
    return plus_product((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), m, b, a)


@njit
def plus_product(c, m, b, a):
    """Return `c` plus matrix `b` of `m` times `a`."""
    return (
        of_row(m, b, 0, a, c[0]),
        of_row(m, b, 1, a, c[1]),
        of_row(m, b, 2, a, c[2]),
        of_row(m, b, 3, a, c[3]),
        of_row(m, b, 4, a, c[4]),
        of_row(m, b, 5, a, c[5]),
    )


@njit
def times(s, a):
    """Return s a."""
    return (s * a[0], s * a[1], s * a[2], s * a[3], s * a[4], s * a[5])


@njit
def minus(a):
    """Return -a."""
    return (-a[0], -a[1], -a[2], -a[3], -a[4], -a[5])


@njit
def less(a, s, b):
    """Return a - s b."""
    s = -s
    return (
        fma(s, b[0], a[0]),
        fma(s, b[1], a[1]),
        fma(s, b[2], a[2]),
        fma(s, b[3], a[3]),
        fma(s, b[4], a[4]),
        fma(s, b[5], a[5]),
    )


@njit
def invert(m, b):
    """Replace the 6 x 6 matrix `b` of `m` by its inverse (Gauss-Jordan).

    Returns
    -------
    bool
        False when a pivot is zero or not finite.
    """
    good = True
    for k in range(6):
        pivot = 1 / m[b, k, k]
        good = good & (abs(pivot) < 1e300)
        m[b, k, k] = 1.0
        pivots = times(pivot, row(m, b, k))
        put_row(m, b, k, pivots)
        for i in range(6):
            if i != k:
                factor = m[b, i, k]
                m[b, i, k] = 0.0
                put_row(m, b, i, less(row(m, b, i), factor, pivots))
    return good


@njit
def multiply_columns(m, b, columns, c):
    """Replace matrix `c` of `columns`, shape (n, 6, 6), by matrix `b` of `m` times it."""
    for j in range(6):
        put_column(columns, c, j, product(m, b, column(columns, c, j)))


@njit
def subtract_product(out, o, left, a, right, b):
    """Subtract matrix `a` of `left` times matrix `b` of `right` from matrix `o` of `out`; all (n, 6, 6)."""
    for j in range(6):
        put_column(out, o, j, plus_product(column(out, o, j), left, a, minus(column(right, b, j))))


@njit
def factorise(work):
    """Factorise the tangent in place: eliminate arms and pins, invert the diagonal blocks.

    Returns
    -------
    bool
        False when a block is singular or not finite.
    """
    d, core = work.lump_block, work.core
    good = True
    for i in range(6):
        core[0, PSI_COLUMN, i] = core[0, PSI_ROW, i] = 0.0
    to_psi, from_psi, rest = six(core[0, PSI_COLUMN], 0), six(core[0, PSI_ROW], 0), core[0, PSI_PSI, 0]
    for p in range(4):
        pin, a = PIN + p, ARM_OF_PIN[p]
        arm = ARM + a
        good = good & invert(d, arm)
        multiply_columns(d, arm, work.arm_pin, p)
        subtract_product(d, pin, work.pin_arm, p, work.arm_pin, p)
        good = good & invert(d, pin)
        multiply_columns(d, pin, work.pin_hub, p)
        subtract_product(d, HUB, work.hub_pin, p, work.pin_hub, p)
        for i in range(6):
            work.pin_psi[p, i] = work.psi_pin[p, i] = 0.0
        if a >= 2:  # output fork
            of_psi = six(work.psi_arm[a], 0)
            by_arm = product(d, arm, six(work.arm_psi[a], 0))
            put_six(work.arm_psi[a], 0, by_arm)
            by_pin = product(d, pin, product(work.pin_arm, p, minus(by_arm)))
            put_six(work.pin_psi[p], 0, by_pin)
            for i in range(6):
                work.psi_pin[p, i] = -dot(of_psi, column(work.arm_pin, p, i))
            row_of_pin = six(work.psi_pin[p], 0)
            rest -= dot(of_psi, by_arm) + dot(row_of_pin, by_pin)
            to_psi = plus_product(to_psi, work.hub_pin, p, minus(by_pin))
            from_psi = minus_row_product(from_psi, row_of_pin, work.pin_hub, p)
    good = good & invert(d, HUB)
    by_hub = product(d, HUB, to_psi)
    put_six(core[0, PSI_COLUMN], 0, by_hub)
    put_six(core[0, PSI_ROW], 0, from_psi)
    pivot = 1 / (rest - dot(from_psi, by_hub))
    core[0, PSI_PSI, 0] = pivot
    return good & (abs(pivot) < 1e300)


@njit
def minus_row_product(c, a, m, b):
    """Return `c` minus the row `a` times matrix `b` of `m`."""
    return (
        c[0] - dot(a, column(m, b, 0)),
        c[1] - dot(a, column(m, b, 1)),
        c[2] - dot(a, column(m, b, 2)),
        c[3] - dot(a, column(m, b, 3)),
        c[4] - dot(a, column(m, b, 4)),
        c[5] - dot(a, column(m, b, 5)),
    )


@njit
def solve(q, work):
    """Solve the factorised system for ``work.solution``, in place; the result is an increment of the unknowns.

    Increments of attitude are converted to increments of the rotation vectors in `q`, shape (55,).
    """
    x, d, core = work.solution, work.lump_block, work.core
    hub, rest = six(x, 0), x[PSI]
    for p in range(4):
        pin, a = 6 * (PIN + p), ARM_OF_PIN[p]
        arm = 6 * (ARM + a)
        of_arm = product(d, ARM + a, six(x, arm))
        of_pin = product(d, PIN + p, plus_product(six(x, pin), work.pin_arm, p, minus(of_arm)))
        hub = plus_product(hub, work.hub_pin, p, minus(of_pin))
        if a >= 2:
            rest -= dot(six(work.psi_arm[a], 0), of_arm) + dot(six(work.psi_pin[p], 0), of_pin)
        put_six(x, arm, of_arm)
        put_six(x, pin, of_pin)
    hub = product(d, HUB, hub)
    psi = core[0, PSI_PSI, 0] * (rest - dot(six(core[0, PSI_ROW], 0), hub))
    x[PSI] = psi
    hub = less(hub, psi, six(core[0, PSI_COLUMN], 0))
    put_six(x, 0, hub)
    for p in range(4):
        pin, a = 6 * (PIN + p), ARM_OF_PIN[p]
        arm = 6 * (ARM + a)
        of_pin = plus_product(six(x, pin), work.pin_hub, p, minus(hub))
        if a >= 2:
            of_pin = less(of_pin, psi, six(work.pin_psi[p], 0))
        of_arm = plus_product(six(x, arm), work.arm_pin, p, minus(of_pin))
        if a >= 2:
            of_arm = less(of_arm, psi, six(work.arm_psi[a], 0))
        put_six(x, pin, of_pin)
        put_six(x, arm, of_arm)
    for body in range(N_LUMPS):
        i = 6 * body + 3
        x[i], x[i + 1], x[i + 2] = unspin((q[i], q[i + 1], q[i + 2]), (x[i], x[i + 1], x[i + 2]))
