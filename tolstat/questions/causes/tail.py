"""The joints with the largest values of a load, with their errors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import RESULT_COLUMNS
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import LOADS
from tolstat.common.shown import shown
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import SIMULATED, Status
from tolstat.store.view import View


@shown
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
    point : str
        Operating point with the largest value; empty where there is one only.
    scores : dict of str to float
        Each error that scatters, in sigma (`sampling.normal_scores`), in descending order of the modulus.
    """

    row: int
    value: float
    status: Status
    point: str
    scores: dict[str, float]


@shown
class Tail(NamedTuple):
    """The joints with the largest values of a load.

    Attributes
    ----------
    by, unit : str
        The load, or the column of the results; its SI unit.
    samples : ndarray of int, shape (m,)
        Samples, the largest value first.
    joints : list of TailJoint
        The same joints.
    """

    by: str
    unit: str
    samples: NDArray[np.intp]
    joints: list[TailJoint]


def worst_joints(view: View, by: str, n: int = 10) -> Tail:
    """Find the joints with the largest load.

    Parameters
    ----------
    view : View
        A campaign.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``), or a column of the results; of some
        operating points ``cross1.F at cruise``.
    n : int
        Maximum number of joints.

    Returns
    -------
    Tail
        At most `n` joints that have results; the nominal joint is not among them, and equal loads come in the order
        of their rows.

    Raises
    ------
    InputError
        When there is no such load, the study does not keep it, or the study cannot be read any more.
    StoreError
        When the study is not that of the file.
    """
    narrowed, name = view.narrowed(by)
    samples, values, unit = _largest(narrowed, name, n)
    points = _points(narrowed, name, samples)
    return Tail(by, unit, samples, _with_errors(narrowed, samples, values, points))


def worst_samples(view: View, by: str, n: int) -> NDArray[np.intp]:
    """Samples of the joints that `worst_joints` finds, without their errors."""
    return _largest(*view.narrowed(by), n)[0]


def _largest(view: View, by: str, n: int) -> tuple[NDArray[np.intp], NDArray[np.float64], str]:
    """Samples of the `n` joints with the largest values, the largest first; these values, and their unit."""
    values, unit = _values(view, by)
    samples = np.flatnonzero(np.isin(view.status, SIMULATED) & np.isfinite(values))
    samples = samples[np.argsort(-values[samples], kind="stable")][:n]
    return samples, values[samples], unit


def _points(view: View, by: str, samples: NDArray[np.intp]) -> list[str]:
    """Operating point with the largest value in each joint; a load, unless there is one point only."""
    if len(view.parts) == 1:
        return [view.points[0]] * len(samples)
    each = np.stack([LOADS[by].of(part.results)[samples] for part in view.parts])
    return [view.points[k] for k in np.argmax(each, axis=0)]


def _with_errors(
    view: View, samples: NDArray[np.intp], values: NDArray[np.float64], points: list[str]
) -> list[TailJoint]:
    """Combine the values of joints with their errors."""
    from tolstat import sampling

    ascending, place = np.unique(samples, return_inverse=True)
    errors = view.errors(ascending, sampling.columns(view.study))[place]
    scores = sampling.normal_scores(view.study, errors)
    joints = []
    for i, row in enumerate(view.rows(samples).tolist()):
        own = {name: float(z[i]) for name, z in scores.items()}
        ordered = dict(sorted(own.items(), key=lambda item: -round(abs(item[1]), 9)))  # equal ones as they come
        joints.append(TailJoint(row, float(values[i]), Status(view.status[samples[i]]), points[i], ordered))
    return joints


def _values(view: View, by: str) -> tuple[NDArray[np.float64], str]:
    """Values of a load or of a column of the results, (n,), and their unit."""
    columns = {column.name: column for column in view.columns}
    if by in view.kept_loads:
        return LOADS[by].of(view.results), LOADS[by].unit
    if by in columns:
        values = columns[by].of(view.read_results([columns[by].field]))
        return values.astype(np.float64), columns[by].unit
    if by in LOADS or by in [column.name for column in RESULT_COLUMNS]:
        found = f"is not kept in {view.path}, see [output] results of its study"
        raise InputError([Fault(by, found, f"give one of: {', '.join([*view.kept_loads, *columns])}")])
    remedy = did_you_mean(by, [*view.kept_loads, *columns])
    raise InputError([Fault(by, "is neither a load nor a column of the results", remedy)])
