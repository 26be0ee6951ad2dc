"""Which line of the drawing to change: the share of the joints above a limit with each line narrower or wider."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from tolstat.common.errors import NotApplicable
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.mechanism import Mechanism
from tolstat.common.shell import quote
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Part, Row, Sentence, Table, has
from tolstat.display.options import Accepted, Costs, Load
from tolstat.display.style import markers
from tolstat.questions.causes import shares
from tolstat.questions.shares import estimated, inapplicable, word
from tolstat.store.view import View
from tolstat.study.widths import COARSER, EXACT, FINER, HALF, STEPS

TITLE = "Which line of the drawing to change"
ON_PAGE = (
    "Each line is an entry of [tolerances]: made half as wide about the middle of its band, exact (in the middle of "
    "its band), one class finer or coarser where it has a class, else × 0.63 and × 1.6. Whiskers are the intervals of "
    "the table (upper: half as wide; lower: coarser), the band is that of the joints as drawn. An arrow at the edge of "
    "the picture: a share or the end of an interval is smaller than what its axis shows."
)
FITS_ON_PAGE = (
    "Another fit has the next fundamental deviation or grade of ISO 286; none with which a pin may be larger than its "
    "hole."
)
COSTS_ON_PAGE = "tolstat causes FILE --costs TABLE prints what each change costs."
_KINDS = {"offset", "tilt", "diameter", "clearance", "position"}
"""Errors whose lines have a name in words."""
_AXES = {"offset": ["e", "t", "z"], "tilt": ["t", "z"]}
"""Axes of errors; a line that has some of them only names these."""
_SHARES = ("factor", *(f"{name}{end}" for name in ("share", "change") for end in shares.ENDS))


_BARS = {
    COARSER: ("one step coarser", style.COLOURS[1], 0.3, -0.1),
    HALF: ("half as wide", style.COLOURS[0], 0.56, 0.1),
    "share": ("another fit", style.COLOURS[3], 0.4, 0.0),
}
"""Bars of the tornado: label, colour, height, and how far above the middle of the bar its whisker is."""


def _cost(head: str, name: str, rank: int = 0) -> Column:
    """Column of what a change costs more than the drawing."""
    # + 0.0: no -0
    return Column(head, lambda row: text.formed(row.get(name, np.nan) + 0.0, "+.4g"), shown=has(name), rank=rank)


LINE = Column("line", word("line"), words=True)
COLUMNS = (
    LINE,
    Column("tolerance", lambda row: row["size"] or "-", rank=3),
    estimated("half as wide, %", HALF),
    estimated("exact, %", EXACT, 1),
    estimated("finer, %", FINER, 5),
    estimated("coarser, %", COARSER, 2),
    Column("finer, coarser", lambda row: ", ".join(row["by"]) or "-", words=True, rank=4),
    estimated("half: change, %", f"{HALF}_change", 6, "+.1f"),
    _cost("half: extra cost", f"{HALF}_cost"),
    _cost("finer: extra cost", f"{FINER}_cost", 5),
    _cost("coarser: extra cost", f"{COARSER}_cost", 2),
)
"""Columns of `Lines.by_line`: a line, its tolerance, and the share above the level after each step."""
FITS = (
    Column("fit", word("step")),
    Column("in place of", word("size"), words=True),
    estimated("share, %", "share"),
    estimated("change, %", "change", 0, "+.1f"),
    _cost("extra cost", "extra_cost"),
    Column("what changes", word("words"), words=True, rank=1),
)
"""Columns of `Lines.other_fits`."""


def lines(view: View, by: Load = None, accepted: Accepted = math.nan, costs: Costs = None) -> Answer:
    """List what each line of the drawing would change.

    Gives for each line of the drawing, an entry of [tolerances], the share of the joints above the limit if it were
    half as wide, exact, finer or coarser by one class (else by the factors 0.63 and 1.6), of a fit with the next
    fundamental deviations and grades; and Sobol' indices of the lines. The joints have the seeds of the campaign;
    tolstat causes FILE --run simulates them.

    Example: tolstat causes iso2768_f.h5 --run

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    by : str, optional
        Load, such as cross1.F or psi, or "any limit"; by default all limits, or the only one.
    accepted : float
        Accepted share of the joints above the limit.
    costs : Path, optional
        Cost of each tolerance, TOML or CSV (see tolstat docs allocate).

    Returns
    -------
    Answer
        Tables ``lines`` (all rows), ``other_fits`` (those of a fit) and ``line_indices``, and facts, see
        `shares.Lines`; also a fact is ``sentence``, see `sentence`.

    Raises
    ------
    NotApplicable
        When the file holds no joints with a line changed.
    InputError
        When there is no such load, or the study does not keep it; with every fault of the costs.
    StoreError
        When the joints are not drawn from tolerances.
    """
    changed = shares.evaluate(view, by or view.decisive, costs)
    if changed is None:
        remedy = f"simulate them: tolstat causes {quote(str(view.path))} --run"
        raise inapplicable(view, "holds no joints with other widths of a line", remedy)
    return Answer("lines", TITLE, _parts(changed, accepted), {**changed.facts, "sentence": sentence(changed) or None})


def lines_on_page(view: View, asked: Asked) -> Answer:
    """What each line would change for all limits together; without such joints, the command that simulates them."""
    applies = view.sampled and view.limits and view.store.whole and view.count(*VALID)
    if not applies or view.design.refuses():
        raise NotApplicable
    changed = shares.evaluate(view, view.decisive)
    if changed is not None:
        explained = " ".join([ON_PAGE, *([FITS_ON_PAGE] if changed.other_fits else []), COSTS_ON_PAGE])
        return Answer("lines", TITLE, [*_parts(changed, asked.accepted), Sentence(explained)])
    file = quote(asked.path.name)
    missing = (
        "Not in the file yet. To simulate the same joints with each tolerance half as wide, exact, finer and coarser: "
        f"tolstat causes {file} --run; then this page again: tolstat report {file} --out PAGE.html"
    )
    return Answer("lines", TITLE, [Sentence(missing, "lead")])


def advice(view: View, load: str, accepted: float) -> str:
    """Return the `sentence` of a load for the verdict; empty where the file holds no joints with lines changed."""
    changed = shares.evaluate(view, load) if view.altered else None
    return "" if changed is None else sentence(changed, accepted)


def sentence(changed: shares.Lines, accepted: float = math.nan) -> str:
    """Sentence on the line that lowers the share most, half as wide or with another fit; empty if none surely does.

    ``Halve the tilt tolerance of the holes (±0.5 deg) and 2.1 % (1.4 to 3 %) exceed the limit``, without full stop.
    Where that is more than the accepted share, it says that no line suffices, and what the exact line gives.
    """
    best = changed.best
    if best is None:
        return ""
    is_half, other = best["step"] == HALF, f"{best['step']} in place of {best['size']}"
    line = _phrase(best, changed.mechanism) + (f" ({best['size']})" if best["size"] else "")
    low, high = 100.0 * best["share_lower"], text.percent(best["share_upper"])
    share = f"{text.percent(best['share'])} ({low:.3g} to {high})"
    if not best["share"] > accepted:
        return f"{f'Halve the {line}' if is_half else f'Write {other}'} and {share} exceed {changed.limit}"
    exact = {row["line"]: row for row in changed.rows if row["step"] == EXACT}
    least = min(exact.values(), key=lambda row: float(row["share"]), default=None)
    tried = f"{f'halving the {line}' if is_half else other} gives {share}"
    if least is not None and least["share"] <= accepted:
        which = "" if least["line"] == best["line"] else f" the {_phrase(least, changed.mechanism)}"
        what = "Halving a single line" if is_half else "Another fit"
        return f"{what} is not enough: {tried}, exact{which} {text.percent(least['share'])}"
    same = exact.get(best["line"])
    return f"No single line is enough: {tried}" + ("" if same is None else f", exact {text.percent(same['share'])}")


def _parts(changed: shares.Lines, accepted: float) -> list[Part]:
    n, share, lower, upper = (changed.facts[name] for name in ("n", "share", "lower", "upper"))
    drawn = f"{changed.event} in {text.percent(share)} ({text.span(lower, upper)}) of {n} joints as drawn"
    rows, by_line, others = changed.rows, changed.by_line, changed.other_fits
    none = f"No line that is made half as wide{', and no other fit,' if others else ''} surely lowers it"
    title, units = f"Share of the joints with {changed.event}, with", dict.fromkeys(_SHARES, "1")
    parts: list[Part] = [
        Sentence(f"{text.sentence(drawn)} {sentence(changed, accepted) or none}.", "lead"),
        Panels([_tornado(changed, accepted)]),
        Table("lines", f"{title} one line changed", COLUMNS if by_line else (), rows, units, by_line),
    ]
    if others:
        parts.append(Table("other_fits", f"{title} another fit", FITS, others, units))
    if changed.indices:
        load = "largest load over its limit" if changed.facts["load"] == ANY_LIMIT else changed.facts["load"]
        load = f"log {load}" if changed.facts["logarithmic"] else load
        heads = f"{load}: alone, %", f"{load}: in all, %", "above: alone, %", "above: in all, %"
        keys = enumerate(zip(heads, shares.INDICES[::3], strict=True))  # no share is beyond 0 and 1
        columns = [LINE, *(estimated(head, key, 3 - i, ends=(0.0, 1.0)) for i, (head, key) in keys)]
        title = f"Part of each line in the scatter of the load, and in whether it is above {changed.limit}"
        parts.append(Table("line_indices", title, columns, changed.indices, dict.fromkeys(shares.INDICES, "1")))
    return [*parts, *map(Sentence, _notes(changed))]


def _notes(changed: shares.Lines) -> Iterator[str]:
    """Definitions, and what the table lacks: joints, steps, lines without joints, lines that are not changed."""
    limit, least = changed.limit, dict[str, int]()
    for row in changed.rows:
        step = row["step"] if row["step"] in STEPS else "another fit"
        least[step] = min(row["n"], least.get(step, row["n"]))
    what = "95 % intervals without the numerical error; joints with the same seeds, as drawn but for the line"
    yield f"share of the joints above {limit}, {what}"
    if len({row["n"] for row in changed.rows}) > 1:
        order = [step for step in (*STEPS, "another fit") if step in least]
        yield f"joints compared: {', '.join(f'{step} {least[step]}' for step in order)}"
    if fewer := [step for step in (EXACT, FINER) if least.get(step, np.inf) < least.get(HALF, 0)]:
        yield f"{', '.join(fewer)}: the share half as wide, plus the difference on the joints that both have"
    if not changed.facts["settled"]:
        yield "the order of neighbouring lines is not settled: --run with a longer --budget or a larger --most goes on"
    if any(step not in line for line in changed.by_line for step in STEPS if step in least):
        yield "-: not simulated yet; the same command with --run goes on"
    if missing := changed.facts["missing"]:
        yield f"not in the file: {', '.join(missing)}; --run simulates them"
    if left_out := changed.facts["left_out"]:
        zones = "the width of their zone depends on other errors (a common direction, or a bonus)"
        yield f"left out: {', '.join(left_out)}; {zones}, and is not changed by itself"
    if changed.indices:
        pairs = max(row["pairs"] for row in changed.indices)
        yield f"alone, in all: closed and total Sobol' index, from {pairs} pairs of joints; above: above {limit}"


def _phrase(row: Row, mechanism: Mechanism) -> str:
    """Line of the drawing in words: ``tilt tolerance of the holes``; ``tolerance "pin1.*"`` where it has none."""
    kinds = {name.rpartition(".")[2].partition("_")[0] for name in row["names"]}
    features = {name.rpartition(".")[0] for name in row["names"]}
    every = {"pins": {pair.pin for pair in mechanism.pairs}, "holes": {pair.hole for pair in mechanism.pairs}}
    bodies = [word for word, names in every.items() if names <= features]
    if len(kinds) > 1 or not kinds <= _KINDS or features != set().union(*(every[word] for word in bodies)):
        return f'tolerance "{row["line"]}"' if "." in row["line"] else f"tolerances of {row['line']}"
    kind, axes = kinds.pop(), sorted({name.rpartition("_")[2] for name in row["names"]})
    some = kind in _AXES and axes != _AXES[kind]
    of_axes = f" {'along' if kind == 'offset' else 'about'} {' and '.join(axes)}" if some else ""
    return f"{kind} tolerance of the {' and '.join(bodies)}{of_axes}"


def _tornado(changed: shares.Lines, accepted: float) -> Panel:
    """Share above the level with each line half as wide, exact, and coarser; and with each other fit."""
    by_line, fits = changed.by_line, changed.other_fits
    halves = "; ".join(f"{row['line']} {text.percent(row.get(HALF, np.nan))}" for row in by_line)
    others = "; ".join(f"{row['step']} {text.percent(row['share'])}" for row in fits)
    description = ". ".join(filter(None, (f"Half as wide: {halves}" * bool(halves), others)))
    labels = [f"{row['line']}\n{row['size']}" if row["size"] else str(row["line"]) for row in by_line]
    labels += [f"{row['step']}\nin place of {row['size']}" for row in fits]
    drawn, lower, upper = (changed.facts[name] for name in ("share", "lower", "upper"))
    # the axis begins below all shares that are not zero, and below the accepted share
    positive = [value for value in (*(row["share"] for row in changed.rows), drawn, accepted) if value > 0.0]
    floor = float(0.6 * max(min(positive, default=1.0), 0.5 / max(changed.facts["n"], 1)))

    def draw(ax: Axes) -> None:
        ax.set_ylim(len(labels) + 0.6, -1.2)  # a row above and one below, for what the vertical lines are
        ax.tick_params(axis="y", labelsize=7.6)
        style.share_axis(ax, floor, "x")
        ax.set_xlim(floor, min(1.0, 1.4 * float(np.nanmax([upper, *(row["share_upper"] for row in changed.rows)]))))
        ax.axvspan(max(lower, floor), upper, color=drawing.GREY, alpha=0.3, lw=0)
        ax.axvline(drawn, color=style.INK, lw=1.2)
        for y, row in enumerate([*by_line, *fits]):
            for name, (label, colour, height, above) in _BARS.items():
                if name in row:
                    share = [row[f"{name}{end}"] for end in shares.ENDS]
                    drawing.share_bar(ax, y, share, drawn, floor, colour, height, above, label)
            if EXACT in row:
                look: Any = {"ls": "", "mfc": "white", "mec": style.INK, "ms": 5.5, "zorder": 4, "clip_on": False}
                look |= {"marker": "o", "label": "exact"} if row[EXACT] >= floor else {"marker": markers.CARETLEFT}
                ax.plot(max(row[EXACT], floor), y, **look)
        ax.text(drawn, -0.9, f"as drawn {text.percent(drawn)}", **drawing.WORDS)
        drawing.accepted(ax, accepted, len(labels) + 0.1)
        ax.set_xlabel(f"share of the joints above {changed.limit}")

    title = f"Share of the joints with {changed.event}, if one line is changed"
    description = f"As drawn {text.percent(drawn)}. {description}"
    size = drawing.WIDTH, 0.34 * (len(labels) + 2.2) + drawing.BOTTOM + 0.48
    return Panel(f"lines-{changed.facts['load']}", title, description, draw, size, rows=labels)
