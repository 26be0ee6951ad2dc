"""Reports of a result file: a table as text, pictures, and their numbers as CSV.

A campaign of random joints gets load exceedance; a sweep gets loads against the swept value; a list of cases
gets its table.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from tolstat.common.errors import Fault, InputError
from tolstat.common.files import atomic_write
from tolstat.display import table, text
from tolstat.display.asked import silent
from tolstat.display.table import WIDTH
from tolstat.joint.mounting import in_words
from tolstat.solver import fidelity
from tolstat.store import Reader, ResultFile, recorded, viewed
from tolstat.store.view import View


class Report(NamedTuple):
    """Output of a report.

    Attributes
    ----------
    table : str
        Mounting of the shafts and contact law; the numbers that the study asks for, as aligned text.
    notes : str
        How many joints were evaluated, and what the intervals cover.
    files : list of Path
        Pictures and CSV files written.
    """

    table: str
    notes: str
    files: list[Path]


def write_report(source: str | Path | ResultFile | View, out_dir: str | Path | None = None) -> list[Path]:
    """Write the report of a result file; see `build`.

    Returns
    -------
    list of Path
        The files written.
    """
    return build(source, out_dir).files


def build(
    source: str | Path | ResultFile | View,
    out_dir: str | Path | None = None,
    width: int | None = WIDTH,
    stage: Callable[[str], None] = silent,
    accepted: float = math.nan,
    point: str = "",
) -> Report:
    """Write the report of a result file; the campaign may be unfinished.

    For ``FILE.h5`` it writes ``FILE_exceedance.png``, ``.svg`` and ``.csv`` (the curves),
    ``FILE_quantiles.csv`` and, where the study sets limits, ``FILE_limits.csv``; for a sweep
    ``FILE_sweep.png``, ``.svg`` and ``.csv``; for a list of cases ``FILE_cases.csv`` and, where
    variants have notes, the table ``FILE_cases.md``. Loads that the study does not keep are left out; without any
    force or torque there is no picture.

    Parameters
    ----------
    source : str, Path, ResultFile or View
        The result file: its path, what `tolstat.open` returns, or a view.
    out_dir : str or Path, optional
        Folder, made if missing; by default that of the file.
    width : int or None
        Characters in a line of the table; None for all columns.
    stage : callable
        Called with the name of each stage when it begins.
    accepted : float
        Accepted share: share of the joints that may be above each limit; NaN if none is given.
    point : str
        Operating point, ``"cruise"``, or the worst of some, ``"cruise+start"``; names of files end in it. The worst of
        all by default.

    Returns
    -------
    Report
        Table, notes and the files written.

    Raises
    ------
    StoreError
        When the file cannot be read.
    InputError
        When the folder cannot be written to.
    """
    folder = None if out_dir is None else Path(out_dir)
    try:
        stage("report")
        from tolstat.questions.exceedance import query

        with viewed(source) as view:
            store = view.store
            folder = view.path.parent if folder is None else folder
            stem = folder / view.path.stem
            stands_on = fidelity.sentence(store.options, store.fidelity)
            if store.case_names:
                return _noted(_cases(store, stem, width), stands_on)
            stem = stem.with_name(f"{stem.name}_{point}") if point else stem
            report = _sweep(view, stem, width) if view.method == "sweep" else _exceedance(view, stem, width, accepted)
            stopped = _stopped(store.stop) if store.stop.get("reached") else ""
            for note in (query.not_kept(view), stopped, stands_on):
                report = _noted(report, note)
            return report
    except OSError as error:
        found = f"cannot be written to: {error.strerror or error}"
        raise InputError([Fault(str(folder), found, "give another folder with --out")]) from error


def _headed(table: str, store: Reader, width: int | None, verdict: str = "") -> str:
    """Table below the verdict, if there is one, and below mounting and contact law."""
    lines = [verdict, in_words(*recorded.mountings(store))]
    said = [text.sentence(line) for line in lines if line]
    return "\n".join([*(said if width is None else (textwrap.fill(line, width) for line in said)), "", table])


def _noted(report: Report, note: str) -> Report:
    return report._replace(notes=f"{report.notes}\n{note}") if note else report


def _exceedance(view: View, stem: Path, width: int | None, accepted: float) -> Report:
    """Report of load exceedance."""
    found = _numbers(view, stem, width, accepted)
    return found._replace(files=[*(_pictures(view, stem) if view.bushing_loads else []), *found.files])


def _pictures(view: View, stem: Path) -> list[Path]:
    from tolstat.display import style
    from tolstat.questions.exceedance.curves_figure import figure

    return style.save(figure(view), stem.with_name(f"{stem.name}_exceedance"))


def _numbers(view: View, stem: Path, width: int | None, accepted: float) -> Report:
    from tolstat.questions import capability
    from tolstat.questions.exceedance import query, rendering
    from tolstat.report.headline import headline, tells_yield

    files, shown, more = [], "no largest load is kept; the results that are: tolstat export", ""
    if view.shown_loads:
        files.append(text.csv(query.curve_columns(view), stem, "exceedance"))
        quantiles = query.quantile_rows(view)
        files.append(text.csv(text.columns_of(quantiles), stem, "quantiles"))
        shown, more = table.fitted(rendering.quantile_columns(), rendering.by_load(quantiles), width)
    verdict = headline(view, accepted)
    if view.limits:
        limits = query.limit_rows(view)
        files.append(text.csv(text.columns_of(limits), stem, "limits"))
        shown, more = table.fitted(rendering.LIMITS, limits, width)
        if points := query.point_rows(view):
            shown += f"\n\n{rendering.AT_POINTS}\n{table.as_text(rendering.at_points(view), points, width)}"
    shown = _headed(shown, view.store, width, verdict.sentence if verdict else "")
    if verdict and verdict.answer and tells_yield(view):
        kept = capability.together(capability.good(view), len(view.limits))
        shown += f"\n\nyield: {kept.value} {kept.words}"
    notes = [*(verdict.notes if verdict else ()), more, view.head(), rendering.note(view), _accuracy(view)]
    return Report(shown, "\n".join(note for note in notes if note), files)


def _sweep(view: View, stem: Path, width: int | None) -> Report:
    from tolstat.display import style
    from tolstat.questions.exceedance import sweep

    files = style.save(sweep.figure(view), stem.with_name(f"{stem.name}_sweep")) if view.bushing_loads else []
    files.append(text.csv(sweep.table(view), stem, "sweep"))
    short = sweep.worst(view)
    shown, more = table.fitted(
        table.plain(short, [str(name) for name in short.columns if "." in str(name)][1:]), short, width
    )
    notes = "\n".join(note for note in (more, view.head(), _accuracy(view)) if note)
    return Report(_headed(shown, view.store, width), notes, files)


def _accuracy(view: View) -> str:
    from tolstat.questions.accuracy import note

    return note(view.verification, view.limits) if view.verification else ""


def _cases(store: Reader, stem: Path, width: int | None) -> Report:
    from tolstat.report import cases

    full = cases.table(store)
    files = [text.csv(full, stem, "cases")]
    counts, worst = store.counts(), cases.worst(full)
    shown, more = table.fitted(table.plain(worst, ["status", "alpha [deg]", "motion"]), worst, width)
    notes = "\n".join(
        [*([more] if more else []), f"{counts.done} of {counts.total} joints, {counts.shortfall}", *cases.advice(full)]
    )
    if full["note"].any():
        files.append(_text(cases.markdown(full), stem, "cases.md"))
    return Report(_headed(shown, store, width), notes, files)


def _text(content: str, stem: Path, ending: str) -> Path:
    path = stem.with_name(f"{stem.name}_{ending}")
    with atomic_write(path) as temporary:
        temporary.write_text(content, encoding="utf-8")
    return path


def _stopped(stop: dict[str, Any]) -> str:
    """Sentences about a campaign that its stop rule ended."""
    from tolstat.campaign.stop_rule import BIASED

    confidence = f"{100 * stop['confidence']:.0f} %"
    return (
        f"stopped by {stop['rule']} at {stop['joints']} joints: {confidence} interval {stop['lower']:.5f} to "
        f"{stop['upper']:.5f}, valid after any number of looks; share {stop['estimate']:.5f}, {BIASED}. Shares and "
        "intervals above are not corrected for the stop."
    )
