"""The joint on the page: with the place of a load marked, from all sides, and the errors of the worst joints, drawn."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from tolstat.common.load_kinds import PLACES
from tolstat.common.loads import load_of
from tolstat.common.tables import SIMULATED
from tolstat.display import text
from tolstat.display.answer import Answer, Part, Sentence
from tolstat.display.asked import Asked
from tolstat.display.blocks import Panel, Panels
from tolstat.display.joint_drawing import sheets
from tolstat.questions.drawings import joints
from tolstat.store.points import point_of
from tolstat.store.recorded import joint_of
from tolstat.store.view import View

LEGEND = (
    "The joint from its own dimensions. Marked: the bushings, pins and shafts of the leading loads. Loads of cross1–4 "
    "act on the pins, those of fork1–4 on the arms; their components are along and about the axes e, t, z of each."
)
"""Text below the drawings of the joint."""
WORST = "Pins and holes stand where their errors have them. To draw another joint: tolstat show FILE --row ROW"
"""Text below the drawings of the worst joints."""


def place_of(view: View, load: str, asked: Asked) -> Panel | None:
    """Drawing of the joint in the view that shows the place of a load, which is marked; None if it cannot be read.

    Parameters
    ----------
    view : View
        A campaign.
    load : str
        The load; empty for a view without a mark.
    asked : Asked
        Takes a note if there is no drawing.
    """
    with asked.noting("the joint is not drawn"):
        place = load_of(load).place if load else PLACES[""]
        front, side = _joint(view, [place.name], load)
        title = "The joint"
        if load:
            own, title = view.load(load), f"{place.name or load}: the largest loads"
            if own.limit is not None:
                often = "most often above" if own.above(own.limit).count else "nearest to"
                title = f"{place.name or load}: {often} its limit"
            title += f", at {point_of(view, load)}" if len(view.points) > 1 else ""
        return replace(side if place.view == "side" else front, key="joint-worst", title=title)
    return None


def _joint(view: View, marked: Collection[str], load: str) -> tuple[Panel, Panel]:
    """Drawings of the joint at the operating point at which a load matters most; at the first one without a load."""
    point = point_of(view, load) if load else view.points[0]
    d = joints.dimensions(joint_of(view.store, 0), view.at(point).store.operation.alpha)
    front, side = sheets.joint(d, marked)
    return front, replace(side, title=f"{side.title}, at {point}") if point else side


def drawings(view: View) -> Answer:
    """Draw the joint, its errors and its worst rows.

    Parameters
    ----------
    view : View
        A campaign.

    Returns
    -------
    Answer
        Pictures: the joint from all sides, with the places of the leading loads marked; the kinds of its errors; errors
        of the joints with the largest leading loads, enlarged.
    """
    marked = sorted({load_of(name).place.name for name in view.leading} - {""})
    joint = joint_of(view.store, 0)
    kinds = sheets.errors(joints.positive(joint), joints.dimensions(joint, 0.0))
    parts: list[Part] = [Panels([*_joint(view, marked, next(iter(view.leading), "")), kinds]), Sentence(LEGEND)]
    if view.method != "sweep" and (worst := _worst(view)):
        parts += [Panels(worst), Sentence(WORST)]
    return Answer("drawings", "The joint and its errors, drawn", parts)


def _worst(view: View) -> list[Panel]:
    """One drawing for each joint that has the largest of a leading load."""
    loads: dict[int, list[str]] = {}
    for name in view.leading:
        load = view.load(name)
        values = np.where(np.isin(load.status, SIMULATED), load.values, np.nan)
        sample = int(np.nanargmax(values))
        loads.setdefault(sample, []).append(f"{name} {text.value(float(values[sample]), load.unit)}")
    panels = []
    for sample, said in loads.items():
        joint, row = joint_of(view.store, int(view.slots(sample))), int(view.rows(sample))
        pairs, d = joints.pairs(joint, view.errors(np.array([sample]))), joints.dimensions(joint, 0.0)
        panels.append(sheets.one(pairs, d, f"Row {row}: {', '.join(said)}", f"drawn-{row}"))
    return panels
