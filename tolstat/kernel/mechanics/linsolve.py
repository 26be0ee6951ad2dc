"""Direct solution of the tangent system by block elimination along the joint's structure.

Four chains pin - arm are connected to the hub; the arms of the output fork also to psi and s of the output shaft. Arms
are eliminated into pins and shaft, pins into hub and shaft; of hub and shaft, the hub first, then psi, then s. The
matrix is symmetric: blocks below the diagonal, and entries below the diagonal of a block on it, are not stored. Each
6 x 6 block on the diagonal is inverted: a product with the inverse is six independent sums, while substitutions are one
long chain of dependent operations. Every diagonal has bushing stiffness, so the blocks are inverted without pivoting; a
zero or NaN determinant is reported. A shaft that is held has 1 on the diagonal of s and zeros beside it.
"""

from tolstat.kernel.mechanics import vector
from tolstat.kernel.mechanics.rotation import unspin
from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, HUB, N_LUMPS, PIN, PSI, S
from tolstat.kernel.mechanics.work import ARM_PIN, OF_PSI, OF_S, PIN_HUB
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import fma, reciprocal


@njit
def six(x, i):
    """Entries `i` to `i` + 5 of the vector `x`, shape (56,)."""
    return (x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5])


@njit
def put_six(x, i, a):
    """Write `a` to entries `i` to `i` + 5 of the vector `x`."""
    x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5] = a


@njit
def edge(e, of, body):
    """Column of the unknown `of` of the output shaft, rows of a lump; `e`: shape (2, 9, 6)."""
    return (e[of, body, 0], e[of, body, 1], e[of, body, 2], e[of, body, 3], e[of, body, 4], e[of, body, 5])


@njit
def put_edge(e, of, body, a):
    """Write `a` to the column of the unknown `of` in `e`, rows of a lump."""
    e[of, body, 0], e[of, body, 1], e[of, body, 2], e[of, body, 3], e[of, body, 4], e[of, body, 5] = a


@njit
def column(m, b, j):
    """Column `j` of matrix `b` of `m`, shape (n, 6, 6)."""
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
def minus_product(c, m, b, a):
    """Return `c` minus matrix `b` of `m` times `a`."""
    a = minus(a)
    return (
        of_row(m, b, 0, a, c[0]),
        of_row(m, b, 1, a, c[1]),
        of_row(m, b, 2, a, c[2]),
        of_row(m, b, 3, a, c[3]),
        of_row(m, b, 4, a, c[4]),
        of_row(m, b, 5, a, c[5]),
    )


@njit
def minus_transposed_product(c, m, b, a):
    """Return `c` minus the transpose of matrix `b` of `m` times `a`."""
    return (
        c[0] - dot(column(m, b, 0), a),
        c[1] - dot(column(m, b, 1), a),
        c[2] - dot(column(m, b, 2), a),
        c[3] - dot(column(m, b, 3), a),
        c[4] - dot(column(m, b, 4), a),
        c[5] - dot(column(m, b, 5), a),
    )


@njit
def symmetric_product(m, b, a):
    """Symmetric matrix `b` of `m` times `a`."""
    return (
        dot((m[b, 0, 0], m[b, 0, 1], m[b, 0, 2], m[b, 0, 3], m[b, 0, 4], m[b, 0, 5]), a),
        dot((m[b, 0, 1], m[b, 1, 1], m[b, 1, 2], m[b, 1, 3], m[b, 1, 4], m[b, 1, 5]), a),
        dot((m[b, 0, 2], m[b, 1, 2], m[b, 2, 2], m[b, 2, 3], m[b, 2, 4], m[b, 2, 5]), a),
        dot((m[b, 0, 3], m[b, 1, 3], m[b, 2, 3], m[b, 3, 3], m[b, 3, 4], m[b, 3, 5]), a),
        dot((m[b, 0, 4], m[b, 1, 4], m[b, 2, 4], m[b, 3, 4], m[b, 4, 4], m[b, 4, 5]), a),
        dot(column(m, b, 5), a),
    )


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
def invert_three(s):
    """Inverse of a symmetric 3 x 3 matrix with a positive trace, and whether it is regular and finite.

    Matrices are given by their entries 00, 01, 02, 11, 12, 22. They are scaled to the trace 1: with short steps the
    determinant, the third power of m / h^2, would be too large for single precision.
    """
    scale = reciprocal(s[0] + s[3] + s[5])
    s = (scale * s[0], scale * s[1], scale * s[2], scale * s[3], scale * s[4], scale * s[5])
    of_x = fma(s[3], s[5], -s[4] * s[4]), fma(s[2], s[4], -s[1] * s[5]), fma(s[1], s[4], -s[2] * s[3])
    det = vector.dot((s[0], s[1], s[2]), of_x)
    of_y = fma(s[0], s[5], -s[2] * s[2]), fma(s[1], s[2], -s[0] * s[4])
    of_z = fma(s[0], s[3], -s[1] * s[1])
    r = scale * reciprocal(det)
    return (r * of_x[0], r * of_x[1], r * of_x[2], r * of_y[0], r * of_y[1], r * of_z), abs(r) < 1e300


@njit
def times_three(s, a):
    """Symmetric 3 x 3 matrix, given as in `invert_three`, times `a`."""
    return (
        vector.dot((s[0], s[1], s[2]), a),
        vector.dot((s[1], s[3], s[4]), a),
        vector.dot((s[2], s[4], s[5]), a),
    )


@njit
def rows_of(columns):
    """Rows of a 3 x 3 matrix given by its columns."""
    x, y, z = columns
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


@njit
def invert(m, b):
    """Replace the symmetric 6 x 6 matrix `b` of `m` by its inverse; return whether it is regular and finite.

    With the 3 x 3 blocks x, y, y^T, z: w = x^-1 y, t = (z - y^T w)^-1, and the inverse is x^-1 + w t w^T, -w t, t.
    """
    x = (m[b, 0, 0], m[b, 0, 1], m[b, 0, 2], m[b, 1, 1], m[b, 1, 2], m[b, 2, 2])
    y0, y1, y2 = (
        (m[b, 0, 3], m[b, 1, 3], m[b, 2, 3]),
        (m[b, 0, 4], m[b, 1, 4], m[b, 2, 4]),
        (m[b, 0, 5], m[b, 1, 5], m[b, 2, 5]),
    )
    x, regular = invert_three(x)
    w0, w1, w2 = times_three(x, y0), times_three(x, y1), times_three(x, y2)
    t, rest_regular = invert_three(
        (
            m[b, 3, 3] - vector.dot(y0, w0),
            m[b, 3, 4] - vector.dot(y0, w1),
            m[b, 3, 5] - vector.dot(y0, w2),
            m[b, 4, 4] - vector.dot(y1, w1),
            m[b, 4, 5] - vector.dot(y1, w2),
            m[b, 5, 5] - vector.dot(y2, w2),
        )
    )
    m[b, 3, 3], m[b, 3, 4], m[b, 3, 5], m[b, 4, 4], m[b, 4, 5], m[b, 5, 5] = t
    w = rows_of((w0, w1, w2))
    v = times_three(t, w[0]), times_three(t, w[1]), times_three(t, w[2])  # rows of w t
    m[b, 0, 3], m[b, 0, 4], m[b, 0, 5] = -v[0][0], -v[0][1], -v[0][2]
    m[b, 1, 3], m[b, 1, 4], m[b, 1, 5] = -v[1][0], -v[1][1], -v[1][2]
    m[b, 2, 3], m[b, 2, 4], m[b, 2, 5] = -v[2][0], -v[2][1], -v[2][2]
    m[b, 0, 0], m[b, 0, 1] = x[0] + vector.dot(w[0], v[0]), x[1] + vector.dot(w[0], v[1])
    m[b, 0, 2], m[b, 1, 1] = x[2] + vector.dot(w[0], v[2]), x[3] + vector.dot(w[1], v[1])
    m[b, 1, 2], m[b, 2, 2] = x[4] + vector.dot(w[1], v[2]), x[5] + vector.dot(w[2], v[2])
    return regular & rest_regular


@njit
def eliminate(lump, following, between, m):
    """Eliminate `lump`: invert its block, multiply matrix `between` by the inverse, and reduce the block `following`.

    `between` has rows of the lump and columns of the one that follows; `m`: all blocks, shape (n, 6, 6). Returns
    whether the block is regular and finite.
    """
    regular = invert(m, lump)
    for j in range(5, -1, -1):  # columns up to j are still those before the product
        solved = symmetric_product(m, lump, column(m, between, j))
        for i in range(j + 1):
            m[following, i, j] -= dot(column(m, between, i), solved)
        put_column(m, between, j, solved)
    return regular


@njit
def reduce_corner(lump, work):
    """Multiply the columns psi and s of a lump by the inverse of its block, and reduce the corner."""
    m, e, corner = work.block, work.edge, work.corner
    of_psi, of_s = edge(e, OF_PSI, lump), edge(e, OF_S, lump)
    by_psi, by_s = symmetric_product(m, lump, of_psi), symmetric_product(m, lump, of_s)
    corner[OF_PSI, OF_PSI] -= dot(of_psi, by_psi)
    corner[OF_PSI, OF_S] -= dot(of_psi, by_s)
    corner[OF_S, OF_S] -= dot(of_s, by_s)
    put_edge(e, OF_PSI, lump, by_psi)
    put_edge(e, OF_S, lump, by_s)


@njit
def factorise(work):
    """Factorise the tangent in place: eliminate arms, pins, hub, and psi; return where it is regular and finite."""
    m, e, corner = work.block, work.edge, work.corner
    regular = True
    none = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    put_edge(e, OF_PSI, HUB, none)
    put_edge(e, OF_S, HUB, none)
    for p in range(4):
        pin, arm = PIN + p, ARM + ARM_OF_PIN[p]
        regular = regular & eliminate(arm, pin, ARM_PIN + p, m) & eliminate(pin, HUB, PIN_HUB + p, m)
        if ARM_OF_PIN[p] < 2:  # input fork
            continue
        for unknown in (OF_PSI, OF_S):
            put_edge(e, unknown, pin, none)  # read back, the zeros have the precision of the tangent
            of_pin = minus_transposed_product(edge(e, unknown, pin), m, ARM_PIN + p, edge(e, unknown, arm))
            of_hub = minus_transposed_product(edge(e, unknown, HUB), m, PIN_HUB + p, of_pin)
            put_edge(e, unknown, pin, of_pin)
            put_edge(e, unknown, HUB, of_hub)
        reduce_corner(arm, work)
        reduce_corner(pin, work)
    regular = regular & invert(m, HUB)
    reduce_corner(HUB, work)
    pivot = reciprocal(corner[OF_PSI, OF_PSI])
    factor = corner[OF_PSI, OF_S] * pivot
    last = reciprocal(corner[OF_S, OF_S] - factor * corner[OF_PSI, OF_S])
    corner[OF_PSI, OF_PSI], corner[OF_PSI, OF_S], corner[OF_S, OF_S] = pivot, factor, last
    return regular & (abs(pivot) < 1e300) & (abs(last) < 1e300)


@njit
def solve(q, work):
    """Solve the factorised system for ``work.solution``, in place; the result is an increment of the unknowns.

    Increments of attitude are converted to increments of the rotation vectors in `q`, shape (56,).
    """
    x, m, e, corner = work.solution, work.block, work.edge, work.corner
    hub, of_psi, of_s = six(x, 0), x[PSI], x[S]
    for p in range(4):
        pin, arm = PIN + p, ARM + ARM_OF_PIN[p]
        of_arm = six(x, 6 * arm)
        of_pin = minus_transposed_product(six(x, 6 * pin), m, ARM_PIN + p, of_arm)
        hub = minus_transposed_product(hub, m, PIN_HUB + p, of_pin)
        put_six(x, 6 * pin, of_pin)
        if ARM_OF_PIN[p] >= 2:
            of_psi = of_psi - dot(edge(e, OF_PSI, arm), of_arm) - dot(edge(e, OF_PSI, pin), of_pin)
            of_s = of_s - dot(edge(e, OF_S, arm), of_arm) - dot(edge(e, OF_S, pin), of_pin)
    of_psi -= dot(edge(e, OF_PSI, HUB), hub)
    of_s -= dot(edge(e, OF_S, HUB), hub)
    s = corner[OF_S, OF_S] * (of_s - corner[OF_PSI, OF_S] * of_psi)
    psi = corner[OF_PSI, OF_PSI] * of_psi - corner[OF_PSI, OF_S] * s
    x[PSI], x[S] = psi, s
    hub = less(less(symmetric_product(m, HUB, hub), psi, edge(e, OF_PSI, HUB)), s, edge(e, OF_S, HUB))
    put_six(x, 0, hub)
    for p in range(4):
        pin, arm = PIN + p, ARM + ARM_OF_PIN[p]
        of_pin = minus_product(symmetric_product(m, pin, six(x, 6 * pin)), m, PIN_HUB + p, hub)
        if ARM_OF_PIN[p] >= 2:
            of_pin = less(less(of_pin, psi, edge(e, OF_PSI, pin)), s, edge(e, OF_S, pin))
        of_arm = minus_product(symmetric_product(m, arm, six(x, 6 * arm)), m, ARM_PIN + p, of_pin)
        if ARM_OF_PIN[p] >= 2:
            of_arm = less(less(of_arm, psi, edge(e, OF_PSI, arm)), s, edge(e, OF_S, arm))
        put_six(x, 6 * pin, of_pin)
        put_six(x, 6 * arm, of_arm)
    for body in range(N_LUMPS):
        i = 6 * body + 3
        x[i], x[i + 1], x[i + 2] = unspin((q[i], q[i + 1], q[i + 2]), (x[i], x[i + 1], x[i + 2]))
