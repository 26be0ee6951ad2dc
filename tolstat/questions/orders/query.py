"""Amplitudes of the shafts' loads at multiples of the input speed, and orbits of their lateral forces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import RESULT_COLUMNS
from tolstat.common.errors import Fault, StoreError
from tolstat.common.load_kinds import LOAD_KINDS, SHAFTS
from tolstat.common.loads import LOADS, load_of
from tolstat.common.shown import shown
from tolstat.common.tables import VALID, Status
from tolstat.solver.compilation import warm_up
from tolstat.solver.simulation import simulate_rows
from tolstat.store.recorded import options_of, parameters
from tolstat.store.sample_load import CONFIDENCE
from tolstat.store.view import View

if TYPE_CHECKING:
    import pandas as pd

SHARES = {"5": 0.05, "median": 0.5, "95": 0.95}
"""Shares of the joints at which quantiles of an amplitude are given, by column."""
NEAR = {"median": 0.5, "95 %": 0.95}
"""Quantiles of the lateral force next to which a joint's orbit is shown, by name."""


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
    force : ndarray, shape (k, 2)
        Components f_x, f_y, N, at the input angles 2 pi i / k; y lies along the fork's pins at an input angle of 90
        deg.
    """

    shaft: str
    near: str
    row: int
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
        are NaN for dependent samples and infinite where joints are too few.
    orbits : list of Orbit
        Of each shaft the nominal joint and those of `NEAR`; empty at several operating points, and for a shaft whose
        lateral force the study does not keep.
    again : bool
        Whether the joints of the orbits were simulated again, since the file holds no full histories.
    """

    name: str
    joints: int
    left_out: int
    table: pd.DataFrame
    orbits: list[Orbit]
    again: bool


def orders_of(view: View, orbits: bool = True, confidence: float = CONFIDENCE) -> Orders:
    """Estimate the amplitudes of the shafts' loads at multiples of the input speed over the joints.

    Parameters
    ----------
    view : View
        A campaign.
    orbits : bool
        Whether to read the orbits of lateral forces, too; without full histories their joints are simulated again.
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

    kept = [name for name in view.kept_loads if LOADS[name].kind.orders]
    names = sorted(kept, key=lambda name: LOAD_KINDS.index(LOADS[name].kind))
    if not names:
        remedy = 'let [output] results of the study select them, such as "*_1x_max", and run it again'
        raise StoreError(str(Fault(str(view.path), "holds no amplitudes of orders", remedy)))
    joints = view.count(*VALID)
    if not joints:
        raise StoreError(str(Fault(str(view.path), "has no joint with a valid result", "resume the campaign")))
    table = pd.DataFrame([_amplitude(view, name, confidence) for name in names])
    drawn = _orbits(view) if orbits and len(view.parts) == 1 else []
    again = bool(drawn) and "shafts" not in view.store.history_specs
    return Orders(view.name, joints, view.counts.done - joints, table, drawn, again)


def are_asked(view: View) -> bool:
    """Whether the study asks for loads of the shafts or orders: by a limit, or by selecting them among its results."""
    chosen = view.kept_loads if len(view.columns) < len(RESULT_COLUMNS) else ()
    asked = [load_of(name) for name in (*view.limits, *chosen)]
    return any(load.kind.orders or load.place.group == "shaft" for load in asked)


def _amplitude(view: View, name: str, confidence: float) -> dict[str, Any]:
    """One row of `Orders.table`."""
    load, kind = view.load(name), LOADS[name].kind
    place, order = LOADS[name].place.name, kind.orders[LOADS[name].element % len(kind.orders)]
    quantity = f"{place}.{kind.symbol}" if place else kind.symbol
    row: dict[str, Any] = {"quantity": quantity, "noun": kind.noun, "order": order, "load": name, "unit": load.unit}
    row["nominal"] = load.nominal
    for key, share in SHARES.items():
        found = load.quantile(share, confidence)
        row |= {f"q{key}": found.estimate, f"q{key}_lower": found.lower, f"q{key}_upper": found.upper}
    return row


def _orbits(view: View) -> list[Orbit]:
    """Orbits of each shaft whose lateral force is kept; joints that several orbits show are read once."""
    places = [(shaft, near, slot) for shaft in SHAFTS for near, slot in _shown(view, f"{shaft}.lateral")]
    slots = np.unique(np.array([slot for *_, slot in places], np.intp))
    forces = dict(zip(slots.tolist(), _forces(view, slots), strict=True))
    rows = dict(zip(slots.tolist(), view.store.row(slots).tolist(), strict=True))
    return [Orbit(shaft, near, rows[slot], forces[slot][:, SHAFTS.index(shaft)]) for shaft, near, slot in places]


def _shown(view: View, name: str) -> list[tuple[str, int]]:
    """Which joints' orbits are shown for a lateral force, and their file slots."""
    if name not in view.kept_loads:
        return []
    nominal = view.nominal_slots[view.nominal["status"] == Status.OK][:1]
    load = view.load(name)
    found = [("nominal", int(slot)) for slot in nominal]
    for near, share in NEAR.items():
        sample = np.nanargmin(np.abs(load.valid_or_nan - load.quantile(share).estimate))
        found.append((near, int(view.slots([sample])[0])))
    return found


def _forces(view: View, slots: NDArray[np.intp]) -> list[NDArray[np.float64]]:
    """Lateral forces of the shafts of joints, (k, 2, 2) each: shaft, f_x and f_y."""
    store = view.store
    if "shafts" in store.history_specs:
        return list(store.histories("shafts", slots)[..., :2].astype(float))
    if slots.size:
        warm_up()
    runs = (
        simulate_rows(parameters(store, slots[i : i + 1]), options_of(store, s), "full")
        for i, s in enumerate(slots.tolist())
    )
    return [run.histories["shafts"][0, ..., :2].astype(float) for run in runs]
