"""Orders of the shafts' loads: table, CSV and pictures."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter

from tolstat.common.load_kinds import ORDERS
from tolstat.display import drawing, style, text
from tolstat.display.blocks import Panel
from tolstat.display.table import Column, Row, has
from tolstat.store import revolutions

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.questions.orders.query import Orbit, Orders

AMPLITUDES = ("nominal joint", "median", "5 to 95 %")
"""Labels of the picture of amplitudes."""
SMALL = 0.05
"""Orbits below this part of the largest one are too small for an arrow."""
GAP = 1.05
"""Room between the rows of the sheet, for titles, legends and labels, inches."""
ORBITS = {"nominal": "nominal joint", "median": "near median", "95 %": "near 95 %"}
"""Labels of the orbits, by `Orbit.near`."""
LOOKS: dict[str, tuple[str, style.Dash]] = {
    "nominal": (style.INK, style.DASHES[2]),
    "median": (style.COLOURS[0], style.DASHES[0]),
    "95 %": (style.COLOURS[1], style.DASHES[0]),
}
"""Colour and dash of the orbits, by `Orbit.near`."""
ORIGIN = {
    "stored": "from the histories in the file",
    "harmonics": "restored from the harmonics in the file",
    revolutions.AGAIN: "simulated again, since the file holds no histories of them",
}


def _value(name: str) -> Callable[[Row], str]:
    return lambda row: text.value(row[name], row["unit"])


def _interval(key: str) -> Callable[[Row], str]:
    return lambda row: text.span_of(row[f"q{key}_lower"], row[f"q{key}_upper"], row["unit"])


COLUMNS = (
    Column("amplitude", lambda row: str(row["load"])),
    Column("nominal joint", _value("nominal")),
    Column("5 %", _value("q5")),
    Column("interval of 5 %", _interval("5"), shown=has("q5_lower"), rank=3),
    Column("median", _value("qmedian")),
    Column("interval of median", _interval("median"), shown=has("qmedian_lower"), rank=2),
    Column("95 %", _value("q95")),
    Column("interval of 95 %", _interval("95"), shown=has("q95_lower"), rank=1),
)
"""Columns of the table `Orders.table`: quantiles over the joints with their intervals."""


def note(found: Orders) -> str:
    """Notes to the table: number of joints, intervals, which joints the orbits are of."""
    counts = f"{found.joints} joints, {found.left_out} without a valid load left out"
    if found.table["q95_lower"].isna().all():
        lines = [counts, "no intervals: the joints are not independent"]
    else:
        lines = [f"{counts}; 95 % intervals"]
    if found.orbits:
        lines.append(f"{_which(found)}; {ORIGIN[found.origin]}")
    if found.apart:
        lines.append(
            f"largest loads of these joints differ by up to {found.apart:.1e} (relative) from the stored ones, which "
            "another machine or version computed"
        )
    return "\n".join(lines)


def _which(found: Orders) -> str:
    """Words on which joints the orbits are of."""
    of_shaft: dict[str, list[str]] = {}
    for own in found.orbits:
        place = f"{own.shaft} shaft{f' at {own.point}' if own.point else ''}"
        of_shaft.setdefault(place, []).append(f"{ORBITS[own.near]} row {own.row}")
    parts = [f"{place} {', '.join(joints)}" for place, joints in of_shaft.items()]
    return f"orbits: {'; '.join(parts)}; nearest in the largest lateral force"


def panels(found: Orders) -> list[Panel]:
    """Pictures: amplitude over order of each quantity, then the orbit of each shaft."""
    made = [_amplitudes(str(name), part) for name, part in found.table.groupby("quantity", sort=False)]
    for shaft in dict.fromkeys(orbit.shaft for orbit in found.orbits):
        own = [orbit for orbit in found.orbits if orbit.shaft == shaft]
        at = f", at {own[0].point}" if own[0].point else ""
        made.append(
            Panel(
                f"orbit-{shaft}",
                f"Lateral force on the {shaft} shaft over one revolution{at}",
                "Orbit of the force in axes that do not turn, of the nominal joint and of two others. "
                + " ".join(f"{ORBITS[o.near]}: up to {text.value(_largest(o), 'N')}." for o in own),
                partial(_orbits, orbits=own),
                (drawing.WIDTH, 4.6),
                top=drawing.legend_room([ORBITS[o.near] for o in own]),
            )
        )
    return made


def write(found: Orders, stem: Path) -> list[Path]:
    """Write ``STEM_orders.csv``, ``.png`` and ``.svg``, and ``STEM_orbits.csv`` where there are orbits.

    Returns
    -------
    list of Path
        The files.
    """
    files = [text.csv(found.table, stem, "orders")]
    if found.orbits:
        files.append(text.csv(points(found), stem, "orbits"))
    return files + style.save(figure(found), stem.with_name(f"{stem.name}_orders"))


def points(found: Orders) -> dict[str, list[float | int | str]]:
    """Points of the orbits, one row each: shaft, which joint, its row, input angle (rad), f_x, f_y (N)."""
    rows = [
        {"shaft": own.shaft, "near": own.near, "row": own.row, "theta": theta, "f_x": x, "f_y": y}
        for own in found.orbits
        for theta, (x, y) in zip(_angles(len(own.force)), own.force.tolist(), strict=True)
    ]
    return text.columns_of(rows)


def _angles(k: int) -> list[float]:
    return [2 * np.pi * i / k for i in range(k)]


def figure(found: Orders) -> Figure:
    """Draw all pictures on one sheet, two in a row."""
    own = panels(found)
    rows = -(-len(own) // 2)
    heights = [max(panel.size[1] for panel in own[2 * i : 2 * i + 2]) - 0.8 for i in range(rows)]
    total = sum(heights) + GAP * rows
    with drawing.settings():
        page = Figure(figsize=(2 * drawing.WIDTH, total))
        axes = page.subplots(rows, 2, squeeze=False, height_ratios=heights)
        page.subplots_adjust(left=0.077, right=0.99, wspace=0.2, hspace=GAP * rows / sum(heights))
        page.subplots_adjust(top=1.0 - 0.5 / total, bottom=(GAP - 0.5) / total)
        for ax in axes.flat[len(own) :]:
            ax.set_axis_off()
        for panel, ax in zip(own, axes.flat, strict=False):
            ax.set_title(panel.title, pad=72.0 * panel.top)
            panel.draw(ax)
    return page


def _amplitudes(name: str, part: pd.DataFrame) -> Panel:
    place, _, _ = name.rpartition(".")
    noun = part["noun"].iloc[0]
    most = max(part.to_dict("records"), key=lambda row: float(row["qmedian"]))
    said = f"The median of the joints is largest at order {most['order']}, {text.value(most['qmedian'], most['unit'])}."
    where = f", {place} shaft" if place else ""
    return Panel(
        f"orders-{name}",
        f"{noun[0].upper()}{noun[1:]}{where}".replace("Psi", "Ψ"),
        said,
        partial(_bars, part=part),
        (drawing.WIDTH, 2.7),
        top=drawing.legend_room(AMPLITUDES),
    )


def _bars(ax: Axes, part: pd.DataFrame) -> None:
    """Draw the nominal joint beside the median, with the range from 5 to 95 % of the joints."""
    order = part["order"].to_numpy()
    low, middle, high = (part[f"q{key}"].to_numpy() for key in ("5", "median", "95"))
    ax.bar(order - 0.18, np.nan_to_num(part["nominal"].to_numpy()), 0.32, color=drawing.GREY)
    ax.bar(order + 0.18, middle, 0.32, color=style.COLOURS[0])
    ax.errorbar(
        order + 0.18, middle, np.clip([middle - low, high - middle], 0.0, None), fmt="none", ecolor=style.INK,
        elinewidth=1.3, capsize=4.0,
    )  # fmt: skip
    top = max(float(high.max()), float(np.nanmax(part["nominal"], initial=0.0)))
    ax.set(xticks=list(ORDERS), xticklabels=[f"{n}×" for n in ORDERS], xlabel="order, multiple of the input speed")
    ax.set(xlim=(ORDERS[0] - 0.6, ORDERS[-1] + 0.6), ylim=(0.0, 1.08 * top or 1.0))
    ax.grid(axis="x", visible=False)
    unit = drawing.loads_axis(ax.yaxis, top, part["unit"].iloc[0])
    if not unit:
        ax.yaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:.3g}"))
    ax.set_ylabel(f"amplitude [{unit or '1'}]")
    handles = [
        Patch(color=drawing.GREY),
        Patch(color=style.COLOURS[0]),
        Line2D([], [], color=style.INK, lw=1.3, marker="|", ms=8.0),
    ]
    drawing.legend_above(ax, handles, AMPLITUDES)


def _orbits(ax: Axes, orbits: list[Orbit]) -> None:
    """Draw the orbits about zero force; a dot is the input angle 0, an arrow head points on."""
    handles = []
    for line in (ax.axhline, ax.axvline):
        line(0.0, color=style.FAINT, lw=0.8)
    for orbit in orbits:
        colour, dash = LOOKS[orbit.near]
        x, y = np.vstack([orbit.force, orbit.force[:1]]).T
        small = orbit.near == "nominal"  # mostly a point at the centre, where other orbits pass
        size, order = (4.0, 4) if small else (6.0, 3)
        handles += ax.plot(x, y, "o", markevery=[0], ms=size, zorder=order, color=colour, ls=dash)
        k = max(1, len(orbit.force) // 12)
        if _largest(orbit) > SMALL * max(map(_largest, orbits)):
            head = {"arrowstyle": "-|>", "color": colour, "mutation_scale": 16.0}
            ax.annotate("", (x[k], y[k]), (x[k - 1], y[k - 1]), arrowprops=head)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.08)
    size = max(map(_largest, orbits))
    unit = drawing.loads_axis(ax.xaxis, size, "N")
    drawing.loads_axis(ax.yaxis, size, "N")
    ax.set(xlabel=f"f_x, in the plane of both shafts [{unit}]", ylabel=f"f_y, normal to that plane [{unit}]")
    drawing.legend_above(ax, handles, [ORBITS[orbit.near] for orbit in orbits])


def _largest(orbit: Orbit) -> float:
    return float(np.linalg.norm(orbit.force, axis=1).max())
