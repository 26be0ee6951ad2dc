"""Pairs that matter on the page: load against the share of the clearance that errors of pin and hole use together."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from tolstat.common.loads import unit_text
from tolstat.display import style, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Table, Text
from tolstat.questions.causes.pairs import Pairs, pairs_of
from tolstat.store.view import View

MATTERS = 0.3
"""Rank correlation of the best combination below which it does not matter, and has no section."""
MOST_USED = 0.1
"""Share of the joints, those that use most of the clearance, whose share above the limit is told."""
LISTED = 5
"""Number of combinations in the table."""


def sections(view: View, asked: Asked) -> list[Section]:
    """Section ``pairs`` of the load with the limit exceeded most; none where a single error tells more than a pair."""
    if not view.sampled or view.design.refuses("index") or not view.limits or view.study.groups:
        return []
    with asked.noting("no pairs of errors"):
        found = pairs_of(view, view.most_exceeded)
        if found.correlation >= max(MATTERS, found.single):
            return [Section("pairs", "Errors of pin and hole together", _blocks(found))]
    return []


def _blocks(found: Pairs) -> list[Block]:
    most, rest = _shares(found)
    said = (
        f"{found.load} comes of errors of pins against their holes: a joint binds where they use up its clearance. "
        f"What tells most is {found.name}, as a share of the clearance: rank correlation with the load "
        f"{found.correlation:.2f}, where that of the best single error is {found.single:.2f}. "
        f"Of the tenth of the joints that use most of the clearance {text.percent(most)} exceed the limit, "
        f"of the others {text.percent(rest)}."
    )
    if len(found.points) > 1:
        said += f" {found.load} is the largest over {', '.join(found.points)}; it is most severe at {found.worst}."
    head = ["rank correlation", "share of the clearance used by"]
    listed = sorted(list(found.others.items())[:LISTED], key=lambda pair: -pair[1])
    rows = [[f"{value:+.2f}", name] for name, value in listed]
    table = Table("The best combinations", head, rows, frozenset({0, 1}))
    how = (
        "Chosen on the joints with an even number, so that it need not be the first of the table; picture and "
        "correlations are of the others. Errors are those of a hole less those of its pin; a tilt counts by what it "
        "takes at the ends of the pin. Offsets along z: what is left of the four after the cross has moved and turned, "
        "the middle of pins 1 and 2 against that of pins 3 and 4."
    )
    return [Text(said), Panels([_panel(found)]), table, Text(how, small=True)]


def _shares(found: Pairs) -> tuple[float, float]:
    """Share above the limit of the joints that use most of the clearance, and of the others."""
    order, most = np.argsort(-found.use), max(1, round(MOST_USED * found.use.size))
    above = found.values > found.limit
    return float(above[order[:most]].mean()), float(above[order[most:]].mean())


def _panel(found: Pairs) -> Panel:
    return Panel(
        f"pairs-{found.load}",
        f"{found.load} against the share of the clearance used",
        f"{found.name}: rank correlation {found.correlation:.2f} over {found.use.size} joints",
        partial(_draw, found=found),
        (4.9, 3.6),
    )


def _draw(ax: Axes, found: Pairs) -> None:
    above = found.values > found.limit
    for here, colour, label in ((~above, style.COLOURS[0], "within the limit"), (above, style.COLOURS[1], "above")):
        ax.plot(found.use[here], found.values[here], "o", color=colour, ms=3.4, alpha=0.6, mew=0, label=label)
    if found.values.min() > 0.0 and found.values.max() > 3.0 * np.median(found.values):
        ax.set_yscale("log")
        ticks = [level * 10.0**power for power in range(-6, 9) for level in (1, 2, 5)]
        low, high = 0.9 * found.values.min(), 1.9 * found.values.max()
        ax.set_yticks([tick for tick in ticks if low <= tick <= high], minor=False)
        ax.set_yticks([], minor=True)
        ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        ax.set_ylim(low, high)
    ax.axhline(found.limit, color=style.INK, lw=1.2, ls=(0.0, (8.0, 3.0)), label="limit")
    ax.set_xlim(0.0, None)
    ax.set(xlabel=f"share of the clearance used by\n{found.name}", ylabel=f"{found.load} [{unit_text(found.unit)}]")
    ax.legend(loc="upper left", ncols=3, columnspacing=1.2, handlelength=1.8)
