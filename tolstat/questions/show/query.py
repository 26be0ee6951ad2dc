"""Numbers behind the drawings of a joint: its dimensions, and the axes of its pins and holes with their errors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.common.load_kinds import PINS
from tolstat.common.tables import HOLES
from tolstat.display.joint_drawing.geometry import KINDS, Array, Dimensions, Feature, Pair
from tolstat.joint import Joint, Operation, nominal_errors, perturb
from tolstat.joint.perturbation import ARM_TRIADS, PIN_TRIADS
from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, FRAME, FRAME_F, FRAME_I, PIN

NO_OPERATION = Operation.model_construct(alpha=0.0, speed=1.0, torque=0.0)
"""Operating point of drawings of pins and holes, which do not depend on it."""


def dimensions(joint: Joint, alpha: float) -> Dimensions:
    """Dimensions of a joint and the pose of its ideal parts at the input angle 0.

    Parameters
    ----------
    joint : Joint
        The nominal joint.
    alpha : float
        Misalignment, rad.
    """
    cos, sin = np.cos(alpha), np.sin(alpha)
    output = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    frames = np.array([output if FRAME[body] == FRAME_F else np.eye(3) for body in range(PIN, ARM + 4)])
    triads = np.concatenate([PIN_TRIADS, ARM_TRIADS]) @ frames.transpose(0, 2, 1)
    e, z = triads[:, 0], triads[:, 2]
    R, r_b, l_f = joint.cross.R, joint.cross.r_b, joint.arm.l_f
    along = np.array([-l_f if FRAME[body] == FRAME_I else l_f for body in range(ARM, ARM + 4)])
    markers = np.concatenate([r_b * e[:4], R * e[4:] + along[:, None] * z[4:]])
    d = joint.arm.d
    width, thickness = (d or float(np.sqrt(12.0 * J / joint.arm.A)) for J in (joint.arm.Jy, joint.arm.Jx))
    return Dimensions(
        R=R,
        r_b=r_b,
        l_f=l_f,
        root=max(R - joint.pin.l, 0.1 * R),
        neck=min(joint.pin.d, joint.contact.D_P),
        pin=joint.contact.D_P,
        hole=joint.contact.D_H,
        z=joint.contact.z,
        arm=(width, thickness),
        alpha=alpha,
        triads=triads,
        centres=R * e,
        markers=markers,
        arm_of_pin=tuple(int(arm) for arm in ARM_OF_PIN),
    )


def pairs(joint: Joint, errors: NDArray[np.void]) -> list[Pair]:
    """Pins 1 to 4 with the holes that they turn in, of one joint; an error of the clearance widens the hole.

    Parameters
    ----------
    joint : Joint
        The nominal joint.
    errors : ndarray, shape (1,), dtype ERROR
        Its errors.
    """
    par = perturb(joint, NO_OPERATION, errors)[0]
    found = []
    for i, arm in enumerate(ARM_OF_PIN):
        names = PINS[i], HOLES[arm]
        own = tuple({kind: float(errors[f"{name}.{kind}"][0]) for kind in KINDS} for name in names)
        clearance = float(par["clearance"][i])
        diameter = joint.contact.D_P + own[0]["diameter"]
        pin = _feature(par["pin_point"][i], par["pin_axis"][i], PIN_TRIADS[i], diameter)
        hole = _feature(par["hole_point"][arm], par["hole_axis"][arm], ARM_TRIADS[arm], diameter + 2.0 * clearance)
        found.append(Pair(names, pin, hole, clearance, (own[0], own[1])))
    return found


def _feature(point: Array, axis: Array, triad: Array, diameter: float) -> Feature:
    return Feature(triad @ point, triad @ axis, diameter)


def positive(joint: Joint) -> dict[str, Pair]:
    """Pin 1 and hole 4, each with a positive error of one kind, by kind; large enough to be drawn as they are."""
    unit = 0.5 * (joint.contact.D_P + joint.contact.z)
    sizes = {"offset": 0.26 * unit, "tilt": np.radians(15.0), "diameter": 0.4 * unit}
    found = {}
    for kind in KINDS:
        errors = nominal_errors(1)
        for name in (PINS[0], HOLES[ARM_OF_PIN[0]]):
            errors[f"{name}.{kind}"] = sizes[kind.partition("_")[0]]
        found[kind] = pairs(joint, errors)[0]
    return found
