"""What the tables are made of; parameters of one joint for the kernel, which the table PARAM holds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np


class Field(NamedTuple):
    """One column, or a small array of columns, of a table.

    Attributes
    ----------
    name : str
        Identifier, the same from TOML key to file and CSV header.
    unit : str
        SI unit, ``"1"`` for a pure number.
    description : str
        One sentence for the reader of the file.
    dtype : str
        NumPy scalar type.
    shape : tuple of int
        ``()`` for a scalar column.
    columns : tuple of str
        Names of the columns of an array, one for each element; ``()`` for a scalar column.
    """

    name: str
    unit: str
    description: str
    dtype: str = "f8"
    shape: tuple[int, ...] = ()
    columns: tuple[str, ...] = ()


def dtype_of(fields: Iterable[Field]) -> np.dtype[np.void]:
    """Aligned structured dtype of a table."""
    return np.dtype([(f.name, f.dtype, f.shape) for f in fields], align=True)


MAX_STATIONS = 16
"""Maximum number of contact stations of a pin."""
MAX_ORDERS = 48
"""Maximum number of different orders of speed and torque: 16 of each, and those that come from a partner joint."""

PARAM_FIELDS = (
    Field("alpha", "rad", "misalignment"),
    Field("omega", "rad/s", "mean angular velocity of the input shaft"),
    Field("torque", "N*m", "mean resisting torque T"),
    Field("n_orders", "1", "number of orders", "i8"),
    Field("order", "1", "cycles of each order in a revolution of the input", shape=(MAX_ORDERS,)),
    Field("speed_order", "rad", "factors of cosine and sine of each order in theta", shape=(MAX_ORDERS, 2)),
    Field("torque_order", "N*m", "factors of cosine and sine of each order in T_r", shape=(MAX_ORDERS, 2)),
    Field("Js", "kg*m^2", "inertia of the output shaft"),
    Field("slides", "1", "1 where the output shaft may move along its axis, 0 where it is held rigidly"),
    Field("m_s", "kg", "mass that moves along the axis of the output shaft"),
    Field("k_a", "N/m", "axial stiffness of the shafts' bearings; 0: free"),
    Field("c_a", "N*s/m", "axial damping of the output shaft"),
    Field("F_a", "N", "axial force on the output shaft, away from the joint"),
    Field("R", "m", "distance of the pins' and arms' reference points from O"),
    Field("r_b", "m", "distance of the cross bushings' markers from O"),
    Field("l_f", "m", "distance of the fork bushings' markers from the hole centre along z"),
    Field("hub_mass", "kg", "mass of the hub"),
    Field("hub_inertia", "kg*m^2", "inertia of the hub about x, y, z of C", shape=(3,)),
    Field("pin_mass", "kg", "mass of a pin"),
    Field("pin_inertia", "kg*m^2", "inertia of a pin about e, t, z", shape=(3,)),
    Field("arm_mass", "kg", "mass of an arm"),
    Field("arm_inertia", "kg*m^2", "inertia of an arm about e, t, z", shape=(3,)),
    Field("k_cross", "N/m, N*m/rad", "cross bushing stiffness: force e, t, z, torque e, t, z", shape=(6,)),
    Field("c_cross", "N*s/m, N*m*s/rad", "cross bushing damping, same order", shape=(6,)),
    Field("k_fork", "N/m, N*m/rad", "fork bushing stiffness, same order", shape=(6,)),
    Field("c_fork", "N*s/m, N*m*s/rad", "fork bushing damping, same order", shape=(6,)),
    Field("c_d", "N*s/m", "normal contact damping"),
    Field("c_t", "N*s/m", "tangential contact damping (lubricant film)"),
    Field("delta_d", "m", "penetration over which contact damping rises"),
    Field("n_stations", "1", "contact stations per pin", "i8"),
    Field("station_s", "m", "signed distance of each station from P along the pin, falling", shape=(MAX_STATIONS,)),
    Field("station_k1", "N/m^2", "quadratic coefficient of each station's force", shape=(MAX_STATIONS,)),
    Field("station_k2", "N/m", "linear coefficient of each station's force", shape=(MAX_STATIONS,)),
    Field("station_k3", "N/m^(9/8)", "coefficient of each station's needles", shape=(MAX_STATIONS,)),
    Field("station_weight", "1", "weight of each station's damping and film", shape=(MAX_STATIONS,)),
    Field("needle_b", "1", "share b of the clearance in the force of needles; 0: no needles"),
    Field("clearance", "m", "radial clearance c of each pin", shape=(4,)),
    Field("pin_point", "m", "P less the pin's reference point, in axes of C", shape=(4, 3)),
    Field("pin_axis", "1", "direction of the pin axis, in axes of C", shape=(4, 3)),
    Field("hole_point", "m", "hole centre less the arm's reference point, in axes of the arm's frame", shape=(4, 3)),
    Field("hole_axis", "1", "direction of the hole axis, in axes of the arm's frame", shape=(4, 3)),
)
"""Parameters of one joint for the kernel. Pin fields are indexed by pin, hole fields by arm (hole k: arm k)."""
