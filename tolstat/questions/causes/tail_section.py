"""The worst joints on the page: their errors, and their loads over the revolution."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from tolstat.common.channels import CHANNELS
from tolstat.common.loads import FloatArray, unit_text
from tolstat.display import drawing, style, text
from tolstat.display.blocks import Block, Panel, Panels, Section, Table, Text
from tolstat.questions.causes import angles_figure
from tolstat.questions.causes.ahead import DRAWN
from tolstat.questions.causes.angles import AgainstAngle
from tolstat.questions.causes.tail import Tail, worst_joints
from tolstat.store import revolutions
from tolstat.store.view import View

JOINTS = 8
"""Number of worst joints listed for each load."""
ANGLES = 180
"""Number of input angles drawn, if the histories have as many samples."""
SPREAD = "5 to 95 %"
"""Label of the loads of all joints."""
ERRORS = 4
"""Number of errors listed for each joint."""


class _Histories(NamedTuple):
    """One load of the worst joints over the revolution.

    Attributes
    ----------
    tail : Tail
        The worst joints.
    angles : ndarray, shape (k,)
        Input angles, rad.
    loads : ndarray, shape (m, k)
        Load of the first m of the worst joints, SI.
    all_joints : AgainstAngle, optional
        The load of all joints.
    limit : float, optional
        Limit of the load, SI.
    """

    tail: Tail
    angles: FloatArray
    loads: FloatArray
    all_joints: AgainstAngle | None
    limit: float | None


def section(view: View, loads: Sequence[str], against: Sequence[AgainstAngle], histories: bool) -> Section:
    """Section of the joints with the largest of some loads.

    Parameters
    ----------
    view : View
        A campaign.
    loads : sequence of str
        The loads.
    against : sequence of AgainstAngle
        Loads of all joints against the shaft angle, drawn with those of the worst joints.
    histories : bool
        Whether to draw loads over the revolution; without stored histories the joints are simulated again.
    """
    tails = [worst_joints(view, load, JOINTS) for load in loads]
    panels = [_history_panel(_histories(view, tail, against)) for tail in tails if histories and tail.by in CHANNELS]
    blocks: list[Block] = [Panels(panels)] if panels else []
    blocks += [_table(tail) for tail in tails]
    at = " --point POINT" if len(view.points) > 1 else ""
    blocks.append(Text(f"To simulate one of them again: tolstat replay FILE --row ROW{at} --out trace.csv", small=True))
    return Section("worst", "The worst joints", blocks)


def _table(tail: Tail) -> Table:
    rows = []
    for joint in tail.joints:
        errors = ",  ".join(f"{name} {z:+.1f} σ" for name, z in list(joint.scores.items())[:ERRORS])
        point = [joint.point] if joint.point else []
        rows.append([str(joint.row), text.value(joint.value, tail.unit), *point, joint.status.label, errors])
    at = ["at"] if any(joint.point for joint in tail.joints) else []
    head = ["row", tail.by, *at, "status", "largest errors, in standard deviations"]
    return Table(f"Largest {tail.by}", head, rows, frozenset({0, *range(2, len(head))}))


def _histories(view: View, tail: Tail, against: Sequence[AgainstAngle]) -> _Histories:
    ascending, place = np.unique(tail.samples[:DRAWN], return_inverse=True)
    found = revolutions.read(view.store, view.slots(ascending), [tail.by], ANGLES)
    all_joints = next((angle for angle in against if angle.load == tail.by), None)
    return _Histories(tail, found.angles, found.loads[tail.by][place], all_joints, view.limits.get(tail.by))


def _history_panel(found: _Histories) -> Panel:
    tail = found.tail
    rows = ", ".join(f"row {joint.row} up to {text.value(joint.value, tail.unit)}" for joint in tail.joints[:DRAWN])
    return Panel(
        f"worst-{tail.by}",
        f"{tail.by} of the worst joints over the revolution",
        f"Histories of the worst joints: {rows}",
        partial(_draw, found=found),
        (4.9, 3.3),
        top=drawing.legend_room([*(f"row {joint.row}" for joint in tail.joints[:DRAWN]), SPREAD, "limit"]),
    )


def _draw(ax: Axes, found: _Histories) -> None:
    tail = found.tail
    theta = angles_figure.theta_axis(ax, found.angles)
    for i, load in enumerate(angles_figure.closed(found.loads)):
        label = f"row {tail.joints[i].row}"
        ax.plot(theta, load, color=style.COLOURS[i], ls=style.DASHES[i], lw=1.3, label=label)
    if found.all_joints is not None:
        low, _, high = angles_figure.closed(found.all_joints.spread)
        around = angles_figure.theta_axis(ax, found.all_joints.angles)
        ax.fill_between(around, low, high, color=style.FAINT, alpha=0.25, lw=0, label=SPREAD)
    if found.limit is not None:
        ax.axhline(found.limit, color=style.INK, lw=1.2, ls=(0.0, (8.0, 3.0)), label="limit")
    unit = unit_text(tail.unit)
    ax.set(ylabel=f"|{tail.by}| [{unit}]", ylim=(0.0, 1.05 * np.nanmax([*found.loads.flat, found.limit or 0.0])))
    drawing.legend_above(ax, *ax.get_legend_handles_labels())
