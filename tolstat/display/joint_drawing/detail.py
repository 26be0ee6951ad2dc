"""Detail: pin 1 in the hole of arm 4, with the clearance enlarged."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from tolstat.display.joint_drawing import ink
from tolstat.display.joint_drawing.front import HATCH
from tolstat.display.joint_drawing.geometry import ALONG_Z, Dimensions, around, round_number, walls


def enlargement(d: Dimensions) -> float:
    """Factor that the clearance is enlarged by: it is drawn as some tenth of the pin's diameter."""
    return round_number(0.1 * d.pin / d.clearance) if d.clearance > 0.0 else 1.0


def draw(ax: Axes, d: Dimensions) -> None:
    """Draw pin and hole in section with their diameters, length of the contact and clearance.

    Parameters are the first two of `front.draw`.
    """
    factor, up, middle = enlargement(d), np.array([0.0, 1.0]), np.zeros(2)
    hole = d.pin + 2.0 * factor * d.clearance
    wall = d.eye - 0.5 * d.hole
    for i, side in enumerate(walls(middle, up, d.z, hole, wall), 1):
        ink.part(ax, side, ink.OUTPUT, f"detail.arm4.{i}", hatch=HATCH)
    ink.part(ax, around(middle, up, d.z, d.pin), ink.CROSS, "detail.pin1")
    tall, wide = 0.5 * d.z, 0.5 * hole + wall
    unit = 0.5 * (d.pin + d.z)
    ink.axis(ax, np.array([0.0, -tall - 0.1 * unit]), np.array([0.0, tall + 0.12 * unit]))
    ink.triad(ax, np.array([0.0, tall + 0.18 * unit]), np.eye(3), ALONG_Z, 0.25 * unit, "detail")
    ink.label(ax, np.array([0.25 * d.pin, 0.0]), "pin 1")
    ink.label(ax, np.array([-wide - 0.06 * unit, 0.0]), "arm 4", ha="right")
    low = np.array([0.0, -1.0])
    corner = np.array([0.5 * d.pin, -tall])
    mirror = np.array([-1.0, 1.0])
    ink.dimension(ax, corner * mirror, corner, 0.18 * unit * low, f"pin ⌀ {ink.millimetres(d.pin)}")
    corner = np.array([0.5 * hole, -tall])
    ink.dimension(ax, corner * mirror, corner, 0.46 * unit * low, f"hole ⌀ {ink.millimetres(d.hole)}")
    right = np.array([wide, tall])
    ink.dimension(
        ax, right * np.array([1.0, -1.0]), right, 0.14 * unit * np.array([1.0, 0.0]), f"z = {ink.millimetres(d.z)}"
    )
    gap = np.array([0.25 * (d.pin + hole), tall])
    foot = gap + np.array([0.12 * unit, 0.22 * unit])
    ink.line(ax, gap - np.array([0.0, 0.3 * d.z]), foot)
    said = f"clearance {ink.millimetres(d.clearance)}"
    said += f",\ndrawn × {factor:g}" if d.clearance > 0.0 else ": interference fit"
    ink.label(ax, foot, said, ha="left", va="bottom", fontsize=ink.SMALL)
    ink.frame(ax, (-wide - 0.45 * unit, -tall - 0.72 * unit), (wide + 0.68 * unit, tall + 0.68 * unit))
