"""The same joints at several operating points, taken together: largest loads and the worst status of each joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.sorted_loads import Intervals
from tolstat.common.errors import Fault, InputError
from tolstat.common.load_kinds import SPAN
from tolstat.common.loads import LOAD_FIELDS, LOADS, FloatArray, Limit, Load, Results, split
from tolstat.common.tables import FAILED, RESULT, UNSETTLED, Status, without_results
from tolstat.store.sample_load import frozen
from tolstat.store.verification import Verification

if TYPE_CHECKING:
    from tolstat.store.view import View

_SEVERITY = np.zeros(max(Status) + 1, np.uint8)
for _rank, _states in enumerate(((Status.STATIONARY,), UNSETTLED, FAILED, (Status.PENDING,)), 1):
    _SEVERITY[[int(state) for state in _states]] = _rank


def deciding(status: Sequence[NDArray[np.uint8]]) -> NDArray[np.intp]:
    """Index of the operating point that decides the status of each joint, (n,).

    A joint is pending if it is so anywhere, else failed, unsettled or stationary; ``OK`` only if it is at all points.

    Parameters
    ----------
    status : sequence of (n,) arrays
        Status of the joints at each operating point.
    """
    return np.asarray(np.argmax(_SEVERITY[np.stack(status)], axis=0))


def together(parts: Sequence[Results]) -> dict[str, NDArray[Any]]:
    """Largest loads of the joints over some operating points.

    Parameters
    ----------
    parts : sequence of Results
        Results at each operating point, with `LOAD_FIELDS` at least.

    Returns
    -------
    dict of str to ndarray, shape (n, ...)
        Columns `LOAD_FIELDS`. A load is NaN if it is at one of the points. Ends of intervals are 1, and NaN for
        stationary joints: loads of one kind may have theirs from different points, see `load_of`.
    """
    status = [part["status"] for part in parts]
    found: dict[str, NDArray[Any]] = {"status": np.choose(deciding(status), status)}
    for kind in SPAN:
        found[f"{kind}_max"] = np.maximum.reduce([part[f"{kind}_max"] for part in parts])
        for end in ("lower", "upper"):
            found[f"{kind}_{end}"] = np.where(found["status"] == Status.STATIONARY, np.nan, 1.0)
    return found


def load_of(parts: Sequence[Results], load: Load) -> tuple[FloatArray, NDArray[np.uint8], Intervals]:
    """One load of the joints over some operating points, in arrays that cannot be written to.

    Parameters
    ----------
    parts : sequence of Results
        Results at each operating point, with `LOAD_FIELDS` at least.
    load : Load
        The load.

    Returns
    -------
    values : ndarray, shape (n,)
        Largest value, SI.
    status : ndarray, shape (n,)
        See `deciding`.
    intervals : Intervals
        Those of joints that are stationary at a point: the largest of the lower ends, and of the upper ones.
    """
    status, each = [part["status"] for part in parts], [load.of(part) for part in parts]
    several = len(parts) > 1  # of one point the values are a column of its results, not a copy
    values = np.maximum.reduce(each) if several else each[0]
    decided = np.choose(deciding(status), status) if several else status[0]
    joints = np.flatnonzero(np.logical_or.reduce([own == Status.STATIONARY for own in status]))
    names = [f"{load.kind.key}_{of}" for of in ("max", "lower", "upper")]
    ends = (load.ends({name: part[name][joints] for name in names}) for part in parts)
    lower, upper = (np.maximum.reduce(own) for own in zip(*ends, strict=True))
    intervals = Intervals.of(values[joints], (lower, upper)).among(joints)
    for array in (values, *intervals):
        frozen(array)
    return values, decided, intervals


def limit_of(parts: Mapping[str, NDArray[np.void]], limit: Limit) -> tuple[FloatArray, NDArray[np.uint8]]:
    """Load of a limit, whose names may have operating points, over these: values, (n,), and the status of each joint.

    Parameters
    ----------
    parts : mapping of str to (n,) tables
        Results by operating point, with `LOAD_FIELDS` at least.
    limit : Limit
        The limit; its level is compared with the values.
    """
    found, states = [], []
    for name, level in zip(limit.loads, limit.levels, strict=True):
        where = split(name)[1]
        chosen = [parts[point] for point in where.split("+")] if where else list(parts.values())
        values, status, _ = load_of(chosen, LOADS[split(name)[0]])
        found.append(values if limit.has_one_level else values / level)
        states.append(status)
    return np.maximum.reduce(found), np.choose(deciding(states), states)


def point_of(view: View, name: str) -> str:
    """Operating point at which a load matters most: where most joints exceed its limit, else where it is largest.

    Parameters
    ----------
    view : View
        A campaign.
    name : str
        A load, ``cross1.F`` or ``cross1.F at cruise+start``.

    Returns
    -------
    str
        Name of the point; empty if the file has one without a name.
    """
    at, plain = view.narrowed(name)
    limit = view.load(name).limit

    def rank(part: View) -> tuple[float, float]:
        load = part.load(plain)
        share = 0.0 if limit is None else float(np.nan_to_num(load.above(limit).estimate))
        return share, float(load.valid[int(0.99 * (load.valid.size - 1))]) if load.valid.size else 0.0

    return max(at.parts, key=rank).points[0]


def nominal(parts: Sequence[NDArray[np.void]]) -> NDArray[np.void]:
    """Largest loads of the nominal joint, RESULT (1,), from its rows; (0,) unless it is valid at all points."""
    if not all(len(part) for part in parts):
        return np.empty(0, RESULT)
    found, loads = without_results(1, Status.OK), together(parts)
    for name in LOAD_FIELDS:
        found[name] = loads[name]
    return found


def checks(parts: Sequence[Verification | None]) -> Verification | None:
    """Verifications of several operating points as one, joints one after the other; None if one of them has none."""
    own = [part for part in parts if part is not None]
    if len(own) < len(parts):
        return None
    names = [name for name in own[0].checks if all(name in part.checks for part in own)]
    return Verification(
        own[0].seed,
        np.concatenate([part.rows for part in own]),
        np.concatenate([part.base for part in own]),
        {
            name: own[0].checks[name]._replace(results=np.concatenate([part.checks[name].results for part in own]))
            for name in names
        },
    )


def shares_of_time(view: View) -> FloatArray:
    """Share of the service time at each operating point of a view, (points,); their sum is 1.

    Raises
    ------
    InputError
        When the study does not give the shares of several points.
    """
    shares = np.array([view.store.points[name].share for name in view.points] if len(view.parts) > 1 else [1.0])
    if np.isnan(shares).any():
        remedy = "write share = ... in each [[operation]] and run the study again, which simulates nothing anew"
        remedy += f"; or look at one point: --point {view.points[0]}"
        raise InputError([Fault(str(view.path), "has operating points without a share of the time", remedy)])
    return np.asarray(shares / shares.sum())


def shares_of_revolutions(view: View) -> FloatArray:
    """Share of the revolutions at each operating point: share of the time times speed, (points,); their sum is 1.

    Raises `InputError` as `shares_of_time`.
    """
    speeds = np.array([abs(view.store.points[name].operation.speed) for name in view.points])
    turns = shares_of_time(view) * speeds
    return np.asarray(turns / turns.sum())
