"""Fatigue of the parts as a table, notes and a figure of the failures over the life."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from tolstat.analysis.strength import Line
from tolstat.display import style, text
from tolstat.display.table import Column, Row
from tolstat.questions.fatigue.parts import ANY, failures_over_life
from tolstat.questions.fatigue.rendering import duty_sentence
from tolstat.questions.fatigue.stress import Stressed
from tolstat.study.stress_point import StressPoint

MAX_APART = 1e-6
"""Relative difference of joints simulated again from their stored loads above which a note says so."""
POINTS = 25
"""Number of lives of the curve."""
DECADES = 2.0
"""Decades drawn around the service life."""


def _line(line: Line) -> str:
    scatter = f", T_S = {line.T_S:.3g}" if line.T_S > 1 else ""
    mean = f", M = {line.M:g} (R = {line.R:g})" if line.M > 0 else ""
    knee = f"range of {line.S_D / 1e6:.4g} MPa at {line.N_D:g} cycles"
    return f"{knee}, k = {line.k:g}, {line.k_2:g} below{scatter}{mean}, damage sum {line.D_c:g}"


def _lines(points: Sequence[StressPoint]) -> list[str]:
    """One sentence for each S–N line, with the names of its points."""
    names: dict[Line, list[str]] = {}
    for point in points:
        names.setdefault(point.line, []).append(point.name)
    if len(names) == 1:
        return [f"S–N line: {_line(points[0].line)}"]
    return [f"S–N line of {'; '.join(own)}: {_line(line)}" for line, own in names.items()]


def _life(x: float) -> str:
    return "-" if math.isnan(x) else "never" if math.isinf(x) else f"{x:.2e}".replace("e+", "e")


def _life_span(row: Row) -> str:
    low, high = row["life_lower"], row["life_upper"]
    return "-" if math.isnan(low) else f"{_life(low)} .. {_life(high)}"


PARTS = (
    Column("point", lambda row: str(row["point"])),
    Column("failures", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["outer_lower"], row["outer_upper"])),
    Column("ppm", lambda row: text.ppm(row["estimate"]), rank=6),
    Column("failures in delivery", text.delivery, rank=7),
    Column("B10 life", lambda row: _life(row["life"])),
    Column("its 95 % interval", _life_span, rank=5),
    Column("nominal damage", lambda row: text.formed(row["nominal"]), rank=3),
    Column("median damage", lambda row: text.formed(row["median"]), rank=2),
    Column("99 % damage", lambda row: text.formed(row["upper_99"]), rank=1),
    Column("nominal joint fails", lambda row: text.percent(row["nominal_failures"]), rank=4),
)
"""Columns of the table `parts.part_failures`."""


def notes(stressed: Stressed, failures: pd.DataFrame) -> str:
    """Notes to `parts.part_failures`: number of joints, meaning of the columns, restrictions."""
    settings = stressed.settings
    starts = f" with {settings.starts:g} starts" if settings.starts else ""
    n = stressed.status.size
    first = f" (the first {n} of {stressed.total})" if stressed.total > n else ""
    lines = [
        f"{int(stressed.valid.sum())} of {n} joints settled{first}; "
        f"service life {settings.revolutions:g} revolutions{starts}",
        "B10 life: revolutions after which 10 % have failed; damage: at the median strength; intervals count joints "
        "without a valid load as failing and as surviving",
        *_lines(settings.points),
    ]
    if cycle := duty_sentence(stressed.duty):
        lines.insert(1, cycle)
    if (failures["point"] == ANY).any():
        lines.append(f"{ANY}: the joint fails with its first part; strengths of two points are independent")
    if not stressed.design.has_interval("mean"):
        lines.append("no intervals: they hold for independent samples only")
    if stressed.apart > MAX_APART:
        lines.append(f"joints simulated again differ from the file by up to {stressed.apart:.1g} of a largest load")
    return "\n".join(lines)


def panel(ax: Axes, stressed: Stressed, failures: pd.DataFrame) -> None:
    """Draw the share of the joints with a failed part against revolutions, with its band and the service life.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    stressed : Stressed
        Stress cycles of the joints.
    failures : DataFrame
        `parts.part_failures` of them.
    """
    life = stressed.settings.revolutions
    centre = failures["life"].iloc[-1]
    first, last = sorted([life, centre if math.isfinite(centre) and centre > 0 else life])
    numbers = np.geomspace(first / 10**DECADES, last * 10**DECADES, POINTS)
    curve = failures_over_life(stressed, numbers.tolist())
    if stressed.design.has_interval("mean"):
        ax.fill_between(
            curve["revolutions"], curve["outer_lower"], curve["outer_upper"], color=style.COLOURS[0], alpha=0.2, lw=0
        )
    ax.plot(curve["revolutions"], curve["estimate"], color=style.COLOURS[0])
    ax.axvline(life, color=style.INK, lw=1, ls="--")
    ax.annotate(
        "service life", (life, 1.0), (4, -2), xycoords=("data", "axes fraction"), textcoords="offset points", va="top"
    )
    ax.set(xscale="log", xlim=(numbers[0], numbers[-1]))
    ends = curve["outer_upper"] if stressed.design.has_interval("mean") else curve["estimate"]
    ax.set_ylim(0.0, min(1.0, 1.1 * float(ends.max())) or 1.0)
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0e}".replace("e+0", "e").replace("e+", "e")))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    ax.set_xlabel("revolutions of the input shaft")
    ax.set_ylabel("joints with a failed part")
