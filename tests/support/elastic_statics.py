"""Statics of rigid members on elastic pins and eyes, pressed without clearance: a linear system at each angle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.support.linkages import pose
from tolstat.joint import Joint

Array = NDArray[np.float64]


def cross(vector: Array) -> Array:
    """Matrix of the cross product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def at(point: Array) -> Array:
    """What gives displacement and rotation at a point from those of a body at the origin, (6, 6)."""
    found = np.eye(6)
    found[:3, 3:] = -cross(point)
    return found


def bushing_loads(case, joint: Joint, torque: float, errors: dict[str, tuple[float, float]], theta: float) -> Array:
    """Force and torque of each bushing in its triad, (2 pairs, 6), pin and eye of each pair in turn.

    `errors`: offsets of pins along t and z, m. The torque acts against z of the member that the case loads.
    """
    free = [member for member, of in case["members"].items() if not of.get("prescribed")]
    bodies = [*free, *(f"{pair}_{side}" for pair in case["pairs"] for side in ("pin", "eye"))]
    matrix, right = np.zeros((6 * len(bodies), 6 * len(bodies))), np.zeros(6 * len(bodies))
    poses = {member: pose(case, member, theta) for member in case["members"]}
    springs = []

    def join(names: tuple[str, str], stiffness: Array, to_place: Array, before: Array) -> Array:
        """Add a spring of `stiffness` in the axes of a place; deformed by `before` when no body moves."""
        rows = np.zeros((len(before), len(right)))
        for sign, name in zip((1.0, -1.0), names, strict=True):
            if name in bodies:
                i = 6 * bodies.index(name)
                rows[:, i : i + 6] = sign * to_place
        matrix[:] += rows.T @ stiffness @ rows
        right[:] -= rows.T @ stiffness @ before
        return rows

    for pair, of in case["pairs"].items():
        for side, k in (("pin", joint.k_cross), ("eye", joint.k_fork)):
            axes, origin = poses[of[side]["member"]]
            e, t = (axes @ np.array(of[side][name]) for name in ("e", "t"))
            triad = np.kron(np.eye(2), np.array([e, t, np.cross(e, t)]))
            place = triad @ at(origin + axes @ of[side]["point_m"])
            springs.append((np.diag(k), join((f"{pair}_{side}", of[side]["member"]), np.diag(k), place, np.zeros(6))))
        axes, origin = poses[of["pin"]["member"]]
        e, t = (axes @ np.array(of["pin"][name]) for name in ("e", "t"))
        across, middle = np.array([t, np.cross(e, t)]), origin + axes @ of["pin"]["point_m"]
        for station in (-0.5, 0.5):
            place = across @ at(middle + station * joint.contact.z * e)[:3]
            half = 0.5 * joint.contact.k2u * np.eye(2)
            join((f"{pair}_pin", f"{pair}_eye"), half, place, np.array(errors.get(pair, (0.0, 0.0))))
        along = 2.0 * joint.thrust.k * np.eye(1)  # both faces stay pressed
        join((f"{pair}_pin", f"{pair}_eye"), along, e[None] @ at(middle)[:3], np.zeros(1))
    (loaded,) = (member for member in free if "z" in case["members"][member]["load_torque"])
    axes, _ = poses[loaded]
    i = 6 * free.index(loaded)
    right[i + 3 : i + 6] -= torque * axes[:, 2]
    found = np.linalg.solve(matrix, right)
    return np.array([-k @ rows @ found for k, rows in springs])
