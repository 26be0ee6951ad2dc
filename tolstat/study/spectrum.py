"""A study of the duty cycle in a measured signal: its operating points, their shares, and the order of their visits."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import input_error
from tolstat.common.late import tomlkit
from tolstat.common.loads import FloatArray
from tolstat.common.strict import read_text
from tolstat.study import signals, starter
from tolstat.study.placing import placed

EXPONENT = 3.0
"""Default Wöhler exponent."""
NEEDED = ("time", "torque", "speed", "alpha")
"""Columns of the signal."""
JOINT = "cirelli2021"
"""Joint of the study where none is given."""
MOST = 12
"""Maximum number of points."""
CLASSES = ((12, 6, 4), (12, 4, 3), (10, 4, 2), (8, 3, 2), (8, 2, 1), (6, 1, 1))
"""Numbers of classes of torque, speed and misalignment from zero to the largest value, the finest ones first."""
COVERED = 0.95
"""Share of the damage by revolutions that the points do with the classes that are chosen."""
ENOUGH = 0.999
"""Share of the damage beyond which no further point is taken."""
STANDING = 0.01
"""Speed up to which the shaft stands still, relative to the largest."""
VISITS = 500
"""Maximum number of visits of points."""


class DutyCycle(NamedTuple):
    """Operating points, the most damaging first, and the order of their visits.

    Attributes
    ----------
    alpha, speed, torque : ndarray, shape (k,)
        Of each point: rad, rad/s, N m. The torque does the damage of the revolutions of its samples.
    time, damage : ndarray, shape (k,)
        Shares of the time in which the shaft turns, and of the damage by revolutions.
    changes : float
        Damage by the cycles of the torque that the visits close, relative to those of the signal.
    standing : float
        Share of the whole time in which the shaft stands still.
    visits : ndarray of int, shape (v,)
        Points in the order of their visits of a revolution and more, at most `VISITS`.
    left_out : int
        Visits that are not among them, since changes of the torque around them are the smallest.
    turns : float
        Revolutions at the points.
    gaps : tuple of str
        Place and length of each gap of the signal, which counts for no time.
    """

    alpha: FloatArray
    speed: FloatArray
    torque: FloatArray
    time: FloatArray
    damage: FloatArray
    changes: float
    standing: float
    visits: NDArray[np.intp]
    left_out: int
    turns: float
    gaps: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Names of the operating points."""
        return [f"p{number}" for number in range(1, 1 + len(self.time))]

    @property
    def operation(self) -> list[dict[str, Any]]:
        """Section ``[[operation]]`` of a study."""
        return [
            {
                "name": name,
                "share": float(f"{time / self.time.sum():.9g}"),
                "alpha": f"{math.degrees(alpha):.6g} deg",
                "speed": f"{speed * 30 / math.pi:.6g} rpm",
                "torque": f"{torque:.6g} N*m",
            }
            for name, time, alpha, speed, torque in zip(
                self.names, self.time, self.alpha, self.speed, self.torque, strict=True
            )
        ]


def duty_cycle(time: FloatArray, torque: FloatArray, speed: FloatArray, alpha: FloatArray, m: float) -> DutyCycle:
    """Choose operating points by the damage of revolutions and, counted alike, of changes of the torque.

    Damage of a revolution is proportional to the torque to the power m, that of a rainflow cycle of the torque to its
    range to this power, half of it at either end.

    Parameters
    ----------
    time, torque, speed, alpha : ndarray, shape (n,)
        Samples: s, rising; N m; rad/s; rad. Gaps of the time count for nothing, see `signals.durations`.
    m : float
        Wöhler exponent.

    Raises
    ------
    ValueError
        When the shaft never turns, or turns without torque.
    """
    steps = signals.durations(time)
    lasting = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))
    turning = np.abs(speed) > STANDING * np.abs(speed).max()
    revolutions = np.where(turning, lasting * np.abs(speed) / (2.0 * np.pi), 0.0)
    damage = revolutions * np.abs(torque / max(np.abs(torque).max(), np.finfo(float).tiny)) ** m
    if not damage.sum() > 0:
        raise ValueError("has no torque while the shaft turns")
    ends, ranges = _cycles(torque)
    change = np.bincount(ends.ravel(), np.repeat(0.5 * ranges**m, 2), len(torque))
    for numbers in CLASSES:
        cells = np.column_stack([_classes(x, n) for x, n in zip((torque, speed, alpha), numbers, strict=True)])
        _, label = np.unique(cells, axis=0, return_inverse=True)
        label = label.ravel()
        share = 0.5 * (np.bincount(label, damage) / damage.sum() + np.bincount(label, change * turning) / change.sum())
        order = np.argsort(-share, kind="stable")[:MOST]
        if np.bincount(label, damage)[order].sum() >= COVERED * damage.sum():
            break
    order = order[: 1 + int(np.searchsorted(np.cumsum(share[order]), ENOUGH))]
    order = order[np.bincount(label, damage)[order] > 0]

    def sums(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(label, values)[order])

    seconds, turns = sums(np.where(turning, lasting, 0.0)), sums(revolutions)
    size = (sums(revolutions * np.abs(torque) ** m) / turns) ** (1.0 / m)
    number = np.full(label.max() + 1, -1)
    number[order] = np.arange(len(order))
    at = np.where(turning, number[label], -1)
    torques = np.sign(sums(revolutions * torque)) * size
    all_visits = _visits(at, revolutions)
    visits = _fewer(all_visits, torques)
    damage_of_visits = float(np.sum(_cycles(torques[visits])[1] ** m) / change.sum()) if len(visits) else 0.0
    return DutyCycle(
        sums(revolutions * alpha) / turns,
        np.sign(sums(revolutions * speed)) * 2.0 * np.pi * turns / seconds,
        torques,
        seconds / lasting[turning].sum(),
        sums(damage) / damage.sum(),
        damage_of_visits,
        float(lasting[~turning].sum() / lasting.sum()),
        visits,
        len(all_visits) - len(visits),
        float(turns.sum()),
    )


def _classes(values: FloatArray, number: int) -> NDArray[np.intp]:
    """Number of the class of each value: equally wide, with an edge at zero."""
    width = np.abs(values).max() / number or 1.0
    return np.clip(np.floor(values / width), -number, number - 1).astype(np.intp)


def _cycles(values: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Rainflow cycles of values that repeat: places of the two ends, (k, 2), and ranges, (k,)."""
    first = int(np.argmax(values))
    order = np.append(np.roll(np.arange(len(values)), -first), first)
    order = order[np.append(True, np.diff(values[order]) != 0)]
    slope = np.sign(np.diff(values[order]))
    order = order[np.concatenate([[True], slope[1:] != slope[:-1], [True]])] if len(slope) else order
    stack: list[int] = []
    ends: list[tuple[int, int]] = []
    for sample in order.tolist():
        stack.append(sample)
        while len(stack) > 2 and abs(values[sample] - values[stack[-2]]) >= abs(values[stack[-2]] - values[stack[-3]]):
            ends.append((stack[-3], stack[-2]))
            stack[-3:] = [sample]
    pairs = np.array(ends, np.intp).reshape(-1, 2)
    return pairs, np.abs(values[pairs[:, 0]] - values[pairs[:, 1]])


def _visits(at: NDArray[np.intp], revolutions: FloatArray) -> NDArray[np.intp]:
    """Points one after another; where a point is left before one revolution is done, the one before it goes on."""
    starts = np.flatnonzero(np.diff(at, prepend=-2))
    whole = (at[starts] >= 0) & (np.add.reduceat(revolutions, starts) >= 1.0)
    visits = at[starts][whole]
    return np.asarray(visits[np.diff(visits, prepend=-1) != 0], np.intp)


def _fewer(visits: NDArray[np.intp], torques: FloatArray) -> NDArray[np.intp]:
    """Leave out visits until `VISITS` are left: turning points of the torque with changes above a rising threshold."""
    for change in np.append(-1.0, np.unique(np.abs(torques[:, None] - torques))):
        chosen, up = list(visits[:1]), 0.0
        for point in visits[1:]:
            step = torques[point] - torques[chosen[-1]]
            if change < 0 or (abs(step) > change and step * up <= 0):
                chosen.append(point)
                up = step
            elif step * up > 0:
                chosen[-1] = point
        if len(chosen) <= VISITS:
            break
    return np.array(chosen[:VISITS], np.intp)


def spectrum(signal: str | Path, m: float = EXPONENT, alpha: float | None = None) -> DutyCycle:
    """Find the duty cycle in a measured signal of torque and speed.

    Parameters
    ----------
    signal : str or Path
        Text table with time, torque, speed and, unless `alpha` is given, the misalignment; see `signals.read`.
    m : float
        Wöhler exponent by which damage is counted.
    alpha : float, optional
        Misalignment, rad.

    Returns
    -------
    DutyCycle
        Its `operation` is that section of a study.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    values, gaps = signals.read(Path(signal), NEEDED, alpha)
    try:
        cycle = duty_cycle(values["time"], values["torque"], values["speed"], values["alpha"], m)
    except ValueError as error:
        raise input_error(signal, str(error), "give the signal of a loaded shaft") from error
    return cycle._replace(gaps=gaps)


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
    study = starter.study_text(path, JOINT) if base is None else read_text(base)
    try:
        document = tomlkit.parse(study)
    except tomlkit.exceptions.TOMLKitError as error:
        raise input_error(base, f"is not TOML: {error}", "give a study that tolstat plan reads") from error
    document.pop("operation", None)
    document.append(tomlkit.key("operation"), tomlkit.item(cycle.operation))
    output = document.setdefault("output", tomlkit.table())
    if output.get("histories", "none") == "none":
        output["histories"] = "cycles"
    if len(set(cycle.visits.tolist())) > 1:
        visits = textwrap.fill(" ".join(cycle.names[visit] for visit in cycle.visits), 100)
        sequence = {"points": tomlkit.string(visits, multiline=True), "revolutions": float(f"{cycle.turns:.6g}")}
        document.setdefault("fatigue", tomlkit.table())["sequence"] = sequence
    head = f"# Operating points, their shares and the order of their visits are from {source.name}.\n"
    return placed(head + document.as_string(), base or path, path)
