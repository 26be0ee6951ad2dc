"""The RCCC linkage over a revolution: angles, slides, speed ratio and reactions from one row of errors."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.joint import Joint, Operation, ideal, perturb
from tolstat.joint.perturbation import PIN_TRIADS
from tolstat.joint.rccc.closure import Pose, Side, close, forward, rates
from tolstat.joint.rccc.constraints import Array, Lines
from tolstat.joint.rccc.statics import INPUT_PIN, OUTPUT_PIN, output_load, react
from tolstat.kernel.mechanics.topology import ARM_OF_PIN


class Revolution(NamedTuple):
    """Motion and reactions of the RCCC linkage at k input angles. NaN where it cannot be closed.

    Attributes
    ----------
    theta : ndarray, shape (k,)
        Input angle, rad.
    output_angle : ndarray, shape (k,)
        Angle of the output shaft, rad, continuous in theta.
    speed_ratio : ndarray, shape (k,)
        d output_angle / d theta.
    psi : ndarray, shape (k,)
        Relative error of the speed ratio against the ideal joint's, eq. (13).
    pair_angle : ndarray, shape (k, 2)
        Angle of the cross in the input fork about x, of the output fork in the cross about y, rad
        (ideal: beta and gamma).
    slide : ndarray, shape (k, 3)
        Travel of the kept input pin out of its hole, of the output pin out of its hole (away from O), and of the output
        shaft along its axis away from O, m.
    couple : ndarray, shape (k,)
        Modulus of the couple that passes through the cross, N m (ideal: `ideal.cross_couple`).
    driving_torque : ndarray, shape (k,)
        Torque that drives the input shaft, N m.
    reactions : ndarray, shape (k, 4, 6)
        Force (N) and moment about the pair's point (N m), axes of G, that each pair transmits from its link to the
        next: frame to input fork, input fork to cross, cross to output fork, output fork to frame.
    cross_loads : ndarray, shape (k, 2, 6)
        Force (N) and moment (N m) of input fork and of output fork on the cross, at the kept pin's point, in the pin's
        axes (e, t, z). The kept pin replaces both pins of its fork: compare with the sum of both pins' loads.
    pose : Pose
        Attitudes and positions of the links.
    lines : Lines
        Axes of the pairs, as `mobility` and `react` take them.
    """

    theta: Array
    output_angle: Array
    speed_ratio: Array
    psi: Array
    pair_angle: Array
    slide: Array
    couple: Array
    driving_torque: Array
    reactions: Array
    cross_loads: Array
    pose: Pose
    lines: Lines


def solve(
    joint: Joint,
    operation: Operation,
    errors: NDArray[np.void],
    theta: ArrayLike,
    *,
    input_pin: int = 3,
    output_pin: int = 1,
) -> Revolution:
    """Solve the RCCC linkage of one joint over input angles, quasi-statically.

    Parameters
    ----------
    joint : Joint
        The nominal joint; only its ``cross.R`` is used.
    operation : Operation
        The operating point; its speed is not used.
    errors : ndarray, shape () or (1,), dtype ERROR
        Errors of the joint: one row.
    theta : array_like, shape (k,)
        Input angles, rad.
    input_pin : {3, 4}
        Pin that is kept as the pair of cross and input fork.
    output_pin : {1, 2}
        Pin that is kept as the pair of cross and output fork.

    Returns
    -------
    Revolution
        Motion and reactions at each input angle; NaN where the loop has no solution (alpha close to 90 degrees).

    Raises
    ------
    ValueError
        When `errors` is not one row, a pin is not on its side of the cross, or alpha is not below 90 degrees.
    """
    if input_pin not in (3, 4) or output_pin not in (1, 2):
        raise ValueError(
            f"pins {input_pin} and {output_pin} kept: keep pin 3 or 4 in the input fork, 1 or 2 in the output fork"
        )
    row = perturb(joint, operation, np.atleast_1d(errors))
    if len(row) != 1:
        raise ValueError(f"errors holds {len(row)} joints: give one row")
    alpha, torque, radius = (float(row[name][0]) for name in ("alpha", "torque", "R"))
    if not abs(alpha) < np.pi / 2:
        raise ValueError(f"alpha is {np.degrees(alpha):g} deg: give less than 90 deg")
    theta = np.atleast_1d(np.asarray(theta, float))
    sides = _side(row, input_pin), _side(row, output_pin)

    q = close(sides, alpha, theta, radius)
    pose, lines, _ = forward(sides, alpha, theta, q, radius)
    tau = rates(sides, lines, pose)[:, 2]
    reactions = react(lines, output_load(lines, torque))
    passed = reactions.at_point
    on_cross = (passed[:, INPUT_PIN], -passed[:, OUTPUT_PIN])
    cross_loads = np.stack([_in_pin(pose, s, load) for s, load in zip(sides, on_cross, strict=True)], axis=1)
    return Revolution(
        theta=theta,
        output_angle=q[:, 2],
        speed_ratio=tau,
        psi=1.0 - ideal.speed_ratio(theta, alpha) / tau,
        pair_angle=q[:, :2],
        slide=q[:, 3:],
        couple=np.linalg.norm(cross_loads[:, 1, 3:], axis=1),
        driving_torque=reactions.driving_torque,
        reactions=passed,
        cross_loads=cross_loads,
        pose=pose,
        lines=lines,
    )


def _side(row: NDArray[np.void], number: int) -> Side:
    pin, arm = number - 1, int(ARM_OF_PIN[number - 1])
    e = PIN_TRIADS[pin, 0]
    centre = float(row["R"][0]) * e
    pin_point, hole_point = centre + row["pin_point"][0, pin], centre + row["hole_point"][0, arm]
    return Side(number, float(e.sum()), pin_point, row["pin_axis"][0, pin], hole_point, row["hole_axis"][0, arm])


def _in_pin(pose: Pose, side: Side, load: Array) -> Array:
    """Force and moment `load` (k, 6) in axes of G, turned into the (e, t, z) of a pin of the cross."""
    to_pin = PIN_TRIADS[side.pin - 1] @ np.swapaxes(pose.attitude[:, 1], 1, 2)
    halves = load.reshape(-1, 2, 3)
    return np.asarray(np.einsum("kij,khj->khi", to_pin, halves).reshape(-1, 6))
