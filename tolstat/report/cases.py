"""A study that lists its joints: largest loads of every joint, and how far its errors have moved them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from tolstat.analysis import paper
from tolstat.tables import BUSHINGS, Status

if TYPE_CHECKING:
    from tolstat.store import ResultStore


def table(store: ResultStore) -> pd.DataFrame:
    """Largest loads and Gamma of every joint of the study.

    Parameters
    ----------
    store : ResultStore
        File of a study whose method is ``cases``.

    Returns
    -------
    DataFrame
        One row a joint: ``variant``, what makes it (``values``), ``alpha [deg]``, ``case``, ``status``; force and
        torque of each bushing, SI, and their Gamma, eq. (14), per cent.
    """
    design, results, alpha = store.design(), store.results(), store.errors()["operation.alpha"]
    variants = [store.variants[i] for i in design["variant"]]
    columns: dict[str, object] = {
        "variant": [variant.family for variant in variants],
        "values": ["; ".join(f"{key} = {value}" for key, value in variant.values.items()) for variant in variants],
        "alpha [deg]": np.degrees(alpha),
        "case": [store.case_names[i] for i in design["case"]],
        "status": [Status(int(code)).label for code in results["status"]],
    }
    gamma = paper.gamma(results, design["group"])
    for b, bushing in enumerate(BUSHINGS):
        for load, (letter, unit) in enumerate((("F", "N"), ("T", "N*m"))):
            columns[f"{bushing}.{letter} [{unit}]"] = results[f"{letter}_max"][:, b]
            columns[f"{bushing}.Gamma_{letter} [%]"] = gamma[:, b, load]
    return pd.DataFrame(columns)


def worst(full: pd.DataFrame) -> pd.DataFrame:
    """Short form of `table`: of all bushings the largest change of force and of torque, with its sign."""
    short = full[["variant", "alpha [deg]", "case", "status"]].copy()
    for letter in "FT":
        gamma = full[[f"{bushing}.Gamma_{letter} [%]" for bushing in BUSHINGS]].to_numpy(float)
        size = np.where(np.isnan(gamma), -1.0, np.abs(gamma))
        short[f"Gamma_{letter} [%]"] = gamma[np.arange(len(gamma)), size.argmax(axis=1)]
    return short
