"""Drive shaft of rigid bodies without friction, turned slowly: what the joints exert on the outer shafts, by statics.

The cross of a Cardan joint turns freely about both pairs of pins, so that a joint transmits a force at its centre and a
moment along the normal of its cross plane. The torque along each shaft gives the size of that moment; the moments of
both joints on the tube, across it, are balanced by a pair of forces at its ends, across it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tests.support.naive import Z, joint_frames, turn


class OnShafts(NamedTuple):
    """Force (N) and moment (N m) across the input and output shaft, in axes of each shaft's bearings, (angles, 3).

    `couples` is the moment (N m) that the pins of each joint transmit, (angles, 2).
    """

    input_force: np.ndarray
    input_moment: np.ndarray
    output_force: np.ndarray
    output_moment: np.ndarray
    couples: np.ndarray


def on_shafts(angles, alphas, plane, offset, length, torque) -> OnShafts:
    """Loads at input angles; arguments as of `joint.DriveShaft`, rad, m, N m."""
    rows = [_at(theta, alphas, plane, offset, length, torque) for theta in angles]
    return OnShafts(*(np.array(values) for values in zip(*rows, strict=True)))


def _at(theta, alphas, plane, offset, length, torque):
    _, cross1, fork = joint_frames(theta, alphas[0])
    tube = turn((0, 1, 0), alphas[0])  # ground axes of the tube: z along it, x in the plane of joint 1
    fork = tube.T @ fork
    second = tube @ turn(Z, plane)  # and with x in the plane of joint 2
    _, cross2, _ = joint_frames(np.arctan2(fork[1, 0], fork[0, 0]) + 0.5 * np.pi + offset, alphas[1])
    output = second @ turn((0, 1, 0), alphas[1])
    normal1, normal2 = cross1 @ Z, second @ cross2 @ Z
    moment2 = torque / (normal2 @ output @ Z) * normal2
    moment1 = moment2 @ tube @ Z / (normal1 @ tube @ Z) * normal1
    force = np.cross(tube @ Z, moment1 - moment2) / length  # on the tube at joint 2, and the opposite at joint 1
    loads = force, -moment1, output.T @ -force, output.T @ moment2
    couples = [np.linalg.norm(moment) for moment in (moment1, moment2)]
    return *(load * (1.0, 1.0, 0.0) for load in loads), couples
