"""Which line of the drawing to change: the share of the joints above a limit with each line narrower or wider."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from shlex import quote
from typing import Annotated

import numpy as np

from tolstat.common.errors import Fault, NotApplicable
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.answer import Answer, Part, Sentence, Table
from tolstat.display.asked import Asked
from tolstat.display.blocks import Panels
from tolstat.display.options import Accepted, Costs, Opt
from tolstat.display.table import Column, Row, has
from tolstat.questions.causes import lines_figure, lines_shares
from tolstat.questions.causes.lines_shares import INDICES, Lines
from tolstat.store.view import View
from tolstat.study.widths import COARSER, EXACT, FINER, HALF, STEPS

TITLE = "Which line of the drawing to change"
ON_PAGE = (
    "Each line is an entry of [tolerances]: made half as wide about the middle of its band, exact (in the middle of "
    "its band), one class finer or coarser where it has a class, else × 0.63 and × 1.6. Whiskers and bands are the "
    "intervals of the table (upper whisker: half as wide; lower: coarser; band: first line). An arrow at the edge of a "
    "picture: a share or the end of an interval is smaller than what its axis shows."
)
FITS_ON_PAGE = (
    "Another fit has the next fundamental deviation or grade of ISO 286; none with which a pin may be larger than its "
    "hole."
)
COSTS_ON_PAGE = "tolstat causes FILE --costs TABLE prints what each change costs."
_KINDS = {"offset", "tilt", "diameter", "clearance", "position"}
"""Errors whose lines have a name in words."""
_SHARES = ("factor", *(f"{name}{end}" for name in ("share", "change") for end in lines_shares.ENDS))


def _interval(row: Row, name: str, form: str = ".1f") -> str:
    """Estimate in per cent with the ends of its interval; a dash where there is none."""
    value = 100 * row.get(name, np.nan)
    if np.isnan(value):
        return "-"
    return f"{value:{form}} ({text.ends(100 * row[f'{name}_lower'], 100 * row[f'{name}_upper'], form)})"


def _cost(row: Row, name: str) -> str:
    """What a change costs more than the drawing; a dash where that is not known."""
    return text.formed(row.get(name, np.nan) + 0.0, "+.4g")  # no -0


def _index(row: Row, name: str) -> str:
    """Share of the variance: estimates may scatter beyond 0 and 1, where no share is."""
    return _interval({**row, name: np.clip(row[name], 0.0, 1.0) + 0.0}, name)


COLUMNS = (
    Column("line", lambda row: str(row["line"]), words=True),
    Column("tolerance", lambda row: row["size"] or "-", rank=3),
    Column("half as wide, %", partial(_interval, name=HALF), shown=has(HALF)),
    Column("exact, %", partial(_interval, name=EXACT), shown=has(EXACT), rank=1),
    Column("finer, %", partial(_interval, name=FINER), shown=has(FINER), rank=5),
    Column("coarser, %", partial(_interval, name=COARSER), shown=has(COARSER), rank=2),
    Column("finer, coarser", lambda row: ", ".join(row["by"]) or "-", words=True, rank=4),
    Column("half: change, %", partial(_interval, name=f"{HALF}_change", form="+.1f"), shown=has(HALF), rank=6),
    *(
        Column(f"{step}: extra cost", partial(_cost, name=f"{step}_cost"), shown=has(f"{step}_cost"), rank=rank)
        for step, rank in ((HALF, 0), (FINER, 5), (COARSER, 2))
    ),
)
"""Columns of `Lines.by_line`: a line, its tolerance, and the share above the level after each step."""
FITS = (
    Column("fit", lambda row: str(row["step"])),
    Column("in place of", lambda row: str(row["size"]), words=True),
    Column("share, %", partial(_interval, name="share")),
    Column("change, %", partial(_interval, name="change", form="+.1f")),
    Column("extra cost", lambda row: _cost({"cost": row["cost"] - row["cost_before"]}, "cost"), shown=has("cost")),
    Column("what changes", lambda row: str(row["words"]), words=True, rank=1),
)
"""Columns of `Lines.other_fits`."""


def lines(
    view: View,
    by: Annotated[str | None, Opt("LOAD")] = None,
    accepted: Accepted = math.nan,
    costs: Costs = None,
) -> Answer:
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
        `lines_shares.Lines`; also a fact is ``sentence``, see `sentence`.

    Raises
    ------
    NotApplicable
        When the file holds no joints with a line changed.
    InputError
        When there is no such load, or the study does not keep it; with every fault of the costs.
    StoreError
        When the joints are not drawn from tolerances, or differ in weight.
    """
    found = lines_shares.evaluate(view, by or view.decisive, costs)
    if found is None:
        remedy = f"simulate them: tolstat causes {quote(str(view.path))} --run"
        raise NotApplicable(str(Fault(str(view.path), "holds no joints with other widths of a line", remedy)))
    return Answer("lines", TITLE, _parts(found, accepted), {**found.facts, "sentence": sentence(found) or None})


def lines_on_page(view: View, asked: Asked) -> Answer:
    """What each line would change for all limits together; without such joints, the command that simulates them."""
    applies = view.sampled and view.limits and view.store.whole and view.count(*VALID)
    if not applies or view.design.refuses("difference"):
        raise NotApplicable
    found = lines_shares.evaluate(view, view.decisive)
    if found is not None:
        explained = " ".join([ON_PAGE, *([FITS_ON_PAGE] if found.other_fits else []), COSTS_ON_PAGE])
        return Answer("lines", TITLE, [*_parts(found, asked.accepted), Sentence(explained)])
    file = quote(asked.path.name)
    steps = "To simulate the same joints with each tolerance half as wide, exact, finer and coarser:"
    again = f"then this page again: tolstat report {file} --out PAGE.html"
    missing = f"Not in the file yet. {steps} tolstat causes {file} --run; {again}"
    return Answer("lines", TITLE, [Sentence(missing, "lead")])


def advice(view: View, load: str, accepted: float) -> str:
    """Return the `sentence` of a load for the verdict; empty where the file holds no joints with lines changed."""
    found = lines_shares.evaluate(view, load) if view.altered else None
    return "" if found is None else sentence(found, accepted)


def sentence(found: Lines, accepted: float = math.nan) -> str:
    """Sentence on the line that lowers the share most, half as wide or with another fit; empty if none surely does.

    ``Halve the tilt tolerance of the holes (±0.5 deg) and 2.1 % (1.4 to 3 %) exceed the limit``, without full stop.
    Where that is more than the accepted share, it says that no line suffices, and what the exact line gives.
    """
    row = found.best
    if row is None:
        return ""
    is_half, other = row["step"] == HALF, f"{row['step']} in place of {row['size']}"
    line = f"{_phrase(row)} ({row['size']})" if row["size"] else _phrase(row)
    low, high = 100.0 * row["share_lower"], text.percent(row["share_upper"])
    share = f"{text.percent(row['share'])} ({low:.3g} to {high})"
    if not row["share"] > accepted:
        return f"{f'Halve the {line}' if is_half else f'Write {other}'} and {share} exceed {found.limit}"
    exact = {own["line"]: own for own in found.rows if own["step"] == EXACT}
    least = min(exact.values(), key=lambda own: float(own["share"]), default=None)
    tried = f"{f'halving the {line}' if is_half else other} gives {share}"
    if least is not None and least["share"] <= accepted:
        which = "" if least["line"] == row["line"] else f" the {_phrase(least)}"
        what = "Halving a single line" if is_half else "Another fit"
        return f"{what} is not enough: {tried}, exact{which} {text.percent(least['share'])}"
    same = exact.get(row["line"])
    return f"No single line is enough: {tried}" + ("" if same is None else f", exact {text.percent(same['share'])}")


def _parts(found: Lines, accepted: float) -> list[Part]:
    n, share, lower, upper = (found.facts[name] for name in ("n", "share", "lower", "upper"))
    drawn = f"{found.event} in {text.percent(share)} ({text.span(lower, upper)}) of {n} joints as drawn"
    others = found.other_fits
    none = f"No line that is made half as wide{', and no other fit,' if others else ''} surely lowers it"
    title, units = f"Share of the joints with {found.event}, with", dict.fromkeys(_SHARES, "1")
    made: list[Part] = [
        Sentence(f"{text.sentence(drawn)} {sentence(found, accepted) or none}.", "lead"),
        Panels([lines_figure.tornado(found, accepted), *lines_figure.curves(found, accepted)]),
        Table("lines", f"{title} one line changed", COLUMNS if found.by_line else (), found.rows, units, found.by_line),
    ]
    if others:
        made.append(Table("other_fits", f"{title} another fit", FITS, others, units))
    if found.indices:
        title = f"Part of each line in the scatter of the load, and in whether it is above {found.limit}"
        made.append(Table("line_indices", title, _indices(found), found.indices, dict.fromkeys(INDICES, "1")))
    return [*made, *map(Sentence, _notes(found))]


def _indices(found: Lines) -> list[Column]:
    """Columns of `Lines.indices`: of the load and of the event, with intervals."""
    load = "largest load over its limit" if found.facts["load"] == ANY_LIMIT else found.facts["load"]
    load = f"log {load}" if found.facts["logarithmic"] else load
    return [
        COLUMNS[0],
        Column(f"{load}: alone, %", partial(_index, name="alone"), rank=3),
        Column(f"{load}: in all, %", partial(_index, name="in_all"), rank=2),
        Column("above: alone, %", partial(_index, name="above_alone"), rank=1),
        Column("above: in all, %", partial(_index, name="above_in_all")),
    ]


def _notes(found: Lines) -> Iterator[str]:
    """Definitions, and what the table lacks: joints, steps, lines without joints, lines that are not changed."""
    least: dict[str, int] = {}
    for row in found.rows:
        step = row["step"] if row["step"] in STEPS else "another fit"
        least[step] = min(row["n"], least.get(step, row["n"]))
    said = "95 % intervals without the numerical error; joints with the same seeds, as drawn but for the line"
    yield f"share of the joints above {found.limit}, {said}"
    if len({row["n"] for row in found.rows}) > 1:
        order = [step for step in (*STEPS, "another fit") if step in least]
        yield f"joints compared: {', '.join(f'{step} {least[step]}' for step in order)}"
    if fewer := [step for step in (EXACT, FINER) if least.get(step, np.inf) < least.get(HALF, 0)]:
        yield f"{', '.join(fewer)}: the share half as wide, plus the difference on the joints that both have"
    if not found.facts["settled"]:
        yield "the order of neighbouring lines is not settled: --run with a longer --budget or a larger --most goes on"
    if any(step not in line for line in found.by_line for step in STEPS if step in least):
        yield "-: not simulated yet; the same command with --run goes on"
    if missing := found.facts["missing"]:
        yield f"not in the file: {', '.join(missing)}; --run simulates them"
    if left_out := found.facts["left_out"]:
        zones = "the width of their zone depends on other errors (a common direction, or a bonus)"
        yield f"left out: {', '.join(left_out)}; {zones}, and is not changed by itself"
    if found.indices:
        pairs = max(row["pairs"] for row in found.indices)
        yield f"alone, in all: closed and total Sobol' index, from {pairs} pairs of joints; above: above {found.limit}"


def _phrase(row: Row) -> str:
    """Line of the drawing in words: ``tilt tolerance of the holes``; ``tolerance "pin1.*"`` where it has none."""
    kinds = {name.partition(".")[2].partition("_")[0] for name in row["names"]}
    features = {name.partition(".")[0] for name in row["names"]}
    bodies = {feature.rstrip("1234") for feature in features}
    if len(kinds) > 1 or not kinds <= _KINDS or not bodies <= {"pin", "hole"} or len(features) % 4:
        return f'tolerance "{row["line"]}"' if "." in row["line"] else f"tolerances of {row['line']}"
    return f"{kinds.pop()} tolerance of the {' and '.join(sorted(f'{body}s' for body in bodies)[::-1])}"
