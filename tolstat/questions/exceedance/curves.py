"""Pictures of load exceedance: curves with their bands, limits and the nominal joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.binomial import simultaneous
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.common.loads import LoadPanel, load_of, load_panels, panels
from tolstat.display import drawing, style, text
from tolstat.display.answer import Axes, Figure, Panel, Reader, Rows
from tolstat.display.style import lines, ticker
from tolstat.questions.exceedance.rows import curve, ends, limit_rows, most_exceeded, readings
from tolstat.store.view import View

DRAWN_LEVELS = 200
"""Maximum number of points of a curve in the picture."""
THIN_LEVELS = 80
"""Maximum number of points of a curve without a band."""
LIMIT_DASH = (0.0, (8.0, 3.0))


def sheet(view: View, notes: Sequence[str]) -> Figure:
    """Draw the exceedance curves of all bushing loads that the study keeps, and of all loads with limits.

    Parameters
    ----------
    view : View
        The campaign; without a valid joint, the panels say so.
    notes : sequence of str
        Small print.

    Returns
    -------
    Figure
        A panel for each group and kind, empty where no load is kept, and for other loads with limits; share of the
        joints on a logarithmic axis down to half a joint.
    """
    title = f"{view.name}: share of joints whose largest load exceeds x"
    drawn = [_panel(view, panel) for panel in load_panels(view.limits, view.mechanism)]
    return drawing.sheet(drawn, title, notes, columns=2)


def _panel(view: View, panel: LoadPanel) -> Panel:
    """Curves of loads of one kind."""
    samples = {i: view.load(x) for i, x in enumerate(panel.names) if x in (*view.bushing_loads, *view.limits)}
    loads = {i: load for i, load in samples.items() if load.valid.size}

    def draw(ax: Axes) -> None:
        if not loads:
            drawing.empty(ax, "no joint with a valid result" if samples else "not kept by the study")
            return
        high, _ = _draw(ax, view, loads)
        unit = drawing.loads_axis(ax.xaxis, max((x.limit for x in loads.values() if x.limit), default=high), panel.unit)
        x = f"x: largest {panel.quantity} over the revolution [{unit or '1'}]"
        ax.set(xlabel=x, ylabel="share of joints above x")
        if view.design.is_sample:
            end = max(curve(load, DRAWN_LEVELS)["outer_upper"][-1] for load in loads.values())
            look: Any = {"color": style.FAINT, "lw": 1.1, "ls": (0.0, (1.0, 2.0)), "zorder": 1.5}
            ax.axhline(end, **look, label="upper end where none exceeds x")

    height = 3.9 + 0.2 * max(len(panel.names) - 4, 0)  # a line of the legend for each
    return Panel(f"exceedance-{panel.key}", panel.title, panel.title, draw, (drawing.WIDTH, height))


def _draw(ax: Axes, view: View, loads: Mapping[int, Sample], others: Sequence[Sample] = ()) -> tuple[float, float]:
    """Draw curves with bands, limits and nominal joints, and others thin; returns the largest load and share drawn.

    `loads` by their number in the group; those of a panel have one unit. The share is the smallest.
    """
    tables = {i: curve(load, DRAWN_LEVELS) for i, load in loads.items()}
    thin = {other.name: curve(other, THIN_LEVELS) for other in others}
    limits: dict[float, list[int]] = {}
    for i, load in loads.items():
        if load.limit is not None:
            limits.setdefault(load.limit, []).append(i)
    levels = np.concatenate([table["level"] for table in (*tables.values(), *thin.values())])
    # the x axis has the loads, which are not negative, and the limits unless they lie far off
    low, high = float(levels.min()), float(levels.max())
    reach = max(high - low, 0.02 * abs(high), 1e-12)
    near = [limit for limit in limits if low - 0.8 * reach <= limit <= high + 0.8 * reach]
    low, high = min([low, *near]), max([high, *near])
    margin = 0.05 * max(high - low, reach)
    low, high = max(low - margin, min(low, 0.0)), high + margin
    floor = 0.5 * min(1.0 / x["n"][0] for x in tables.values())
    ax.set_xlim(low, high)
    style.share_axis(ax, floor)
    for i, table in tables.items():
        look: Any = style.curve(i)
        _bands(ax, table, floor, look["color"])
        look |= {"zorder": 3, "label": loads[i].name}
        _step(ax, table, table["estimate"], floor, **look)
    for i in tables:
        if low <= loads[i].nominal <= high:
            style.mark(ax, loads[i].nominal, 1.0, style.curve(i)["color"])
    for name, table in thin.items():
        dash = "-" if load_of(name, view.mechanism).place.group == _groups(view)[0] else (0.0, (4.0, 1.5))
        line = _step(ax, table, table["estimate"], floor, color=style.FAINT, lw=0.7, ls=dash)
        drawing.switched(line, "others")
    for level, which in sorted(limits.items()):
        of = "" if len(which) == len(loads) else f" ({_numbers(view, [loads[i].name for i in which])})"
        beyond = " →" if level > high else " ←" if level < low else ""
        colour = style.curve(which[0])["color"] if len(which) == 1 < len(loads) else style.INK
        look = {"color": colour, "lw": 1.4, "zorder": 2}
        look |= {"ls": LIMIT_DASH, "label": f"limit {text.value(level, loads[which[0]].unit)}{of}{beyond}"}
        if beyond:
            ax.plot([], [], **look)
        else:
            ax.axvline(level, **look)
    return high, floor


def _numbers(view: View, names: Sequence[str]) -> str:
    """Numbers of the bushings of loads, of drive shafts by joint: ``1, 2``, ``joint2: 1, 2``."""
    numbers: dict[str, list[str]] = {}
    for name in names:
        place = load_of(name, view.mechanism).place
        joint, _, bushing = place.name.rpartition(".")
        numbers.setdefault(joint, []).append(bushing.removeprefix(place.group))
    return "; ".join(f"{joint}: {', '.join(each)}".removeprefix(": ") for joint, each in numbers.items())


def _groups(view: View) -> list[str]:
    """Groups of bushings; thin curves of the first one are solid, those of others dashed."""
    return list(dict.fromkeys(group for group, _ in panels(view.mechanism)))


def _steps(ax: Axes, table: NDArray[np.void]) -> NDArray[np.float64]:
    """Levels of a curve, whose first row is drawn from the left edge on."""
    return np.append(ax.get_xlim()[0], table["level"][1:])


def _step(ax: Axes, table: NDArray[np.void], shares: NDArray[np.float64], floor: float, **look: Any) -> lines.Line2D:
    return ax.step(_steps(ax, table), shares.clip(1e-3 * floor, 1.0), where="post", **look)[0]


def _bands(ax: Axes, table: NDArray[np.void], floor: float, colour: str) -> None:
    """Draw the interval of sampling and, lighter, the one with unresolved joints; without an interval its bounds."""
    known = np.isfinite(table["lower"]).all()
    bands = [("lower", "upper", 0.2)] if known else []
    if table["n_failed"][0] + table["n_unsettled"][0]:
        bands.append(("outer_lower", "outer_upper", 0.1) if known else ("bound_lower", "bound_upper", 0.1))
    for lower, upper, alpha in bands:
        low, high = (table[end].clip(1e-3 * floor, 1.0) for end in (lower, upper))
        label = "95 % band" if lower == "lower" else None
        ax.fill_between(_steps(ax, table), low, high, step="post", color=colour, alpha=alpha, lw=0, label=label)


def leading_panel(view: View, name: str) -> Panel:
    """Curve of a leading load with its band; on switches the other bushings, and a band for the whole curve."""
    load, plain = view.load(name), view.narrowed(name)[1]
    others = [other for other in view.bushing_loads if other != plain and plain in view.bushing_loads]
    kind_of = {other: load_of(other, view.mechanism).kind for other in (*others, plain)}
    others = [f"{other}{name.removeprefix(plain)}" for other in others if kind_of[other] == kind_of[plain]]
    dashes = ", ".join(f"{group} {'dashed' if i else 'solid'}" for i, group in enumerate(_groups(view)))
    switches = [("others", f"other bushings, without bands ({dashes})")] if others else []
    if view.design.independent:
        switches.append(("curve-band", "95 % band for the whole curve (DKW)"))
    description = "no joint with a valid result"
    if load.valid.size:
        half, few = (text.value(load.quantile(share).estimate, load.unit) for share in (0.5, 0.99))
        description = f"half of the joints exceed {half}, 1 % {few}"

    def draw(ax: Axes) -> None:
        """The load with band, limit and nominal joint; other loads as thin lines, and the band for all x, switched."""
        if not load.valid.size:
            drawing.empty(ax, "no joint with a valid result")
            return
        high, floor = _draw(ax, view, {0: load}, [other for other in view.loads(others) if other.valid.size])
        if view.design.independent:
            table, half = curve(load, DRAWN_LEVELS), simultaneous(load.valid.size, load.design.level(CONFIDENCE))
            for end in (table["bound_upper"] + half, table["bound_lower"] - half):
                line = _step(ax, table, end, floor, color=style.INK, lw=0.9, ls=(0.0, (4.0, 2.0)))
                drawing.switched(line, "curve-band")
        ax.xaxis.set_major_locator(ticker.MaxNLocator(5 if load.unit != "1" else 3))
        unit = drawing.loads_axis(ax.xaxis, load.limit or high, load.unit)
        ax.set_xlabel(f"x: {load.name} [{unit or '1'}], largest over the revolution")
        ax.set_ylabel("share of joints above x")

    title, description = f"{name}: share of the joints above x", f"{name}: {description}"
    looks: Any = {"reads": (name, *others), "switches": switches}
    return Panel(f"leading-{name}", title, description, draw, (drawing.WIDTH, 3.7), **looks)


def reader(view: View) -> Reader:
    """The reader: it begins with the limit that the verdict names; without limits with a leading load."""
    limits = limit_rows(view)
    return Reader(readings(view), str(most_exceeded(view, limits)["load"]) if limits else view.most_exceeded)


def forest_panel(rows: Rows, accepted: float) -> Panel:
    """Share above each limit with its intervals, side by side; `rows` as those of `limit_rows`."""
    labels = [text.limit(row) for row in rows]
    description = "; ".join(
        f"{row['load']} above {text.value(row['level'], row['unit'])}: {text.percent(row['estimate'])}, "
        f"95 % interval {text.span(row['lower'], row['upper'])}"
        for row in rows
    )
    spans = [ends(row) if not np.isnan(ends(row)[0]) else (row["bound_lower"], row["bound_upper"]) for row in rows]
    n = max(1, *(row["n"] for row in rows))
    shown = np.array([*(row["estimate"] for row in rows), *np.ravel(spans)], float)
    shown = np.array([*shown[shown >= 0.5 / n], *([accepted] if accepted > 0 else ())])
    high = min(1.4 * shown.max(initial=0.5 / n), 1.0)

    def draw(ax: Axes) -> None:
        """Estimate, interval and total interval of each limit, on an axis from the least to the largest of them."""
        style.share_axis(ax, min(0.7 * shown.min(initial=high), 0.3 * high), "x", high)
        low, blue = ax.get_xlim()[0], style.COLOURS[0]
        for i, (row, span) in enumerate(zip(rows, spans, strict=True)):
            ax.plot([max(span[0], 0.1 * low), span[1]], [i, i], color=drawing.GREY, lw=5.0, solid_capstyle="butt")
            if not np.isnan(row["estimate"] + row["lower"]):
                ax.plot([max(row["lower"], 0.1 * low), row["upper"]], [i, i], color=blue, lw=2.0)
            if row["estimate"] >= 0:
                marker = "o" if row["estimate"] >= low else "<"
                ax.plot(max(row["estimate"], low), i, marker, color=blue, ms=5.5, clip_on=False)
        if accepted > 0:
            ax.axvline(accepted, color=style.INK, lw=1.4, ls=LIMIT_DASH)
            ax.text(accepted, -0.75, f"accepted: {text.percent(accepted)}", ha="center", va="bottom")
        ax.set_xlabel("share of the joints above the limit")

    size = (drawing.WIDTH, drawing.rows_height(len(rows)))
    return Panel("forest", "Share of the joints above each limit", description, draw, size, 1.4, rows=labels)
