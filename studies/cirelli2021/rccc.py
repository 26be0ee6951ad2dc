"""The Cardan joint as an RCCC linkage: with manufacturing errors, but rigid and without clearance.

Cirelli et al. (2021), section 1, replace the overconstrained joint by a linkage of four links, one revolute and three
cylindrical pairs. The paper does not say which pair is which. Here the links and pairs are

    frame -R- input fork -C- cross -C- output fork -C- frame

(as in Ciornei et al., IOP Conf. Ser.: Mater. Sci. Eng. 477, 2019, 012037), because (1) the paper turns revolute
joints into cylindrical ones and keeps one revolute pair, which must be the bearing of the input shaft: this shaft is
driven and its bearing is rigid (`docs/model.md`), so the bearing holds the linkage along its axis; (2) pins slide
freely along their holes, so both pairs of the cross are cylindrical; (3) the output shaft must then be free to slide:
if it were held too, the linkage would be overconstrained by one, and errors would lock it.

Of the two opposite pins in each fork one is kept as the pair, the other is left out as redundant. Parameters select
the kept pins: pin 3 (in arm 1) or 4 (in arm 2) on the input side, pin 1 (in arm 4) or 2 (in arm 3) on the output side.
By default pins 3 and 1 are kept; the paper's errors are those of pin 1 and the hole of arm 4. Errors of a pin or hole
left out have no effect; neither have diameters.

    revolution = rccc.solve(joint, operation, errors[i], theta)
    revolution.psi, revolution.output_angle, revolution.reactions
    rccc_statics.mobility(revolution.lines, "RRRR").dof

Three cylindrical pairs whose axes are not parallel to one plane transmit no force, so a torque reaches the output as a
couple alone, normal to both axes of the cross. The shafts' rotation depends on tilts alone, and only on those that
change a right angle between neighbouring axes (a pin about z, a hole about t); the other tilts shift the output angle
by a constant or do not change it, and position errors only make the pairs slide. All other effects of errors in a real
joint come from the pins left out here.

The loop is cut at the output fork. The pose of the output fork through input fork and cross must equal its pose on the
output shaft. Newton's method solves these six equations for three angles and three slides, at all input angles at once.
The Jacobian consists of the screws of the pairs, which also give the rates of angles and slides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from studies.cirelli2021.rccc_statics import INPUT_PIN, OUTPUT_PIN, Lines, output_load, react
from tolstat.joint import Joint, Operation, ideal, perturb
from tolstat.joint.bodies import PIN_TRIADS
from tolstat.joint.material import Array

CLOSED = 1e-12
"""A loop is closed when all components of its gap are below this, in rad and in units of ``cross.R``."""

MAX_ITERATIONS = 25


class Side(NamedTuple):
    """The kept pin and hole of one fork: number of the pin, then point (m) and direction of both axes, (3,) each.

    Pin point and axis are in axes of the cross, hole point and axis in axes of the fork; directions point away from O.
    `sign` is +1 where the nominal direction is the frame's x or y, -1 where it is the opposite.
    """

    pin: int
    sign: float
    pin_point: Array
    pin_axis: Array
    hole_point: Array
    hole_axis: Array


class Pose(NamedTuple):
    """Links at k poses, in axes of G.

    Attributes
    ----------
    attitude : ndarray, shape (k, 3, 3, 3)
        Attitudes of input fork, cross and output fork; columns are the link's axes x, y, z.
    origin : ndarray, shape (k, 3, 3)
        Positions of the links' nominal centres, which are at O in the ideal joint, m.
    """

    attitude: Array
    origin: Array


def _turn(axis: Array, angle: Array) -> Array:
    """Rotations by `angle` (k,) about a fixed `axis` (3,), shape (k, 3, 3)."""
    return np.asarray(Rotation.from_rotvec(np.multiply.outer(angle, axis)).as_matrix())


def _aligning(start: Array, end: Array) -> Array:
    """The shortest rotation from unit vector `start` to `end`, which must not be opposite, shape (3, 3)."""
    skew = np.cross(np.eye(3), np.cross(start, end))
    return np.asarray(np.eye(3) + skew + skew @ skew / (1.0 + start @ end))


def forward(sides: tuple[Side, Side], alpha: float, theta: Array, q: Array, radius: float) -> tuple[Pose, Lines, Array]:
    """Pose of the links and axes of the pairs at coordinates `q` (k, 6), and the gap of the loop (k, 6).

    Coordinates are pair angles, output angle and slides, in the order of `Revolution`. The gap is the rotation (to
    first order, rad) and the displacement (m) from the output fork's pose on its shaft to its pose through the chain.
    """
    into, out = sides
    beta, gamma, output_angle, slide_in, slide_out, slide_shaft = q.T
    z, y = np.eye(3)[2], np.eye(3)[1]
    shaft = np.array([np.sin(alpha), 0.0, np.cos(alpha)])

    fork = _turn(z, theta)
    cross = fork @ _turn(into.hole_axis, into.sign * beta) @ _aligning(into.pin_axis, into.hole_axis)
    axis_in = fork @ into.hole_axis
    point_in = fork @ into.hole_point + slide_in[:, None] * axis_in
    centre = point_in - cross @ into.pin_point

    follower = cross @ _turn(out.pin_axis, out.sign * gamma) @ _aligning(out.hole_axis, out.pin_axis)
    axis_out = cross @ out.pin_axis
    point_out = centre + cross @ out.pin_point
    end = point_out - slide_out[:, None] * axis_out - follower @ out.hole_point

    on_shaft = _turn(y, np.array([alpha]))[0] @ _turn(z, output_angle)
    turned = follower @ np.swapaxes(on_shaft, 1, 2)
    rotation = 0.5 * np.stack(
        [turned[:, 2, 1] - turned[:, 1, 2], turned[:, 0, 2] - turned[:, 2, 0], turned[:, 1, 0] - turned[:, 0, 1]],
        axis=1,
    )
    gap = np.concatenate([rotation, end - slide_shaft[:, None] * shaft], axis=1)
    zero = np.zeros_like(end)
    pose = Pose(np.stack([fork, cross, follower], axis=1), np.stack([zero, centre, end], axis=1))
    points = np.stack([zero, point_in, point_out, zero], axis=1)
    axes = np.stack([zero + z, axis_in, axis_out, zero + shaft], axis=1)
    return pose, Lines(points, axes, radius), gap


def _screws(sides: tuple[Side, Side], lines: Lines, pose: Pose) -> Array:
    """Jacobian of the loop's gap in the coordinates: the pairs' screws at the output fork's centre, (k, 6, 6)."""
    screws = np.zeros((len(lines.point), 6, 6))
    for k, side in enumerate(sides):
        axis, arm = lines.axis[:, k + 1], pose.origin[:, 2] - lines.point[:, k + 1]
        screws[:, :3, k] = side.sign * axis
        screws[:, 3:, k] = side.sign * np.cross(axis, arm)
    screws[:, :3, 2] = -lines.axis[:, 3]
    screws[:, 3:, 3] = lines.axis[:, 1]
    screws[:, 3:, 4] = -lines.axis[:, 2]
    screws[:, 3:, 5] = -lines.axis[:, 3]
    return screws


def _input_screw(pose: Pose) -> Array:
    """Derivative of the loop's gap with respect to the input angle, (k, 6, 1)."""
    z = np.zeros_like(pose.origin[:, 2])
    z[:, 2] = 1.0
    return np.concatenate([z, np.cross(z, pose.origin[:, 2])], axis=1)[..., None]


def rates(sides: tuple[Side, Side], lines: Lines, pose: Pose) -> Array:
    """Derivatives of the six coordinates with respect to the input angle, (k, 6): pure numbers, slides m/rad."""
    return np.asarray(np.linalg.solve(_screws(sides, lines, pose), -_input_screw(pose))[..., 0], float)


def close(sides: tuple[Side, Side], alpha: float, theta: Array, radius: float) -> Array:
    """Solve for the coordinates (k, 6) that close the loop, by Newton's method from the ideal joint; NaN on failure."""
    q = np.zeros((len(theta), 6))
    q[:, 0] = np.arctan(np.tan(alpha) * np.sin(theta))  # tan(beta) = tan(alpha) sin(theta)
    q[:, 1] = np.arcsin(np.sin(alpha) * np.cos(theta))
    q[:, 2] = ideal.output_angle(theta, alpha)
    unit = np.array([1.0, 1.0, 1.0, radius, radius, radius])
    for _ in range(MAX_ITERATIONS):
        pose, lines, gap = forward(sides, alpha, theta, q, radius)
        closed = np.max(np.abs(gap) / unit, axis=1) < CLOSED
        if closed.all():
            break
        q[~closed] -= np.linalg.solve(_screws(sides, lines, pose), gap[..., None])[~closed, :, 0]
    return np.where(closed[:, None], q, np.nan)


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
        Modulus of the couple that passes through the cross, N m (ideal: T / sqrt(1 - (sin(alpha) cos(theta))^2)).
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
    alpha, torque, radius = (row[name].item() for name in ("alpha", "torque", "R"))
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
    pin = number - 1
    e = PIN_TRIADS[pin, 0]
    centre = float(row["R"][0]) * e
    pin_point, hole_point = centre + row["pin_point"][0, pin], centre + row["hole_point"][0, pin]
    return Side(number, float(e.sum()), pin_point, row["pin_axis"][0, pin], hole_point, row["hole_axis"][0, pin])


def _in_pin(pose: Pose, side: Side, load: Array) -> Array:
    """Force and moment `load` (k, 6) in axes of G, turned into the (e, t, z) of a pin of the cross."""
    to_pin = PIN_TRIADS[side.pin - 1] @ np.swapaxes(pose.attitude[:, 1], 1, 2)
    halves = load.reshape(-1, 2, 3)
    return np.asarray(np.einsum("kij,khj->khi", to_pin, halves).reshape(-1, 6))
