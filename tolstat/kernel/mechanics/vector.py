"""Vectors of three as tuples: they stay in registers, and nothing is allocated."""

from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import fma, where


@njit
def add(a, b):
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@njit
def sub(a, b):
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@njit
def scale(s, a):
    """Return s a."""
    return (s * a[0], s * a[1], s * a[2])


@njit
def axpy(s, a, b):
    """Return s a + b."""
    return (fma(s, a[0], b[0]), fma(s, a[1], b[1]), fma(s, a[2], b[2]))


@njit
def dot(a, b):
    """Return the scalar product."""
    return fma(a[2], b[2], fma(a[1], b[1], a[0] * b[0]))


@njit
def cross(a, b):
    """Return the vector product a x b."""
    return (
        fma(a[1], b[2], -(a[2] * b[1])),
        fma(a[2], b[0], -(a[0] * b[2])),
        fma(a[0], b[1], -(a[1] * b[0])),
    )


@njit
def choose(condition, a, b):
    """Return a where the condition holds, else b."""
    return (where(condition, a[0], b[0]), where(condition, a[1], b[1]), where(condition, a[2], b[2]))


@njit
def row(matrix, i):
    """Row `i` of an (n, 3) array."""
    return (matrix[i, 0], matrix[i, 1], matrix[i, 2])


@njit
def put(matrix, i, a):
    """Write `a` to row `i` of an (n, 3) array."""
    matrix[i, 0], matrix[i, 1], matrix[i, 2] = a


@njit
def of_row(matrices, i, j):
    """Row `j` of matrix `i` of an (n, 3, 3) array."""
    return (matrices[i, j, 0], matrices[i, j, 1], matrices[i, j, 2])


@njit
def of_column(matrices, i, j):
    """Column `j` of matrix `i` of an (n, 3, 3) array."""
    return (matrices[i, 0, j], matrices[i, 1, j], matrices[i, 2, j])


@njit
def turn(matrices, i, a):
    """Return A a, A being matrix `i` of an (n, 3, 3) array."""
    return (dot(of_row(matrices, i, 0), a), dot(of_row(matrices, i, 1), a), dot(of_row(matrices, i, 2), a))


@njit
def turn_back(matrices, i, a):
    """Return A^T a, A being matrix `i` of an (n, 3, 3) array."""
    return (dot(of_column(matrices, i, 0), a), dot(of_column(matrices, i, 1), a), dot(of_column(matrices, i, 2), a))


@njit
def copy(values, out):
    """Copy `values` to `out`, both of shape (n,); NumPy's assignment would allocate."""
    for i in range(out.size):
        out[i] = values[i]


@njit
def larger(a, b):
    """The larger of two numbers; NaN if one of them is NaN."""
    return where((b > a) | (b != b), b, a)
