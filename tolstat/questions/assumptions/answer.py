"""What the verdict stands on: shares above the limits with other values of what nobody measured of the joint."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from tolstat.analysis import binomial
from tolstat.campaign import what_if as sets
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.work import Work
from tolstat.common.errors import Fault, NotApplicable, gather, raise_all
from tolstat.common.shell import quote
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Sentence, Table
from tolstat.display.options import Accepted, Opt
from tolstat.display.verdict import WORDS
from tolstat.questions.assumptions import sentences, variations
from tolstat.questions.shares import Simulation, estimated, inapplicable, own_joints, unusable, word
from tolstat.store import Writer
from tolstat.store.view import View

TITLE = "What the verdict stands on"
_UNITS = {f"{name}{end}": "1" for name in ("share", "change") for end in ("", "_lower", "_upper")}


COLUMNS = (
    Column("with", word("label"), words=True),
    estimated("share, %", "share"),
    estimated("change, %", "change", form="+.1f"),
    Column(
        "verdict",
        lambda row: WORDS.get(row["side"], ""),
        shown=lambda rows: any(r["side"] for r in rows),
        words=True,
        rank=1,
    ),
    Column("turns it", lambda row: "yes" if row["turns"] else "", shown=lambda rows: any(r["turns"] for r in rows)),
    Column("assumed, since", word("because"), words=True, rank=2),
    Column("keys of the joint", word("keys"), words=True, rank=3),
)
"""Columns of the rows of `Standing`."""


def assumptions(view: View, accepted: Accepted = math.nan) -> Answer:
    """Compute what the verdict stands on.

    Gives the share of the joints above the limits with each other value that [[assumed]] of the joint file and of the
    study lists, all else equal, and with all assumptions together at their better and at their worse values: share,
    change joint by joint, and with --accept whether the verdict turns. With --run, simulates the first 1000 joints of
    FILE with each value and keeps their loads in FILE. To go on after an interruption, run the same command again.

    Example: tolstat assumptions iso2768_f.h5 --run --accept "10 %"

    Parameters
    ----------
    view : View
        A campaign of a study with limits whose joints are drawn from tolerances.
    accepted : float
        Accepted share of the joints that exceed at least one limit, for the verdict.

    Returns
    -------
    Answer
        Table ``assumptions``, see `variations.Standing.rows`, and facts: ``n``, ``confidence``; ``share``, ``lower``,
        ``upper`` as drawn; ``stands_on``, see `sentences.values`.

    Raises
    ------
    NotApplicable
        When the file holds no joints with other values.
    StoreError
        When the joints are not those of one joint, not drawn from tolerances, or have no limits.
    """
    standing = variations.evaluate(view, accepted)
    if not standing.rows:
        remedy = f"simulate them: tolstat assumptions {quote(str(view.path))} --run"
        raise inapplicable(view, "holds no joints with other values of what is assumed", remedy)
    share, lower, upper = standing.drawn
    lead = f"As drawn {text.percent(share)} of the joints exceed a limit ({text.span(lower, upper)})."
    if any(verdict := sentences.turned(standing)):
        lead += f" {text.sentence(', '.join(verdict))}"
    answer = _answer(view, standing)
    below = [Sentence(line, "lead") for line in (sentences.still(standing), sentences.shop(view)) if line]
    table, *notes = answer.parts
    return replace(answer, parts=[Sentence(lead, "lead"), Panels([bars(standing)]), table, *below, *notes])


def assumptions_on_page(view: View, asked: Asked) -> Answer:
    """Table of the variations; their picture is beside the verdict."""
    standing = variations.applicable(view, asked.accepted)
    if standing is None or not standing.rows:
        raise NotApplicable
    return _answer(view, standing)


def _answer(view: View, standing: variations.Standing) -> Answer:
    """Table, notes and facts."""
    most = max(row["n"] for row in standing.rows)
    each = f"{text.several(standing.n, 'joint')} of each" + (
        f", {most} of those left open" if most > standing.n else ""
    )
    bases = {row["n"]: text.percent(row["drawn"]) for row in standing.rows}
    told = ", ".join(f"{drawn} of {n}" for n, drawn in bases.items())
    title = f"Share above a limit with other values, and its change; {each}"
    base = f"change: from the share of the same joints as drawn, {told}"
    intervals = (
        f"intervals of {100.0 * standing.confidence:.4g} % (95 % for all {len(standing.rows)} variations together), "
        "without the numerical error; a verdict turns if the interval of the share lies on the other side of the "
        "accepted share, and that of the change excludes zero"
    )
    idle = sentences.idle(standing)
    notes = (
        base,
        sentences.without_result(standing),
        intervals,
        idle,
        sentences.not_varied(standing, view.path.name),
        sentences.more(standing, view.path.name),
    )
    table = Table("assumptions", title, COLUMNS, standing.rows, _UNITS)
    facts: dict[str, Any] = {"n": standing.n, "confidence": standing.confidence}
    facts |= dict(zip(("share", "lower", "upper"), standing.drawn, strict=True))
    facts |= {"stands_on": sentences.values(standing)}
    return Answer("assumptions", TITLE, [table, *map(Sentence, filter(None, notes))], facts)


DRAWN = "as drawn"
_LONGEST = 30
"""Number of letters of a label from which on it has two lines."""


def bars(standing: variations.Standing) -> Panel:
    """Share as drawn, then with each value that moves it, on one axis with the accepted share."""
    (share, lower, upper), accepted, rows, labels = standing.drawn, standing.accepted, standing.moving, [DRAWN]
    for row in rows:
        label = f"{row['label']}: {WORDS[row['side']]}" if row["turns"] else str(row["label"])
        labels.append(label.replace(" (", "\n(") if len(label) > _LONGEST else label)

    def draw(ax: Axes) -> None:
        ends = [lower, upper, *(row[f"share{end}"] for row in rows for end in ("", "_lower", "_upper"))]
        shown = np.array([share, accepted, *ends])
        known = shown[shown >= 0.5 / max(standing.n, 1)]
        floor, high = 0.6 * float(known.min(initial=0.1)), min(1.2 * float(known.max(initial=0.1)), 1.0)
        ax.set_ylim(len(labels) - 0.4, -1.3)  # a row above, for the accepted share in words
        style.share_axis(ax, floor, "x", high)
        drawn = max(share, floor)
        ax.axvline(drawn, color=style.INK, lw=1.0)
        if not np.isnan(lower):
            ax.plot([max(lower, floor), max(upper, floor)], [0, 0], color=style.INK, lw=1.6)
        ax.plot(drawn, 0, "o" if share >= floor else style.markers.CARETLEFT, color=style.INK, ms=6.0, clip_on=False)
        for y, row in enumerate(rows, 1):
            moved = [row[f"share{end}"] for end in ("", "_lower", "_upper")]
            drawing.share_bar(ax, y, moved, drawn, floor, style.COLOURS[row["change"] > 0.0], 0.62)
        drawing.accepted(ax, accepted, -0.9)
        ax.set_xlabel("share of the joints that exceed a limit")

    moving = "; ".join(f"{row['label']} {text.percent(row['share'])}" for row in rows)
    description = f"As drawn {text.percent(share)}. {moving or 'Nothing that is assumed moves it'}"
    size = drawing.WIDTH, 0.27 * (len(labels) + 1) + drawing.BOTTOM + 0.3
    title = "Share of the joints above a limit, with other values of what is assumed"
    return Panel("assumptions", title, description, draw, size, rows=labels)


FURTHER = 4
"""Largest number of joints of a variation whose first joints leave it open, in multiples of theirs."""


def simulate(
    path: Path,
    work: Work,
    joints: Annotated[int | None, Opt("N", least=variations.LEAST)] = None,
    accepted: Accepted = math.nan,
) -> list[Path]:
    """Simulate the first joints of a campaign with each value of what is assumed, and keep their loads in the file.

    First each value of each assumption that is varied, all else equal, then all assumptions at their better and at
    their worse values. With an accepted share, variations that would turn the verdict, but for their number of joints,
    get up to `FURTHER` times as many. Of several operating points those that a limit of the study is about. What is
    done stays in the file, also of a run that is stopped; the same call goes on.

    Parameters
    ----------
    path : Path
        Result file of a campaign whose joints are drawn from tolerances.
    work : Work
        Workers, progress and messages.
    joints : int
        With --run: number of joints of each variation, those of the campaign unless given, at most 1000; more than the
        campaign has are drawn with its seed.
    accepted : float
        Accepted share of the joints that exceed at least one limit; NaN if none is given.

    Returns
    -------
    list of Path
        The file.

    Raises
    ------
    InputError
        With every fault of the values.
    StoreError
        When the file cannot be used, was made by other code, or its joint has no assumptions that are varied.
    """
    with Writer.open(path) as store, kept_workers():
        view = View(store)
        variations.check(view)
        if not variations.joints_of(view):
            remedy = f"run its study: tolstat run {store.study_name}.toml"
            raise unusable(view, "has no simulated joint to compare with", remedy)
        sets.check_code(store)
        singles, study, n = variations.singles(view.study), view.study, joints or variations.joints_of(view)
        if not singles:
            found = "lists no other values to try: neither the study nor its joint file has [[assumed]] with any"
            remedy = "write [[assumed]] with name, values and because in the study, see tolstat docs study"
            raise unusable(view, found, f"{remedy}, and run it again, which simulates nothing anew")
        simulation, begin, labels = Simulation(store, view, work, view.limits), time.monotonic(), set[str]()

        def run(wanted: Sequence[variations.Variation], number: int) -> None:
            """Simulate what the file lacks of the first joints of some variations."""
            changes, faults = list[sets.Change](), list[Fault]()
            for variation in wanted:
                with gather(faults):
                    changes.append(sets.with_joint(study, variation.keys, range(number)))
            raise_all(faults)
            labels.update(variation.label for variation in wanted)
            if (first := own_joints(view)) < number:
                changes.insert(0, sets.as_drawn(study, range(first, number)))
            simulation.run(changes, "variations")

        run(singles, n)
        run(variations.all_together(View(store)), n)
        further, number = _further(View(store), accepted, n)
        if further:
            run(further, number)
            run(variations.all_together(View(store)), n)
        if simulation.simulated:
            done = f"simulated {text.several(simulation.simulated, 'joint')} in {time.monotonic() - begin:.0f} s"
            more = f", {number} of {', '.join(variation.label for variation in further)}" if further else ""
            work.tell(f"{done}, {n} of each of {len(labels)} variations{more}")
        else:
            work.tell(f"all {len(labels)} variations are in the file, {n} joints of each")
    return [path]


def _further(view: View, accepted: float, n: int) -> tuple[list[variations.Variation], int]:
    """Variations that would turn the verdict if more joints, at most `FURTHER` times `n`, decided them; that number."""
    standing = variations.evaluate(view, accepted)
    second = (1.0 + standing.confidence) / 2.0
    needed = {row["label"]: binomial.needed(row["share"], accepted, second) for row in standing.undecided}
    numbers = {label: number for label, number in needed.items() if number <= FURTHER * n}
    by_label = {each.label: each for each in (*variations.singles(view.study), *variations.all_together(view))}
    return [by_label[label] for label in numbers], math.ceil(max(numbers.values(), default=n))
