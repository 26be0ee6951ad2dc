"""Rainflow cycles of a settled revolution, for one signal or for all channels of a joint.

The revolution repeats, so counting begins at its largest value and every cycle closes (ASTM E1049-85, 5.4.5). The
four-point method gives the same cycles when its residue is appended to itself and counted again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.load_kinds import CHANNELS
from tolstat.common.tables import HistorySpec

KEPT = 16
"""Maximum number of cycles kept per channel: joints made to ISO 2768-f have 1.7 a channel in the mean, 11 at most."""
GATE = 1e-4
"""Cycles up to this fraction of the joint's largest force or torque are not counted: the default of
``solver.settle_tol`` allows loads to differ by as much between two revolutions."""
MIN_SAMPLES = 90
"""Minimum number of samples a revolution where tolstat chooses the steps: errors of peaks of a load with four cycles
are within 1 %."""

SPECS = {
    "cycles": HistorySpec(
        (len(CHANNELS), KEPT, 2),
        "f4",
        "N, N*m",
        "range and mean of the largest rainflow cycles of the last revolution, descending, 0 where there are none; of "
        "bushings cross 1-4, fork 1-4 in turn: force e, t, z, torque e, t, z, modulus of force, of torque",
        ("channel", "cycle", "of_cycle"),
    ),
    "cycle_count": HistorySpec(
        (len(CHANNELS),), "u2", "1", "rainflow cycles of the last revolution, those not kept included", ("channel",)
    ),
}
"""What `count` gives for a joint, as histories of a result file."""


def periodic(signal: ArrayLike, gate: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rainflow cycles of one period of a signal that repeats.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Equally or unequally spaced samples of one period; the last is followed by the first.
    gate : float
        Cycles whose range is not above it are left out.

    Returns
    -------
    ranges, means : ndarray, shape (cycles,)
        In the unit of the signal, ranges descending. Every cycle is a whole one.

    Raises
    ------
    ValueError
        When the signal is empty, not one-dimensional or not finite.

    Examples
    --------
    The history of ASTM E1049-85, Figure 7: cycles of 9, 7, 4 and 3 units.

    >>> periodic([-2, 1, -3, 5, -1, 3, -4, 4])[0].tolist()
    [9.0, 7.0, 4.0, 3.0]
    """
    from tolstat.kernel.revolution import rainflow

    x = np.ascontiguousarray(signal, dtype=float)
    if x.ndim != 1 or not x.size or not np.isfinite(x).all():
        raise ValueError(f"signal of shape {x.shape}: finite values of one period expected")
    ranges, means = np.empty(x.size), np.empty(x.size)
    n = rainflow.count(x, float(gate), np.empty(x.size + 1), ranges, means)
    return ranges[:n], means[:n]


def count(loads: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Rainflow cycles of all channels of a joint.

    Parameters
    ----------
    loads : ndarray, shape (samples, 8, 6)
        Force (N) and torque (N m) along e, t, z of the bushings over one revolution.

    Returns
    -------
    dict
        By name of `SPECS`: ``cycles`` (64, KEPT, 2), N and N m, and ``cycle_count`` (64,); the channels are
        those of `load_kinds.CHANNELS`. NaN and 0 when a load is not finite.
    """
    from tolstat.kernel.revolution import rainflow

    counted = {name: spec.blank(1)[0] for name, spec in SPECS.items()}
    if np.isfinite(loads).all():
        ranges, means = np.empty((2, len(CHANNELS), KEPT))
        cycles = np.empty(len(CHANNELS), np.int64)
        rainflow.count_joint(np.ascontiguousarray(loads, dtype=float), GATE, ranges, means, cycles)
        counted["cycles"][...] = np.stack([ranges, means], axis=-1)
        counted["cycle_count"][...] = cycles
    return counted
