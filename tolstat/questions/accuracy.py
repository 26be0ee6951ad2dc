"""Numerical error of the loads: of each check of some joints, and as they give it together."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import accuracy as comparison
from tolstat.analysis.accuracy import FIDELITY, KIND_OF, OBSERVABLES, REFERENCE
from tolstat.common.load_kinds import KIND, LOAD_KINDS
from tolstat.common.loads import UNIT_OF_LOAD, FloatArray, load_of
from tolstat.common.tables import Status
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Rows, Sentence, Table
from tolstat.questions.shares import Cell, inapplicable, word
from tolstat.store.verification import Verification
from tolstat.store.view import View

TOTAL = "numerical error"
LEAST = 1e-5
"""Smallest error that is given as a number in per cent."""


def _small(key: str) -> Cell:
    return lambda row: text.formed(row[key], ".1e")


ERRORS = (
    Column("load", word("load")),
    Column("error", word("error"), words=True),
    Column("joints", word("joints")),
    Column("median", _small("median")),
    Column("95 % below", _small("usual")),
    Column("worst", _small("worst")),
)
"""Columns of the table ``errors``."""


def accuracy(view: View) -> Answer:
    """Give the numerical error of the loads, from checks of joints.

    Parameters
    ----------
    view : View
        A campaign of which some joints were checked, as ``tolstat run`` and ``tolstat verify`` do.

    Returns
    -------
    Answer
        Table ``errors``, see `error_rows`. Fact ``numerical_error``: by kind of load, the error that 95 % of the
        checked joints stay below; None if it is not known.

    Raises
    ------
    NotApplicable
        When the file holds no checks.
    """
    checks = view.verification
    if checks is None:
        remedy = f"check some joints: tolstat verify {view.path}"
        raise inapplicable(view, "holds no checks of the numerical error", remedy)
    title = "Relative to the largest load of its kind in the joint"
    table = Table("errors", title, ERRORS, error_rows(checks), dict.fromkeys(("median", "usual", "worst"), "1"))
    lead = Sentence(text.sentence(note(checks, view.limits)), "lead")
    return Answer("accuracy", "Numerical error", [lead, table], {"numerical_error": view.numerical_error})


def error_rows(verification: Verification, by_kind: bool = True) -> Rows:
    """Distribution of the errors over the joints, for each check and each kind of load, or load, that is kept.

    Returns
    -------
    sequence of mapping
        ``load`` (``F``: the worst of its bushings in each joint; ``cross1.F`` if not `by_kind`), ``error`` (name of the
        check or `TOTAL`), ``joints``, ``median``, ``usual`` (95 % of the joints are below) and ``worst``.
    """
    by_check, kept = errors(verification), _kept(verification)
    columns = {OBSERVABLES[k]: k for k in np.flatnonzero(kept)}
    if by_kind:
        columns = {LOAD_KINDS[k].key: k for k in np.unique(KIND_OF[kept])}
        by_check = {name: comparison.by_kind(values) for name, values in by_check.items()}
    each = ((load, name, *comparison.spread(by_check[name][:, k])) for load, k in columns.items() for name in by_check)
    return [dict(zip(("load", "error", "joints", "median", "usual", "worst"), row, strict=True)) for row in each]


def errors(verification: Verification) -> dict[str, FloatArray]:
    """Errors, (m, loads), by check, as of `accuracy.differences`; last `TOTAL`, from `accuracy.numerical`."""
    results = {name: check.results for name, check in verification.checks.items()}
    by_check = {name: comparison.differences(verification.base, other) for name, other in results.items()}
    return by_check | {TOTAL: comparison.numerical(verification.base, results)}


def joint_rows(verification: Verification) -> Rows:
    """Errors of every joint, by check and load kept.

    Returns
    -------
    sequence of mapping
        ``row``, ``check``, ``status`` (of the check), ``load``, ``unit``, ``campaign`` and ``value`` (SI), ``error``:
        the campaign's value minus the check's, relative to the largest load of the measure.
    """
    base, rows = comparison.loads(verification.base), []
    for name, check in verification.checks.items():
        other, error = comparison.loads(check.results), comparison.differences(verification.base, check.results)
        states = [Status(code).label for code in check.results["status"]]
        for k in np.flatnonzero(_kept(verification)):
            fixed = {"load": OBSERVABLES[k], "unit": UNIT_OF_LOAD[OBSERVABLES[k]]}
            values = zip(verification.rows, states, base[:, k], other[:, k], error[:, k], strict=True)
            for row, status, *numbers in values:
                figures = dict(zip(("campaign", "value", "error"), map(float, numbers), strict=True))
                rows.append({"row": int(row), "check": name, "status": status, **fixed, **figures})
    return rows


def note(verification: Verification, limits: Iterable[str] = ()) -> str:
    """Sentence on the numerical error of the largest loads: of kinds that every report shows, and those of `limits`."""
    kinds = {load_of(name).kind.key for name in limits}
    total = [row for row in error_rows(verification) if row["error"] == TOTAL]
    shown = [row for row in total if row["load"] in kinds or KIND[row["load"]].shown] or total
    known = [row for row in shown if not np.isnan(row["worst"])]
    called = {kind.key: kind.symbol if kind.symbol == kind.key else kind.noun for kind in LOAD_KINDS}
    words = [f"{called[row['load']]} {row['median']:.1e}, at worst {row['worst']:.1e}" for row in known]
    noun = "error of numerics and fidelity" if FIDELITY in verification.checks else "numerical error"
    base = verification.base["status"] == Status.OK
    lost = {"": int((~base).sum())}  # joints that failed or did not settle, in the campaign and in each check
    for name, check in verification.checks.items():
        lost[f" in {name}"] = int((base & (check.results["status"] != Status.OK)).sum())
    unsettled = ", ".join(f"{count} not settled{where}" for where, count in lost.items() if count)
    return f"{noun}, {basis(verification)}: {'; '.join(words) or 'unknown'}{f'; {unsettled}' if unsettled else ''}"


def basis(verification: Verification) -> str:
    """Words on how the numerical error was determined."""
    m = len(verification.rows)
    if REFERENCE in verification.checks:
        settled = int((verification.checks[REFERENCE].results["status"] == Status.OK).sum())
        return f"measured on {settled} of {m} joints against a tight reference"
    noun = "joint" if m == 1 else "joints"
    return f"estimated on {m} {noun} from half the step, tighter Newton and longer settling"


def in_percent(error: float) -> str:
    """Format an error in per cent; below `LEAST` the number says no more than that it is small."""
    return f"< {text.percent(LEAST)}" if error < LEAST else text.percent(error)


def _kept(verification: Verification) -> NDArray[np.bool_]:
    """Which of `OBSERVABLES` the campaign keeps, (loads,); all if no joint has a value."""
    has_values = ~np.isnan(comparison.loads(verification.base)).all(axis=0)
    return np.asarray(has_values | ~has_values.any())
