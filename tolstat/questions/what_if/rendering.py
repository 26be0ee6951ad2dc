"""What if a line of the drawing had another width: text, JSON, sentence of the verdict, pictures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.markers import CARETDOWN, CARETLEFT
from matplotlib.patches import Patch

from tolstat.common.loads import ANY_LIMIT
from tolstat.display import drawing, style, text
from tolstat.display.blocks import Panel
from tolstat.display.table import Column, Row, has
from tolstat.questions.what_if import query
from tolstat.study.widths import COARSER, EXACT, FINER, HALF

if TYPE_CHECKING:
    from tolstat.questions.what_if.query import WhatIf
    from tolstat.store.view import View

CURVES = 4
"""Number of lines whose curve has a colour; the others are grey."""
_HEADS = {HALF: "half as wide, %", EXACT: "exact, %", FINER: "finer, %", COARSER: "coarser, %"}
_RANKS = {HALF: 0, EXACT: 1, COARSER: 2, FINER: 5}
_ACCEPTED: dict[str, Any] = {"color": style.COLOURS[2], "lw": 1.4, "ls": (0.0, (6.0, 2.0))}
"""Style of the accepted share."""
_STEPS = ("half as wide", "one step coarser", "exact")
"""Legend of the tornado."""
_KINDS = {"offset", "tilt", "diameter", "clearance", "position"}
"""Errors whose lines have a name in words."""


def columns(found: WhatIf) -> list[Column]:
    """Columns of `rows`: a line, its tolerance, and the share above the level after each step, with its interval."""
    steps = [
        Column(head, partial(_share, step=step), shown=has(step), rank=_RANKS[step]) for step, head in _HEADS.items()
    ]
    return [
        Column("line", lambda row: str(row["line"]), words=True),
        Column("tolerance", lambda row: row["size"] or "-", rank=3),
        *steps,
        Column("finer, coarser", lambda row: str(row["by"]), words=True, rank=4),
        Column("half: change, %", partial(_change, step=HALF), shown=has(HALF), rank=6),
        Column("alone, %", partial(_index, name="above_alone"), shown=has("above_alone"), rank=8),
        Column("in all, %", partial(_index, name="above_in_all"), shown=has("above_in_all"), rank=7),
    ]


def index_columns(found: WhatIf) -> list[Column]:
    """Columns of the table `indices` of a result: Sobol' indices of the load and of the event, with intervals."""
    load = "largest load over its limit" if found.load == ANY_LIMIT else found.load
    load = f"log {load}" if found.logarithmic else load
    heads = {"alone": f"{load}: alone, %", "in_all": "in all, %"}
    heads |= {"above_alone": f"{_above(found)}: alone, %", "above_in_all": "in all, %"}
    return [
        Column("line", lambda row: str(row["line"]), words=True),
        *(Column(head, partial(_index, name=name)) for name, head in heads.items()),
    ]


def rows(found: WhatIf) -> pd.DataFrame:
    """One row per line, with the numbers of each step behind its name: ``half``, ``half_lower``, ``half_change``."""
    own: dict[str, dict[str, Any]] = {}
    for row in found.table.to_dict("records"):
        line = own.setdefault(row["line"], {"line": row["line"], "size": row["size"], "steps": {}})
        step = row["step"]
        line |= {step: row["share"]} | {f"{step}_{end}": row[f"share_{end}"] for end in ("lower", "upper")}
        line |= {f"{step}_change{end}": row[f"change{end}"] for end in ("", "_lower", "_upper")}
        line["steps"][step] = row["words"]
    table = pd.DataFrame(list(own.values()))
    table["by"] = [", ".join(s[step] for step in (FINER, COARSER) if step in s) or "-" for s in table.pop("steps")]
    return table.merge(found.indices, on="line", how="left", sort=False)


def heading(found: WhatIf) -> str:
    """Two lines above the table: the joints as drawn, and what the table holds."""
    share = f"{text.percent(found.share)} ({text.span(found.lower, found.upper)})"
    return f"{event(found)}: {share} of {found.n} joints as drawn\nthis share with one line changed:"


def note(found: WhatIf) -> str:
    """Notes to the table."""
    said = [
        f"share of the joints {_above(found)}, 95 % intervals without the numerical error; joints with the same seeds"
    ]
    if found.table["n"].nunique() > 1:
        said.append(joints(found))
    if not found.settled:
        said.append("the order of neighbouring lines is not settled: --run with a longer --budget goes on")
    said += absent(found)
    if not found.indices.empty:
        said.append(
            f"alone, in all: Sobol' indices of the event that the load is {_above(found)}, "
            f"from {int(found.indices['pairs'].max())} pairs of joints"
        )
    return "\n".join(said)


def absent(found: WhatIf) -> list[str]:
    """Sentences on what the table lacks, without full stop: steps, lines without joints, lines that are not changed."""
    said, table = [], rows(found)
    if any(step in table and table[step].isna().any() for step in _HEADS):
        said.append("-: not simulated yet; the same command with --run goes on")
    if found.missing:
        said.append(f"not in the file: {', '.join(found.missing)}; --run simulates them")
    if found.left_out:
        said.append(
            f"left out: {', '.join(found.left_out)}; the width of their zone depends on other errors (a common "
            "direction, or a bonus), and is not changed by itself"
        )
    return said


def event(found: WhatIf) -> str:
    """What the share is about: ``cross1.F > 1500 N``, or ``at least one limit exceeded``."""
    if found.load == ANY_LIMIT:
        return "at least one limit exceeded"
    return text.limit({"load": found.load, "level": found.level, "unit": found.unit})


def _above(found: WhatIf) -> str:
    return "above at least one limit" if found.load == ANY_LIMIT else "above the limit"


def joints(found: WhatIf) -> str:
    """Numbers of joints of each step, the smallest of all lines: ``joints compared: half 5624, exact 1023``."""
    least = found.table.groupby("step", sort=False)["n"].min()
    return f"joints compared: {', '.join(f'{step} {n}' for step, n in least.items())}"


def sentence(found: WhatIf, accepted: float = np.nan) -> str:
    """Sentence on the line that lowers the share most if half as wide; empty if none surely does.

    ``Halve the tilt tolerance of the holes (±0.5 deg) and 2.1 % (1.4 to 3 %) exceed the limit``, without full stop.
    Where that is more than the accepted share, it says that no line suffices, and what the exact line gives.
    """
    row = query.best(found)
    if row is None:
        return ""
    line = f"{phrase(row)} ({row['size']})" if row["size"] else phrase(row)
    if not row["share"] > accepted:
        limit = "at least one limit" if found.load == ANY_LIMIT else "the limit"
        return f"Halve the {line} and {_share_in_words(row)} exceed {limit}"
    exact = {own["line"]: own for own in found.table.to_dict("records") if own["step"] == EXACT}
    least = min(exact.values(), key=lambda own: float(own["share"]), default=None)
    said = f"halving the {line} gives {_share_in_words(row)}"
    if least is not None and least["share"] <= accepted:
        which = "" if least["line"] == row["line"] else f" the {phrase(least)}"
        return f"Halving a single line is not enough: {said}, exact{which} {text.percent(least['share'])}"
    same = exact.get(row["line"])
    return f"No single line is enough: {said}" + ("" if same is None else f", exact {text.percent(same['share'])}")


def _share_in_words(row: Row) -> str:
    low, high = 100.0 * row["share_lower"], text.percent(row["share_upper"])
    return f"{text.percent(row['share'])} ({low:.3g} to {high})"


def advice(view: View, load: str, accepted: float) -> str:
    """Return the `sentence` of a load for the verdict; empty where the file holds no joints with other widths."""
    found = query.what_if(view, load) if view.altered else None
    return "" if found is None else sentence(found, accepted)


def phrase(row: Row) -> str:
    """Line of the drawing in words: ``tilt tolerance of the holes``; ``tolerance "pin1.*"`` where it has none."""
    kinds = {name.partition(".")[2].partition("_")[0] for name in row["names"]}
    features = {name.partition(".")[0] for name in row["names"]}
    bodies = {feature.rstrip("1234") for feature in features}
    if len(kinds) > 1 or not kinds <= _KINDS or not bodies <= {"pin", "hole"} or len(features) % 4:
        return f'tolerance "{row["line"]}"' if "." in row["line"] else f"tolerances of {row['line']}"
    return f"{kinds.pop()} tolerance of the {' and '.join(sorted(f'{body}s' for body in bodies)[::-1])}"


def values(found: WhatIf) -> dict[str, Any]:
    """JSON values."""
    own = found._asdict() | {"table": text.records(found.table), "indices": text.records(found.indices)}
    return own | {"missing": list(found.missing), "left_out": list(found.left_out), "sentence": sentence(found) or None}


def tornado_panel(found: WhatIf, accepted: float) -> Panel:
    """Share above the level with each line half as wide, exact, and coarser."""
    table = rows(found)
    halves = "; ".join(f"{row['line']} {text.percent(row.get(HALF, np.nan))}" for row in table.to_dict("records"))
    labels = _labels(table)
    left = drawing.rows_left([part for label in labels for part in label.split("\n")])
    top = drawing.legend_room(_STEPS, left)
    return Panel(
        f"what-if-{_slug(found)}",
        f"Share of the joints with {event(found)}, if one line is changed",
        f"As drawn {text.percent(found.share)}. Half as wide: {halves}",
        partial(_tornado, found=found, table=table, labels=labels, accepted=accepted),
        (drawing.WIDTH, 0.34 * (len(table) + 2.2) + drawing.BOTTOM + top),
        left,
        top,
    )


def curve_panel(found: WhatIf, accepted: float) -> Panel:
    """Share above the level against the width of each line."""
    table = found.table[np.isfinite(found.table["factor"])]
    return Panel(
        f"widths-{_slug(found)}",
        "The share against the width of each line",
        "; ".join(
            f"{line}: " + ", ".join(f"{row['factor']:.3g} {text.percent(row['share'])}" for row in own)
            for line, own in ((line, part.to_dict("records")) for line, part in table.groupby("line", sort=False))
        ),
        partial(_curves, found=found, table=table, accepted=accepted),
        (drawing.WIDTH, 3.4 + (room := drawing.legend_room(_curve_labels(table, accepted)))),
        top=room,
    )


def _curve_labels(table: pd.DataFrame, accepted: float) -> list[str]:
    lines = [str(line) for line in table["line"].unique()]
    others = ["the other lines"] if len(lines) > CURVES else []
    return [*lines[:CURVES], *others, *([f"accepted {text.percent(accepted)}"] if accepted > 0.0 else [])]


def _labels(table: pd.DataFrame) -> list[str]:
    return [f"{row['line']}\n{row['size']}" if row["size"] else str(row["line"]) for row in table.to_dict("records")]


def _tornado(ax: Axes, found: WhatIf, table: pd.DataFrame, labels: list[str], accepted: float) -> None:
    drawing.rows(ax, labels)
    ax.set_ylim(len(labels) + 0.6, -1.2)  # a row above and one below, for what the vertical lines are
    ax.tick_params(axis="y", labelsize=7.6)
    floor = _floor(found, accepted)
    style.share_axis(ax, floor, "x")
    shares = [found.upper, *found.table["share_upper"]]
    ax.set_xlim(floor, min(1.0, 1.4 * float(np.nanmax(shares))))
    ax.axvspan(max(found.lower, floor), found.upper, color=drawing.GREY, alpha=0.3, lw=0)
    ax.axvline(found.share, color=style.INK, lw=1.2)
    for step, colour, height, above in ((COARSER, style.COLOURS[1], 0.3, -0.1), (HALF, style.COLOURS[0], 0.56, 0.1)):
        for place, row in enumerate(table.to_dict("records")):
            if not np.isnan(row.get(step, np.nan)):
                end = max(row[step], floor)
                ax.barh(place, end - found.share, height, left=found.share, color=colour, zorder=2)
                _whisker(ax, place - above, row[f"{step}_lower"], row[f"{step}_upper"], floor)
    for place, row in enumerate(table.to_dict("records")):
        if not np.isnan(row.get(EXACT, np.nan)):
            marker = "o" if row[EXACT] >= floor else CARETLEFT
            marks: dict[str, Any] = {"mfc": "white", "mec": style.INK, "ms": 5.5, "zorder": 4, "clip_on": False}
            ax.plot(max(row[EXACT], floor), place, marker=marker, ls="", **marks)
    said: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8.0}
    ax.text(found.share, -0.9, f"as drawn {text.percent(found.share)}", backgroundcolor="white", **said)
    if accepted > 0.0:
        ax.axvline(accepted, **_ACCEPTED)
        ax.text(accepted, len(labels) + 0.1, f"accepted {text.percent(accepted)}", backgroundcolor="white", **said)
    handles: list[Patch | Line2D] = [Patch(color=style.COLOURS[0]), Patch(color=style.COLOURS[1])]
    handles.append(Line2D([], [], ls="", marker="o", mfc="white", mec=style.INK, ms=5.5))
    drawing.legend_above(ax, handles, _STEPS)
    ax.set_xlabel(f"share of the joints {_above(found)}")


def _whisker(ax: Axes, y: float, low: float, high: float, floor: float) -> None:
    """Draw an interval; an arrow at the left edge stands for an end that is smaller than what the axis shows."""
    ax.plot([max(low, floor), max(high, floor)], [y, y], color=style.INK, lw=1.2, zorder=3)
    if low < floor:
        ax.plot(floor, y, marker=CARETLEFT, color=style.INK, ms=5.0, zorder=4, clip_on=False)


def _curves(ax: Axes, found: WhatIf, table: pd.DataFrame, accepted: float) -> None:
    floor = _floor(found, accepted)
    style.share_axis(ax, floor)
    top = floor
    handles: list[Artist] = []
    for place, (_, part) in enumerate(table.groupby("line", sort=False)):
        own = part.sort_values("factor")
        at = int(np.searchsorted(own["factor"], 1.0))
        x, y = (np.insert(own[name].to_numpy(), at, value) for name, value in (("factor", 1.0), ("share", found.share)))
        top, grey = max(top, float(y.max())), place >= CURVES
        colour = drawing.GREY if grey else style.COLOURS[place]
        dash = "-" if grey else style.DASHES[place]
        (drawn,) = ax.plot(x, np.maximum(y, floor), color=colour, ls=dash, marker="o", ms=3.0, lw=1.0 if grey else 1.6)
        at_edge = np.full(int((y < floor).sum()), floor)
        ax.plot(x[y < floor], at_edge, marker=CARETDOWN, ls="", color=colour, ms=5.0, clip_on=False)
        handles += [drawn] if place <= CURVES else []
        if place == 0:
            ends = (("share_lower", found.lower), ("share_upper", found.upper))
            low, high = (np.insert(own[name].to_numpy(), at, drawn) for name, drawn in ends)
            ax.fill_between(x, np.maximum(low, floor), np.maximum(high, floor), color=colour, alpha=0.18, lw=0)
    ax.plot(1.0, found.share, "D", color=style.INK, ms=6.0, zorder=5)
    ax.set_ylim(floor, min(1.0, 2.0 * top))
    if accepted > 0.0:
        handles.append(ax.axhline(accepted, **_ACCEPTED))
    ax.set(xlabel="width of the line, relative to the drawing", ylabel=f"share {_above(found)}")
    drawing.legend_above(ax, handles, _curve_labels(table, accepted))


def _slug(found: WhatIf) -> str:
    return found.load.replace(" ", "-")


def _floor(found: WhatIf, accepted: float) -> float:
    """Lower end of an axis of shares: below all shares that are not zero, and below the accepted share."""
    least = [value for value in [*found.table["share"], found.share, accepted] if value > 0.0]
    return 0.6 * max(min(least, default=1.0), 0.5 / max(found.n, 1))


def _share(row: Row, step: str) -> str:
    return _interval(row, step, step)


def _change(row: Row, step: str) -> str:
    value = row[f"{step}_change"]
    return "-" if np.isnan(value) else f"{100 * value:+.1f} ({_ends(row, f'{step}_change', '+.1f')})"


def _index(row: Row, name: str) -> str:
    """Share of the variance: estimates may scatter beyond 0 and 1, where no share is."""
    return _interval({**row, name: np.clip(row[name], 0.0, 1.0) + 0.0}, name, name)


def _interval(row: Row, name: str, ends: str) -> str:
    return "-" if np.isnan(row[name]) else f"{100 * row[name]:.1f} ({_ends(row, ends, '.1f')})"


def _ends(row: Row, name: str, form: str) -> str:
    return text.ends(100 * row[f"{name}_lower"], 100 * row[f"{name}_upper"], form)
