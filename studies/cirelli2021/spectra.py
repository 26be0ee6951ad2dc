"""Frequency content of bushing loads: amplitudes at multiples of the input speed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ORDERS = 8
"""Highest multiple of the input speed that is looked at."""


def moduli(loads: NDArray[Any]) -> Array:
    """Moduli of bushing force and torque.

    Parameters
    ----------
    loads : ndarray, shape (m, samples, 8, 6)
        Force e, t, z (N) and torque e, t, z (N m).

    Returns
    -------
    ndarray, shape (m, samples, 8, 2)
        N, N m.
    """
    wide = loads.astype(np.float64)
    return np.stack([np.linalg.norm(wide[..., :3], axis=-1), np.linalg.norm(wide[..., 3:], axis=-1)], axis=-1)


def amplitudes(samples: Array, orders: int = ORDERS) -> Array:
    """Amplitudes of a settled revolution at multiples of the input speed.

    Parameters
    ----------
    samples : ndarray, shape (m, samples, ...)
        Values at equally spaced input angles over one revolution.
    orders : int
        Highest multiple.

    Returns
    -------
    ndarray, shape (m, orders + 1, ...)
        Mean (order 0) and amplitudes, in the unit of the samples:
        ``x(theta) = a0 + sum a_h cos(h theta + phase_h)``.
    """
    count = samples.shape[1]
    spectrum = np.abs(np.fft.rfft(samples, axis=1))[:, : orders + 1] / count
    spectrum[:, 1:] *= 2.0
    if orders == count // 2 and count % 2 == 0:
        spectrum[:, -1] *= 0.5  # the highest order has no twin
    return np.asarray(spectrum)
