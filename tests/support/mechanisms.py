"""Numbers of a mechanism's parts by their names."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import CARDAN
from tolstat.common.mechanism import ALONG_Z, Mechanism


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
