"""Share of a revolution in which a load is above a level; not the share of joints that exceed the level."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import binomial, cycles
from tolstat.analysis.design import Design
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.common import channels, strict
from tolstat.common.errors import Fault, InputError, gather, raise_all
from tolstat.common.loads import FloatArray
from tolstat.common.tables import Status
from tolstat.display import drawing, text
from tolstat.display.answer import Answer, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Loads, Opt
from tolstat.questions.shares import NO_INTERVALS, Cell, unusable, with_ends
from tolstat.store import revolutions
from tolstat.store.view import View
from tolstat.study.selection import Entry, quantity

SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints at which quantiles of the time above are given."""
POINTS = 60
"""Number of levels of a curve."""
MAX_LOADS = 4
"""Maximum number of loads in pictures."""
LINES = {"time": "mean joint", "time_50": "median joint", "time_90": "90 % below", "time_99": "99 % below"}
"""Labels of the curves of time above, by key."""


def _share(name: str) -> Cell:
    def cell(row: Row) -> str:
        share, low, high = (100.0 * row[name + end] for end in ("", "_lower", "_upper"))
        return f"{share:.3g} %" if math.isnan(low) else f"{share:.3g} ({low:.3g} .. {high:.3g}) %"

    return cell


LEVELS = (
    Column("load > level", text.limit),
    Column("joints above", _share("joints_above")),
    Column("mean time above", _share("time")),
    Column("median", _share("time_50"), rank=3),
    Column("90 % below", _share("time_90"), rank=2),
    Column("99 % below", _share("time_99"), rank=1),
)
"""Columns of the table ``levels``; shares in per cent."""


def time_above(
    view: View,
    by: Loads = None,
    levels: Annotated[list[str] | None, Opt("LEVEL", name="level")] = None,
    curves: bool = False,
) -> Answer:
    """Estimate how much of a revolution loads are above levels.

    Gives the time above, a share of the revolution of each joint, as its mean and its 50, 90 and 99 % quantiles over
    the joints; and the exceedance, the share of joints that are above the level at any time. The study must keep load
    histories (output.histories "full" or "harmonics").

    Example: tolstat time-above iso2768_f.h5 --by cross1.F --level "1000 N"

    Parameters
    ----------
    view : View
        A campaign with load histories, in full or as harmonics.
    by : list of str, optional
        Load or component, such as cross1.F, fork2.T_e or output.moment; repeatable; default: loads with limits.
    levels : list of str, optional
        Level, such as "700 N", of all loads of its unit; repeatable; default: the limits.
    curves : bool
        Evaluate 60 levels of each load, too: pictures and a table for --out, the table also in --json.

    Returns
    -------
    Answer
        Table ``levels``, one row per load and level, SI: ``load``, ``unit``, ``level``; ``joints_above`` (share of the
        joints that are above the level at any time), with ``_lower`` and ``_upper``; ``time`` (mean share of the
        revolution over the joints), with ends; ``time_50``, ``time_90``, ``time_99`` (share of the revolution that
        this percentage of the joints does not exceed), with ends. NaN ends for dependent samples. With `curves` table
        ``curves`` with the same keys. Facts ``joints`` and ``left_out``: joints with and without a settled revolution,
        those pending not counted.

    Raises
    ------
    InputError
        With every fault of loads and levels.
    StoreError
        When the file holds no histories, joints that are no sample of a production, or no settled joint.
    """
    view.check("mean")
    asked = _levels(view, by or (), levels or ())
    settled = np.flatnonzero(view.status == Status.OK)
    if not settled.size:
        raise unusable(view, "has no settled joint", "resume the campaign")
    rows, ends = _rows(view, settled, asked)
    parts: list[Part] = [Table("levels", "Time above levels within a revolution", LEVELS, rows)]
    if curves:
        more, _ = _rows(view, settled, {name: np.linspace(*ends[name], POINTS) for name in asked})
        drawn = [panel for name in list(asked)[:MAX_LOADS] for panel in _panels(name, more, asked[name])]
        parts += [Table("curves", "Time above many levels", (), more), Panels(drawn)]
    left_out = view.counts.done - settled.size
    counts = f"{settled.size} joints, {left_out} without a settled revolution left out"
    parts.append(Sentence(f"{counts}; time: share of a revolution"))
    parts += [] if view.design.only(settled).has_interval("mean") else [Sentence(NO_INTERVALS)]
    return Answer("time_above", "Time above levels", parts, {"joints": settled.size, "left_out": left_out})


def _levels(view: View, by: Sequence[str], levels: Sequence[str]) -> dict[str, FloatArray]:
    """Levels of each load that is asked for, SI."""
    names = list(by) or [name for name in view.limits if name in channels.CHANNELS]
    faults = [
        Fault("--by", f"{name!r} is no load over the input angle", strict.did_you_mean(name, list(channels.CHANNELS)))
        for name in names
        if name not in channels.CHANNELS
    ]
    if not names:
        faults.append(Fault("--by", "the study limits no load over the input angle", "name one: --by cross1.F"))
    units = {name: channels.CHANNELS[name].unit for name in names if name in channels.CHANNELS}
    given: dict[str, list[float]] = {unit: [] for unit in units.values()}
    for level in levels if given else ():
        with gather(faults):
            unit, value = _level(level, sorted(given))
            given[unit].append(value)
    levels_of = {}
    for name, unit in units.items():
        values = given[unit] or ([view.limits[name]] if name in view.limits and not levels else [])
        if not values and not faults:
            faults.append(Fault("--level", f"{name} has neither a level nor a limit", 'give one: --level "700 N"'))
        levels_of[name] = np.array(values, dtype=float)
    raise_all(faults)
    return levels_of


def _level(level: str, units: Sequence[str]) -> tuple[str, float]:
    """Unit and value of a level, in the first of the units that it can have."""
    entry = Entry(level, (level,), level)
    for unit in units[:-1]:
        with suppress(InputError):
            return unit, quantity(entry, unit, "--level")
    return units[-1], quantity(entry, units[-1], "--level")


def _rows(
    view: View, samples: NDArray[np.intp], levels: Mapping[str, FloatArray]
) -> tuple[list[Row], dict[str, tuple[float, float]]]:
    """One row per load and level, from settled joints, and smallest and largest value of each load."""
    times = {name: np.empty((len(samples), len(values))) for name, values in levels.items()}
    ends = dict.fromkeys(levels, (np.inf, -np.inf))
    slots, design = view.slots(samples), view.design.only(samples)
    for part in revolutions.blocks(len(slots)):
        loads = revolutions.loads(view.store, slots[part], channels.histories_of(levels))
        for name, values in levels.items():
            load = channels.CHANNELS[name].of(loads)
            ends[name] = min(ends[name][0], float(load.min())), max(ends[name][1], float(load.max()))
            for k, level in enumerate(values):
                times[name][part, k] = cycles.share_of_revolution_above(load, float(level))
    pairs = {name: zip(levels[name], times[name].T, strict=True) for name in levels}
    return [_row(name, level, time, design) for name in levels for level, time in pairs[name]], ends


def _row(name: str, level: float, time: FloatArray, design: Design) -> Row:
    """Share of the joints above a level, and their time above it, a share of a revolution, (m,)."""
    sample = Sample.of(time, np.full(time.size, Status.OK), design)
    above, known = sample.above(0.0, CONFIDENCE), design.has_interval("mean")
    row = {"load": name, "unit": channels.CHANNELS[name].unit, "level": float(level)}
    row |= with_ends("joints_above", (above.estimate, above.lower, above.upper))
    # a variable in [0, 1] has at most the variance of a Bernoulli variable with the same mean
    mean = binomial.clopper_pearson(time.sum(), time.size, CONFIDENCE) if known else (np.nan, np.nan)
    row |= with_ends("time", (time.mean(), *mean))
    for share in SHARES:
        q = sample.quantile(share, CONFIDENCE)
        row |= with_ends(f"time_{100 * share:g}", (q.estimate, *np.clip([q.lower, q.upper], 0.0, 1.0)))
    return row


def _panels(name: str, rows: Rows, levels: FloatArray) -> Iterator[Panel]:
    """Curves of one load over the level: share of the joints, and of the revolution."""
    columns = text.columns_of([row for row in rows if row["load"] == name])
    words = "Share over the level, with its 95 % interval where the joints give one; the levels asked for are marked."
    for key, title, labels in (
        ("joints", "joints that exceed a level", {"joints_above": ""}),
        ("time", "time above a level", LINES),
    ):
        draw = partial(_curves, columns=columns, labels=labels, levels=levels)
        yield Panel(f"{key}-{name}", f"{name}: {title}", words, draw, (drawing.WIDTH, 3.4))


def _curves(ax: Axes, columns: Mapping[str, Any], labels: Mapping[str, str], levels: FloatArray) -> None:
    """Draw curves over the level, the first with its interval."""
    x, ends = np.array(columns["level"]), ("", "_lower", "_upper")
    curves = {label: [100.0 * np.array(columns[f"{key}{end}"]) for end in ends] for key, label in labels.items()}
    has_band = all(np.isfinite(low).all() for _, low, _ in curves.values())
    drawing.curves(ax, x, curves, levels, bands=int(has_band))
    unit = drawing.loads_axis(ax.xaxis, float(np.abs(x).max()), columns["unit"][0])
    ax.set(xlabel=f"level [{unit}]", ylim=(0.0, None))
    ax.set_ylabel("time above, % of a revolution" if len(labels) > 1 else "joints that exceed the level, %")
