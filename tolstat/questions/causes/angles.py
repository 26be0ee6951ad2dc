"""Which errors make a load scatter at which shaft angle."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import sensitivity
from tolstat.analysis.sensitivity import FirstOrder
from tolstat.common.draw_records import check_equal_weights
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import BUSHINGS, Status
from tolstat.questions.causes.query import scattering
from tolstat.store import ResultStore
from tolstat.store.revolutions import FloatArray, Revolutions, read
from tolstat.study import Study

JOINTS = 1000
"""Default number of joints evaluated, the first valid ones: some 2 s if they are simulated again."""
FEWEST = 100
"""Minimum number of joints for shares to be given."""
DRAWN = ("random", "sobol", "lhs")
SPREAD = (0.05, 0.5, 0.95)
"""Shares of the joints at which quantiles of the load are shown."""


class AgainstAngle(NamedTuple):
    """First-order indices of a load at each shaft angle.

    Attributes
    ----------
    load, unit : str
        ``cross1.F``: the modulus of the bushing's force at an angle, not its largest over the revolution; SI unit.
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


def of_store(
    store: ResultStore,
    study: Study,
    loads: Sequence[str],
    joints: int = JOINTS,
    logarithmic: Container[str] = (),
) -> list[AgainstAngle]:
    """Find which errors make bushing loads scatter at which shaft angle.

    Parameters
    ----------
    store : ResultStore
        The result file of a campaign of joints drawn from tolerances.
    study : Study
        Its study.
    loads : sequence of str
        ``cross1.F`` to ``fork4.T``.
    joints : int
        Number of joints evaluated, the first valid ones. Without stored histories they are simulated again.
    logarithmic : container of str
        Loads for which the variance of the logarithm is decomposed.

    Returns
    -------
    list of AgainstAngle
        One for each load.

    Raises
    ------
    InputError
        When a name is not the load of a bushing.
    StoreError
        When the joints are not drawn from tolerances, or fewer than `FEWEST` are valid.
    """
    known = [f"{bushing}.{letter}" for bushing in BUSHINGS for letter in "FT"]
    for name in loads:
        if name not in known:
            raise InputError([Fault(name, "is no load over the shaft angle", did_you_mean(name, known))])
    check_equal_weights(store.sampling, store.path)
    if store.sampling["method"] not in DRAWN or not study.tolerances:
        remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(store.path), "holds joints that are not drawn from tolerances", remedy)))
    skip = int(bool(store.sampling["nominal_first"]) and store.rows.start == 0)
    status = store.status()
    rows = skip + np.flatnonzero(status[skip:] == Status.OK)[:joints]
    if len(rows) < FEWEST:
        found = f"{len(rows)} valid joints are looked at"
        raise StoreError(str(Fault(str(store.path), found, f"{FEWEST} are needed: run more joints")))
    nominal = np.zeros(int(skip and status[0] == Status.OK), np.intp)
    both = read(store, np.concatenate([nominal, rows]))
    errors = store.errors(slice(int(rows[-1]) + 1))[rows]
    iid = store.sampling["method"] == "random"
    x = {name: sampling.values(errors, name) for name in scattering(study, errors)}
    return [_of_load(x, both, len(nominal), name, iid, name in logarithmic) for name in loads]


def _of_load(
    errors: dict[str, FloatArray], both: Revolutions, skip: int, name: str, iid: bool, log: bool
) -> AgainstAngle:
    bushing, _, letter = name.partition(".")
    values = (both.F if letter == "F" else both.T)[:, :, BUSHINGS.index(bushing)]
    y = values[skip:]
    names = list(errors)
    first, overall = sensitivity.over_revolution(
        np.column_stack(list(errors.values())), np.log(y) if log else y, iid=iid
    )
    order = np.argsort(-overall.estimate, kind="stable")
    return AgainstAngle(
        load=name,
        unit="N" if letter == "F" else "N*m",
        joints=len(y),
        origin=both.origin,
        apart=both.apart,
        angles=both.angles,
        nominal=values[0] if skip else np.full(len(both.angles), np.nan),
        spread=np.quantile(y, SPREAD, axis=0, method="inverted_cdf"),
        names=tuple(names[i] for i in order),
        first=_sorted(first, order),
        overall=_sorted(overall, order),
    )


def _sorted(indices: FirstOrder, order: NDArray[np.intp]) -> FirstOrder:
    return FirstOrder(indices.estimate[order], indices.lower[order], indices.upper[order], indices.variance)
