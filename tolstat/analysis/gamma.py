"""Relative errors of the largest bushing loads (Cirelli, Rossi, Valentini and Pennestri 2021, eq. 14)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.common.tables import Status


def gamma(results: NDArray[np.void], group: NDArray[np.int32]) -> NDArray[np.float64]:
    """Compare the largest loads of each joint with those of the first joint of its group, eq. (14).

    Parameters
    ----------
    results : ndarray of RESULT, shape (n,)
        Joints; the first of a group is the one without errors.
    group : ndarray of int, shape (n,)
        Group number of each joint; joints of a group differ in their errors only.

    Returns
    -------
    ndarray, shape (n, 8, 2)
        Relative difference in per cent, signed: force, torque. NaN unless the joint and the first of its group are OK.
    """
    loads = np.stack([results["F_max"], results["T_max"]], axis=-1)
    loads[results["status"] != Status.OK] = np.nan
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    return np.asarray(100.0 * (loads / loads[first[inverse]] - 1.0))
