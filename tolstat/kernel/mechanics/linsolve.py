"""Direct solution of the tangent system by block elimination along the mechanism's structure.

Lumps are eliminated in the order of a plan (`common.elimination`), then the unknowns of shafts, the border. Of a Cardan
joint arms are eliminated into pins and shaft, pins into hub and shaft; of hub and shaft, the hub first, then psi, then
s. The matrix is symmetric: blocks below the diagonal, and entries below the diagonal of a block on it, are not stored.
Each 6 x 6 block on the diagonal is inverted: a product with the inverse is six independent sums, while substitutions
are one long chain of dependent operations. Every diagonal has bushing stiffness, so the blocks are inverted without
pivoting; a zero or NaN determinant is reported. A shaft that is held has 1 on the diagonal of s and zeros beside it.
"""

from tolstat.kernel.mechanics import vector
from tolstat.kernel.mechanics.rotation import unspin
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import fma, reciprocal


@njit
def six(x, i):
    """Entries `i` to `i` + 5 of the vector `x`, shape (n,)."""
    return (x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5])


@njit
def put_six(x, i, a):
    """Write `a` to entries `i` to `i` + 5 of the vector `x`."""
    x[i], x[i + 1], x[i + 2], x[i + 3], x[i + 4], x[i + 5] = a


@njit
def edge(e, of, body):
    """Column of the shafts' unknown `of`, rows of a lump; `e`: shape (unknowns, lumps, 6)."""
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
def eliminate(step, m, par):
    """Eliminate the lump of a step: invert its block, multiply those beside it by the inverse, reduce what follows.

    `m`: all blocks, shape (n, 6, 6). Returns whether the block is regular and finite.
    """
    lump, first = par.step_lump[step], par.step_first[step]
    regular = invert(m, lump)
    for y in range(par.step_first[step + 1] - 1, first - 1, -1):  # earlier ones are still those before the product
        between, following = par.between[y], par.following[y]
        for j in range(5, -1, -1):  # and so are columns up to j
            solved = symmetric_product(m, lump, column(m, between, j))
            for i in range(j + 1):
                m[following, i, j] -= dot(column(m, between, i), solved)
            for z in range(par.target_first[y], par.target_first[y + 1]):
                other, target = par.between[first + z - par.target_first[y]], par.target[z]
                for i in range(6):
                    m[target, i, j] -= dot(column(m, other, i), solved)
            put_column(m, between, j, solved)
    return regular


@njit
def eliminate_border(step, par, work):
    """Reduce the columns of the shafts' unknowns by the lump of a step, multiply its own by the inverse."""
    m, e, corner = work.block, work.edge, work.corner
    lump, begin, end = par.step_lump[step], par.column_first[step], par.column_first[step + 1]
    for x in range(begin, end):
        unknown = par.column[x]
        for y in range(par.step_first[step], par.step_first[step + 1]):
            of_following = edge(e, unknown, par.following[y])
            reduced = minus_transposed_product(of_following, m, par.between[y], edge(e, unknown, lump))
            put_edge(e, unknown, par.following[y], reduced)
    for x in range(end - 1, begin - 1, -1):
        unknown = par.column[x]
        solved = symmetric_product(m, lump, edge(e, unknown, lump))
        for z in range(begin, x + 1):
            corner[par.column[z], unknown] -= dot(edge(e, par.column[z], lump), solved)
        put_edge(e, unknown, lump, solved)


@njit
def factorise(par, work):
    """Factorise the tangent in place; return where it is regular and finite."""
    m, e, corner = work.block, work.edge, work.corner
    regular = True
    none = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for x in range(par.filled.shape[0]):
        put_edge(e, par.filled[x, 0], par.filled[x, 1], none)
    for step in range(par.step_lump.shape[0]):
        regular = regular & eliminate(step, m, par)
        eliminate_border(step, par, work)
    border = corner.shape[0]
    for i in range(border):
        pivot = reciprocal(corner[i, i])
        regular = regular & (abs(pivot) < 1e300)
        for j in range(border - 1, i, -1):
            factor = corner[i, j] * pivot
            for k in range(i + 1, j + 1):
                corner[k, j] -= factor * corner[i, k]
            corner[i, j] = factor
        corner[i, i] = pivot
    return regular


@njit
def solve(q, par, work):
    """Solve the factorised system for ``work.solution``, in place; the result is an increment of the unknowns.

    Increments of attitude are converted to increments of the rotation vectors in `q`, shape (n,).
    """
    x, m, e, corner = work.solution, work.block, work.edge, work.corner
    lumps, border = par.step_lump.shape[0], corner.shape[0]
    shafts = 6 * lumps
    for step in range(lumps):
        lump = par.step_lump[step]
        of_lump = six(x, 6 * lump)
        for y in range(par.step_first[step], par.step_first[step + 1]):
            i = 6 * par.following[y]
            put_six(x, i, minus_transposed_product(six(x, i), m, par.between[y], of_lump))
        for z in range(par.column_first[step], par.column_first[step + 1]):
            x[shafts + par.column[z]] -= dot(edge(e, par.column[z], lump), of_lump)
    for i in range(border):
        for j in range(i + 1, border):
            x[shafts + j] -= corner[i, j] * x[shafts + i]
    for i in range(border - 1, -1, -1):
        value = corner[i, i] * x[shafts + i]
        for j in range(i + 1, border):
            value = value - corner[i, j] * x[shafts + j]
        x[shafts + i] = value
    for step in range(lumps - 1, -1, -1):
        lump = par.step_lump[step]
        of_lump = symmetric_product(m, lump, six(x, 6 * lump))
        for y in range(par.step_first[step], par.step_first[step + 1]):
            of_lump = minus_product(of_lump, m, par.between[y], six(x, 6 * par.following[y]))
        for z in range(par.column_first[step], par.column_first[step + 1]):
            of_lump = less(of_lump, x[shafts + par.column[z]], edge(e, par.column[z], lump))
        put_six(x, 6 * lump, of_lump)
    for lump in range(lumps):
        i = 6 * lump + 3
        x[i], x[i + 1], x[i + 2] = unspin((q[i], q[i + 1], q[i + 2]), (x[i], x[i + 1], x[i + 2]))
