"""Joints one by one, such as measured ones: loads against limits, loads of the shafts, lives of the bearings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign.replay import CaseResult
from tolstat.common.loads import FloatArray, loads_of, units_of_loads
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Part, Row, Sentence, Table
from tolstat.joint import Bearing
from tolstat.joint.bearing import FOR_LIFE
from tolstat.questions.bearing_life.lives import HOUR, rated, turning_of
from tolstat.store.view import View
from tolstat.study import Study

OF_SHAFTS = ("axial", "lateral", "moment", "bearing_a", "bearing_b")
"""Kinds of loads of shafts that are shown, with limits or without."""
MOST = 3
"""Maximum number of joints that are shown, side by side."""


class Quantity(NamedTuple):
    """A load or a life of n joints.

    Attributes
    ----------
    name, unit : str
        Its name and unit; hours of a life.
    limit : float
        What loads must not exceed, and lives must reach; NaN where none is given.
    values : ndarray, shape (n,)
        NaN without a result or a rating.
    """

    name: str
    unit: str
    limit: float
    values: FloatArray

    @property
    def use(self) -> FloatArray:
        """Load over limit, or required life over life, (n,): above 1 the joint is beyond the limit."""
        with np.errstate(divide="ignore"):
            return self.limit / self.values if self.unit == "h" else self.values / self.limit


def names_of(limits: Mapping[str, float], mechanism: Mechanism) -> list[str]:
    """Loads that are shown: those with limits, and those of the shafts."""
    of_shafts = [name for name, load in loads_of(mechanism).items() if load.kind.key in OF_SHAFTS]
    return list(dict.fromkeys([*limits, *of_shafts]))


def of_case(case: Study, result: CaseResult) -> Answer:
    """Answer on the joint of a case beside the same joint without errors, see `parts`."""
    both, every = np.concatenate([result.simulation.results, result.nominal]), loads_of(case.mechanism)
    loads = {name: every[name].of(both) for name in names_of(case.limits, case.mechanism)}
    turning = {name: np.repeat(result.params[name], 2, axis=0) for name in ("alpha", "omega")}
    turning["equivalent_load"] = both["equivalent_load"]
    return Answer("simulate", "Joint", parts(case, loads, turning, ["this joint", "without errors"], both["status"]))


def of_listed(view: View) -> list[Part]:
    """Parts of an answer on the joints that a study lists, see `parts`."""
    loads = {name: view.load(name).values for name in names_of(view.limits, view.mechanism) if name in view.kept_loads}
    design = view.store.design()
    labels = [view.store.case_names[number] for number in design["case"]]
    if len(set(design["group"])) > 1:
        labels = [f"{label} ({number})" for number, label in enumerate(labels)]
    return parts(view.study, loads, turning_of(view.store), labels, view.status)


def parts(
    study: Study,
    loads: Mapping[str, FloatArray],
    turning: Mapping[str, FloatArray],
    labels: Sequence[str],
    status: NDArray[np.uint8],
) -> list[Part]:
    """Sentence on the limits, and a table of loads and lives; none without limits and rating lives.

    Parameters
    ----------
    study : Study
        Limits, and bearings.
    loads : mapping
        Loads of n joints, SI, (n,) each.
    turning : mapping
        What the lives follow from, see `lives.turning_of`.
    labels : sequence of str
        Name of each joint, (n,). Of more than `MOST` joints the table shows those nearest to a limit.
    status : ndarray, (n,)
        `Status` of each joint.
    """
    of_bearings, units = lives(study.joint.bearing, turning), units_of_loads(study.mechanism)
    if not (study.limits or of_bearings):
        return []
    of_loads = [Quantity(name, units[name], study.limits.get(name, np.nan), of) for name, of in loads.items()]
    valid, shown = np.isin(status, VALID), list(range(len(labels)))
    found = [each._replace(values=np.where(valid, each.values, np.nan)) for each in [*of_loads, *of_bearings]]
    verdict: list[Part] = []
    if limited := [each for each in found if not np.isnan(each.limit)]:
        use = np.nan_to_num(np.array([each.use for each in limited]), nan=-1.0)
        shown = np.argsort(-use.max(axis=0), kind="stable").tolist() if len(labels) > MOST else shown
        verdict.append(Sentence(_verdict(limited, use, [(labels[k], k) for k in shown]), "lead"))
    columns = [
        Column("load or life", lambda row: str(row["quantity"].name)),
        Column("limit", lambda row: text.value(row["quantity"].limit, row["quantity"].unit)),
        *(Column(labels[k], partial(_cell, k)) for k in shown[:MOST]),
    ]
    rows = [
        {"joint": label, "quantity": each.name, "unit": each.unit, "limit": each.limit, "value": value}
        for each in found
        for label, value in zip(labels, each.values.tolist(), strict=True)
    ]
    seen = [{"quantity": each} for each in found]
    return [*verdict, Table("joints", "Loads and lives of the joints", columns, rows, seen=seen)]


def lives(bearing: Bearing | None, turning: Mapping[str, FloatArray]) -> list[Quantity]:
    """Rating lives of the pins' bearings and of the joint; none without what they need."""
    if bearing is None or bearing.lacking(FOR_LIFE):
        return []
    hours = rated(bearing, np.ones(1), [turning])[1].T
    required = np.nan if bearing.required_life is None else bearing.required_life / HOUR
    of_pins = [Quantity(f"life of pin{i}", "h", np.nan, of_pin) for i, of_pin in enumerate(hours[:-1], 1)]
    return [*of_pins, Quantity(f"life of all {text.in_words(len(of_pins))}", "h", required, hours[-1])]


def _cell(number: int, row: Row) -> str:
    of: Quantity = row["quantity"]
    beyond = (" short" if of.unit == "h" else " above") if of.use[number] > 1.0 else ""
    return f"{text.value(float(of.values[number]), of.unit)}{beyond}"


def _verdict(limited: Sequence[Quantity], use: FloatArray, joints: Sequence[tuple[str, int]]) -> str:
    """Joints beyond limits: ``Beyond a limit: 2 of 5 joints: line 2 (cross1.F, psi), line 5 (psi).``."""
    names = [[each.name for each, ratio in zip(limited, use[:, k], strict=True) if ratio > 1.0] for _, k in joints]
    beyond = [f"{label} ({', '.join(own)})" for (label, _), own in zip(joints, names, strict=True) if own]
    listed = f": {', '.join(beyond[:MOST])}{' and others' * (len(beyond) > MOST)}" if beyond else ""
    lacking = int((use < 0.0).any(axis=0).sum())
    without = f"; {lacking} without a valid load or a rating" if lacking else ""
    return f"Beyond a limit: {len(beyond) or 'none'} of {len(joints)} joints{listed}{without}."
