"""Which errors make a load scatter at which shaft angle."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import sensitivity
from tolstat.analysis.sensitivity import FirstOrder
from tolstat.common.channels import CHANNELS
from tolstat.common.errors import Fault, InputError
from tolstat.common.shown import shown
from tolstat.common.strict import did_you_mean
from tolstat.questions.causes.ahead import JOINTS, evaluated
from tolstat.questions.causes.query import scattering
from tolstat.store import revolutions
from tolstat.store.revolutions import FloatArray, Revolutions
from tolstat.store.view import View

if TYPE_CHECKING:
    import pandas as pd

SPREAD = (0.05, 0.5, 0.95)
"""Shares of the joints at which quantiles of the load are shown."""


@shown
class AgainstAngle(NamedTuple):
    """First-order indices of a load at each shaft angle.

    Attributes
    ----------
    load, unit : str
        ``cross1.F``: the load at an angle, not its largest over the revolution; SI unit.
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
        Shares of the variance (or of the variance of the logarithm) at each angle, (d, k); variance (k,).
    overall : FirstOrder
        Shares over the whole revolution, (d,).
    """

    load: str
    unit: str
    joints: int
    origin: str
    apart: float
    angles: FloatArray
    nominal: FloatArray
    spread: FloatArray
    names: tuple[str, ...]
    first: FirstOrder
    overall: FirstOrder

    def table(self) -> pd.DataFrame:
        """One row per angle and error: ``theta`` (rad), ``load``, ``unit``, ``std``, ``error``, ``share``, ends."""
        import pandas as pd

        k, d = len(self.angles), len(self.names)
        return pd.DataFrame(
            {
                "theta": np.repeat(self.angles, d),
                "load": self.load,
                "unit": self.unit,
                "std": np.repeat(np.sqrt(self.first.variance), d),
                "error": list(self.names) * k,
                "share": self.first.estimate.T.ravel(),
                "share_lower": self.first.lower.T.ravel(),
                "share_upper": self.first.upper.T.ravel(),
            }
        )


def against_angle(
    view: View, loads: Sequence[str], joints: int = JOINTS, logarithmic: Container[str] = ()
) -> list[AgainstAngle]:
    """Find which errors make loads scatter at which shaft angle.

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
            raise InputError([Fault(name, "is not a load over the shaft angle", did_you_mean(name, list(CHANNELS)))])
    nominal, samples = evaluated(view, joints)
    found = revolutions.read(view.store, np.concatenate([nominal, view.slots(samples)]), loads)
    errors = view.errors(samples, sampling.columns(view.study))
    x = scattering(sampling.components(view.study, errors))
    return [
        _of_load(x, found, len(nominal), name, view.design.has_interval("index"), name in logarithmic) for name in loads
    ]


def _of_load(
    errors: dict[str, FloatArray], found: Revolutions, nominal: int, name: str, iid: bool, log: bool
) -> AgainstAngle:
    """Indices of one load; the first `nominal` (0 or 1) joints of `found` are the nominal joint."""
    values = found.loads[name]
    y = values[nominal:]
    names = list(errors)
    first, overall = sensitivity.over_revolution(
        np.column_stack(list(errors.values())), np.log(y) if log else y, iid=iid
    )
    order = np.argsort(-overall.estimate, kind="stable")
    return AgainstAngle(
        load=name,
        unit=CHANNELS[name].unit,
        joints=len(y),
        origin=found.origin,
        apart=found.apart,
        angles=found.angles,
        nominal=values[0] if nominal else np.full(len(found.angles), np.nan),
        spread=np.quantile(y, SPREAD, axis=0, method="inverted_cdf"),
        names=tuple(names[i] for i in order),
        first=_sorted(first, order),
        overall=_sorted(overall, order),
    )


def _sorted(indices: FirstOrder, order: NDArray[np.intp]) -> FirstOrder:
    return FirstOrder(indices.estimate[order], indices.lower[order], indices.upper[order], indices.variance)
