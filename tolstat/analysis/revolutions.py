"""Orders of a measured signal: what repeats in each revolution of a shaft, and what does not."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.loads import FloatArray

SMALLEST = 0.01
"""Smallest order that is kept, relative to the largest."""
MOST = 16
"""Maximum number of orders that are kept."""
ROUNDING = 1e-6
"""Largest amplitude, relative to the largest value, that may be the rounding of a file."""
FEWEST = 8
"""Minimum number of samples in a revolution."""
PER_WAVE = 4
"""Samples in the shortest wave that is kept."""
FINEST = 512
"""Maximum number of equal parts of a revolution that a signal is resampled to."""
TURN = 2.0 * np.pi


class Orders(NamedTuple):
    """Mean and orders of a signal.

    Attributes
    ----------
    mean : float
        Mean over time, in the unit of the signal.
    numbers : ndarray of int, shape (k,)
        Orders that are kept, ascending.
    amplitudes, phases : ndarray, shape (k,)
        The signal is mean + sum of amplitude cos(number phi + phase), phi the mean input angle, rad.
    unrepeated : float
        Share of the variance that does not repeat in each revolution; NaN for one revolution or a constant.
    left_out : float
        Share of the variance in orders that are not kept; NaN for a constant.
    turns : int
        Revolutions evaluated.
    """

    mean: float
    numbers: NDArray[np.intp]
    amplitudes: FloatArray
    phases: FloatArray
    unrepeated: float
    left_out: float
    turns: int


def turns_of(angle: FloatArray) -> int:
    """Number of whole revolutions in samples of an angle (rad): an even one if there are several.

    A half order changes its sign from one revolution to the next; an even number of them has none of it in the mean.
    The step from the last sample back to the first may be missing.
    """
    turns = math.floor(float(2 * angle[-1] - angle[-2] - angle[0]) / TURN + 1e-9)
    return turns - turns % 2 if turns > 1 else turns


def orders(angle: FloatArray, time: FloatArray, values: FloatArray | None = None) -> Orders:
    """Resample a signal to equal parts of each revolution, and expand its mean revolution.

    Parameters
    ----------
    angle : ndarray, shape (n,)
        Input angle, rad, rising.
    time : ndarray, shape (n,)
        Times of the samples, s, rising; the angle itself where the shaft turns evenly. A revolution's mean input angle
        is proportional to the time in it.
    values : ndarray, shape (n,), optional
        The signal; by default the speed of the angle.

    Returns
    -------
    Orders
        Orders up to a quarter of the samples in a revolution.

    Raises
    ------
    ValueError
        When the samples cover less than one revolution, or are fewer than `FEWEST` in one.
    """
    from scipy.interpolate import CubicSpline

    turns = turns_of(angle)
    if turns < 1:
        raise ValueError(f"covers {(angle[-1] - angle[0]) / TURN:.3g} of a revolution, one at least is needed")
    end = angle[0] + TURN * turns
    density = int(np.searchsorted(angle, end - 1e-9)) / turns
    if density < FEWEST:
        raise ValueError(f"has {density:.3g} samples in a revolution, {FEWEST} at least are needed")
    if end > angle[-1]:  # the signal repeats: the sample after the last one has the value one revolution before
        following = 2 * angle[-1] - angle[-2]
        if values is not None:
            values = np.append(values, np.interp(following - TURN, angle, values))
        time = np.append(time, 2 * time[-1] - time[-2])
        angle = np.append(angle, following)
    parts = min(FINEST, 2 ** math.ceil(math.log2(2 * density)))
    begin = CubicSpline(angle, time)(angle[0] + TURN * np.arange(turns + 1))
    at = begin[:-1, None] + np.diff(begin)[:, None] * np.arange(parts) / parts
    speed = CubicSpline(time, angle)(at, 1)
    signal = speed if values is None else CubicSpline(time, values)(at)
    mean_speed = TURN * turns / (begin[-1] - begin[0])
    mean = float(mean_speed if values is None else np.average(signal.mean(axis=1), weights=np.diff(begin)))
    ahead = _ahead(speed.mean(axis=0) / mean_speed)
    waves = 2.0 * np.fft.rfft(signal.mean(axis=0)) / parts
    size = np.abs(waves)
    size[0] = size[min(int(density / PER_WAVE), parts // 2 - 1) + 1 :] = 0.0
    floor = max(SMALLEST * size.max(), ROUNDING * np.abs(signal).max())
    largest = np.argsort(-size, kind="stable")[:MOST]
    numbers = np.sort(largest[size[largest] > floor])
    phases = np.angle(waves[numbers]) - numbers * (angle[0] + ahead)
    whole, repeated = float(signal.var()), float(signal.mean(axis=0).var())
    constant = whole <= (ROUNDING * float(np.abs(signal).max())) ** 2
    kept = 0.5 * float((size[numbers] ** 2).sum())
    return Orders(
        mean,
        numbers,
        size[numbers],
        np.arctan2(np.sin(phases), np.cos(phases)),
        math.nan if constant or turns == 1 else max(0.0, 1.0 - repeated / whole),
        math.nan if constant else max(0.0, repeated - kept) / whole,
        turns,
    )


def _ahead(speed: FloatArray) -> float:
    """Angle by which the input is ahead of its mean on average, rad; from relative speeds, where it is not ahead.

    The mean input angle begins a revolution at the input angle; its waves, sum a sin(n phi + p), have the mean zero.
    """
    waves = np.fft.rfft(speed)[1 : len(speed) // 2] / len(speed)
    return float(-2.0 * np.sum(waves.imag / np.arange(1, len(waves) + 1)))
