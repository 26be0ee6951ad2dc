"""Numbers of a mechanism's parts by their names, parameters of a mechanism, and two Cardan joints in series."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import CARDAN
from tolstat.common.fields import dtype_of
from tolstat.common.mechanism import Bushing, Hinge, Lump, Mechanism, Member, Pair, Shaft, numbering
from tolstat.common.parameters import param_fields


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
        angle = 0.5 * np.pi * lump.quarters
        e, z = np.array([np.cos(angle), np.sin(angle), 0.0]).round(), np.array([0.0, 0.0, 1.0])
        found.append([e, np.cross(z, e), z])
    return np.array(found)


N_DOF, N_LUMPS = CARDAN.dof, len(CARDAN.lumps)
"""Number of unknowns and of lumps of a Cardan joint."""
PSI, S = unknown("psi"), unknown("s")
"""Numbers of the unknowns of its output shaft."""


def _renamed(mechanism: Mechanism, prefix: str, unknowns: dict[str, tuple[str, str]]) -> Mechanism:
    """A mechanism with `prefix` before all names but those of kinds; `unknowns`: psi and s of each shaft."""
    members = tuple(Member(prefix + one.name, one.motion, one.about_z) for one in mechanism.members)
    lumps = tuple(Lump(prefix + one.name, prefix + one.member, one.kind, one.quarters) for one in mechanism.lumps)
    shafts = tuple(Shaft(prefix + one.name, prefix + one.member, *unknowns[one.name]) for one in mechanism.shafts)
    bushings = tuple(
        Bushing(prefix + one.name, prefix + one.lump, prefix + one.base, one.kind) for one in mechanism.bushings
    )
    hinges = tuple(Hinge(prefix + one.name, prefix + one.pin, prefix + one.hole, one.axis) for one in mechanism.hinges)
    pairs = tuple(Pair(prefix + one.pin, prefix + one.hole, prefix + one.hinge) for one in mechanism.pairs)
    cardan = tuple(prefix + name for name in mechanism.cardan)
    return Mechanism(prefix, members, lumps, shafts, bushings, hinges, pairs, (), cardan)


def in_series() -> Mechanism:
    """Two Cardan joints: the tube turns by ``psi1`` in both, the output shaft by ``psi2``; nothing slides."""
    first = _renamed(CARDAN, "joint1.", {"input": ("", ""), "output": ("psi1", "")})
    second = _renamed(CARDAN, "joint2.", {"input": ("psi1", ""), "output": ("psi2", "")})
    parts = ("members", "lumps", "shafts", "bushings", "hinges", "pairs")
    both = {name: getattr(first, name) + getattr(second, name) for name in parts}
    return Mechanism("two joints", **both, unknowns=("psi1", "psi2"), cardan=first.cardan + second.cardan)


def blank(mechanism: Mechanism, n: int = 1) -> NDArray[np.void]:
    """Parameters of `n` mechanisms: their numbers, and zeros."""
    params = np.zeros(n, dtype_of(param_fields(mechanism)))
    for name, values in numbering(mechanism).items():
        params[name] = values
    return params


def joined(first: np.record, second: np.record, ahead: float, inertia: float) -> np.recarray:
    """Parameters of two joints in series from those of each, by the same dtype as `blank`.

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
    params = blank(in_series()).view(np.recarray)
    row, own = params[0], numbering(in_series())
    for name in params.dtype.names:
        if name in own:
            continue
        if row[name].shape == first[name].shape:
            row[name] = first[name]
        elif name in ("clearance", "pin_point", "pin_axis", "hole_point", "hole_axis"):
            row[name] = np.concatenate([first[name], second[name]])
    row.alpha[:], row.ahead[:] = (first.alpha[0], second.alpha[0]), (0.0, ahead)
    row.Js[:], row.torque = (inertia, second.Js[0]), second.torque
    row.torque_order[:] = second.torque_order
    return params
