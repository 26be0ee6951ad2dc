"""A study that lists its joints: largest loads of every joint, and their change due to its errors (Gamma)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import accuracy
from tolstat.campaign.remedy import remedy
from tolstat.common.columns import holds
from tolstat.common.load_kinds import BUSHINGS
from tolstat.common.tables import Status
from tolstat.display.answer import Answer, Part, Row, Rows, Sentence, Table, plain
from tolstat.questions.shares import inapplicable, rows_of
from tolstat.solver import refinement
from tolstat.store import Reader, recorded, verification
from tolstat.store.view import View

RANKED = ("status", "alpha [deg]", "period")
"""Columns that a narrow terminal leaves out, the last first."""


def cases(view: View) -> Answer:
    """Compare the largest loads of the listed joints.

    Parameters
    ----------
    view : View
        A file of a study whose method is ``cases``.

    Returns
    -------
    Answer
        Table ``cases``, one row per joint: ``variant``, the ``values`` that define it, ``note``, ``alpha [deg]``,
        ``case``, ``status``, ``period``, ``revolutions``, ``cost`` (`refinement.work` relative to the first joint),
        ``remedy``; force and torque of each bushing, SI, and their Gamma, eq. (14), per cent; loads that the study does
        not keep are left out. If the file holds a comparison with the reference (``tolstat verify``), also
        ``reference`` (status of the reference simulation, empty for joints that were not compared),
        ``reference_change`` (its closure), ``error_F`` and ``error_T`` (error of the largest load of the worst bushing,
        relative to the largest of the kind).

    Raises
    ------
    NotApplicable
        When the study lists no joints.
    """
    store = view.store
    if not store.case_names:
        raise inapplicable(view, "does not list its joints", "give the result file of a study that lists its joints")
    rows = _rows(store)
    seen = [_worst(row) for row in rows]
    title, counts = "Change of the loads by the errors of each joint", store.counts()
    parts: list[Part] = [Table("cases", title, plain(seen, RANKED), rows, seen=seen)]
    parts.append(Sentence(f"{counts.done} of {counts.total} joints, {counts.shortfall}"))
    parts += [Sentence(f"{row['variant']}, {row['case']}: {row['remedy']}") for row in rows if row["remedy"]]
    return Answer("cases", "Listed joints", parts)


def _rows(store: Reader) -> Rows:
    design, results = store.design(), store.results()
    work = refinement.work(results)
    variants = [store.variants[i] for i in design["variant"]]
    columns: dict[str, Sequence[Any]] = {
        "variant": [variant.family for variant in variants],
        "values": ["; ".join(f"{key} = {value}" for key, value in variant.values.items()) for variant in variants],
        "note": [variant.note for variant in variants],
        "alpha [deg]": np.degrees(recorded.operating_points(store)["alpha"]).tolist(),
        "case": [store.case_names[i] for i in design["case"]],
        "status": [Status(int(code)).label for code in results["status"]],
        "period": results["period"].tolist(),
        "revolutions": results["revolutions"].tolist(),
        "cost": (work / max(1.0, float(work[0]))).tolist(),
    }
    set_by_variants = (
        {key.removeprefix("solver."): value for key, value in variant.values.items() if key.startswith("solver.")}
        for variant in variants
    )
    columns["remedy"] = [remedy(row, store.options | keys) for row, keys in zip(results, set_by_variants, strict=True)]
    gamma = relative_errors(results, design["group"])
    for b, bushing in enumerate(BUSHINGS):
        for load, (letter, unit) in enumerate((("F", "N"), ("T", "N*m"))):
            if holds(store.columns, f"{bushing}.{letter}"):
                columns[f"{bushing}.{letter} [{unit}]"] = results[f"{letter}_max"][:, b].tolist()
                columns[f"{bushing}.Gamma_{letter} [%]"] = gamma[:, b, load].tolist()
    return rows_of(columns | _reference(store))


def relative_errors(results: NDArray[np.void], group: NDArray[np.int32]) -> NDArray[np.float64]:
    """Compare the largest loads of each joint with those of the first joint of its group: Gamma.

    Cirelli, Rossi, Valentini and Pennestri (2021), eq. (14).

    Parameters
    ----------
    results : ndarray of RESULT, shape (n,)
        Joints; the first of a group is the one without errors.
    group : ndarray of int, shape (n,)
        Group number of each joint; joints of a group differ in their errors only.

    Returns
    -------
    ndarray, shape (n, 8, 2)
        Relative difference in per cent, signed: force, torque. NaN unless the joint and the first of its group are OK.
    """
    loads = np.stack([results["F_max"], results["T_max"]], axis=-1)
    loads[results["status"] != Status.OK] = np.nan
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    return np.asarray(100.0 * (loads / loads[first[inverse]] - 1.0))


def _reference(store: Reader) -> dict[str, Sequence[Any]]:
    """Columns that compare every joint with the tight reference; none if the file holds no comparison."""
    verified = verification.read(store)
    if verified is None or accuracy.REFERENCE not in verified.checks:
        return {}
    true, slots = verified.checks[accuracy.REFERENCE].results, store.slot(verified.rows)
    columns = {"reference": np.full(store.n, "", object)}
    columns |= {key: np.full(store.n, np.nan) for key in ("reference_change", "error_F", "error_T")}
    columns["reference"][slots] = [Status(int(code)).label for code in true["status"]]
    columns["reference_change"][slots] = true["closure"]
    error = accuracy.by_kind(accuracy.differences(verified.base, true))
    columns["error_F"][slots], columns["error_T"][slots] = error[:, 0], error[:, 1]
    return {name: values.tolist() for name, values in columns.items()}


def _worst(row: Row) -> dict[str, Any]:
    """Row for people: Gamma of the largest modulus among the bushings kept, signed, for force and for torque."""
    short = {key: row[key] for key in ("variant", "alpha [deg]", "case", "status", "period")}
    for head in ("Gamma_F [%]", "Gamma_T [%]"):
        if gamma := [row[name] for bushing in BUSHINGS if (name := f"{bushing}.{head}") in row]:
            short[head] = max(gamma, key=lambda x: -1.0 if np.isnan(x) else abs(x))
    return short
