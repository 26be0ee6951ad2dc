"""First-order indices of a load at each input angle, from histories of joints or from joints simulated again."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import sensitivity
from tolstat.analysis.sensitivity import FirstOrder
from tolstat.common.channels import CHANNELS
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import FloatArray
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import Status
from tolstat.questions.causes.indices import scattering
from tolstat.store import revolutions
from tolstat.store.revolutions import Revolutions
from tolstat.store.view import View

JOINTS = 1000
"""Default number of joints evaluated, the first settled ones: some 2 s if they are simulated again."""
MIN_JOINTS = 100
"""Minimum number of joints for shares to be given."""
SPREAD = (0.05, 0.5, 0.95)
"""Shares of the joints at which quantiles of the load are shown."""


class AgainstAngle(NamedTuple):
    """First-order indices of a load at each input angle.

    Attributes
    ----------
    load, unit : str
        ``cross1.F``: the load at an angle, not its largest over the revolution; SI unit.
    logarithm : bool
        Whether the variance of the logarithm is decomposed.
    joints : int
        Number of joints evaluated.
    origin, apart
        As in `revolutions.Revolutions`.
    angles : ndarray, shape (k,)
        Input angles, rad.
    nominal : ndarray, shape (k,)
        Load of the nominal joint; NaN if there is none that settled.
    spread : ndarray, shape (3, k)
        Quantiles of the load over the joints, at the shares `SPREAD`.
    names : tuple of str
        The d errors, in descending order of their share over the revolution.
    first : FirstOrder
        Shares of the variance at each angle, (d, k); variance (k,).
    overall : FirstOrder
        Shares over the whole revolution, (d,).
    """

    load: str
    unit: str
    logarithm: bool
    joints: int
    origin: str
    apart: float
    angles: FloatArray
    nominal: FloatArray
    spread: FloatArray
    names: tuple[str, ...]
    first: FirstOrder
    overall: FirstOrder

    @property
    def quantity(self) -> str:
        """Name of the decomposed quantity: the load, or its logarithm."""
        return f"log {self.load}" if self.logarithm else self.load


def against_angle(
    view: View, loads: Sequence[str], joints: int = JOINTS, logarithmic: Container[str] = ()
) -> list[AgainstAngle]:
    """Find which errors make loads scatter at which input angle.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances, all of the same weight.
    loads : sequence of str
        Keys of `channels.CHANNELS`: ``cross1.F``, ``output.moment``.
    joints : int
        Number of joints evaluated, the first settled ones. Without stored histories they are simulated again.
    logarithmic : container of str
        Loads for which the variance of the logarithm is decomposed.

    Returns
    -------
    list of AgainstAngle
        One for each load.

    Raises
    ------
    InputError
        When a name is not a load over the input angle.
    StoreError
        When the joints are not drawn from tolerances, differ in weight or form a pick-freeze design, or fewer than
        `MIN_JOINTS` have settled.
    """
    for name in loads:
        if name not in CHANNELS:
            raise InputError([Fault(name, "is not a load over the input angle", did_you_mean(name, list(CHANNELS)))])
    nominal, samples = evaluated(view, joints)
    found = revolutions.read(view.store, np.concatenate([nominal, view.slots(samples)]), loads)
    errors = view.errors(samples, sampling.columns(view.study))
    x = scattering(sampling.components(view.study, errors))
    independent = view.design.has_interval("index")
    return [_of_load(x, found, len(nominal), name, independent, name in logarithmic) for name in loads]


def spreads(view: View, loads: Sequence[str], joints: int) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Input angles, rad, and quantiles over the joints at the shares `SPREAD`, (3, k), of the loads of `against_angle`.

    Raises as `against_angle`.
    """
    found = revolutions.read(view.store, view.slots(evaluated(view, joints)[1]), loads)
    return {name: (found.angles, _quantiles(found.loads[name])) for name in loads}


def evaluated(view: View, joints: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """File slots of the nominal joint, (1,), if it settled, else (0,); and the samples that `against_angle` evaluates.

    Raises
    ------
    StoreError
        As `against_angle`.
    """
    view.check_drawn()
    view.check("index")
    if view.study.groups:
        remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(view.path), "holds a pick-freeze design", remedy)))
    samples = np.flatnonzero(view.status == Status.OK)[:joints]
    if len(samples) < MIN_JOINTS:
        too_few = f"has {len(samples)} settled joints to evaluate"
        raise StoreError(str(Fault(str(view.path), too_few, f"{MIN_JOINTS} are needed: run more joints")))
    return view.nominal_slots[view.nominal["status"] == Status.OK], samples


def _of_load(
    errors: dict[str, FloatArray], found: Revolutions, nominal: int, name: str, independent: bool, logarithm: bool
) -> AgainstAngle:
    """Indices of one load; the first `nominal` (0 or 1) joints of `found` are the nominal joint."""
    values = found.loads[name]
    y = values[nominal:]
    x, names = np.column_stack(list(errors.values())), list(errors)
    first, overall = sensitivity.over_revolution(x, np.log(y) if logarithm else y, iid=independent)
    order = np.argsort(-overall.estimate, kind="stable")
    return AgainstAngle(
        load=name,
        unit=CHANNELS[name].unit,
        logarithm=logarithm,
        joints=len(y),
        origin=found.origin,
        apart=found.apart,
        angles=found.angles,
        nominal=values[0] if nominal else np.full(len(found.angles), np.nan),
        spread=_quantiles(y),
        names=tuple(names[i] for i in order),
        first=_sorted(first, order),
        overall=_sorted(overall, order),
    )


def _quantiles(values: FloatArray) -> FloatArray:
    return np.asarray(np.quantile(values, SPREAD, axis=0, method="inverted_cdf"))


def _sorted(indices: FirstOrder, order: NDArray[np.intp]) -> FirstOrder:
    return FirstOrder(indices.estimate[order], indices.lower[order], indices.upper[order], indices.variance)
