"""Numerical error of a campaign's joints, as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import accuracy
from tolstat.analysis.accuracy import KIND_OF, OBSERVABLES
from tolstat.common.load_kinds import LOAD_KINDS
from tolstat.common.loads import UNIT_OF_LOAD, FloatArray
from tolstat.common.tables import Status
from tolstat.store.verification import Verification
from tolstat.store.view import View

if TYPE_CHECKING:
    import pandas as pd

TOTAL = "numerical error"
COLUMNS = ("load", "error", "joints", "median", "usual", "worst")
"""Columns of `distribution`."""


def _results(verification: Verification) -> dict[str, np.ndarray[tuple[int], np.dtype[np.void]]]:
    return {name: check.results for name, check in verification.checks.items()}


def _held(verification: Verification) -> NDArray[np.bool_]:
    """Which of `OBSERVABLES` the campaign keeps, (loads,); all if no joint has a value."""
    held = ~np.isnan(accuracy.loads(verification.base)).all(axis=0)
    return np.asarray(held | ~held.any())


def errors(verification: Verification) -> dict[str, FloatArray]:
    """Errors, (m, loads), by check, as of `accuracy.differences`; last `TOTAL`, from `accuracy.numerical`."""
    results = _results(verification)
    found = {name: accuracy.differences(verification.base, other) for name, other in results.items()}
    return found | {TOTAL: accuracy.numerical(verification.base, results)}


def distribution(verification: Verification) -> pd.DataFrame:
    """Distribution of the errors over the joints.

    Returns
    -------
    DataFrame
        One row per kind of load kept and check: ``load`` (``F``: the worst of its bushings in each joint), ``error``
        (name of the check or `TOTAL`), ``joints``, ``median``, ``usual`` (95 % of the joints are below) and ``worst``.
    """
    import pandas as pd

    return pd.DataFrame(distribution_rows(verification), columns=COLUMNS)


def distribution_rows(verification: Verification) -> list[dict[str, Any]]:
    """Rows of the table `distribution`."""
    rows = []
    found, held = errors(verification), _held(verification)
    for k in np.unique(KIND_OF[held]):
        kind = LOAD_KINDS[k].key
        for name, values in found.items():
            n, *spread = accuracy.spread(accuracy.by_kind(values)[:, k])
            rows.append(dict(zip(COLUMNS, (kind, name, n, *spread), strict=True)))
    return rows


def by_observable(verification: Verification) -> pd.DataFrame:
    """Distribution of the errors over the joints as in `distribution`, for each observable kept."""
    import pandas as pd

    rows = []
    for name, values in errors(verification).items():
        for k in np.flatnonzero(_held(verification)):
            n, *spread = accuracy.spread(values[:, k])
            rows.append([OBSERVABLES[k], name, n, *spread])
    return pd.DataFrame(rows, columns=COLUMNS)


def joints(verification: Verification) -> pd.DataFrame:
    """Errors of every joint, by check and observable kept.

    Returns
    -------
    DataFrame
        ``row``, ``check``, ``status`` (of the check), ``load``, ``unit``, ``campaign`` and ``value`` (SI), ``error``:
        the campaign's value minus the check's, relative to the largest load of the measure.
    """
    import pandas as pd

    base = accuracy.loads(verification.base)
    parts = []
    for name, check in verification.checks.items():
        other, error = accuracy.loads(check.results), accuracy.differences(verification.base, check.results)
        status = [Status(s).label for s in check.results["status"]]
        for k in np.flatnonzero(_held(verification)):
            columns = {
                "row": verification.rows,
                "check": name,
                "status": status,
                "load": OBSERVABLES[k],
                "unit": UNIT_OF_LOAD[OBSERVABLES[k]],
                "campaign": base[:, k],
                "value": other[:, k],
                "error": error[:, k],
            }
            parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)


def summary(view: View, confidence: float) -> dict[str, Any]:
    """JSON value: ``numerical_error`` that 95 % of the joints stay below, by kind of load; null if none is known."""
    known = {kind: None if np.isnan(error) else error for kind, error in view.numerical_error.items()}
    return {"numerical_error": known}
