"""Measured signals of a drive: text files, and the orders of speed and torque that a study takes from them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common import units
from tolstat.common.errors import Fault, gather, input_error
from tolstat.common.late import interpolate
from tolstat.common.loads import FloatArray
from tolstat.common.strict import dotted
from tolstat.common.text_table import TextTable
from tolstat.common.toml_lines import KeyPath, paths
from tolstat.display.text import percent
from tolstat.study import rewriting

UNITS = {"time": "s", "angle": "rad", "speed": "rad/s", "torque": "N*m", "alpha": "rad"}
"""SI unit of each column that a signal may have; others are ignored."""
WRITTEN = {"speed": ("rad/s", "rpm", "%"), "torque": ("N*m", "N*m", "N*m")}
"""SI unit of a key of an operating point, unit in which its mean is written, and unit of an amplitude."""
GAP = 10.0
"""Smallest time between samples that is a gap, relative to the median."""
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

Table = dict[str, Any]


class Signal(NamedTuple):
    """A measured signal.

    Attributes
    ----------
    columns : dict of str to ndarray, (n,)
        Those of `UNITS` that it has, by name, SI; an angle may begin anew after each revolution in the file, not here.
    gaps : tuple of str
        Place and length of each gap, see `durations`.
    """

    columns: dict[str, FloatArray]
    gaps: tuple[str, ...]


def read(path: Path, needed: Sequence[str] = (), alpha: float | None = None) -> Signal:
    """Read a measured signal.

    Parameters
    ----------
    path : Path
        Text table: a header such as ``time [s], speed [rpm], torque [N*m]``, then a line for each sample.
    needed : sequence of str
        Columns that it must have.
    alpha : float, optional
        Misalignment of a signal without a column of it, rad.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    table = TextTable(path)
    otherwise = ', or give --alpha "9 deg"' if "alpha" in needed else ""
    needed = [name for name in needed if name != "alpha" or alpha is None]
    signal = table.numbers(UNITS, needed, FEWEST, otherwise=otherwise)
    if alpha is not None:
        if "alpha" in signal:
            table.fault(table.head, "alpha", "is there and given, too", "remove --alpha, or the column")
        signal["alpha"] = np.full(len(table.rows), alpha)
    if "angle" in signal:
        signal["angle"] = np.unwrap(signal["angle"])
    for name in ("time", "angle"):
        for row in 1 + np.flatnonzero(np.diff(signal.get(name, np.zeros(0))) <= 0):
            table.fault(table.rows[row][0], name, "does not rise", "give samples in their order")
    table.check()
    time = signal.get("time", np.zeros(0))
    gaps = [
        f"{path}:{table.rows[row + 1][0]}: gap of {time[row + 1] - time[row]:.6g} s after the time {time[row]:.6g} s"
        for row in np.flatnonzero(durations(time) == 0)
    ]
    return Signal(signal, tuple(gaps))


def durations(time: FloatArray) -> FloatArray:
    """Times between samples, s, (n - 1,); zero in a gap, more than `GAP` times as long as the median one."""
    steps = np.diff(time)
    return np.where(steps > GAP * np.median(steps), 0.0, steps) if len(steps) else steps


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
    gaps : tuple of str
        Place and length of each gap of the file; the longest part between them is evaluated.
    """

    mean: float
    numbers: NDArray[np.intp]
    amplitudes: FloatArray
    phases: FloatArray
    unrepeated: float
    left_out: float
    turns: int
    gaps: tuple[str, ...] = ()


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
    # the step from the last sample back to the first may be missing
    turns = math.floor(float(2 * angle[-1] - angle[-2] - angle[0]) / TURN + 1e-9)
    # half orders change their sign from one revolution to the next: the mean of an even number has none of them
    turns -= turns % 2 if turns > 1 else 0
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
    begin = interpolate.CubicSpline(angle, time)(angle[0] + TURN * np.arange(turns + 1))
    at = begin[:-1, None] + np.diff(begin)[:, None] * np.arange(parts) / parts
    speed = interpolate.CubicSpline(time, angle)(at, 1)
    signal = speed if values is None else interpolate.CubicSpline(time, values)(at)
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
    variance_kept = 0.5 * float((size[numbers] ** 2).sum())
    return Orders(
        mean,
        numbers,
        size[numbers],
        np.arctan2(np.sin(phases), np.cos(phases)),
        math.nan if constant or turns == 1 else max(0.0, 1.0 - repeated / whole),
        math.nan if constant else max(0.0, repeated - variance_kept) / whole,
        turns,
    )


def _ahead(speed: FloatArray) -> float:
    """Angle by which the input is ahead of its mean on average, rad; from relative speeds, where it is not ahead.

    The mean input angle begins a revolution at the input angle; its waves, sum a sin(n phi + p), have the mean zero.
    """
    waves = np.fft.rfft(speed)[1 : len(speed) // 2] / len(speed)
    return float(-2.0 * np.sum(waves.imag / np.arange(1, len(waves) + 1)))


def orders_of(path: Path, key: str) -> Orders:
    """Orders of the ``"speed"`` or the ``"torque"`` of a measured signal.

    The file has two of time, angle and speed, or for the torque of a shaft that turns evenly the angle alone. Of a
    signal with gaps, the longest part without one is taken.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    signal, gaps = read(path, ["torque"] if key == "torque" else [])
    if gaps:
        parts = np.split(np.arange(len(signal["time"])), 1 + np.flatnonzero(durations(signal["time"]) == 0))
        signal = {name: values[max(parts, key=len)] for name, values in signal.items()}
    time, angle, speed = (signal.get(name) for name in ("time", "angle", "speed"))
    if speed is not None and not speed.min() > 0:
        remedy = "give a part in which the shaft turns forwards"
        raise input_error(f"{path}: speed", "is not above zero everywhere", remedy)
    if angle is None and (time is None or speed is None):
        raise input_error(path, "has no angle", "add a column angle [deg], or time [s] and speed [rpm]")
    if key == "speed" and time is None and speed is None:
        raise input_error(path, "has no speed", "add a column speed [rpm] or time [s]")
    if angle is None:
        angle = _integral(time, speed)
    if time is None:
        time = angle if speed is None else _integral(angle, 1.0 / speed)
    try:
        return orders(angle, time, signal.get(key))._replace(gaps=gaps)
    except ValueError as error:
        raise input_error(path, str(error), "give a longer or denser signal") from error


def _integral(x: Any, y: Any) -> FloatArray:
    return np.asarray(interpolate.CubicSpline(x, y).antiderivative()(x))


def replaced(text: str, data: Mapping[str, Any], path: Path, faults: list[Fault]) -> tuple[str, tuple[str, ...]]:
    """Put mean and orders in the place of each measured signal of a study's operating points.

    Parameters
    ----------
    text : str
        TOML of the study or case.
    data : mapping
        What it says.
    path : Path
        Its file: paths start from its folder, faults name it.
    faults : list of Fault
        Those found are added. A signal with faults becomes 1 rpm or 1 N m.

    Returns
    -------
    text : str
        TOML without signals.
    notes : tuple of str
        What each signal has, and which share of it does not repeat.
    """
    changes: dict[KeyPath, Mapping[str, Any]] = {}
    notes, known = [], dict[tuple[str, str], Orders]()
    none = np.zeros(0)
    stand_in = Orders(1.0, none.astype(int), none, none, math.nan, math.nan, 0)
    for path_of_key, table in _files(data):
        key = str(path_of_key[-1])
        orders_found, faults_of_key = stand_in, list[Fault]()
        with gather(faults_of_key):
            if unknown := set(table) - {"file"}:
                where = f"{path}: {dotted((*path_of_key, min(unknown)))}"
                raise input_error(where, "is given beside a file", "remove one of the two")
            if not isinstance(table["file"], str):
                where = f"{path}: {dotted((*path_of_key, 'file'))}"
                raise input_error(where, "is not a text", 'write file = "engine.csv"')
            if (table["file"], key) not in known:
                known[table["file"], key] = orders_of(path.parent / table["file"], key)
            orders_found = known[table["file"], key]
            notes.append(f"{dotted(path_of_key)}: {_note(table['file'], orders_found)}")
            notes += [f"{gap}: orders are of the longest part without a gap" for gap in orders_found.gaps]
        faults += faults_of_key
        changes[path_of_key] = dict.fromkeys(table) | _written(key, orders_found)
    with gather(faults):
        text = rewriting.with_keys(text, changes, str(path)) if changes else text
    return text, tuple(dict.fromkeys(notes))


def _files(data: Any) -> Iterator[tuple[KeyPath, Table]]:
    """Key path and table of each speed or torque that is a file."""
    for path in paths({"operation": data.get("operation")}):
        table = reduce(getitem, path, data)
        is_of_point = path[-1] in WRITTEN and all(isinstance(part, int) for part in path[1:-1])
        if is_of_point and isinstance(table, dict) and "file" in table:
            yield path, table


def _written(key: str, measured: Orders) -> Table:
    """Mean and orders as a study writes them."""
    unit, unit_of_mean, unit_of_order = WRITTEN[key]
    amplitudes = measured.amplitudes / measured.mean * 100 if key == "speed" else measured.amplitudes
    orders = [
        {"n": int(n), "amplitude": f"{a:.6g} {unit_of_order}", "phase": f"{math.degrees(p):.6g} deg"}
        for n, a, p in zip(measured.numbers, amplitudes, measured.phases, strict=True)
    ]
    return {"mean": units.written(measured.mean, unit, f"1 {unit_of_mean}", 8)} | ({"orders": orders} if orders else {})


def _note(file: str, orders: Orders) -> str:
    what = f"{len(orders.numbers)} orders" + (f" up to {orders.numbers[-1]}" if len(orders.numbers) else "")
    if math.isnan(orders.left_out):
        return f"{file} is constant"
    if math.isnan(orders.unrepeated):
        repeats = "one revolution: what does not repeat is not known"
    else:
        repeats = f"{orders.turns} revolutions: {percent(orders.unrepeated)} of the variance does not repeat"
    return f"{what} of {file}, {repeats}, {percent(orders.left_out)} is in orders left out"
