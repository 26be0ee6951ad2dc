"""Parameters of the bodies of joints and drive shafts: of all that the errors of pins and holes do not change."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import ARM_QUARTERS, PIN_QUARTERS
from tolstat.common.mechanism import OBLIQUE, Mechanism
from tolstat.joint import material
from tolstat.joint.material import Array
from tolstat.joint.model import Joint
from tolstat.joint.sections import RIGID, Arm, Hub, Pin
from tolstat.joint.shaft import DriveShaft, Lumped

Table = NDArray[np.void]
Place = tuple[float, float, float]


def _triads(quarters: Sequence[int]) -> Array:
    """Rows e, t, z of triads after quarter turns about z, (n, 3, 3)."""
    e = np.array([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0)])[list(quarters)]
    z = np.tile((0.0, 0.0, 1.0), (len(e), 1))
    return np.stack([e, np.cross(z, e), z], axis=1)


PIN_TRIADS: Array = _triads(PIN_QUARTERS)
"""Rows e, t, z of pins 1 to 4 in axes of the cross frame C; shape (4, 3, 3)."""

ARM_TRIADS: Array = _triads(ARM_QUARTERS)
"""Rows e, t, z of arms 1, 2 (input frame I) and 3, 4 (output frame F); shape (4, 3, 3)."""


def write(
    params: Table, own: Mapping[str, Joint], shaft: DriveShaft | None, errors: Table, mechanism: Mechanism
) -> dict[str, Array]:
    """Write parameters of all bodies, at factor 1 on E.

    Parameters
    ----------
    params : ndarray, shape (n,), dtype PARAM
        Where to.
    own : mapping
        Joints by what stands before the names of their parts, `mechanism.prefixes`.
    shaft : DriveShaft or None
        What is between two joints.
    errors : ndarray, shape (n,), dtype ERROR
        Those of the drive shaft's angles count.
    mechanism : Mechanism
        What is simulated.

    Returns
    -------
    dict of str to ndarray, shape (3, 3) or (n, 3, 3)
        Rows e, t, z of the triad of each pin and hole, in axes of its member.
    """
    first, *_, last = (*own.values(), *own.values())
    for name, value in _constants(first, last).items():
        params[name] = value
    params["R"] = min(each.cross.R for each in own.values())
    for name, of_kinds in _of_kinds(own, shaft).items():
        kinds = mechanism.lump_kinds if name in OF_LUMPS else mechanism.bushing_kinds
        params[name] = [of_kinds[kind] for kind in kinds]
    if roots := [own[name.rpartition("cross")[0]].pin.root for name in mechanism.roots]:
        params["of_root"] = [root.factors if root else (0.0, 0.0) for root in roots]
    lumps = mechanism.lumps
    triads = dict(zip([lump.name for lump in lumps], _triads([lump.quarters % OBLIQUE for lump in lumps]), strict=True))
    if shaft is not None:
        params["plane"][:, 1], params["span"][:, 1] = shaft.plane, shaft.length
        params["alpha"][:, 1] = shaft.alpha + errors["shaft.alpha"]
        params["ahead"][:, 1] = 0.5 * np.pi + shaft.offset + errors["shaft.offset"]
        triads |= _on_tube(params["ahead"][:, 1] + shaft.plane)
        params["triad"] = np.stack(np.broadcast_arrays(*(triads[lump.name] for lump in lumps)), axis=1)
    return triads


def _constants(first: Joint, last: Joint) -> dict[str, Any]:
    """Parameters of the outer shafts, which do not depend on the errors."""
    shaft = last.shaft
    return {
        "Js": shaft.Js,
        "bearing_at": np.reshape(
            [
                sign * np.array(ends.bearings)
                for sign, ends in ((-1.0, first.shaft.input), (1.0, shaft.output))
                if ends is not None
            ],
            (-1, 2),
        ),
        "slides": shaft.slides,
        "m_s": shaft.mass if shaft.slides or shaft.lateral != RIGID else 0.0,
        "k_l": shaft.k_l,
        "c_l": 2 * last.bushing.xi * math.sqrt(shaft.k_l * (shaft.mass or 0.0)),
        "k_a": shaft.k_a,
        "c_a": shaft.axial_damping if shaft.slides else 0.0,
    }


OF_LUMPS = ("mass", "inertia", "at")
"""Parameters of kinds of lumps; others of `_of_kinds` are of kinds of bushings."""


def _of_kinds(own: Mapping[str, Joint], shaft: DriveShaft | None) -> dict[str, dict[str, Any]]:
    """Parameters of lumps and bushings by kind, at factor 1 on E; `own`: joints by what stands before their parts."""
    *_, last = own.values()
    of: dict[str, dict[str, Any]] = {name: {} for name in (*OF_LUMPS, "k", "c", "marker")}

    def lump(kind: str, body: Hub | Pin | Arm | Lumped, at: Place) -> None:
        of["mass"][kind], of["inertia"][kind], of["at"][kind] = body.mass, body.inertia, at

    def bushing(kind: str, k: Array, body: Pin | Arm | Lumped, markers: Sequence[Place], joint: Joint) -> None:
        damping = material.bushing_damping(k, body.mass, np.array(body.inertia), joint.bushing.xi)
        of["k"][kind], of["c"][kind], of["marker"][kind] = k, damping, markers

    tubes = {} if shaft is None else shaft.tubes
    # distance of the base's reference point from the joint's centre, along the base
    ends = {"input": 0.0, "output": 0.0}
    if shaft is not None:
        at = [tube.at for tube in tubes.values()]
        ends = {
            "joint1.input": 0.0,
            "joint1.output": at[0],
            "joint2.input": at[-1] - shaft.length,
            "joint2.output": 0.0,
        }
    for end, base in ends.items():
        prefix = end.removesuffix("input").removesuffix("output")
        side, joint = -1.0 if end.endswith("input") else 1.0, own[prefix]
        R, r_b, l_f = joint.cross.R, joint.cross.r_b, joint.arm.l_f
        lump(f"{prefix}hub", joint.hub, (0.0, 0.0, 0.0))
        lump(f"{prefix}pin", joint.pin, (R, 0.0, 0.0))
        lump(f"{prefix}arm", joint.arm, (R, 0.0, 0.0))
        bushing(f"{prefix}cross", joint.k_cross, joint.pin, [(r_b - R, 0.0, 0.0), (r_b, 0.0, 0.0)], joint)
        fork = [(0.0, 0.0, side * l_f), (R, 0.0, side * l_f - base)]
        bushing(f"{end} fork", joint.k_fork, joint.arm, fork, joint)
    if shaft is not None:
        lump("joint2.arm of tube", last.arm, (last.cross.R, 0.0, shaft.length))
        for name, tube in tubes.items():
            lump(name, tube, (0.0, 0.0, tube.at))
        if spline := shaft.spline:
            k = np.array([*[spline.k_lateral] * 2, 0.0, *[spline.k_bending] * 2, spline.k_torsion])
            places = [(0.0, 0.0, spline.at - tubes[name].at) for name in ("tube2", "tube1")]
            bushing("spline", k, tubes["tube2"], places, last)
            of["c"]["spline"][2] = spline.axial_damping
    return of


def _on_tube(turned: Array) -> dict[str, Array]:
    """Triads, (n, 3, 3) each, of the arms of joint 2 in axes of the tube; `turned`: about the tube, rad, (n,)."""
    zero, one = np.zeros_like(turned), np.ones_like(turned)
    cosine, sine = np.cos(turned), np.sin(turned)
    attitude = np.moveaxis(np.array([[cosine, -sine, zero], [sine, cosine, zero], [zero, zero, one]]), -1, 0)
    return {f"joint2.hole{i}": np.einsum("nij,aj->nai", attitude, ARM_TRIADS[i - 1]) for i in (1, 2)}
