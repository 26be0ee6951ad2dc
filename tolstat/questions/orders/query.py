"""Amplitudes of the shafts' loads at multiples of the input speed, and orbits of their lateral forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.sample import CONFIDENCE
from tolstat.common.columns import RESULT_COLUMNS
from tolstat.common.errors import Fault, StoreError
from tolstat.common.load_kinds import LOAD_KINDS, SHAFTS
from tolstat.common.loads import LOADS, load_of
from tolstat.common.shown import shown
from tolstat.common.tables import VALID
from tolstat.store import revolutions
from tolstat.store.points import point_of
from tolstat.store.view import View

if TYPE_CHECKING:
    import pandas as pd

SHARES = {"5": 0.05, "median": 0.5, "95": 0.95}
"""Shares of the joints at which quantiles of an amplitude are given, by column."""
NEAR = {"median": 0.5, "95 %": 0.95}
"""Quantiles of the largest lateral force; the orbit of the joint nearest to each is shown."""


@shown
class Orbit(NamedTuple):
    """Lateral force on a shaft over the last revolution, in axes that do not turn.

    Attributes
    ----------
    shaft : str
        ``"input"`` or ``"output"``.
    near : str
        Which joint: ``"nominal"``, or the name in `NEAR` of the quantile that its largest lateral force is nearest to.
    row : int
        Row of the joint in the campaign.
    point : str
        Operating point: of several the one at which the lateral force matters most.
    force : ndarray, shape (k, 2)
        Components f_x (in the plane of both shafts) and f_y (normal to it), N, at equally spaced input angles from 0.
    """

    shaft: str
    near: str
    row: int
    point: str
    force: NDArray[np.float64]


@shown
class Orders(NamedTuple):
    """Orders of the shafts' loads.

    Attributes
    ----------
    name : str
        Name of the study.
    joints, left_out : int
        Joints with and without a valid result, those pending not counted.
    table : DataFrame
        One row per quantity and order that the study keeps, SI: ``quantity`` (``input.lateral``), ``noun``, ``order``,
        ``load`` (``input.lateral_2x``), ``unit``; ``nominal`` (NaN without a nominal joint); ``q5``, ``qmedian``,
        ``q95`` (amplitude that this share of the joints does not exceed), each with ``_lower`` and ``_upper``, which
        are NaN for dependent samples; too few joints give 0 and infinity.
    orbits : list of Orbit
        Of each shaft whose lateral force the study keeps, the nominal joint and those of `NEAR`.
    origin : str
    apart : float
        Source of the orbits, as in `revolutions.Revolutions`; empty without orbits.
    """

    name: str
    joints: int
    left_out: int
    table: pd.DataFrame
    orbits: list[Orbit]
    origin: str
    apart: float


def orders_of(view: View, orbits: bool = True, confidence: float = CONFIDENCE) -> Orders:
    """Estimate the amplitudes of the shafts' loads at multiples of the input speed over the joints.

    Parameters
    ----------
    view : View
        A campaign.
    orbits : bool
        Whether to read the orbits of lateral forces, too; without histories of them their joints are simulated again.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    Orders

    Raises
    ------
    StoreError
        When the study keeps no amplitude, no joint has a valid result, or the file holds levels of a subset simulation.
    InputError
        When a joint has to be simulated again and this version cannot read the file's joint or options.
    """
    import pandas as pd

    names = [name for name in view.kept_loads if LOADS[name].kind.orders]
    if not names:
        remedy = 'let [output] results of the study select them, such as "*_1x_max", and run it again'
        raise StoreError(str(Fault(str(view.path), "holds no amplitudes of orders", remedy)))
    joints = view.count(*VALID)
    if not joints:
        raise StoreError(str(Fault(str(view.path), "has no joint with a valid result", "resume the campaign")))
    names.sort(key=lambda name: LOAD_KINDS.index(LOADS[name].kind))
    table = pd.DataFrame([_amplitude(view, name, confidence) for name in names])
    found, origin, apart = _orbits(view) if orbits else ([], "", 0.0)
    return Orders(view.name, joints, view.counts.done - joints, table, found, origin, apart)


def are_asked(view: View) -> bool:
    """Whether the study asks for loads of the shafts or orders: by a limit, or by selecting them among its results."""
    selected = view.kept_loads if len(view.columns) < len(RESULT_COLUMNS) else ()
    asked = [load_of(name) for name in (*view.limits, *selected)]
    return any(load.kind.orders or load.place.group == "shaft" for load in asked)


def _amplitude(view: View, name: str, confidence: float) -> dict[str, Any]:
    """One row of `Orders.table`."""
    load, kind = view.load(name), LOADS[name].kind
    order = kind.orders[LOADS[name].element % len(kind.orders)]
    quantity = ".".join(filter(None, (LOADS[name].place.name, kind.symbol)))
    row = {"quantity": quantity, "noun": kind.noun, "order": order, "load": name, "unit": load.unit}
    row["nominal"] = load.nominal
    for key, share in SHARES.items():
        found = load.quantile(share, confidence)
        ends = {"lower": float(np.maximum(found.lower, 0.0)), "upper": found.upper}
        row |= {f"q{key}": found.estimate} | {f"q{key}_{end}": value for end, value in ends.items()}
    return row


def _orbits(view: View) -> tuple[list[Orbit], str, float]:
    """Orbits of each shaft whose lateral force is kept, their source, and how far from the stored values."""
    found, origin, apart = [], "", 0.0
    for shaft in SHAFTS:
        name = f"{shaft}.lateral"
        if name not in view.kept_loads or not view.load(name).valid.size:
            continue
        at = view.at(point_of(view, name))
        for near, slot in _near(at, name).items():
            force, origin, off = _force(at, slot, shaft)
            apart = max(apart, off)
            found.append(Orbit(shaft, near, int(at.store.row(slot)), at.points[0], force))
    return found, origin, apart


def _force(view: View, slot: int, shaft: str) -> tuple[NDArray[np.float64], str, float]:
    """Lateral force on a shaft, (k, 2), its source, and how far the joint is from the stored values."""
    names = [f"{shaft}.f_x", f"{shaft}.f_y"]
    samples = int(view.store.options["steps_per_rev"])
    found = revolutions.read(view.store, np.array([slot]), names, samples)
    return np.column_stack([found.loads[name][0] for name in names]), found.origin, found.apart


def _near(view: View, name: str) -> dict[str, int]:
    """File slots of the joints whose orbits are shown for a lateral force, by `Orbit.near`."""
    load = view.load(name)
    found = {"nominal": int(view.nominal_slots[0])} if view.nominal_slots.size else {}
    for near, share in NEAR.items():
        apart = np.abs(load.values - load.quantile(share).estimate)
        if np.isfinite(apart).any():
            found[near] = int(view.slots(np.nanargmin(apart)))
    return found
