"""A change of the study, simulated on the joints of its campaign: shares above the limits before and after."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from tolstat.analysis import difference
from tolstat.campaign import what_if as sets
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.work import Work
from tolstat.common.errors import input_error
from tolstat.common.loads import ANY_LIMIT, FloatArray, unit_text
from tolstat.common.shell import quote
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Part, Row, Sentence, Table
from tolstat.display.options import Accepted, Budget, Opt, Settings
from tolstat.display.verdict import WORDS, side_of
from tolstat.questions import shares
from tolstat.store import Writer
from tolstat.store.view import View
from tolstat.study import changes
from tolstat.study.rewriting import QUOTES

TITLE = "A change on the same joints"
FIRST, LEAST, MOST = 1024, 128, 16_384
"""Number of joints of the first look where the campaign has fewer than the least, or more than the most allowed."""
BUDGET_S = 300.0
"""Default time limit, s."""
QUANTILES = (0.5, 0.95)
"""Quantiles of the loads whose shift is told."""


def _shift(row: Row) -> str:
    ends = row["change_lower"], row["change_upper"]
    interval = "" if any(map(math.isnan, ends)) else f" ({text.ends(*ends, '+.3g')})"
    return f"{row['change']:+.3g}{interval} {unit_text(row['unit'])}".rstrip()


LIMITS = (
    Column("load > limit", text.limit),
    shares.estimated("before, %", "before"),
    shares.estimated("after, %", "after"),
    shares.estimated("change, %", "change", form="+.1f"),
    Column("joints", shares.word("n"), rank=1),
    Column("without a load", shares.word("n_failed"), rank=2),
)
"""Columns of the table ``limits``."""
LOADS = (
    Column("load", shares.word("load")),
    Column("share below", lambda row: f"{100.0 * row['share']:g} %"),
    Column("before", lambda row: text.value(row["before"], row["unit"])),
    Column("after", lambda row: text.value(row["after"], row["unit"])),
    Column("shift", _shift),
)
"""Columns of the table ``loads``."""


def change(view: View, settings: Settings, accepted: Accepted = math.nan) -> Answer:
    """Simulate a change of the study on the same joints.

    Joint i is sample i of the campaign, drawn with the changed study: each error has the same quantile. Changes
    tolerances, keys of the joint and its contact law, operating points, fixed errors; several --set are one change.
    Simulates what FILE lacks of it, more joints until the difference is settled, and keeps their loads in FILE.
    To go on after an interruption, run the same command again.

    Gives the share of joints above each limit and any limit before and after, their difference joint by joint with its
    95 % interval, whether the verdict turns, and how far the loads shift. With --out, writes the changed study.

    Example: tolstat change iso2768_f.h5 --set "*.tilt_*.cpk=1.2"

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    settings : list of str
        Key to change: "pin*.offset_t.plus_minus=0.05 mm", "joint.contact.law=sliced", "operation.alpha=12 deg",
        "pin*.tilt_t=none"; repeatable.
    accepted : float
        Accepted share of the joints that exceed at least one limit, for the verdict.

    Returns
    -------
    Answer
        Table ``limits``, one row per limit, and `ANY_LIMIT` for all of several: ``load``, ``unit``, ``level``, ``n``
        joints compared, ``n_failed`` of them without a valid load before or after, ``before``, ``after`` and ``change``
        with ``_lower`` and ``_upper``. Table ``loads``, one row per leading load, of a study without limits per load,
        and quantile: ``load``, ``unit``, ``share`` of the joints below, ``before``, ``after``, ``change`` with ends.
        Facts: ``n``, ``settled`` (see `ChangedJoints.tells`), ``yield_before``, ``yield_after``, ``verdict_before``,
        ``verdict_after`` (``kept``, ``not kept``, ``open``; None without an accepted share), ``turns``, ``differs``
        (keys of what determines the joints, and their changed values).

    Raises
    ------
    InputError
        With every fault of the settings.
    NotApplicable
        When the file holds no joints with this change; `simulate` adds them.
    StoreError
        When the joints are not drawn from tolerances.
    """
    asked = _Asked(view, settings)
    joints = shares.ChangedJoints(view, view.decisive, view.altered)
    values = joints.of(asked.about)
    if values is None or not np.isfinite(values + joints.base[: len(values)]).any():
        words = " ".join(f"--set {quote(setting)}" for setting in settings)
        remedy = f"simulate them: tolstat change {quote(str(view.path))} {words}"
        raise shares.inapplicable(view, "holds no joints with this change", remedy)
    n = min(len(values), len(joints.base))
    names = [*([ANY_LIMIT] if len(view.limits) > 1 else []), *view.limits]
    rows = [_of_limit(view, name, asked) for name in names]
    loads = view.leading if view.limits else view.shown_loads
    quantiles = [row for name in loads for row in _of_load(view, name, asked)]
    facts: dict[str, Any] = {"n": n, "settled": joints.tells(values[:n])}
    parts: list[Part] = []
    if rows:
        first = rows[0]
        facts |= {f"yield_{when}": 1.0 - first[when] for when in ("before", "after")}
        ends = [(first[f"{when}_lower"], first[f"{when}_upper"]) for when in ("before", "after")]
        sides = [WORDS.get(side_of(interval, accepted)) for interval in ends]
        facts |= {"verdict_before": sides[0], "verdict_after": sides[1]}
        facts |= {"turns": set(sides) == {"kept", "not kept"}}
        parts += [Sentence(line, "lead") for line in _sentences(view, first, sides, accepted)]
        parts.append(Table("limits", "Share of the joints above each limit, before and after", LIMITS, rows))
    parts.append(Table("loads", "Largest loads, before and after", LOADS, quantiles))
    compared = text.several(n, "joint")
    notes = [f"{compared} compared one by one; 95 % intervals without the numerical error, not corrected for the looks"]
    notes.insert(0, changes.words(view.study, asked.text))
    if not view.design.independent:
        notes.append("joints are drawn independently here: without lots")
    if len(view.limits) > len(loads):
        notes.append("largest loads: of each kind the one whose limit most joints exceed")
    if not facts["settled"]:
        notes.append("the difference is not settled: a larger --most or a longer --budget goes on")
    documents = shares.study_documents(view.study, asked.text)
    facts |= {"differs": asked.about["differs"]}
    return Answer("change", TITLE, [*parts, *map(Sentence, notes), *documents], facts)


class _Asked:
    """A change of the study of a campaign: the text and the study that it makes, and its entry in the file."""

    def __init__(self, view: View, settings: Sequence[str]) -> None:
        shares.check_one_joint(view)
        self.text = changes.with_settings(view.study, settings)
        self.study = changes.read(view.study, self.text)
        plain = (setting.translate(QUOTES).split("=", 1) for setting in settings)
        self.label = ", ".join("=".join(part.strip() for part in setting) for setting in plain)
        self.about = sets.with_study(view.study, self.study, self.label, range(0)).about
        if not self.about["differs"]:
            raise input_error(f"--set {self.label}", "changes nothing", "give a value that is not that of the study")


def _of_limit(view: View, name: str, asked: _Asked) -> dict[str, Any]:
    """Row of the table ``limits``."""
    joints = shares.ChangedJoints(view, name, view.altered)
    before, after = _pairs(joints, asked)
    row = {"load": name, "unit": joints.load.unit, "level": joints.level, "n": len(after)}
    row |= {"n_failed": int(np.isnan(before + after).sum())}
    row |= shares.with_ends("before", joints.share(before)) | shares.with_ends("after", joints.share(after))
    return row | shares.with_ends("change", joints.difference(before, after))


def _of_load(view: View, name: str, asked: _Asked) -> list[dict[str, Any]]:
    """Rows of the table ``loads``."""
    joints = shares.ChangedJoints(view, name, view.altered)
    before, after = (shares.sample_of(values, joints.design) for values in _pairs(joints, asked))
    rows = []
    for share in QUANTILES:
        found = difference.quantiles(before, after, share, paired=True)
        row = {"load": name, "unit": joints.load.unit, "share": share, "before": found.a, "after": found.b}
        rows.append(row | shares.with_ends("change", (found.estimate, found.lower, found.upper)))
    return rows


def _pairs(joints: shares.ChangedJoints, asked: _Asked) -> tuple[FloatArray, FloatArray]:
    """Load of the same joints before and after."""
    values = joints.of(asked.about)
    assert values is not None
    n = min(len(values), len(joints.base))
    return joints.base[:n], values[:n]


def _sentences(view: View, row: Row, sides: Sequence[str | None], accepted: float) -> list[str]:
    """What the change does to the share above the limits, and to the verdict."""
    before, after = (_with_interval(row, when) for when in ("before", "after"))
    event = "at least one limit" if row["load"] == ANY_LIMIT else text.limit(row)
    exceed = f"exceed {event}" if row["load"] == ANY_LIMIT else f"have {event}"
    ends = text.ends(100.0 * row["change_lower"], 100.0 * row["change_upper"], "+.1f")
    difference_in_words = f"{100.0 * row['change']:+.1f} % ({ends})"
    lines = [f"{after} of the joints {exceed} with the change, {before} before: {difference_in_words}."]
    lines.append(f"Yield {text.percent(1.0 - row['before'])} before, {text.percent(1.0 - row['after'])} after.")
    if sides[0]:
        share = f"({text.percent(accepted)} accepted)"
        verb = "The verdict turns" if set(sides) == {"kept", "not kept"} else "The verdict does not turn"
        if "open" in sides:
            known_first = sorted(zip(sides, ("as drawn", "with the change"), strict=True), key=lambda s: s[0] == "open")
            told = ", ".join(f"{side} {when}" for side, when in known_first)
            lines.append(f"{told[0].upper()}{told[1:]} {share}: the joints do not tell whether the verdict turns.")
        else:
            lines.append(f"{verb}: {sides[0]} before, {sides[1]} after {share}.")
    return lines


def _with_interval(row: Row, when: str) -> str:
    return f"{text.percent(row[when])} ({text.span(row[f'{when}_lower'], row[f'{when}_upper'])})"


def simulate(
    path: Path,
    work: Work,
    settings: Settings,
    accepted: Accepted = math.nan,
    budget: Budget = BUDGET_S,
    most: Annotated[int, Opt("N", least=LEAST)] = MOST,
) -> list[Path]:
    """Simulate what a file lacks of a change, and keep the loads in the file.

    First as many joints as the campaign has, then twice as many at a time, with its seed, until the difference of the
    share above the limits is settled and, with an accepted share, the verdict too; at 95 % for all looks together.

    Parameters
    ----------
    path : Path
        Result file of a campaign whose joints are drawn from tolerances.
    work : Work
        Workers, progress and messages.
    settings : list of str
        As in `change`.
    accepted : float
        Accepted share of the joints that exceed at least one limit; NaN if none is given.
    budget : float
        Time limit, with unit s, min or h; 5 min unless given.
    most : int
        Largest number of joints.

    Returns
    -------
    list of Path
        The file.

    Raises
    ------
    InputError
        With every fault of the settings, or when the time is up before any joint is simulated.
    StoreError
        When the file cannot be used, or lacks joints and was made by other code.
    """
    begin = time.monotonic()
    with Writer.open(path) as store, kept_workers():
        view = View(store, work.study_file)
        asked, own = _Asked(view, settings), shares.own_joints(view)
        simulation = shares.Simulation(store, view, work, view.limits or ("",))
        n = min(own if LEAST <= own <= most else FIRST, most)
        confidence = 1.0 - 0.05 / (1 + math.ceil(math.log2(max(most / n, 1.0))))
        while True:
            wanted = [sets.with_study(view.study, asked.study, asked.label, range(n))]
            if n > own:
                wanted.insert(0, sets.as_drawn(view.study, range(own, n)))
            missing = simulation.run(wanted, asked.label, end=begin + budget)
            joints = shares.ChangedJoints(view, view.decisive, simulation.altered)
            if missing or n >= most or _is_settled(joints, joints.of(asked.about), accepted, confidence):
                break
            n = min(2 * n, most)
        if joints.of(asked.about) is None:
            found = f"{budget:g} s were over before a joint with the change was simulated"
            raise input_error("--budget", found, 'give more, such as --budget "5 min"; the same command goes on')
        if simulation.simulated:
            work.tell(f"simulated {text.several(simulation.simulated, 'joint')} in {time.monotonic() - begin:.0f} s")
    return [path]


def _is_settled(joints: shares.ChangedJoints, values: FloatArray | None, accepted: float, confidence: float) -> bool:
    """Whether it is known what a change does, and on which side of the accepted share it ends."""
    if values is None or not np.isfinite(values + joints.base[: len(values)]).any():
        return False
    _, low, high = joints.share(values, confidence)
    return side_of((low, high), accepted) != "open" and joints.tells(values, confidence)
