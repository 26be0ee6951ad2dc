"""Pairs that matter: what of the clearance the errors of a pin and its hole use up together, against the load.

A load comes of a pin's errors against its hole's, so single errors hardly explain it. What matters is relative: the
tilt of a pin against that of its hole, and how far the two axes of the cross miss those of the forks, each as a share
of the clearance. The cross is free to move along z and to turn about both of its axes, so of the four relative offsets
along z one combination is left that no motion takes up: that of pins 1 and 2 against that of pins 3 and 4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.ranks import ranks
from tolstat.common.errors import Fault, StoreError
from tolstat.common.load_kinds import PINS
from tolstat.common.loads import FloatArray
from tolstat.common.shown import shown
from tolstat.joint import HOLE_OF_PIN, perturb
from tolstat.store import points
from tolstat.store.view import View

MOST = 4000
"""Number of joints used, the first ones."""
FEWEST = 200
"""Minimum number of valid joints."""
MISSED = "offsets along z"
"""Name of the combination of offsets that no motion of the cross takes up."""


@shown
class Pairs(NamedTuple):
    """Load against the combination of errors that orders the joints best.

    Attributes
    ----------
    load, unit : str
        The load, and its SI unit.
    limit : float
        Its limit, SI; NaN without one.
    points : tuple of str
        Operating points over which the load is the largest; ``("",)`` for one without a name.
    worst : str
        The one of these at which most joints exceed the limit, or else at which the load is largest.
    name : str
        The combination, chosen on the joints with an even number.
    use, values : ndarray, shape (n,)
        Share of the clearance that the combination uses, and load, SI, of the joints with an odd number.
    correlation : float
        Spearman's rank correlation of `use` and `values`.
    single : float
        Largest magnitude of the correlation of the load and a single error, or its distance from the mean, chosen and
        found in the same way.
    others : dict of str to float
        Correlation of each combination, in descending order of that of the joints with an even number.
    """

    load: str
    unit: str
    limit: float
    points: tuple[str, ...]
    worst: str
    name: str
    use: FloatArray
    values: FloatArray
    correlation: float
    single: float
    others: dict[str, float]


def pairs_of(view: View, by: str) -> Pairs:
    """Find the combination of a pin's errors and its hole's that orders the joints best by a load.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances, all of the same weight.
    by : str
        A load that can have a limit (``cross1.F``, ``fork2.T``).

    Returns
    -------
    Pairs

    Raises
    ------
    InputError
        When there is no such load, or the study does not keep it.
    StoreError
        When joints are not drawn from tolerances, differ in weight, or too few are valid.

    Examples
    --------
    >>> with tolstat.open(path) as store:  # doctest: +SKIP
    ...     tolstat.pairs_of(store.view(), "fork1.F").name
    """
    view.check_drawn()
    view.check("index")
    load = view.load(by)
    samples = np.flatnonzero(load.is_valid)[:MOST]
    if samples.size < FEWEST or np.ptp(load.values[samples]) == 0.0:
        found = f"has {samples.size} joints with a valid {by} that scatters"
        raise StoreError(str(Fault(str(view.path), found, f"run {FEWEST} joints or more")))
    errors, values = view.errors(samples), load.values[samples]
    point = points.point_of(view, by)
    chosen, seen = slice(None, None, 2), slice(1, None, 2)
    # what is taken of the parameters, clearances and stations, is the same at every operating point
    used = combinations(errors, perturb(view.study.joint, view.at(point).store.operation, errors))
    rank = sorted(used, key=lambda name: -_spearman(used[name][chosen], values[chosen]))
    best = rank[0]
    scattering = [errors[name] for name in _scattering(errors)]
    single = [*scattering, *(np.abs(error - error.mean()) for error in scattering)]
    one = max(single, key=lambda error: abs(_spearman(error[chosen], values[chosen])))
    return Pairs(
        load=by,
        unit=load.unit,
        limit=np.nan if load.limit is None else load.limit,
        points=view.narrowed(by)[0].points,
        worst=point,
        name=best,
        use=used[best][seen],
        values=values[seen],
        correlation=_spearman(used[best][seen], values[seen]),
        single=abs(_spearman(one[seen], values[seen])),
        others={name: _spearman(used[name][seen], values[seen]) for name in rank},
    )


def combinations(errors: NDArray[np.void], params: NDArray[np.void]) -> dict[str, FloatArray]:
    """Shares of the clearance that relative errors of pins and holes use, by what they are in words.

    Parameters
    ----------
    errors : ndarray of ERROR, shape (n,)
        Errors of joints.
    params : ndarray of PARAM, shape (n,)
        Their clearances, and the stations of their contacts.

    Returns
    -------
    dict of str to ndarray, (n,)
        1 where the clearance is used up.
    """
    clearance = np.maximum(params["clearance"], 1e-9).T
    reach = np.abs(params["station_s"]).max(axis=1)

    def relative(name: str) -> FloatArray:
        return np.array([errors[f"{HOLE_OF_PIN[pin]}.{name}"] - errors[f"{pin}.{name}"] for pin in PINS])

    along_z, about_t, about_z = relative("offset_z"), relative("tilt_t"), relative("tilt_z")
    missed = np.abs(along_z[:2].sum(axis=0) - along_z[2:].sum(axis=0)) / clearance.sum(axis=0)
    of_t, of_both = np.abs(about_t) * reach / clearance, np.hypot(about_t, about_z) * reach / clearance
    found = {
        "largest tilt of a pin against its hole about t": of_t.max(axis=0),
        "largest tilt of a pin against its hole": of_both.max(axis=0),
        MISSED: missed,
        f"{MISSED} plus mean tilt about t": missed + of_t.mean(axis=0),
        f"{MISSED} plus largest tilt about t": missed + of_t.max(axis=0),
        f"{MISSED} plus largest tilt": missed + of_both.max(axis=0),
    }
    for place, pin in enumerate(PINS):
        hole = HOLE_OF_PIN[pin]
        found[f"tilt of {pin} against {hole} about t"] = of_t[place]
        found[f"{MISSED} plus tilt of {pin} against {hole}"] = missed + of_both[place]
    return found


def _scattering(errors: NDArray[np.void]) -> list[str]:
    return [name for name in errors.dtype.names or () if np.ptp(errors[name]) > 0.0]


def _spearman(x: FloatArray, y: FloatArray) -> float:
    """Rank correlation; 0 if one of the two does not scatter."""
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    a, b = ranks(np.column_stack([x, y])).T
    return float(np.corrcoef(a, b)[0, 1])
