"""How far are the loads from the exact solution? The numerical error, from checks of joints."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from tolstat.analysis import accuracy as comparison
from tolstat.common.load_kinds import kinds
from tolstat.common.loads import FloatArray, load_of, units_of_loads
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Status
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Row, Rows, Sentence, Table
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
    rows, unit = error_rows(checks, view.mechanism), dict.fromkeys(("median", "usual", "worst"), "1")
    table = Table("errors", title, ERRORS, rows, unit)
    lead = Sentence(text.sentence(error_of_view(view, checks)), "lead")
    return Answer("accuracy", "Numerical error", [lead, table], {"numerical_error": view.numerical_error})


def error_rows(verification: Verification, mechanism: Mechanism, by_kind: bool = True) -> Rows:
    """Distribution of the errors over the joints, for each check and each kind of load, or load, that is kept.

    Returns
    -------
    sequence of mapping
        ``load`` (``F``: the worst of its bushings in each joint; ``cross1.F`` if not `by_kind`), ``error`` (name of the
        check or `TOTAL`), ``joints``, ``median``, ``usual`` (95 % of the joints are below) and ``worst``.
    """
    by_check, columns = errors(verification, mechanism), _kept(verification, mechanism)
    if by_kind:
        shown = {load_of(name, mechanism).kind.key for name in columns}
        columns = {key: k for k, key in enumerate(kinds(mechanism)) if key in shown}
        by_check = {name: comparison.by_kind(values, mechanism) for name, values in by_check.items()}
    each = ((load, name, *comparison.spread(by_check[name][:, k])) for load, k in columns.items() for name in by_check)
    return [dict(zip(("load", "error", "joints", "median", "usual", "worst"), row, strict=True)) for row in each]


def errors(verification: Verification, mechanism: Mechanism) -> dict[str, FloatArray]:
    """Errors, (m, loads), by check, as of `accuracy.differences`; last `TOTAL`, from `accuracy.numerical`."""
    results = {name: check.results for name, check in verification.checks.items()}
    by_check = {name: comparison.differences(verification.base, other, mechanism) for name, other in results.items()}
    return by_check | {TOTAL: comparison.numerical(verification.base, results, mechanism)}


def joint_rows(verification: Verification, mechanism: Mechanism) -> Rows:
    """Errors of every joint, by check and load kept.

    Returns
    -------
    sequence of mapping
        ``row``, ``check``, ``status`` (of the check), ``load``, ``unit``, ``campaign`` and ``value`` (SI), ``error``:
        the campaign's value minus the check's, relative to the largest load of the measure.
    """
    base, rows = comparison.loads(verification.base, mechanism), list[Row]()
    for name, check in verification.checks.items():
        other = comparison.loads(check.results, mechanism)
        error = comparison.differences(verification.base, check.results, mechanism)
        states = [Status(code).label for code in check.results["status"]]
        for load, k in _kept(verification, mechanism).items():
            fixed = {"load": load, "unit": units_of_loads(mechanism)[load]}
            values = zip(verification.rows, states, base[:, k], other[:, k], error[:, k], strict=True)
            for row, status, *numbers in values:
                figures = dict(zip(("campaign", "value", "error"), map(float, numbers), strict=True))
                rows.append({"row": int(row), "check": name, "status": status, **fixed, **figures})
    return rows


def error_of_view(view: View, checks: Verification) -> str:
    """Sentence on the numerical error of a campaign from its `checks`, and on that near its limits."""
    words, near = error_note(checks, view.mechanism, view.limits, view.method == "random"), view.near
    known = _known(near, view.mechanism, view.limits) if near else {}
    if near is None or not known:
        return words
    largest = ", ".join(f"{kind} {row['worst']:.1e}" for kind, row in known.items())
    how = basis(near).partition(" ")[0]
    how = "" if how in words else f" ({how})"
    return f"{words}; largest of the {len(near.rows)} joints nearest to limits{how}: {largest}"


def _known(verification: Verification, mechanism: Mechanism, limits: Iterable[str]) -> dict[str, Row]:
    """Rows of `TOTAL` that are known, by kind of load: of kinds that every report shows, and those of `limits`."""
    limited = {load_of(name, mechanism).kind.key for name in limits}
    total = [row for row in error_rows(verification, mechanism) if row["error"] == TOTAL]
    shown = [row for row in total if row["load"] in limited or kinds(mechanism)[row["load"]].shown] or total
    return {called_for_people(row["load"], mechanism): row for row in shown if not np.isnan(row["worst"])}


def error_note(
    verification: Verification, mechanism: Mechanism, limits: Iterable[str] = (), is_sample: bool = True
) -> str:
    """Sentence on the numerical error of the largest loads.

    Of joints of a production that were chosen at random (`is_sample`) the largest error is a bound for most others.
    """
    known = _known(verification, mechanism, limits)
    words = [f"{kind} median {row['median']:.1e}, largest {row['worst']:.1e}" for kind, row in known.items()]
    if known and is_sample:
        points = np.unique(verification.rows, return_counts=True)[1].max()  # at each of them the same joints
        fewest = min(row["joints"] for row in known.values()) // points
        words += [f"at least {bounded(fewest)} of the production has smaller ones than the largest (confidence 95 %)"]
    noun = "error of numerics and fidelity" if comparison.FIDELITY in verification.checks else "numerical error"
    base = verification.base["status"] == Status.OK
    lost = {"": int((~base).sum())}  # joints that failed or did not settle, in the campaign and in each check
    for name, check in verification.checks.items():
        lost[f" in {name}"] = int((base & (check.results["status"] != Status.OK)).sum())
    unsettled = ", ".join(f"{count} not settled{where}" for where, count in lost.items() if count)
    return f"{noun}, {basis(verification)}: {'; '.join(words) or 'unknown'}{f'; {unsettled}' if unsettled else ''}"


def called_for_people(key: str, mechanism: Mechanism) -> str:
    """Name of a kind of loads in sentences: its symbol where tables have that beside every load, or else its noun."""
    kind = kinds(mechanism)[key]
    return kind.symbol if kind.shown or kind.key == "psi" else kind.noun


def basis(verification: Verification) -> str:
    """Words on how the numerical error was determined."""
    m = len(verification.rows)
    if comparison.REFERENCE in verification.checks:
        settled = int((verification.checks[comparison.REFERENCE].results["status"] == Status.OK).sum())
        return f"measured on {settled} of {m} joints against a tight reference"
    noun = "joint" if m == 1 else "joints"
    return f"estimated on {m} {noun} from half the step and smaller tolerances"


def bounded(joints: int) -> str:
    """Share of all joints that is below the largest of so many chosen at random, in whole per cent, rounded down."""
    return f"{math.floor(100.0 * comparison.share_below_largest(joints))} %"


def in_percent(error: float) -> str:
    """Format an error in per cent; below `LEAST` the number says no more than that it is small."""
    return f"< {text.percent(LEAST)}" if error < LEAST else text.percent(error)


def _kept(verification: Verification, mechanism: Mechanism) -> dict[str, int]:
    """Loads that the campaign keeps, with their numbers in `accuracy.observables`; all if no joint has a value."""
    has_values = ~np.isnan(comparison.loads(verification.base, mechanism)).all(axis=0)
    kept = np.asarray(has_values | ~has_values.any())
    return {name: k for k, name in enumerate(comparison.observables(mechanism)) if kept[k]}
