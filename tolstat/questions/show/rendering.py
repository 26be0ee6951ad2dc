"""Figures and tables of a joint: the joint itself, the meaning of its errors, the errors of one joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from tolstat.display.joint_drawing import sheets
from tolstat.display.joint_drawing.error_kinds import MEANINGS
from tolstat.display.joint_drawing.geometry import KINDS, Pair
from tolstat.display.table import Column, Row
from tolstat.questions.show import query

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tolstat.joint import Joint


def draw_joint(joint: Joint, alpha: float, title: str = "", columns: int = 2) -> Figure:
    """Draw a joint from its dimensions: the cross in its holes, both shafts, a pin in its hole.

    Parameters
    ----------
    joint : Joint
        The nominal joint, such as ``study.joint``.
    alpha : float
        Misalignment, rad.
    title : str
        Headline; the joint's description by default.
    columns : int
        Number of drawings side by side: 1 for a narrow page.

    Returns
    -------
    matplotlib.figure.Figure
        Its parts have their names as ids in an SVG.
    """
    panels = sheets.joint(query.dimensions(joint, alpha))
    return sheets.figure(panels, title or joint.description or "Cardan joint", sheets.NOTES, columns)


def draw_errors(joint: Joint) -> Figure:
    """Draw what a positive error of each kind means, on pin 1 and hole 4 of a joint."""
    panel = sheets.errors(query.positive(joint), query.dimensions(joint, 0.0))
    notes = (
        "Dashed: without error. e points away from the centre of the joint; every pin and hole has its own e, t, z.",
    )
    return sheets.figure([panel], "Errors of a pin and a hole", notes)


def draw_row(joint: Joint, errors: NDArray[np.void], title: str = "") -> Figure:
    """Draw the errors of one joint, enlarged together with its clearances, and write them beside the drawing.

    Parameters
    ----------
    joint : Joint
        The nominal joint.
    errors : ndarray, shape (1,), dtype ERROR
        Errors of the joint, such as ``store.errors(slice(17, 18))``.
    title : str
        Headline.
    """
    d = query.dimensions(joint, 0.0)
    panel = sheets.one(query.pairs(joint, errors), d, "Seen along z and along t of each pin", "row")
    return sheets.figure([panel], title or "Errors of one joint")


def lengths(joint: Joint, alpha: float) -> pd.DataFrame:
    """Dimensions on the drawing: ``name``, ``value`` in ``unit``, ``meaning``."""
    d = query.dimensions(joint, alpha)
    rows: list[tuple[str, float, str]] = [
        ("cross.R", d.R, "centre of the joint to the middle of pin and hole"),
        ("cross.r_b", d.r_b, "centre of the joint to a cross bushing"),
        ("arm.l_f", d.l_f, "middle of a hole to a fork bushing, along the shaft"),
        ("contact.D_P", d.pin, "diameter of the pins"),
        ("contact.D_H", d.hole, "diameter of the holes"),
        ("clearance", d.clearance, "radial clearance"),
        ("contact.z", d.z, "length of the contact"),
        ("pin.d", joint.pin.d, "diameter of a pin's beam"),
        ("pin.l", joint.pin.l, "length of a pin's beam"),
        ("arm.width", joint.arm.width or 0.0, "side of an arm's section along t"),
        ("arm.depth", joint.arm.depth or 0.0, "side of an arm's section along e"),
    ]
    found = [(name, 1e3 * x, "mm", said) for name, x, said in rows if x or not name.startswith("arm.")]
    found.append(("operation.alpha", float(np.degrees(alpha)), "deg", "misalignment of the shafts"))
    return pd.DataFrame(found, columns=["name", "value", "unit", "meaning"])


LENGTHS = (
    Column("dimension", lambda row: str(row["name"])),
    Column("value", lambda row: f"{row['value']:.5g} {row['unit']}"),
    Column("meaning", lambda row: str(row["meaning"]), words=True),
)
"""Columns of the table `lengths`."""


def meanings() -> pd.DataFrame:
    """Kinds of errors: ``kind``, and ``meaning`` of a positive value."""
    return pd.DataFrame([{"kind": kind, "meaning": MEANINGS[kind]} for kind in KINDS])


def numbers(pairs: Sequence[Pair]) -> pd.DataFrame:
    """Errors of a joint, SI: ``feature``, its errors by kind, and ``clearance`` of the pair."""
    rows = []
    for pair in pairs:
        for name, errors in zip(pair.names, pair.errors, strict=True):
            rows.append({"feature": name, **errors, "clearance": pair.clearance})
    return pd.DataFrame(rows)


def _length(kind: str) -> Callable[[Row], str]:
    return lambda row: f"{1e3 * row[kind]:.4f}"


def _angle(kind: str) -> Callable[[Row], str]:
    return lambda row: f"{np.degrees(row[kind]):.4f}"


NUMBERS = (
    Column("feature", lambda row: str(row["feature"])),
    *(Column(f"{axis} [mm]", _length(f"offset_{axis}")) for axis in "etz"),
    *(Column(f"tilt {axis} [°]", _angle(f"tilt_{axis}")) for axis in "tz"),
    Column("⌀ [mm]", _length("diameter")),
    Column("clearance", lambda row: f"{1e3 * row['clearance']:.4f} mm"),
)
"""Columns of the table `numbers`; e, t, z: offsets; ⌀: deviation of the diameter."""

MEANING = (Column("error", lambda row: str(row["kind"])), Column("a positive value", lambda row: str(row["meaning"])))
"""Columns of the table `meanings`."""
