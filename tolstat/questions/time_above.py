"""Share of a revolution in which a load is above a level; not the share of joints that exceed the level."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import binomial, cycles
from tolstat.analysis.design import Design
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.common.channels import CHANNELS, histories_of
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.loads import FloatArray
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import Status
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Part, Sentence, Table
from tolstat.display.blocks import Panel, Panels
from tolstat.display.mpl import lines
from tolstat.display.options import Loads, Opt
from tolstat.display.table import Column, Row, Rows
from tolstat.store import revolutions
from tolstat.store.view import View
from tolstat.study.selection import Entry, quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints at which quantiles of the time above are given."""
POINTS = 60
"""Number of levels of a curve."""
MAX_LOADS = 4
"""Maximum number of loads in pictures."""
LINES = {
    "time": "mean joint",
    "time_50": "median joint",
    "time_90": "90 % below",
    "time_99": "99 % below",
}
"""Labels of the curves of time above, by key."""


def _share(name: str) -> Callable[[Row], str]:
    def cell(row: Row) -> str:
        own, low, high = (100.0 * row[name + end] for end in ("", "_lower", "_upper"))
        return f"{own:.3g} %" if math.isnan(low) else f"{own:.3g} ({low:.3g} .. {high:.3g}) %"

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
        raise StoreError(str(Fault(str(view.path), "has no settled joint", "resume the campaign")))
    shares, ends = _shares(view, settled, asked)
    design = view.design.only(settled)
    rows = list(_rows(asked, shares, design))
    parts: list[Part] = [Table("levels", "Time above levels within a revolution", LEVELS, rows)]
    if curves:
        spread = {name: np.linspace(*ends[name], POINTS) for name in asked}
        more = list(_rows(spread, _shares(view, settled, spread)[0], design))
        drawn = [panel for name in list(asked)[:MAX_LOADS] for panel in _panels(name, more, asked[name])]
        parts += [Table("curves", "Time above many levels", (), more), Panels(drawn)]
    left_out = view.counts.done - settled.size
    counts = f"{settled.size} joints, {left_out} without a settled revolution left out"
    parts.append(Sentence(f"{counts}; time: share of a revolution"))
    if not design.has_interval("mean"):
        parts.append(Sentence("no intervals: they hold for independent samples only"))
    return Answer("time_above", "Time above levels", parts, {"joints": settled.size, "left_out": left_out})


def _levels(view: View, by: Sequence[str], levels: Sequence[str]) -> dict[str, FloatArray]:
    """Levels of each load that is asked for, SI."""
    faults: list[Fault] = []
    names = list(by) or [name for name in view.limits if name in CHANNELS]
    if not names:
        faults.append(Fault("--by", "the study limits no load over the input angle", "name one: --by cross1.F"))
    faults += [
        Fault("--by", f"{name!r} is no load over the input angle", did_you_mean(name, list(CHANNELS)))
        for name in names
        if name not in CHANNELS
    ]
    names = [name for name in names if name in CHANNELS]
    given: dict[str, list[float]] = {CHANNELS[name].unit: [] for name in names}
    for level in levels if given else ():
        with gather(faults):
            unit, value = _level(level, sorted(given))
            given[unit].append(value)
    found = {}
    for name in names:
        own = given[CHANNELS[name].unit] or ([] if levels or name not in view.limits else [view.limits[name]])
        if not own and not faults:
            faults.append(Fault("--level", f"{name} has neither a level nor a limit", 'give one: --level "700 N"'))
        found[name] = np.array(own, dtype=float)
    if faults:
        raise InputError(faults)
    return found


def _level(level: str, units: Sequence[str]) -> tuple[str, float]:
    """Unit and value of a level, in the first of the units that it can have."""
    *others, last = units
    for unit in others:
        with suppress(InputError):
            return unit, quantity(Entry(level, (level,), level), unit, "--level")
    return last, quantity(Entry(level, (level,), level), last, "--level")


def _shares(
    view: View, samples: NDArray[np.intp], levels: Mapping[str, FloatArray]
) -> tuple[dict[str, FloatArray], dict[str, tuple[float, float]]]:
    """Share of the revolution above each level, (m, levels), and smallest and largest value, of each load."""
    shares = {name: np.empty((len(samples), len(own))) for name, own in levels.items()}
    ends = dict.fromkeys(levels, (np.inf, -np.inf))
    slots = view.slots(samples)
    for part in revolutions.blocks(len(slots)):
        loads = revolutions.loads(view.store, slots[part], histories_of(levels))
        for name, own in levels.items():
            load = CHANNELS[name].of(loads)
            ends[name] = min(ends[name][0], float(load.min())), max(ends[name][1], float(load.max()))
            for k, level in enumerate(own):
                shares[name][part, k] = cycles.share_of_revolution_above(load, float(level))
    return shares, ends


def _rows(
    levels: Mapping[str, FloatArray], shares: Mapping[str, FloatArray], design: Design
) -> Iterator[dict[str, Any]]:
    """One row per load and level."""
    for name, own in levels.items():
        for level, time in zip(own, shares[name].T, strict=True):
            sample = Sample.of(time, np.full(time.size, Status.OK), design)
            above = sample.above(0.0, CONFIDENCE)
            row = {"load": name, "unit": CHANNELS[name].unit, "level": float(level)}
            row |= _ends("joints_above", above.estimate, above.lower, above.upper)
            # a variable in [0, 1] has at most the variance of a Bernoulli variable with the same mean
            known = design.has_interval("mean")
            mean = binomial.clopper_pearson(time.sum(), time.size, CONFIDENCE) if known else (np.nan, np.nan)
            row |= _ends("time", float(time.mean()), *map(float, mean))
            for share in SHARES:
                q = sample.quantile(share, CONFIDENCE)
                lower, upper = np.clip([q.lower, q.upper], 0.0, 1.0)
                row |= _ends(f"time_{100 * share:g}", q.estimate, lower, upper)
            yield row


def _ends(name: str, estimate: float, lower: float, upper: float) -> dict[str, float]:
    return {name: estimate, f"{name}_lower": lower, f"{name}_upper": upper}


def _panels(name: str, rows: Rows, levels: FloatArray) -> Iterator[Panel]:
    """Curves of one load over the level: share of the joints, and of the revolution."""
    own = text.columns_of([row for row in rows if row["load"] == name])
    words = "Share over the level, with its 95 % interval where the joints give one; the levels asked for are marked."
    for key, title, names in (
        ("joints", "joints that exceed a level", ["joints_above"]),
        ("time", "time above a level", list(LINES)),
    ):
        draw = partial(_curves, own=own, names=names, levels=levels)
        room = drawing.legend_room(list(LINES.values())) if key == "time" else Panel.top
        yield Panel(f"{key}-{name}", f"{name}: {title}", words, draw, (drawing.WIDTH, 3.4), top=room)


def _curves(ax: Axes, own: Mapping[str, Any], names: Sequence[str], levels: FloatArray) -> None:
    x = np.array(own["level"])
    for name, colour, dash in zip(names, style.COLOURS, style.DASHES, strict=False):
        middle, low, high = (100.0 * np.array(own[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
        ax.plot(x, middle, color=colour, ls=dash)
        if name == names[0] and np.isfinite(low).all():
            ax.fill_between(x, low, high, color=colour, alpha=0.2, lw=0)
    for level in levels:
        ax.axvline(float(level), color=style.FAINT, lw=1.0, ls=style.DASHES[2])
    unit = drawing.loads_axis(ax.xaxis, float(np.abs(x).max()), own["unit"][0])
    ax.set(xlabel=f"level [{unit}]", ylim=(0.0, None))
    if len(names) == 1:
        ax.set_ylabel("joints that exceed the level, %")
        return
    ax.set_ylabel("time above, % of a revolution")
    looks = zip(style.COLOURS, style.DASHES, strict=True)
    drawing.legend_above(ax, [lines.Line2D([], [], color=c, ls=d) for c, d in looks], list(LINES.values()))
