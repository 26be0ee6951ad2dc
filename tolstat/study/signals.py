"""Measured signals of a drive: CSV files, and the orders of speed and torque that a study takes from them."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from tolstat.analysis import revolutions
from tolstat.analysis.revolutions import Orders
from tolstat.common import units
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.loads import FloatArray
from tolstat.common.strict import dotted, read_text
from tolstat.display.text import percent
from tolstat.study import rewriting

UNITS = {"time": "s", "angle": "rad", "speed": "rad/s", "torque": "N*m", "alpha": "rad"}
"""SI unit of each column that a signal may have; others are ignored."""
WRITTEN = {"speed": ("rad/s", "rpm", "%"), "torque": ("N*m", "N*m", "N*m")}
"""SI unit of a key of an operating point, unit in which its mean is written, and unit of an amplitude."""
HEADS = {"time": "s", "angle": "deg", "speed": "rpm", "torque": "N*m", "alpha": "deg"}
"""Unit of each column that a remedy proposes."""
SHOWN = 20
"""Maximum number of faults of a file that are shown."""
_HEAD = re.compile(r"\s*(\w+)\s*(?:\[([^\]]*)\])?\s*")

Table = dict[str, Any]


def read(path: Path, needed: Sequence[str] = ()) -> dict[str, FloatArray]:
    """Read a measured signal.

    Parameters
    ----------
    path : Path
        CSV: a header line such as ``time [s], speed [rpm], torque [N*m]``, then a line for each sample; lines that
        begin with # are ignored.
    needed : sequence of str
        Columns that it must have.

    Returns
    -------
    dict
        Columns of `UNITS` by name, SI, (n,) each; an angle may begin anew after each revolution in the file, not here.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    lines = list(enumerate(csv.reader(read_text(path).splitlines()), start=1))
    lines = [(number, cells) for number, cells in lines if cells and not cells[0].lstrip().startswith("#")]
    faults: list[Fault] = []
    head, cells_of = lines[0] if lines else (1, [])
    columns: dict[str, tuple[int, float]] = {}
    for place, cell in enumerate(cells_of):
        match = _HEAD.fullmatch(cell)
        if match is None or match[1] not in UNITS:
            continue
        name = match[1]
        if name in columns:
            faults.append(Fault(f"{path}:{head}: {name}", "is there twice", "rename one of the columns"))
        try:
            columns[name] = place, units.to_si(f"1 {match[2] or ''}", UNITS[name])
        except PydanticCustomError:
            columns[name] = place, math.nan
            found = "has no unit" if not match[2] else f"[{match[2]}] is no unit of it"
            faults.append(Fault(f"{path}:{head}: {name}", found, f"write the header {name} [{HEADS[name]}]"))
    for name in needed:
        if name not in columns:
            remedy = f"add one with the header {name} [{HEADS[name]}]"
            faults.append(Fault(f"{path}:{head}", f"has no column {name}", remedy))
    numbers = [number for number, _ in lines[1:]]
    values = {name: np.array([_number(cells, place) for _, cells in lines[1:]]) for name, (place, _) in columns.items()}
    for name, own in values.items():
        for row in np.flatnonzero(np.isnan(own)):
            cells = lines[1 + row][1]
            found = repr(cells[columns[name][0]]) if columns[name][0] < len(cells) else "missing"
            faults.append(Fault(f"{path}:{numbers[row]}: {name}", f"{found} is no finite number", "give a number"))
    signal = {name: factor * values[name] for name, (_, factor) in columns.items()}
    if "angle" in signal:
        signal["angle"] = np.unwrap(signal["angle"])
    for name in ("time", "angle"):
        for row in 1 + np.flatnonzero(np.diff(signal.get(name, np.zeros(0))) <= 0):
            faults.append(Fault(f"{path}:{numbers[row]}: {name}", "does not rise", "give samples in their order"))
    if len(numbers) < revolutions.FEWEST:
        found = f"has {len(numbers)} samples"
        faults.append(Fault(str(path), found, f"give at least {revolutions.FEWEST} lines below the header"))
    if len(faults) > SHOWN:
        others = Fault(str(path), f"has {len(faults) - SHOWN} more faults", "mend all lines in the same way")
        faults = [*faults[:SHOWN], others]
    if faults:
        raise InputError(faults)
    return signal


def _number(cells: Sequence[str], place: int) -> float:
    try:
        value = float(cells[place])
    except (ValueError, IndexError):
        return math.nan
    return value if math.isfinite(value) else math.nan


def orders_of(path: Path, key: str) -> Orders:
    """Orders of the ``"speed"`` or the ``"torque"`` of a measured signal.

    The file has two of time, angle and speed, or for the torque of a shaft that turns evenly the angle alone.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    signal = read(path, ["torque"] if key == "torque" else [])
    time, angle, speed = (signal.get(name) for name in ("time", "angle", "speed"))
    fault = None
    if speed is not None and not speed.min() > 0:
        fault = Fault(f"{path}: speed", "is not above zero everywhere", "give a part in which the shaft turns forwards")
    elif angle is None and (time is None or speed is None):
        fault = Fault(str(path), "has no angle", "add a column angle [deg], or time [s] and speed [rpm]")
    elif key == "speed" and time is None and speed is None:
        fault = Fault(str(path), "has no speed", "add a column speed [rpm] or time [s]")
    if fault is not None:
        raise InputError([fault])
    if angle is None:
        angle = _integral(time, speed)
    if time is None:
        time = angle if speed is None else _integral(angle, 1.0 / speed)
    try:
        return revolutions.orders(angle, time, signal.get(key))
    except ValueError as error:
        raise InputError([Fault(str(path), str(error), "give a longer or denser signal")]) from error


def _integral(x: Any, y: Any) -> FloatArray:
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(x, y).antiderivative()(x))


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
    changes: dict[tuple[int | str, ...], Mapping[str, Any]] = {}
    notes, known = [], dict[tuple[str, str], Orders]()
    none = np.zeros(0)
    stand_in = Orders(1.0, none.astype(int), none, none, math.nan, math.nan, 0)
    for place, table in _files(data):
        key = str(place[-1])
        found, own = stand_in, list[Fault]()
        with gather(own):
            if unknown := set(table) - {"file"}:
                where = f"{path}: {dotted((*place, min(unknown)))}"
                raise InputError([Fault(where, "is given beside a file", "remove one of the two")])
            if not isinstance(table["file"], str):
                where = f"{path}: {dotted((*place, 'file'))}"
                raise InputError([Fault(where, "is not a text", 'write file = "engine.csv"')])
            if (table["file"], key) not in known:
                known[table["file"], key] = orders_of(path.parent / table["file"], key)
            found = known[table["file"], key]
            notes.append(f"{dotted(place)}: {_note(table['file'], found)}")
        faults += [fault for fault in own if fault not in faults]
        changes[place] = dict.fromkeys(table) | _written(key, found)
    with gather(faults):
        text = rewriting.with_keys(text, changes, str(path)) if changes else text
    return text, tuple(notes)


def _files(data: Mapping[str, Any]) -> Iterator[tuple[tuple[int | str, ...], Table]]:
    """Key path and table of each speed or torque that is a file."""
    section = data.get("operation")
    each: list[tuple[tuple[int | str, ...], Any]] = [(("operation",), section)]
    if isinstance(section, list):
        each = [(("operation", number), own) for number, own in enumerate(section)]
    for path, own in each:
        for key in WRITTEN:
            table = own.get(key) if isinstance(own, Mapping) else None
            if isinstance(table, dict) and "file" in table:
                yield (*path, key), table


def _written(key: str, found: Orders) -> Table:
    """Mean and orders as a study writes them."""
    unit, unit_of_mean, unit_of_order = WRITTEN[key]
    amplitudes = found.amplitudes / found.mean * 100 if key == "speed" else found.amplitudes
    orders = [
        {"n": int(n), "amplitude": f"{a:.6g} {unit_of_order}", "phase": f"{math.degrees(p):.6g} deg"}
        for n, a, p in zip(found.numbers, amplitudes, found.phases, strict=True)
    ]
    return {"mean": units.written(found.mean, unit, f"1 {unit_of_mean}", 8)} | ({"orders": orders} if orders else {})


def _note(file: str, found: Orders) -> str:
    told = f"{len(found.numbers)} orders" + (f" up to {found.numbers[-1]}" if len(found.numbers) else "")
    if math.isnan(found.left_out):
        return f"{file} is constant"
    if math.isnan(found.unrepeated):
        repeats = "one revolution: what does not repeat is not known"
    else:
        repeats = f"{found.turns} revolutions: {percent(found.unrepeated)} of the variance does not repeat"
    return f"{told} of {file}, {repeats}, {percent(found.left_out)} is in orders left out"
