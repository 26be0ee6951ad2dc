"""What the verdict stands on: shares above the limits with other values of what nobody measured of the joint."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import numpy as np

from tolstat.analysis import binomial
from tolstat.campaign import what_if as sets
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.what_if import Change
from tolstat.campaign.work import Work
from tolstat.common.cores import available_cores
from tolstat.common.errors import Fault, InputError, NotApplicable, gather
from tolstat.display import drawing, progress, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Row, Sentence, Table
from tolstat.display.options import Accepted, Opt
from tolstat.questions.assumptions import sentences, variations
from tolstat.questions.shares import inapplicable, own_joints, unusable
from tolstat.solver.compilation import warm_up
from tolstat.store import Writer, what_if
from tolstat.store.view import View

TITLE = "What the verdict stands on"
_UNITS = {f"{name}{end}": "1" for name in ("share", "change") for end in ("", "_lower", "_upper")}


def _interval(row: Row, name: str, form: str) -> str:
    value = 100.0 * row[name]
    if np.isnan(value):
        return "-"
    return f"{value:{form}} ({text.ends(100.0 * row[f'{name}_lower'], 100.0 * row[f'{name}_upper'], form)})"


COLUMNS = (
    Column("with", lambda row: str(row["label"]), words=True),
    Column("share, %", partial(_interval, name="share", form=".1f")),
    Column("change, %", partial(_interval, name="change", form="+.1f")),
    Column(
        "verdict",
        lambda row: sentences.KEPT.get(row["side"]) or str(row["side"]),
        shown=lambda rows: any(r["side"] for r in rows),
        words=True,
        rank=1,
    ),
    Column("turns it", lambda row: "yes" if row["turns"] else "", shown=lambda rows: any(r["turns"] for r in rows)),
    Column("assumed, since", lambda row: str(row["because"]), words=True, rank=2),
    Column("keys of the joint", lambda row: str(row["keys"]), words=True, rank=3),
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
        When the joints are not those of one joint, not drawn from tolerances, differ in weight, or have no limits.
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
    each = f"{standing.n} joints of each" + (f", {most} of those left open" if most > standing.n else "")
    title = f"Share above a limit with other values, and its change; {each}"
    intervals = (
        f"intervals of {100.0 * standing.confidence:.4g} % (95 % for all {len(standing.rows)} variations together), "
        "without the numerical error; a verdict turns if the interval of the share lies on the other side of the "
        "accepted share, and that of the change excludes zero"
    )
    notes = (intervals, sentences.not_varied(standing, view.path.name), sentences.more(standing, view.path.name))
    table = Table("assumptions", title, COLUMNS, standing.rows, _UNITS)
    facts: dict[str, Any] = {"n": standing.n, "confidence": standing.confidence}
    facts |= dict(zip(("share", "lower", "upper"), standing.drawn, strict=True))
    facts |= {"stands_on": sentences.values(standing)}
    return Answer("assumptions", TITLE, [table, *map(Sentence, filter(None, notes))], facts)


DRAWN = "as drawn"
_LONGEST = 30
"""Number of letters of a label from which on it has two lines."""
_ACCEPTED: dict[str, Any] = {"color": style.COLOURS[2], "lw": 1.4, "ls": (0.0, (6.0, 2.0))}
"""Style of the accepted share."""


def bars(standing: variations.Standing) -> Panel:
    """Share as drawn, then with each value that moves it, on one axis with the accepted share."""
    rows = standing.moving
    moving = "; ".join(f"{row['label']} {text.percent(row['share'])}" for row in rows)
    labels = [DRAWN, *map(_label, rows)]
    return Panel(
        "assumptions",
        "Share of the joints above a limit, with other values of what is assumed",
        f"As drawn {text.percent(standing.drawn[0])}. {moving or 'Nothing that is assumed moves it'}",
        partial(_bars, standing=standing, labels=labels),
        (drawing.WIDTH, 0.27 * (len(labels) + 1) + drawing.BOTTOM + 0.3),
        drawing.rows_left([part for label in labels for part in label.split("\n")]),
    )


def _label(row: Any) -> str:
    words = f"{row['label']}: {sentences.KEPT[row['side']]}" if row["turns"] else str(row["label"])
    return words.replace(" (", "\n(") if len(words) > _LONGEST else words


def _bars(ax: Axes, standing: variations.Standing, labels: list[str]) -> None:
    (share, lower, upper), accepted, rows = standing.drawn, standing.accepted, standing.moving
    ends = [lower, upper, *(row[f"share{end}"] for row in rows for end in ("", "_lower", "_upper"))]
    shown = np.array([share, accepted, *ends])
    known = shown[shown >= 0.5 / max(standing.n, 1)]
    floor, high = 0.6 * float(known.min(initial=0.1)), min(1.2 * float(known.max(initial=0.1)), 1.0)
    drawing.rows(ax, labels)
    ax.set_ylim(len(labels) - 0.4, -1.3)  # a row above, for the accepted share in words
    style.share_axis(ax, floor, "x", high)
    drawn = max(share, floor)
    ax.axvline(drawn, color=style.INK, lw=1.0)
    if not np.isnan(lower):
        ax.plot([max(lower, floor), max(upper, floor)], [0, 0], color=style.INK, lw=1.6)
    ax.plot(drawn, 0, "o" if share >= floor else style.markers.CARETLEFT, color=style.INK, ms=6.0, clip_on=False)
    for y, row in enumerate(rows, 1):
        share_shown, low, top = (max(row[f"share{end}"], floor) for end in ("", "_lower", "_upper"))
        ax.barh(y, share_shown - drawn, 0.62, left=drawn, color=style.COLOURS[row["change"] > 0.0], zorder=2)
        ax.plot([low, top], [y, y], color=style.INK, lw=1.2, zorder=3)
        if row["share_lower"] < floor:
            ax.plot(floor, y, marker=style.markers.CARETLEFT, color=style.INK, ms=5.0, zorder=4, clip_on=False)
    if accepted > 0.0:
        ax.axvline(accepted, **_ACCEPTED)
        words: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8.0, "backgroundcolor": "white"}
        ax.text(accepted, -0.9, f"accepted {text.percent(accepted)}", **words)
    ax.set_xlabel("share of the joints that exceed a limit")


PILOT = 64
"""Number of joints whose time is measured."""
FURTHER = 4
"""Largest number of joints of a variation whose first joints leave it open, in multiples of theirs."""
MARGIN = 1.2
"""Factor on the number of joints that would just decide a variation."""


def simulate(
    path: Path,
    work: Work,
    joints: Annotated[int, Opt("N", least=100)] = variations.JOINTS,
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
        With --run: number of joints of each variation, 1000 unless given; more than the campaign has are drawn with its
        seed.
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
        run = _Run(store, view, work, joints)
        singles = variations.singles(view.study)
        if not singles:
            remedy = "write [[assumed]] in the study, with name, values and because: tolstat docs study"
            raise unusable(view, "has a joint of which nothing is assumed that is varied", remedy)
        run.simulate(singles)
        run.simulate(variations.all_together(View(store)))
        further, number = _further(View(store), accepted, run.n)
        if further:
            run.simulate(further, number)
            run.simulate(variations.all_together(View(store)))
        work.tell(run.outcome)
    return [path]


def _further(view: View, accepted: float, n: int) -> tuple[list[variations.Variation], int]:
    """Variations that would turn the verdict if more joints, at most `FURTHER` times `n`, decided them; that number."""
    standing = variations.evaluate(view, accepted)
    second = (1.0 + standing.confidence) / 2.0
    needed = {row["label"]: MARGIN * binomial.needed(row["share"], accepted, second) for row in standing.undecided}
    numbers = {label: number for label, number in needed.items() if number <= FURTHER * n}
    every = {each.label: each for each in (*variations.singles(view.study), *variations.all_together(view))}
    return [every[label] for label in numbers], math.ceil(max(numbers.values(), default=n))


class _Run:
    """Simulation of variations, one round after the other.

    Attributes
    ----------
    n : int
        Number of joints of each variation.
    simulated : int
        Number of joints simulated so far, each at every point.
    """

    def __init__(self, store: Writer, view: View, work: Work, joints: int) -> None:
        self._begin, self._seconds = time.monotonic(), 0.0
        self._store, self._view, self._work = store, view, work
        self._workers = work.workers or available_cores()
        self._asked = sets.Asked(view.kept_loads, variations.points_of(view))
        self.n = joints if joints > variations.JOINTS else min(joints, variations.joints_of(view))
        self.simulated, self._variations, self._more = 0, set[str](), ""

    @property
    def outcome(self) -> str:
        """What was simulated, in words."""
        spent = time.monotonic() - self._begin
        if not self.simulated:
            return f"all {len(self._variations)} variations are in the file, {self.n} joints of each"
        each = f"{self.n} of each of {len(self._variations)} variations"
        return f"simulated {self.simulated} joints in {spent:.0f} s, {each}{self._more}"

    def simulate(self, wanted: Sequence[variations.Variation], number: int = 0) -> None:
        """Simulate what the file lacks of the first joints of some variations: `n` of each unless a number is given."""
        n = number or self.n
        if number:
            self._more = f", {number} of {', '.join(variation.label for variation in wanted)}"
        study, changes, faults = self._view.study, list[Change](), list[Fault]()
        for variation in wanted:
            with gather(faults):
                changes.append(sets.with_joint(study, variation.keys, range(n)))
        if faults:
            raise InputError(faults)
        self._variations |= {variation.label for variation in wanted}
        if (first := own_joints(self._view)) < n:
            changes.insert(0, sets.as_drawn(study, range(first, n)))
        in_file, names = what_if.read(self._store), self._asked.names(study)
        lacking = sum(len(sets.missing(in_file, change, names)) for change in changes)
        if not lacking:
            return
        if not self._seconds:
            warm_up()
            options = sets.options_of(study, self._store)
            self._seconds = sets.seconds_per_joint(study, options, PILOT, self._asked.points) / self._workers
        cost, points = progress.clock(self._seconds * lacking), ", ".join(self._asked.points)
        where = f" at {points}" if points else ""
        self._work.tell(f"{lacking} joints to simulate{where}, about {cost} on {self._workers} processes")
        self._work.display.stage("variations")
        sets.simulate(study, self._store, changes, self._asked, self._workers, lambda: False, self._work.display)
        self.simulated += lacking
