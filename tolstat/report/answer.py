"""The report of a result file as one answer: verdict, what it stands on, and the numbers that the study asks for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from tolstat import questions
from tolstat.campaign.stop_rule import BIASED
from tolstat.common.errors import Fault, StoreError
from tolstat.common.files import check_target
from tolstat.common.tables import Status
from tolstat.display import rewording, text
from tolstat.display.answer import Answer, Part, Sentence, Sheet, Table
from tolstat.questions import accuracy, capability, shares
from tolstat.questions.exceedance import answer as exceedance
from tolstat.questions.exceedance import curves, rows
from tolstat.questions.sweep import cases, sweep
from tolstat.report.headline import headline, life_verdicts, tells_yield
from tolstat.report.parts import of_listed
from tolstat.solver import fidelity
from tolstat.store import Reader, View, recorded, viewed


def report(view: View, accepted: float = math.nan) -> Answer:
    """Report the share of joints above each load.

    Parameters
    ----------
    view : View
        A campaign; it may be unfinished.
    accepted : float
        Accepted share: share of the joints that may be above each limit; NaN if none is given.

    Returns
    -------
    Answer
        Verdict, those on required lives, mounting of the shafts and contact law. Tables ``limits`` and ``at_points``,
        where the study sets limits, ``quantiles`` and, with at most `rows.MAX_LEVELS` levels of a load, ``exceedance``;
        for a sweep the table ``sweep``, for listed joints ``cases``. Loads that the study does not keep are left out.
    """
    return rewording.answer(_answer(view, accepted), recorded.wording_of(view.store))


def _answer(view: View, accepted: float) -> Answer:
    store = view.store
    stands_on = [Sentence(text.sentence(recorded.in_words(store)), "lead")]
    if store.case_names or view.method == "sweep":
        answer = cases(view) if store.case_names else sweep(view)
        notes = [] if store.case_names else [*_notes(view)]
        one_by_one = of_listed(view) if store.case_names else []
        return Answer("report", view.name, [*stands_on, *answer.parts, *one_by_one, *notes, *_run(view)])
    verdict, lives = headline(view, accepted), life_verdicts(view, accepted)
    facts: dict[str, Any] = {"verdict": verdict.values()} if verdict else {}
    if lives:
        facts["lives"] = [life.values() for life in lives]
    verdicts = [*([verdict] if verdict else []), *lives]
    parts: list[Part] = [Sentence(text.sentence(each.sentence), "lead") for each in verdicts]
    parts += [*stands_on, *_tables(view, accepted)]
    if verdict and verdict.answer and tells_yield(view):
        in_words = shares.together(shares.good(view), len(view.limits))
        parts.append(Sentence(f"Yield: {in_words.value} {in_words.words}.", "lead"))
    causes = [Sentence(note) for note in verdict.notes] if verdict else []
    causes += [Sentence(text.sentence(note)) for life in lives for note in life.notes]
    return Answer("report", view.name, [*parts, *causes, *_notes(view), *_run(view)], facts)


def write_report(
    source: str | Path | Reader | View,
    out_dir: str | Path | None = None,
    accepted: float = math.nan,
    point: str = "",
) -> list[Path]:
    """Write the report of a result file: tables as CSV, curves as PNG and SVG.

    Parameters
    ----------
    source : str, Path, ResultFile or View
        The result file: its path, what `tolstat.open` returns, or a view.
    out_dir : str or Path, optional
        Folder, made if missing; by default that of the file.
    accepted : float
        Accepted share: share of the joints that may be above each limit; NaN if none is given.
    point : str
        Operating point, ``"cruise"``, or the worst of some, ``"cruise+start"``; names of files end in it. The worst of
        all by default.

    Returns
    -------
    list of Path
        The files written: for ``FILE.h5`` ``FILE_exceedance.png``, ``.svg`` and ``.csv``, ``FILE_quantiles.csv`` and,
        with limits, ``FILE_limits.csv``; for a sweep ``FILE_sweep.png``, ``.svg`` and ``.csv``; for listed joints
        ``FILE_cases.csv``.

    Raises
    ------
    StoreError
        When the file cannot be read.
    InputError
        When the folder cannot be written to.
    """
    with viewed(source) as view:
        folder = view.path.parent if out_dir is None else Path(out_dir)
        stem = folder / (f"{view.path.stem}_{point}" if point else view.path.stem)
        check_target(stem)
        return report(view.at(point), accepted).write(stem)


def _tables(view: View, accepted: float) -> Iterator[Part]:
    """Tables for people, limits or else quantiles; the other ones and the curves as numbers, and their picture."""
    if view.bushing_loads:
        yield Sheet("exceedance", lambda: curves.sheet(view, [view.head(), exceedance.note(view)]))
    if not view.shown_loads:
        yield Sentence("no largest load is kept; the results that are: tolstat export", "lead")
    for table in exceedance.quantile_tables(view):
        yield Table("exceedance", "Exceedance curves", (), rows.curve_rows(view))
        yield replace(table, columns=()) if view.limits else table
    yield from exceedance.limit_tables(view, accepted)
    yield from capability.of_lots(view)


def _notes(view: View) -> Iterator[Part]:
    """How many joints were evaluated, what intervals cover, and the numerical error."""
    yield Sentence(view.head())
    if view.method != "sweep":
        yield Sentence(exceedance.note(view))
    if view.verification:
        yield Sentence(accuracy.error_of_view(view, view.verification))


def _run(view: View) -> Iterator[Part]:
    """Restrictions that come from how the campaign was run."""
    store = view.store
    missing = "" if store.case_names else rows.not_kept(view)
    for note in (missing, stopped(view), fidelity.sentence(store.options, store.fidelity)):
        if note:
            yield Sentence(note)


def stopped(view: View) -> str:
    """Sentences about a campaign that its stop rule ended; empty if none did."""
    stop = view.store.stop
    if not stop.get("reached"):
        return ""
    confidence = f"{100 * stop['confidence']:.0f} %"
    return (
        f"stopped by {stop['rule']} at {stop['joints']} joints: {confidence} interval {stop['lower']:.5f} to "
        f"{stop['upper']:.5f}; share {stop['estimate']:.5f}, {BIASED}. All intervals of shares and quantiles of this "
        "file are valid after any number of looks"
    )


def statistics(view: View, accepted: float = math.nan) -> dict[str, Any]:
    """Collect the statistics of a campaign.

    Parameters
    ----------
    view : View
        Campaign of a study whose joints are drawn from tolerances.
    accepted : float
        Accepted share: share of the joints that may be above each limit; NaN if none is given.

    Returns
    -------
    dict
        JSON values in SI units, null if unknown: ``study``, ``method``, ``confidence``; ``verdict``, with ``answer``
        of the joints as drawn (null without an accepted share), ``stands_on``, ``sentence`` and ``notes``, null without
        limits; ``joints``, numbers by status; ``lives``, verdicts on required lives, only where the study requires one
        that is known without simulation; the answers ``exceedance``, ``bearing_life``, ``capability`` and
        ``accuracy``, each with ``facts``, ``sentences`` and ``tables``, null where the file cannot give it;
        ``joint``, mounting of the shafts and contact law in words; ``fidelity``, a sentence on the fidelity of the
        results; ``provenance``.

    Raises
    ------
    StoreError
        When the file holds listed joints or a sweep.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.statistics(store.view())
    >>> found["joints"], round(found["exceedance"]["tables"]["limits"]["rows"][0]["estimate"], 2)
    ({'ok': 595, 'not_settled': 2, 'newton_failed': 3}, 0.02)
    """
    store = view.store
    if view.method in ("cases", "sweep"):
        remedy = "its joints are in: tolstat export --csv"
        raise StoreError(str(Fault(str(store.path), "holds no sample of a production, and has no statistics", remedy)))
    verdict = headline(view, accepted)
    head: dict[str, Any] = {
        "study": view.name,
        "method": view.method,
        "confidence": 0.95,
        "verdict": None if verdict is None else verdict.values(),
        "joints": {status.label: count for status in Status if (count := view.count(status))},
    }
    if lives := life_verdicts(view, accepted, samples=0):
        head["lives"] = [life.values() for life in lives]
    provenance = {
        "created": store.created,
        "git_commit": store.git_commit,
        "versions": store.versions,
        "sampling": store.sampling,
        "stop": store.stop,
    }
    answers = questions.statistics(view)
    stands_on: dict[str, Any] = {
        "joint": recorded.in_words(store),
        "fidelity": fidelity.sentence(store.options, store.fidelity),
    }
    head, stands_on = (rewording.values(each, recorded.wording_of(store)) for each in (head, stands_on))
    return head | answers | stands_on | {"provenance": provenance}
