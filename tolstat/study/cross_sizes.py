"""Crosses of catalogue size: the table ``data/cross_sizes.csv``, and what a joint and a drive shaft take from it."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from tolstat.common.errors import input_error
from tolstat.common.files import data_rows

TEXTS = ("size", "source", "computed")
"""Columns that are no numbers."""


class Cross(NamedTuple):
    """Row of the table."""

    size: str
    cup_mm: float
    length_mm: float
    pin_mm: float
    needles: float
    needle_diameter_mm: float
    needle_length_mm: float
    C_kN: float
    torque_Nm: float
    source: str
    computed: str

    @property
    def radius_mm(self) -> float:
        """Distance of the middle of the needles from the centre: the bottom of a cup is a tenth of it thick."""
        return 0.5 * self.length_mm - 0.1 * self.cup_mm - 0.5 * self.needle_length_mm

    @property
    def pin_force_kN(self) -> float:
        """Force on a pin at the rated torque, T/(2 R)."""
        return 0.5 * self.torque_Nm / self.radius_mm

    def words(self) -> dict[str, str]:
        """Return what stands in the template of a joint: the row, and what follows from it by proportions."""
        pin, arm = self.radius_mm - 0.9 * self.pin_mm, 1.1 * self.cup_mm
        derived = {
            "R_mm": self.radius_mm,
            "pitch_diameter_mm": self.pin_mm + self.needle_diameter_mm,
            "pin_l_mm": pin,
            "pin_short_mm": 0.8 * pin,
            "pin_long_mm": 1.2 * pin,
            "arm_width_mm": 1.3 * self.cup_mm,
            "arm_depth_mm": 0.5 * self.cup_mm,
            "arm_l_mm": arm,
            "arm_short_mm": 0.7 * arm,
            "arm_long_mm": 1.3 * arm,
        }
        given = {name: value if isinstance(value, str) else f"{value:g}" for name, value in self._asdict().items()}
        return given | {name: f"{value:.3g}" for name, value in derived.items()}


def crosses() -> list[Cross]:
    """Rows of the table, by ascending size."""
    made = []
    for row in data_rows("cross_sizes.csv"):
        values: dict[str, Any] = {name: text if name in TEXTS else float(text) for name, text in row.items()}
        made.append(Cross(**values))
    return made


def cross(size: str) -> Cross:
    """Cross of a size, ``"27 x 81.8"``; also ``"27x81.8"`` and ``"27 × 81,8 mm"``.

    Raises
    ------
    InputError
        When the table has no such size.
    """
    asked = re.sub(r"\s|mm", "", size.lower().replace("×", "x").replace(",", "."))
    known = crosses()
    for row in known:
        if row.size.replace(" ", "") == asked:
            return row
    sizes = ", ".join(row.size for row in known)
    raise input_error("--size", f"no cross of {size!r} is in the table", f"give cup x length in mm, one of: {sizes}")
