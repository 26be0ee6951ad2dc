"""A study that lists its joints: largest loads of every joint, and their change due to its errors (Gamma)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from tolstat.analysis import accuracy
from tolstat.analysis.gamma import gamma as relative_errors
from tolstat.campaign.remedy import remedy
from tolstat.common import selected_results
from tolstat.common.load_kinds import BUSHINGS
from tolstat.common.tables import Motion, Status
from tolstat.solver import refinement
from tolstat.store import recorded, verification
from tolstat.study.design import IDEAL

if TYPE_CHECKING:
    from tolstat.common.tables import Variant
    from tolstat.store import Reader


def table(store: Reader) -> pd.DataFrame:
    """Largest loads and Gamma of every joint of the study.

    Parameters
    ----------
    store : ResultFile
        File of a study whose method is ``cases``.

    Returns
    -------
    DataFrame
        One row per joint: ``variant``, the ``values`` that define it, ``note``, ``alpha [deg]``, ``case``, ``status``,
        ``motion``, ``revolutions``, ``cost`` (`refinement.work` relative to the first joint), ``remedy``; force and
        torque of each bushing, SI, and their Gamma, eq. (14), per cent; loads that the study does not keep are left
        out. If the file holds a comparison with the reference (``tolstat verify``), also the columns of `reference`.
    """
    design, results, alpha = store.design(), store.results(), recorded.operating_points(store)["alpha"]
    work = refinement.work(results)
    variants = [store.variants[i] for i in design["variant"]]
    columns: dict[str, object] = {
        "variant": [variant.family for variant in variants],
        "values": ["; ".join(f"{key} = {value}" for key, value in variant.values.items()) for variant in variants],
        "note": [variant.note for variant in variants],
        "alpha [deg]": np.degrees(alpha),
        "case": [store.case_names[i] for i in design["case"]],
        "status": [Status(int(code)).label for code in results["status"]],
        "motion": [_motion(row) for row in results],
        "revolutions": results["revolutions"],
        "cost": work / max(1.0, float(work[0])),
        "remedy": [remedy(row, store.options | _own(v, "solver")) for row, v in zip(results, variants, strict=True)],
    }
    gamma = relative_errors(results, design["group"])
    for b, bushing in enumerate(BUSHINGS):
        for load, (letter, unit) in enumerate((("F", "N"), ("T", "N*m"))):
            if not selected_results.holds(store.columns, f"{bushing}.{letter}"):
                continue
            columns[f"{bushing}.{letter} [{unit}]"] = results[f"{letter}_max"][:, b]
            columns[f"{bushing}.Gamma_{letter} [%]"] = gamma[:, b, load]
    return pd.DataFrame(columns | reference(store))


def reference(store: Reader) -> dict[str, object]:
    """Compare every joint with the tight reference.

    Parameters
    ----------
    store : ResultFile
        File of the study.

    Returns
    -------
    dict of str to ndarray, shape (n,)
        ``error_F``, ``error_T``: error of the largest load of the worst bushing, relative to the largest of the kind;
        NaN for joints that did not settle or without a reference result. ``reference``: status of the reference
        simulation, empty for joints that were not compared. ``reference_change``: closure of the reference. The
        dictionary is empty if the file holds no comparison.
    """
    found = verification.read(store)
    if found is None or accuracy.REFERENCE not in found.checks:
        return {}
    true = found.checks[accuracy.REFERENCE].results
    error, change, state = np.full((store.n, 2), np.nan), np.full(store.n, np.nan), np.full(store.n, "", object)
    slots = store.slot(found.rows)
    error[slots] = accuracy.by_kind(accuracy.differences(found.base, true))[:, :2]
    change[slots] = true["closure"]
    state[slots] = [Status(int(code)).label for code in true["status"]]
    return {"reference": state, "reference_change": change, "error_F": error[:, 0], "error_T": error[:, 1]}


def _motion(row: np.void) -> str:
    motion = Motion(int(row["motion"]))
    return f"{motion.label} {row['period']}" if motion == Motion.SUBHARMONIC else motion.label


def _own(variant: Variant, section: str) -> dict[str, Any]:
    """Values of a variant in one section of the study, by key."""
    return {k.partition(".")[2]: value for k, value in variant.values.items() if k.startswith(f"{section}.")}


def markdown(full: pd.DataFrame) -> str:
    """Markdown form of `table`: why each joint is difficult, and its results.

    One line per joint: status, largest force and torque, their errors if known, and its cost relative to the first
    joint.
    """
    heads = ["joint", "what makes it hard", "status", "motion", "revolutions", "max F (N)", "max T (N m)", "cost"]
    checked = "reference" in full
    heads += ["error of F", "error of T"] if checked else []
    lines = [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
    force, torque = (full[_of_bushings(full, load)].max(axis=1) for load in ("F [N]", "T [N*m]"))
    for i, row in enumerate(full.to_dict("records")):
        name = row["variant"] if row["case"] == IDEAL else f"{row['variant']}, {row['case']}"
        note = row["note"] if row["case"] == IDEAL else ""
        numbers = (f"{x:.3g}" for x in (row["revolutions"], force[i], torque[i], row["cost"]))
        cells = [name, note, row["status"], row["motion"], *numbers, *(_errors(row) if checked else [])]
        lines.append(f"| {' | '.join(cells)} |".replace("nan", "–"))
    return "\n".join(lines) + "\n"


def _of_bushings(full: pd.DataFrame, what: str) -> list[str]:
    return [name for bushing in BUSHINGS if (name := f"{bushing}.{what}") in full.columns]


def _errors(row: Mapping[Any, Any]) -> list[str]:
    """Cells with the errors of F and T, or the reason why they are missing."""
    if not row["reference"]:
        return ["nothing to compare" if row["status"] != Status.OK.label else "not compared", "nan"]
    if row["reference"] == Status.NEWTON_FAILED.label:
        return ["reference gave up", "nan"]
    wanders = f" ± {row['reference_change']:.0e}" if row["reference"] == Status.NOT_SETTLED.label else ""
    return [f"{row[key]:.0e}{wanders}" for key in ("error_F", "error_T")]


def advice(full: pd.DataFrame) -> list[str]:
    """One line for each joint with a remedy: its name, and what to do."""
    loose = full[full["remedy"] != ""]
    return [f"{row['variant']}, {row['case']}: {row['remedy']}" for row in loose.to_dict("records")]


def worst(full: pd.DataFrame) -> pd.DataFrame:
    """Short form of `table`: Gamma of the largest modulus among the bushings kept, signed, for force and for torque."""
    short = full[["variant", "alpha [deg]", "case", "status", "motion"]].copy()
    for letter in "FT":
        columns = _of_bushings(full, f"Gamma_{letter} [%]")
        if not columns:
            continue
        gamma = full[columns].to_numpy(float)
        size = np.where(np.isnan(gamma), -1.0, np.abs(gamma))
        short[f"Gamma_{letter} [%]"] = gamma[np.arange(len(gamma)), size.argmax(axis=1)]
    return short
