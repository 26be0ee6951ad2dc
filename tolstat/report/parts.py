"""Joints one by one, such as measured ones: loads against limits, loads of the shafts, lives of the bearings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign.replay import CaseResult
from tolstat.common.loads import FloatArray, loads_of, units_of_loads
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Part, Sentence, Table
from tolstat.joint import joints_of
from tolstat.joint.bearing import FOR_LIFE
from tolstat.questions.bearing_life.lives import places_of
from tolstat.questions.bearing_life.rated import HOUR, rated, turning_of
from tolstat.store.view import View
from tolstat.study import Study

OF_SHAFTS = ("axial", "lateral", "moment", "bearing_a", "bearing_b")
"""Kinds of loads of shafts that are shown, with limits or without."""
MOST = 3
"""Maximum number of joints that are shown, side by side."""


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
    design = view.store.design
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
        What the lives follow from, see `rated.turning_of`.
    labels : sequence of str
        Name of each joint, (n,). Of more than `MOST` joints the table shows those nearest to a limit.
    status : ndarray, (n,)
        `Status` of each joint.
    """
    hours, bearing = lives(study, turning), study.joint.bearing
    if not (study.limits or hours):
        return []
    required = bearing.required_life if hours and bearing else None
    limits = study.limits | ({} if required is None else {list(hours)[-1]: required / HOUR})
    units, values = units_of_loads(study.mechanism) | dict.fromkeys(hours, "h"), {**loads, **hours}
    table = np.where(np.isin(status, VALID), np.array(list(values.values())), np.nan)
    limit = np.array([[limits.get(name, np.nan)] for name in values])
    with np.errstate(divide="ignore"):
        use = np.where([[name in hours] for name in values], limit / table, table / limit)
    nearest = np.argsort(-np.nan_to_num(use, nan=-1.0).max(axis=0), kind="stable").tolist()
    shown = (nearest if limits and len(labels) > MOST else range(len(labels)))[:MOST]
    rows, seen = [], []
    for name, own, of, ratios in zip(values, limit[:, 0], table, use, strict=True):
        same = {"quantity": name, "unit": units[name], "limit": float(own)}
        rows += [{"joint": label} | same | {"value": float(of[k])} for k, label in enumerate(labels)]
        beyond = " short" if name in hours else " above"
        cells = {labels[k]: f"{text.value(of[k], units[name])}{beyond * bool(ratios[k] > 1.0)}" for k in shown}
        seen.append({"load or life": name, "limit": text.value(own, units[name])} | cells)
    columns = [Column(head, itemgetter(head)) for head in seen[0]]
    some = f"{len(shown)} of {len(labels)} joints{', nearest to a limit first' * bool(limits)}"
    title = f"Loads and lives of {some if len(shown) < len(labels) else 'the joints'}"
    found = Table("joints", title, columns, rows, seen=seen)
    if not limits:
        return [found]
    names = {labels[k]: [name for name, ratio in zip(values, use[:, k], strict=True) if ratio > 1.0] for k in nearest}
    lacking = [labels[k] for k in np.flatnonzero(np.isnan(use[~np.isnan(limit[:, 0])]).any(axis=0)).tolist()]
    return [Sentence(_verdict(names, lacking), "lead"), found]


def lives(study: Study, turning: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Rating life of each of `places_of`, h, (n,) each; none of linkages, or without what they need."""
    if study.mechanism.placed:
        return {}
    bearings = [joint.bearing for joint in joints_of(study.joint, study.operation)]
    complete = [bearing for bearing in bearings if bearing is not None and not bearing.lacking(FOR_LIFE)]
    if len(complete) < len(bearings):
        return {}
    names = [f"life of {place}" for place in places_of(study.mechanism).values()]
    return dict(zip(names, rated(complete, np.ones(1), [turning]).hours.T, strict=True))


def _verdict(names: Mapping[str, Sequence[str]], lacking: Sequence[str]) -> str:
    """Joints beyond limits: ``Beyond a limit: 2 of 5 joints: line 2 (cross1.F, psi), line 5 (psi).``.

    Behind it those that are `lacking` a valid load or a rating.
    """
    beyond = [f"{label} ({', '.join(own)})" for label, own in names.items() if own]
    listed = f": {_first(beyond)}" if beyond else ""
    without = f"; {len(lacking)} without a valid load or a rating: {_first(lacking)}" if lacking else ""
    return f"Beyond a limit: {len(beyond) or 'none'} of {len(names)} joints{listed}{without}."


def _first(labels: Sequence[str]) -> str:
    """Join the first labels."""
    return f"{', '.join(labels[:MOST])}{' and others' * (len(labels) > MOST)}"
