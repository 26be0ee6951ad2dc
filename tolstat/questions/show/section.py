"""The joint on the page: a legend of the loads that the verdict names, and the errors of the worst joints, drawn."""

from __future__ import annotations

import numpy as np

from tolstat.common.loads import split
from tolstat.common.tables import SIMULATED
from tolstat.display import text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Panel, Panels, Section, Text
from tolstat.display.joint_drawing import sheets
from tolstat.questions.show import query
from tolstat.store.recorded import joint_of
from tolstat.store.view import View

LEGEND = (
    "The joint from its own dimensions. Marked: the bushings and pins of the leading loads. Loads of cross1–4 act on "
    "the pins, those of fork1–4 on the arms; their components are along and about the axes e, t, z of each."
)
"""Text below the drawings of `legend`."""


def legend(view: View, asked: Asked) -> list[Panel]:
    """Drawings of the joint in which bushings and pins of the leading loads stand out; empty if it cannot be read."""
    with asked.noting("the joint is not drawn"):
        alpha = view.parts[0].store.operation.alpha
        marked = sorted({split(name)[0].rpartition(".")[0] for name in view.leading} - {""})
        return list(sheets.joint(query.dimensions(joint_of(view.store, 0), alpha), marked))
    return []


def sections(view: View, asked: Asked) -> list[Section]:
    """Errors of the joints with the largest leading loads, enlarged; none for a sweep or without such joints."""
    if view.method == "sweep":
        return []
    with asked.noting("the worst joints are not drawn"):
        panels = _worst(view)
        if not panels:
            return []
        joint = joint_of(view.store, 0)
        kinds = sheets.errors(query.positive(joint), query.dimensions(joint, 0.0))
        said = "Pins and holes stand where their errors have them. To draw another joint: tolstat show FILE --row ROW"
        return [Section("drawn", "The worst joints, drawn", [Panels([*panels, kinds]), Text(said, small=True)])]
    return []


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
        errors = view.errors(np.array([sample]))
        d = query.dimensions(joint, 0.0)
        panels.append(sheets.one(query.pairs(joint, errors), d, f"Row {row}: {', '.join(said)}", f"drawn-{row}"))
    return panels
