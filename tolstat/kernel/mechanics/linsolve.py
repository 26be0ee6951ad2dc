"""Direct solution of the tangent system by block elimination along the joint's structure.

Four chains pin - arm are connected to the hub; the arms of the output fork also to psi and s of the output shaft. Arms
are eliminated into pins and shaft, pins into hub and shaft; of hub and shaft, the hub first, then psi, then s. Each 6 x
6 block on the diagonal is inverted: a product with the inverse is six independent sums, while substitutions are one
long chain of dependent operations. Every diagonal has bushing stiffness, so the blocks are inverted without pivoting; a
zero or NaN pivot is reported. A shaft that is held has 1 on the diagonal of s and zeros beside it.
"""

from tolstat.kernel.mechanics.rotation import unspin
from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, HUB, N_LUMPS, PIN, PSI, S
from tolstat.kernel.mechanics.work import (
    ARM_PIN,
    ARM_SHAFT,
    HUB_PIN,
    HUB_SHAFT,
    OF_PSI,
    OF_S,
    PIN_ARM,
    PIN_HUB,
    PIN_SHAFT,
    SHAFT_ARM,
    SHAFT_HUB,
    SHAFT_PIN,
)
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import fma


@njit
def six(x, i):
    """Entries `i` to `i` + 5 of the vector `x`, shape (56,)."""
    return (x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5])


@njit
def put_six(x, i, a):
    """Write `a` to entries `i` to `i` + 5 of the vector `x`."""
    x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5] = a


@njit
def edge(e, of, i):
    """Vector `i` of the unknown `of` of the output shaft; `e`: shape (2, n, 6)."""
    return (e[of, i, 0], e[of, i, 1], e[of, i, 2], e[of, i, 3], e[of, i, 4], e[of, i, 5])


@njit
def put_edge(e, of, i, a):
    """Write `a` to vector `i` of the unknown `of` of the output shaft in `e`."""
    e[of, i, 0], e[of, i, 1], e[of, i, 2], e[of, i, 3], e[of, i, 4], e[of, i, 5] = a


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
def multiply_columns(m, b, c):
    """Replace matrix `c` of `m`, shape (n, 6, 6), by matrix `b` times it."""
    for j in range(6):
        put_column(m, c, j, product(m, b, column(m, c, j)))


@njit
def subtract_product(m, o, a, b):
    """Subtract matrix `a` of `m`, shape (n, 6, 6), times matrix `b` from matrix `o`."""
    for j in range(6):
        put_column(m, o, j, plus_product(column(m, o, j), m, a, minus(column(m, b, j))))


@njit
def factorise(work):
    """Factorise the tangent in place: eliminate arms and pins, invert the diagonal blocks.

    Returns
    -------
    bool
        False when a block is singular or not finite.
    """
    m = work.block
    good = True
    for unknown in (OF_PSI, OF_S):
        for i in range(6):
            work.edge[unknown, HUB_SHAFT, i] = work.edge[unknown, SHAFT_HUB, i] = 0.0
    for p in range(4):
        pin, a = PIN + p, ARM_OF_PIN[p]
        arm = ARM + a
        good = good & invert(m, arm)
        multiply_columns(m, arm, ARM_PIN + p)
        subtract_product(m, pin, PIN_ARM + p, ARM_PIN + p)
        good = good & invert(m, pin)
        multiply_columns(m, pin, PIN_HUB + p)
        subtract_product(m, HUB, HUB_PIN + p, PIN_HUB + p)
        if a >= 2:  # output fork
            eliminate_into_shaft(p, work)
    good = good & invert(m, HUB)
    return good & factorise_corner(work)


@njit
def eliminate_into_shaft(p, work):
    """Eliminate pin `p` and its arm from the columns and rows of the output shaft; their blocks are inverted."""
    m, e, corner = work.block, work.edge, work.corner
    pin, a = PIN + p, ARM_OF_PIN[p]
    for unknown in (OF_PSI, OF_S):
        by_arm = product(m, ARM + a, edge(e, unknown, ARM_SHAFT + a))
        put_edge(e, unknown, ARM_SHAFT + a, by_arm)
        by_pin = product(m, pin, product(m, PIN_ARM + p, minus(by_arm)))
        put_edge(e, unknown, PIN_SHAFT + p, by_pin)
        of_arm = edge(e, unknown, SHAFT_ARM + a)
        for i in range(6):
            e[unknown, SHAFT_PIN + p, i] = -dot(of_arm, column(m, ARM_PIN + p, i))
        put_edge(e, unknown, HUB_SHAFT, plus_product(edge(e, unknown, HUB_SHAFT), m, HUB_PIN + p, minus(by_pin)))
        of_pin = edge(e, unknown, SHAFT_PIN + p)
        put_edge(e, unknown, SHAFT_HUB, minus_row_product(edge(e, unknown, SHAFT_HUB), of_pin, m, PIN_HUB + p))
    for i in (OF_PSI, OF_S):
        of_arm, of_pin = edge(e, i, SHAFT_ARM + a), edge(e, i, SHAFT_PIN + p)
        for j in (OF_PSI, OF_S):
            corner[i, j] -= dot(of_arm, edge(e, j, ARM_SHAFT + a)) + dot(of_pin, edge(e, j, PIN_SHAFT + p))


@njit
def factorise_corner(work):
    """Eliminate the hub from psi and s, and psi from s; return False when a pivot is zero or not finite."""
    e, corner = work.edge, work.corner
    for unknown in (OF_PSI, OF_S):
        put_edge(e, unknown, HUB_SHAFT, product(work.block, HUB, edge(e, unknown, HUB_SHAFT)))
    for i in (OF_PSI, OF_S):
        for j in (OF_PSI, OF_S):
            corner[i, j] -= dot(edge(e, i, SHAFT_HUB), edge(e, j, HUB_SHAFT))
    pivot = 1 / corner[OF_PSI, OF_PSI]
    factor = corner[OF_S, OF_PSI] * pivot
    last = 1 / (corner[OF_S, OF_S] - factor * corner[OF_PSI, OF_S])
    corner[OF_PSI, OF_PSI], corner[OF_S, OF_PSI], corner[OF_S, OF_S] = pivot, factor, last
    return (abs(pivot) < 1e300) & (abs(last) < 1e300)


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

    Increments of attitude are converted to increments of the rotation vectors in `q`, shape (56,).
    """
    x, m, e = work.solution, work.block, work.edge
    hub, of_psi, of_s = six(x, 0), x[PSI], x[S]
    for p in range(4):
        pin, a = 6 * (PIN + p), ARM_OF_PIN[p]
        arm = 6 * (ARM + a)
        of_arm = product(m, ARM + a, six(x, arm))
        of_pin = product(m, PIN + p, plus_product(six(x, pin), m, PIN_ARM + p, minus(of_arm)))
        hub = plus_product(hub, m, HUB_PIN + p, minus(of_pin))
        if a >= 2:
            of_psi -= dot(edge(e, OF_PSI, SHAFT_ARM + a), of_arm) + dot(edge(e, OF_PSI, SHAFT_PIN + p), of_pin)
            of_s -= dot(edge(e, OF_S, SHAFT_ARM + a), of_arm) + dot(edge(e, OF_S, SHAFT_PIN + p), of_pin)
        put_six(x, arm, of_arm)
        put_six(x, pin, of_pin)
    hub = product(m, HUB, hub)
    of_psi -= dot(edge(e, OF_PSI, SHAFT_HUB), hub)
    of_s -= dot(edge(e, OF_S, SHAFT_HUB), hub)
    s = work.corner[OF_S, OF_S] * (of_s - work.corner[OF_S, OF_PSI] * of_psi)
    psi = work.corner[OF_PSI, OF_PSI] * (of_psi - work.corner[OF_PSI, OF_S] * s)
    x[PSI], x[S] = psi, s
    hub = less(less(hub, psi, edge(e, OF_PSI, HUB_SHAFT)), s, edge(e, OF_S, HUB_SHAFT))
    put_six(x, 0, hub)
    for p in range(4):
        pin, a = 6 * (PIN + p), ARM_OF_PIN[p]
        arm = 6 * (ARM + a)
        of_pin = plus_product(six(x, pin), m, PIN_HUB + p, minus(hub))
        if a >= 2:
            of_pin = less(less(of_pin, psi, edge(e, OF_PSI, PIN_SHAFT + p)), s, edge(e, OF_S, PIN_SHAFT + p))
        of_arm = plus_product(six(x, arm), m, ARM_PIN + p, minus(of_pin))
        if a >= 2:
            of_arm = less(less(of_arm, psi, edge(e, OF_PSI, ARM_SHAFT + a)), s, edge(e, OF_S, ARM_SHAFT + a))
        put_six(x, pin, of_pin)
        put_six(x, arm, of_arm)
    for body in range(N_LUMPS):
        i = 6 * body + 3
        x[i], x[i + 1], x[i + 2] = unspin((q[i], q[i + 1], q[i + 2]), (x[i], x[i + 1], x[i + 2]))
