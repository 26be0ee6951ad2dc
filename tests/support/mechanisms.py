"""Numbers of a mechanism's parts by their names, and parameters of two Cardan joints in series."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import CARDAN, SERIES
from tolstat.common.mechanism import ALONG_Z, Mechanism
from tolstat.common.parameters import numbers
from tolstat.common.tables import blank_params


def body(name: str, mechanism: Mechanism = CARDAN) -> int:
    """Number of a lump or shaft."""
    return mechanism.bodies.index(name)


def unknown(name: str, mechanism: Mechanism = CARDAN) -> int:
    """Number of an unknown of a shaft among all unknowns."""
    return 6 * len(mechanism.lumps) + mechanism.unknowns.index(name)


def lump_kind(name: str, mechanism: Mechanism = CARDAN) -> int:
    """Number of a kind of lump."""
    return mechanism.lump_kinds.index(name)


def bushing_kind(name: str, mechanism: Mechanism = CARDAN) -> int:
    """Number of a kind of bushing."""
    return mechanism.bushing_kinds.index(name)


def triads(mechanism: Mechanism = CARDAN) -> NDArray[np.float64]:
    """Rows e, t, z of each lump in axes of its member, (lumps, 3, 3)."""
    found = []
    for lump in mechanism.lumps:
        if lump.quarters == ALONG_Z:
            found.append(np.roll(np.eye(3), 1, axis=0))
            continue
        angle = 0.5 * np.pi * lump.quarters
        e, z = np.array([np.cos(angle), np.sin(angle), 0.0]).round(), np.array([0.0, 0.0, 1.0])
        found.append([e, np.cross(z, e), z])
    return np.array(found)


N_DOF, N_LUMPS = CARDAN.dof, len(CARDAN.lumps)
"""Number of unknowns and of lumps of a Cardan joint."""
PSI, S = unknown("psi"), unknown("s")
"""Numbers of the unknowns of its output shaft."""


def joined(first: np.record, second: np.record, ahead: float, inertia: float) -> np.recarray:
    """Parameters of two joints in series, `SERIES`, from those of each.

    Parameters
    ----------
    first, second : records of PARAM
        The joints: speed and orders of the first, torque, and inertia of the output shaft, of the second; stiffness,
        masses and contact law of the first.
    ahead : float
        Angle of the second joint's input fork ahead of the first joint's output fork, rad.
    inertia : float
        Of the tube, kg m^2.
    """
    params = blank_params(1, SERIES).view(np.recarray)
    row, own = params[0], numbers(SERIES)
    for name in params.dtype.names:
        if name in own or name not in first.dtype.names:
            continue
        if row[name].shape == first[name].shape:
            row[name] = first[name]
        elif name in ("clearance", "pin_point", "pin_axis", "hole_point", "hole_axis"):
            row[name] = np.concatenate([first[name], second[name]])
    row.alpha[:], row.ahead[:] = (first.alpha[0], second.alpha[0]), (0.0, ahead)
    row.Js[:], row.torque = (inertia, second.Js[0]), second.torque
    row.torque_order[:] = second.torque_order
    return params
