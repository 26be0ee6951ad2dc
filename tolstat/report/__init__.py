"""Reports of a result file: a table as text, pictures, and their numbers as CSV.

A campaign of random joints gets load exceedance; a sweep gets loads against the swept value; a list of cases
gets its table.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from tolstat.common.errors import Fault, InputError
from tolstat.common.files import atomic_write
from tolstat.display import text
from tolstat.solver import fidelity
from tolstat.store import Reader
from tolstat.store.view import View


class Report(NamedTuple):
    """Output of a report.

    Attributes
    ----------
    table : str
        The numbers that the study asks for, as aligned text.
    notes : str
        How many joints were evaluated, and what the intervals cover.
    files : list of Path
        Pictures and CSV files written.
    """

    table: str
    notes: str
    files: list[Path]


def write_report(path: str | Path, out_dir: str | Path | None = None) -> list[Path]:
    """Write the report of a result file; see `build`.

    Returns
    -------
    list of Path
        The files written.
    """
    return build(path, out_dir).files


def build(path: str | Path, out_dir: str | Path | None = None) -> Report:
    """Write the report of a result file; the campaign may be unfinished.

    For ``FILE.h5`` it writes ``FILE_exceedance.png``, ``.svg`` and ``.csv`` (the curves),
    ``FILE_quantiles.csv`` and, where the study sets limits, ``FILE_limits.csv``; for a sweep
    ``FILE_sweep.png``, ``.svg`` and ``.csv``; for a list of cases ``FILE_cases.csv`` and, where
    variants have notes, the table ``FILE_cases.md``. Loads that the study does not keep are left out; without any
    force or torque there is no picture.

    Parameters
    ----------
    path : str or Path
        The result file.
    out_dir : str or Path, optional
        An existing folder; by default that of the file.

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
    path = Path(path)
    stem = (Path(out_dir) if out_dir is not None else path.parent) / path.stem
    try:
        with Reader.open(path) as store:
            stands_on = fidelity.sentence(store.options, store.fidelity)
            if store.case_names:
                return _noted(_cases(store, stem), stands_on)
            view = store.view()
            report = _sweep(view, stem) if view.method == "sweep" else _exceedance(view, stem)
            for note in (view.missing(), _stopped(store.stop) if store.stop else "", stands_on):
                report = _noted(report, note)
            return report
    except OSError as error:
        found = f"cannot be written to: {error.strerror or error}"
        raise InputError([Fault(str(stem.parent), found, "name an existing folder with --out")]) from error


def _noted(report: Report, note: str) -> Report:
    return report._replace(notes=f"{report.notes}\n{note}") if note else report


def _exceedance(view: View, stem: Path) -> Report:
    from tolstat.display import style
    from tolstat.display.table import as_text
    from tolstat.questions.exceedance import query, rendering

    files, table = [], "no largest load is kept; the results that are: tolstat export"
    if view.bushing_loads:
        files = style.save(rendering.figure(view), stem.with_name(f"{stem.name}_exceedance"))
    if view.shown_loads:
        files.append(text.csv(query.curves(view), stem, "exceedance"))
        quantiles = query.quantiles(view)
        files.append(text.csv(quantiles, stem, "quantiles"))
        table = as_text(rendering.quantile_columns(), rendering.by_load(quantiles))
    if view.limits:
        limits = query.limits(view)
        files.append(text.csv(limits, stem, "limits"))
        table = as_text(rendering.LIMITS, limits)
    return Report(table, f"{view.head()}\n{rendering.note(view)}{_accuracy(view)}", files)


def _sweep(view: View, stem: Path) -> Report:
    from tolstat.display import style
    from tolstat.questions.exceedance import sweep

    files = style.save(sweep.figure(view), stem.with_name(f"{stem.name}_sweep")) if view.bushing_loads else []
    files.append(text.csv(sweep.table(view), stem, "sweep"))
    return Report(text.plain(sweep.worst(view)), f"{view.head()}{_accuracy(view)}", files)


def _accuracy(view: View) -> str:
    from tolstat.questions.accuracy import rendering

    return f"\n{rendering.note(view.verification)}" if view.verification else ""


def _cases(store: Reader, stem: Path) -> Report:
    from tolstat.report import cases

    full = cases.table(store)
    files = [text.csv(full, stem, "cases")]
    counts = store.counts()
    notes = "\n".join([f"{counts.done} of {counts.total} joints, {counts.shortfall}", *cases.advice(full)])
    if full["note"].any():
        files.append(_text(cases.markdown(full), stem, "cases.md"))
    return Report(text.plain(cases.worst(full)), notes, files)


def _text(content: str, stem: Path, ending: str) -> Path:
    path = stem.with_name(f"{stem.name}_{ending}")
    with atomic_write(path) as temporary:
        temporary.write_text(content, encoding="utf-8")
    return path


def _stopped(stop: dict[str, Any]) -> str:
    """Sentence about a campaign that its stop rule ended."""
    confidence = f"{100 * stop['confidence']:.0f} %"
    return (
        f"stopped by {stop['rule']} at {stop['joints']} joints; {confidence} interval corrected for "
        f"{len(stop['looks'])} looks: {stop['lower']:.5f} to {stop['upper']:.5f}. Intervals above are not corrected."
    )
