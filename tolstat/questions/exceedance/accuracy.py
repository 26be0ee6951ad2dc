"""Numerical error of a campaign's joints, as tables."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat.analysis import accuracy
from tolstat.analysis.accuracy import FIDELITY, KIND_OF, OBSERVABLES, REFERENCE
from tolstat.common.loads import KINDS, UNIT_OF_LOAD
from tolstat.common.tables import Status
from tolstat.store.verification import Verification

TOTAL = "numerical error"
FORMAT = "{:.1e}"


def _results(verification: Verification) -> dict[str, np.ndarray[tuple[int], np.dtype[np.void]]]:
    return {name: check.results for name, check in verification.checks.items()}


def _held(verification: Verification) -> NDArray[np.bool_]:
    """Which of `OBSERVABLES` the campaign keeps, (21,); all if no joint has a value."""
    held = ~np.isnan(accuracy.loads(verification.base)).all(axis=0)
    return np.asarray(held | ~held.any())


def errors(verification: Verification) -> dict[str, accuracy.FloatArray]:
    """Errors relative to the largest load of the kind, (m, 21), by check; last `TOTAL`, from `accuracy.numerical`."""
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
    rows = []
    found, held = errors(verification), _held(verification)
    for k in np.unique(KIND_OF[held]):
        kind = KINDS[k]
        for name, values in found.items():
            n, *spread = accuracy.spread(accuracy.by_kind(values)[:, k])
            rows.append([kind, name, n, *spread])
    return pd.DataFrame(rows, columns=["load", "error", "joints", "median", "usual", "worst"])


def by_observable(verification: Verification) -> pd.DataFrame:
    """Distribution of the errors over the joints as in `distribution`, for each observable kept."""
    rows = []
    for name, values in errors(verification).items():
        for k in np.flatnonzero(_held(verification)):
            n, *spread = accuracy.spread(values[:, k])
            rows.append([OBSERVABLES[k], name, n, *spread])
    return pd.DataFrame(rows, columns=["load", "error", "joints", "median", "usual", "worst"])


def joints(verification: Verification) -> pd.DataFrame:
    """Errors of every joint, by check and observable kept.

    Returns
    -------
    DataFrame
        ``row``, ``check``, ``status`` (of the check), ``load``, ``unit``, ``campaign`` and ``value`` (SI), ``error``:
        the campaign's value minus the check's, relative to the largest load of the kind.
    """
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


def usual(verification: Verification) -> dict[str, float]:
    """Numerical error that 95 % of the joints stay below, by kind of load; NaN if unknown."""
    values = accuracy.by_kind(errors(verification)[TOTAL])
    return {kind: accuracy.spread(values[:, k]).usual for k, kind in enumerate(KINDS)}


def basis(verification: Verification) -> str:
    """Words on how the numerical error was determined."""
    m = len(verification.rows)
    results = _results(verification)
    if REFERENCE in results:
        settled = int((results[REFERENCE]["status"] == Status.OK).sum())
        return f"measured on {settled} of {m} joints against a tight reference"
    noun = "joint" if m == 1 else "joints"
    return f"estimated on {m} {noun} from half the step, tighter Newton and longer settling"


def note(verification: Verification) -> str:
    """Sentence on the numerical error of the largest loads."""
    table = distribution(verification)
    total = table[table["error"] == TOTAL]
    shown = total["load"].isin(["F", "T"])
    total = total[shown] if shown.any() else total
    words = [
        f"{kind} {FORMAT.format(median)}, at worst {FORMAT.format(worst)}"
        for kind, median, worst in zip(total["load"], total["median"], total["worst"], strict=True)
        if not np.isnan(worst)
    ]
    noun = "error of numerics and fidelity" if FIDELITY in verification.checks else "numerical error"
    text = f"{noun}, {basis(verification)}: {'; '.join(words) or 'unknown'}"
    lost = lost_joints(verification)
    return f"{text}; {lost}" if lost else text


def lost_joints(verification: Verification) -> str:
    """Words on joints that failed or did not settle in the campaign or in a check; empty if there are none."""
    base = verification.base["status"] == Status.OK
    words = [f"{int((~base).sum())} not settled"] if not base.all() else []
    for name, results in _results(verification).items():
        bad = int((base & (results["status"] != Status.OK)).sum())
        words += [f"{bad} not settled in {name}"] if bad else []
    return ", ".join(words)
