"""A study of the duty cycle in a measured signal: its operating points, their shares, and the order of their visits."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path

import tomlkit
from tomlkit.exceptions import TOMLKitError

from tolstat.analysis import load_spectrum
from tolstat.analysis.load_spectrum import DutyCycle
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import read_text
from tolstat.study import signals, starter

NEEDED = ("time", "torque", "speed", "alpha")
"""Columns of the signal."""
JOINT = "cirelli2021"
"""Joint of the study where none is given."""


def read(path: Path, m: float) -> DutyCycle:
    """Duty cycle of a measured signal, see `signals.read` and `load_spectrum.duty_cycle`.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    signal = signals.read(path, NEEDED)
    try:
        return load_spectrum.duty_cycle(signal["time"], signal["torque"], signal["speed"], signal["alpha"], m)
    except ValueError as error:
        raise InputError([Fault(str(path), str(error), "give the signal of a loaded shaft")]) from error


def names(cycle: DutyCycle) -> list[str]:
    """Names of the operating points."""
    return [f"p{number}" for number in range(1, 1 + len(cycle.time))]


def text(cycle: DutyCycle, source: Path, path: Path, base: Path | None = None) -> str:
    """Study of a duty cycle.

    Parameters
    ----------
    cycle : DutyCycle
        The duty cycle.
    source : Path
        File that it is from.
    path : Path
        The study.
    base : Path, optional
        Study whose operating points are replaced; by default a new one.

    Raises
    ------
    InputError
        When the base cannot be changed.
    """
    given = starter.study_text(path, JOINT) if base is None else read_text(base)
    try:
        document = tomlkit.parse(given)
    except TOMLKitError as error:
        raise InputError([Fault(str(base), f"is not TOML: {error}", "give a study that tolstat plan reads")]) from error
    document.pop("operation", None)
    points = tomlkit.aot()
    for place, name in enumerate(names(cycle)):
        point = tomlkit.table()
        values = {
            "name": name,
            "share": float(f"{cycle.time[place] / cycle.time.sum():.9g}"),
            "alpha": f"{math.degrees(cycle.alpha[place]):.6g} deg",
            "speed": f"{cycle.speed[place] * 30 / math.pi:.6g} rpm",
            "torque": f"{cycle.torque[place]:.6g} N*m",
        }
        for key, value in values.items():
            point.add(key, value)
        points.append(point)
    document.append(tomlkit.key("operation"), points)
    output = document.setdefault("output", tomlkit.table())
    if output.get("histories", "none") == "none":
        output["histories"] = "cycles"
    if len(set(cycle.visits.tolist())) > 1:
        sequence = tomlkit.table()
        visits = textwrap.fill(" ".join(names(cycle)[visit] for visit in cycle.visits), 100)
        sequence.add("points", tomlkit.string(visits, multiline=True))
        sequence.add("revolutions", float(f"{cycle.turns:.6g}"))
        document.setdefault("fatigue", tomlkit.table())["sequence"] = sequence
    head = f"# Operating points, their shares and the order of their visits are from {source.name}.\n"
    return head + document.as_string()
