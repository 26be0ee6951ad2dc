"""The joints in the tail of a load, with their errors."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.common import selected_results
from tolstat.common.columns import RESULT_COLUMNS
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import UNIT_OF_LOAD
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import SIMULATED, Status
from tolstat.store import ResultStore
from tolstat.store.recall import recall
from tolstat.store.view import load
from tolstat.study import Study
from tolstat.study.tolerances.distributions import score


class TailJoint(NamedTuple):
    """A joint with a large load.

    Attributes
    ----------
    row : int
        Row of the campaign.
    value : float
        The load, SI.
    status : Status
        Its status; the load of a joint that is not settled is that of the recorded revolution.
    scores : dict of str to float
        Each error with a tolerance, in sigma (`distributions.score`), in descending order of the modulus.
    """

    row: int
    value: float
    status: Status
    scores: dict[str, float]


class Tail(NamedTuple):
    """The joints with the largest values of a load, the largest first, and its SI unit."""

    joints: list[TailJoint]
    unit: str


def worst(store: ResultStore, by: str, n: int = 10, study_path: Path | None = None) -> Tail:
    """Find the joints with the largest load.

    Parameters
    ----------
    store : ResultStore
        The result file.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``), or a column of the results.
    n : int
        Maximum number of joints.
    study_path : Path, optional
        Study file to read if the text in the result file can no longer be read.

    Returns
    -------
    Tail
        At most `n` joints that have results; the nominal joint is not among them, and equal loads come in the order
        of their rows.

    Raises
    ------
    InputError
        When there is no such load, or the study cannot be read any more.
    StoreError
        When the study is not that of the file.
    """
    study = recall(store, path=study_path)
    results = store.results()
    values, unit = _values(results, by)
    _check_kept(store, by)
    counts = np.isin(results["status"], SIMULATED) & np.isfinite(values)
    if study.sampling.nominal_first and store.rows.start == 0:
        counts[0] = False
    rows = np.flatnonzero(counts)
    rows = rows[np.argsort(-values[rows], kind="stable")][:n]
    return Tail(describe(store, study, rows, values[rows], results["status"][rows]), unit)


def describe(
    store: ResultStore, study: Study, rows: NDArray[np.intp], values: NDArray[np.float64], status: NDArray[np.uint8]
) -> list[TailJoint]:
    """Combine the loads of joints with their errors.

    Parameters
    ----------
    store : ResultStore
        The result file.
    study : Study
        Its study.
    rows : ndarray of int, shape (m,)
        File slots of the joints.
    values, status : ndarray, shape (m,)
        Their load and `tables.Status`.
    """
    errors = np.concatenate([store.errors(slice(0, 0)), *(store.errors(slice(row, row + 1)) for row in rows)])
    scores = {name: score(d, sampling.values(errors, name)) for name, d in study.tolerances.items()}
    joints = []
    for i, row in enumerate(rows):
        own = {name: float(z[i]) for name, z in scores.items()}
        ordered = dict(sorted(own.items(), key=lambda item: -abs(item[1])))
        joints.append(TailJoint(store.rows[row], float(values[i]), Status(status[i]), ordered))
    return joints


def _values(results: NDArray[np.void], by: str) -> tuple[NDArray[np.float64], str]:
    if by in UNIT_OF_LOAD:
        return load(results, by)
    columns = {c.name: c for c in RESULT_COLUMNS}
    if by not in columns:
        remedy = did_you_mean(by, [*UNIT_OF_LOAD, *columns])
        raise InputError([Fault("--by", f"{by!r} is neither a load nor a column of the results", remedy)])
    return columns[by].of(results).astype(np.float64), columns[by].unit


def _check_kept(store: ResultStore, by: str) -> None:
    """Raise `InputError` if the study does not keep the load or column."""
    held = [c.name for c in store.columns]
    loads = [load for load in UNIT_OF_LOAD if selected_results.holds(store.columns, load)]
    if by not in (*loads, *held):
        found = f"{store.path} does not keep {by}, see [output] results of its study"
        raise InputError([Fault("--by", found, f"give one of: {', '.join([*loads, *held])}")])
