"""Load Numba's functions on arrays without scipy's BLAS, which takes a third of the time until the first kernel runs.

Numba imports ``scipy.linalg`` only to ask if it is there. It is, because tolstat depends on it; no kernel calls it, and
code of others that does still imports it when it is compiled.
"""

import sys

from numba.np import linalg
from numba.np.linalg import ensure_blas

if "numba.np.arraymath" not in sys.modules and "scipy.linalg" not in sys.modules:
    linalg.ensure_blas = lambda: None
    try:
        from numba.np import arraymath

        arraymath.ensure_blas = ensure_blas
    finally:
        linalg.ensure_blas = ensure_blas
