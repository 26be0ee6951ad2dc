"""Pairs that matter: what of the clearance the errors of a pin and its hole use up together, against the load.

A load comes of a pin's errors against its hole's, so single errors hardly explain it. What matters is relative: the
tilt of a pin against that of its hole, and how far the two axes of the cross miss those of the forks, each as a share
of the clearance. The cross is free to move along z and to turn about both of its axes, so of the four relative offsets
along z one combination is left that no motion takes up: that of pins 1 and 2 against that of pins 3 and 4.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.ranks import ranks
from tolstat.common.errors import NotApplicable
from tolstat.common.load_kinds import PINS
from tolstat.common.loads import FloatArray, unit_text
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Part, Sentence, Table
from tolstat.display.options import Load
from tolstat.joint import HOLE_OF_PIN, perturb
from tolstat.questions.shares import unusable, word
from tolstat.store.view import View

MOST = 4000
"""Number of joints used, the first ones."""
FEWEST = 200
"""Minimum number of valid joints."""
MISSED = "offsets along z"
"""Name of the combination of offsets that no motion of the cross takes up."""
MATTERS = 0.3
"""Rank correlation of the best combination below which it does not matter, and the page does not show it."""
MOST_USED = 0.1
"""Share of the joints, those that use most of the clearance, whose share above the limit is told."""
CHOSEN, SHOWN = slice(None, None, 2), slice(1, None, 2)
"""Joints on which the combination is chosen, and those that correlations and pictures are of."""
LISTED = 5
"""Number of combinations that people see."""
COLUMNS = (
    Column("rank correlation", lambda row: f"{row['correlation']:+.2f}", words=True),
    Column("share of the clearance used by", word("name"), words=True),
)
HOW = (
    "Chosen on the joints with an even number, so that it need not be the first of the table; picture and "
    "correlations are of the others. Errors are those of a hole less those of its pin; a tilt counts by what it "
    "takes at the ends of the pin. Offsets along z: what is left of the four after the cross has moved and turned, "
    "the middle of pins 1 and 2 against that of pins 3 and 4."
)


def pairs(view: View, by: Load = None) -> Answer:
    """Find which errors of pin and hole together cause a load.

    A joint binds where errors of a pin against its hole use up the clearance. Gives the combinations of tilts and
    offsets whose share of the clearance orders the joints best by the load, and how often joints that use most of it
    exceed the limit.

    Example: tolstat pairs iso2768_f.h5 --by cross1.F

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    by : str, optional
        Load, such as cross1.F or fork2.T; by default the one whose limit most joints exceed.

    Returns
    -------
    Answer
        Table ``combinations``: ``name`` and rank ``correlation`` with the load over the joints with an odd number, in
        descending order of that of the joints with an even number. Table ``joints``, those with an odd number:
        ``use``, share of the clearance that the first combination uses, and ``value`` of the load. Facts: ``load``,
        ``unit``, ``limit`` (NaN without one); ``points`` over which the load is the largest, and ``worst`` of them;
        ``name`` and ``correlation`` of the first combination, ``single``: largest magnitude of the correlation of the
        load and a single error, or its distance from the mean, chosen and found in the same way.

    Raises
    ------
    InputError
        When there is no such load, or the study does not keep it.
    StoreError
        When joints are not drawn from tolerances, or too few are valid.
    """
    view.check_drawn()
    view.check("index")
    load = view.load(by or view.most_exceeded)
    samples = np.flatnonzero(load.is_valid)[:MOST]
    if samples.size < FEWEST or np.ptp(load.values[samples]) == 0.0:
        few = f"has {samples.size} joints with a valid {load.name} that scatters"
        raise unusable(view, few, f"run {FEWEST} joints or more")
    errors, values, point = view.errors(samples), load.values[samples], view.point_of(load.name)
    # what is taken of the parameters, clearances and stations, is the same at every operating point
    used = combinations(errors, perturb(view.study.joint, view.at(point).store.operation, errors))
    rank = sorted(used, key=lambda name: -_spearman(used[name][CHOSEN], values[CHOSEN]))
    use, shown = used[rank[0]][SHOWN], values[SHOWN]
    rows: list[dict[str, Any]] = [{"name": name, "correlation": _spearman(used[name][SHOWN], shown)} for name in rank]
    facts = {"load": load.name, "unit": load.unit, "limit": math.nan if load.limit is None else load.limit}
    facts |= {"points": list(view.narrowed(load.name)[0].points), "worst": point, **rows[0]}
    facts["single"] = _largest_single(errors, values)
    joints = [{"use": u, "value": v, "unit": load.unit} for u, v in zip(use.tolist(), shown.tolist(), strict=True)]
    listed = sorted(rows[:LISTED], key=lambda row: -row["correlation"])
    parts: list[Part] = [
        Sentence(_finding(facts, use, shown), "lead"),
        Panels([_panel(facts, use, shown)]),
        Table("combinations", "The best combinations", COLUMNS, rows, seen=listed),
        Table("joints", "Load and share of the clearance used", (), joints, {"use": "1"}),
        Sentence(HOW),
    ]
    return Answer("pairs", "Errors of pin and hole together", parts, facts)


def pairs_on_page(view: View, asked: Asked) -> Answer:
    """Pairs that matter for the load with the limit exceeded most; none where a single error tells more than a pair."""
    if not (view.sampled and view.limits and view.leading) or view.design.refuses("index"):
        raise NotApplicable
    with asked.noting("no pairs of errors"):
        answer = pairs(view)
        if answer.facts["correlation"] >= max(MATTERS, answer.facts["single"]):
            return answer
    raise NotApplicable


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
    used = {
        "largest tilt of a pin against its hole about t": of_t.max(axis=0),
        "largest tilt of a pin against its hole": of_both.max(axis=0),
        MISSED: missed,
        f"{MISSED} plus mean tilt about t": missed + of_t.mean(axis=0),
        f"{MISSED} plus largest tilt about t": missed + of_t.max(axis=0),
        f"{MISSED} plus largest tilt": missed + of_both.max(axis=0),
    }
    for i, pin in enumerate(PINS):
        used[f"tilt of {pin} against {HOLE_OF_PIN[pin]} about t"] = of_t[i]
        used[f"{MISSED} plus tilt of {pin} against {HOLE_OF_PIN[pin]}"] = missed + of_both[i]
    return used


def _largest_single(errors: NDArray[np.void], values: FloatArray) -> float:
    """Magnitude of the correlation of the load and the single error, or its distance from the mean, that tells most."""
    scattering = [errors[name] for name in errors.dtype.names or () if np.ptp(errors[name]) > 0.0]
    single = [*scattering, *(np.abs(error - error.mean()) for error in scattering)]
    best = max(single, key=lambda error: abs(_spearman(error[CHOSEN], values[CHOSEN])))
    return abs(_spearman(best[SHOWN], values[SHOWN]))


def _spearman(x: FloatArray, y: FloatArray) -> float:
    """Rank correlation; 0 if one of the two does not scatter."""
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    a, b = ranks(np.column_stack([x, y])).T
    return float(np.corrcoef(a, b)[0, 1])


def _finding(facts: Mapping[str, Any], use: FloatArray, values: FloatArray) -> str:
    """What the best combination is, and what it tells of joints above the limit."""
    load, name, limit = facts["load"], facts["name"], facts["limit"]
    sentences = (
        f"{load} comes of errors of pins against their holes: a joint binds where they use up its clearance. What "
        f"tells most is {name}"
    )
    if facts["correlation"] < facts["single"]:
        sentences = f"A single error tells more of {load} than any combination; of these, {name} tells most"
    sentences += (
        f", as a share of the clearance: rank correlation with the load {facts['correlation']:.2f}, where that of the "
        f"best single error is {facts['single']:.2f}."
    )
    if not math.isnan(limit):
        above, first = values[np.argsort(-use)] > limit, max(1, round(MOST_USED * use.size))
        sentences += (
            f" Of the tenth of the joints that use most of the clearance {text.percent(above[:first].mean())} exceed "
            f"the limit, of the others {text.percent(above[first:].mean())}."
        )
    if len(facts["points"]) > 1:
        sentences += f" {load} is the largest over {', '.join(facts['points'])}; it is most severe at {facts['worst']}."
    return sentences


def _panel(facts: Mapping[str, Any], use: FloatArray, values: FloatArray) -> Panel:
    load, limit, has_limit = facts["load"], facts["limit"], not math.isnan(facts["limit"])

    def draw(ax: Axes) -> None:
        above, unit = values > limit, unit_text(facts["unit"])  # nowhere without a limit
        for here, colour, label in ((~above, style.COLOURS[0], "within the limit"), (above, style.COLOURS[1], "above")):
            ax.plot(
                use[here], values[here], "o", color=colour, ms=3.4, alpha=0.6, mew=0, label=label if has_limit else None
            )
        if values.min() > 0.0 and values.max() > 3.0 * np.median(values):
            low, high = 0.9 * values.min(), 1.1 * values.max()
            unit = drawing.log_loads(ax.yaxis, low, high, high, facts["unit"])
        ax.set_xlim(0.0, None)
        ax.set(xlabel=f"clearance used by {facts['name']}", ylabel=f"{load} [{unit}]")
        if has_limit:
            ax.axhline(limit, color=style.INK, lw=1.2, ls=(0.0, (8.0, 3.0)), label="limit")

    description = f"{facts['name']}: rank correlation {facts['correlation']:.2f} over {use.size} joints"
    title, size = f"{load} against the share of the clearance used", (drawing.WIDTH, 3.6)
    return Panel(f"pairs-{load}", title, description, draw, size)
