"""What became of the joints: those without a valid load, and how their errors differ from those of the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tolstat import sampling
from tolstat.analysis import ranks
from tolstat.campaign.remedy import remedy
from tolstat.common.tables import FAILED, UNSETTLED, Status
from tolstat.store.view import View

if TYPE_CHECKING:
    import pandas as pd

MAX_JOINTS = 20_000
"""Number of joints (the first ones) whose errors are compared."""


class WithoutLoad(NamedTuple):
    """A joint without a valid load: its row in the campaign, its status and what to do about it."""

    row: int
    status: str
    remedy: str


def without_load(view: View) -> list[WithoutLoad]:
    """Return the first joints without a valid load, see `View.first_without_load`."""
    samples = np.flatnonzero(np.isin(view.status, (*FAILED, *UNSETTLED)))[: len(view.first_without_load)]
    return [
        WithoutLoad(int(row), Status(int(joint["status"])).label, remedy(joint, view.store.options))
        for row, joint in zip(view.rows(samples), view.first_without_load, strict=True)
    ]


def their_errors(view: View) -> pd.DataFrame | None:
    """Compare the errors of joints without a valid load with those of the others, among the first `MAX_JOINTS`.

    Returns
    -------
    DataFrame, optional
        ``error``, then ``direction`` and ``size`` with ``_lower``, ``_upper`` and ``_p``, `ranks.Part`;
        the error that differs most first. None if there are too few joints of either kind, or if the joints are not
        drawn from tolerances with equal weights.

    Raises
    ------
    InputError, StoreError
        When the study cannot be read.
    """
    import pandas as pd

    if view.design.refuses("difference") or view.study.groups:
        return None
    samples = np.flatnonzero(view.status[:MAX_JOINTS] != Status.PENDING)
    bad = np.isin(view.status[samples], (*FAILED, *UNSETTLED))
    if min(int(bad.sum()), int((~bad).sum())) < ranks.FEWEST:
        return None
    errors = view.errors(samples)
    scores = {name: own for name, own in sampling.normal_scores(view.study, errors).items() if np.ptp(own) > 0}
    z = np.column_stack(list(scores.values()))
    found = ranks.tail(z, bad, iid=view.design.has_interval("difference"))
    columns: dict[str, Any] = {"error": list(scores)}
    for key, part in found._asdict().items():
        columns |= {key: part.estimate, f"{key}_lower": part.lower, f"{key}_upper": part.upper, f"{key}_p": part.p}
    table = pd.DataFrame(columns)
    far = np.maximum(abs(table["direction"] - 0.5), abs(table["size"] - 0.5))
    return table.iloc[np.argsort(-far, kind="stable")].reset_index(drop=True)
