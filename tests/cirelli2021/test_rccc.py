"""The RCCC linkage: mobility, closure, speed ratio and reactions, against closed forms and the reference joints."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from studies.cirelli2021 import rccc, rccc_statics
from tests.conftest import REFERENCE
from tests.support.closed_forms import cross_couple, pin_force
from tests.support.mechanisms import body, triads
from tolstat.common.cardan import CARDAN, HOLE_OF_PIN
from tolstat.joint import Operation, ideal, nominal_errors

THETA = np.linspace(0, 2 * np.pi, 73) + 0.03
TORQUE = 100.0
AT = Operation.model_construct(alpha=0.0, speed=50.0, torque=TORQUE)
KEPT = [(3, 1), (3, 2), (4, 1), (4, 2)]
FEATURES = [f"{kind}{i}" for kind in ("pin", "hole") for i in (1, 2, 3, 4)]


@pytest.fixture
def errors():
    def make(alpha=15.0, seed=None, offset=2e-4, tilt=1e-2, **given):
        table = nominal_errors(1, CARDAN)
        table["operation.alpha"] = np.radians(alpha)
        rng = np.random.default_rng(seed)
        for feature in FEATURES if seed is not None else ():
            for axis in "etz":
                table[f"{feature}.offset_{axis}"] = rng.normal(0, offset)
            for axis in "tz":
                table[f"{feature}.tilt_{axis}"] = rng.normal(0, tilt)
        for name, value in given.items():
            table[name.replace("__", ".")] = value
        return table

    return make


def features(errors, radius, pin):
    """Point and direction of a pin in the cross and of its hole in its fork."""
    found = []
    for name in (f"pin{pin}", f"hole{HOLE_OF_PIN[pin - 1]}"):
        local = triads()[body(name)]
        shift = np.array([errors[f"{name}.offset_{axis}"][0] for axis in "etz"])
        turn = np.array([0.0, errors[f"{name}.tilt_t"][0], errors[f"{name}.tilt_z"][0]])
        found += [radius * local[0] + shift @ local, Rotation.from_rotvec(turn @ local).apply(local[0])]
    return found


def about_z(angle):
    return Rotation.from_rotvec(np.multiply.outer(angle, [0.0, 0.0, 1.0]))


def links(alpha, theta, output_angle):
    """Attitudes of the forks from the angles of their shafts, (k, 3, 3) each."""
    tilted = Rotation.from_euler("y", alpha)
    return about_z(theta).as_matrix(), (tilted * about_z(output_angle)).as_matrix()


def twists(joint, row, theta, h=1e-5, **kept):
    """Twists of the three links about O for a unit input speed, (k, 3, 6), by differences of their poses."""
    after, before = (rccc.solve(joint, AT, row, theta + s, **kept).pose for s in (h, -h))
    now = rccc.solve(joint, AT, row, theta, **kept).pose
    turned = after.attitude @ np.swapaxes(before.attitude, -1, -2)
    spin = Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_rotvec().reshape(-1, 3, 3) / (2 * h)
    velocity = (after.origin - before.origin) / (2 * h)
    return np.concatenate([velocity - np.cross(spin, now.origin), spin], axis=-1)


# --- mobility -------------------------------------------------------------------------------------------


def test_kutzbach_counts_as_the_paper_does():
    assert rccc_statics.kutzbach(4, [1, 1, 1, 1]) == -2
    assert rccc_statics.kutzbach(4, [1, 2, 2, 2]) == 1


@pytest.mark.parametrize("alpha", [0.0, 15.0, 40.0])
def test_ideal_revolute_joint_turns_because_its_constraints_are_dependent(cirelli, errors, alpha):
    lines = rccc.solve(cirelli, AT, errors(alpha), THETA).lines
    revolute, cylindrical = rccc_statics.mobility(lines, "RRRR"), rccc_statics.mobility(lines, "RCCC")
    assert (revolute.kutzbach, revolute.equations) == (-2, 20)
    assert_array_equal([revolute.rank, revolute.dof, revolute.redundant], np.outer([17, 1, 3], np.ones(73)))
    assert (cylindrical.kutzbach, cylindrical.equations) == (1, 17)
    assert_array_equal([cylindrical.rank, cylindrical.dof, cylindrical.redundant], np.outer([17, 1, 0], np.ones(73)))
    assert revolute.singular_values[:, -1].max() < 1e-14
    assert revolute.singular_values[:, -2].min() > 0.1


@pytest.mark.parametrize("seed", range(3))
def test_errors_lock_the_revolute_joint_and_leave_the_rccc_linkage_its_freedom(cirelli, errors, seed):
    lines = rccc.solve(cirelli, AT, errors(seed=seed), THETA).lines
    assert_array_equal(rccc_statics.mobility(lines, "RRRR").dof, 0)
    assert_array_equal(rccc_statics.mobility(lines).dof, 1)


@pytest.mark.parametrize(
    ("freedoms", "names"),
    [
        (0, ["pin1__offset_z", "pin1__tilt_t", "hole4__offset_t", "hole4__tilt_z"]),  # an axis misses the next: skew
        (
            1,
            ["pin1__offset_t", "pin1__tilt_z", "hole4__offset_z", "hole4__tilt_t", "pin1__offset_e"],
        ),  # still they meet
    ],
)
def test_rigid_revolute_pairs_lock_where_an_error_makes_axes_miss_each_other(cirelli, errors, freedoms, names):
    for name in names:
        size = 1e-4 if "offset" in name else np.radians(0.5)
        lines = rccc.solve(cirelli, AT, errors(**{name: size}), [1.0]).lines
        assert rccc_statics.mobility(lines, "RRRR").dof == [freedoms], name
        assert rccc_statics.mobility(lines).dof == [1], name


@pytest.mark.parametrize(("pairs", "seed"), [("RRRR", None), ("RRRR", 4), ("RCCC", None), ("RCCC", 4), ("RCCR", 4)])
def test_freedoms_are_those_of_the_loop_of_screws(cirelli, errors, pairs, seed):
    """Freedoms of a closed loop: screws less the rank of their 6 x n matrix, in Plücker coordinates."""
    lines = rccc.solve(cirelli, AT, errors(seed=seed), THETA).lines
    dof = []
    for points, axes in zip(lines.point / lines.length, lines.axis, strict=True):
        screws = [[*u, *np.cross(p, u)] for p, u in zip(points, axes, strict=True)]
        screws += [[0, 0, 0, *u] for u, kind in zip(axes, pairs, strict=True) if kind == "C"]
        dof.append(len(screws) - np.linalg.matrix_rank(screws, tol=1e-9))
    assert_array_equal(rccc_statics.mobility(lines, pairs).dof, dof)


@pytest.mark.parametrize("pairs", ["RCC", "RCCP", ""])
def test_unknown_pairs_are_refused(cirelli, errors, pairs):
    lines = rccc.solve(cirelli, AT, errors(), [0.0]).lines
    with pytest.raises(ValueError, match="four letters"):
        rccc_statics.mobility(lines, pairs)


# --- closure and speed ratio ----------------------------------------------------------------------------


@pytest.mark.parametrize(("input_pin", "output_pin"), KEPT)
@pytest.mark.parametrize("alpha", [0.0, 15.0, -30.0])
def test_misalignment_alone_gives_the_ideal_joint(cirelli, errors, alpha, input_pin, output_pin):
    found = rccc.solve(cirelli, AT, errors(alpha), THETA, input_pin=input_pin, output_pin=output_pin)
    a = np.radians(alpha)
    ratio = np.cos(a) / (1 - np.sin(a) ** 2 * np.cos(THETA) ** 2)  # eq. (2)
    assert_allclose(found.speed_ratio, ratio, rtol=1e-13)
    assert_allclose(found.psi, 0, atol=1e-13)
    assert_allclose(found.output_angle, ideal.output_angle(THETA, a), atol=1e-12)
    assert_allclose(np.tan(found.pair_angle[:, 0]), np.tan(a) * np.sin(THETA), atol=1e-12)
    assert_allclose(np.sin(found.pair_angle[:, 1]), np.sin(a) * np.cos(THETA), atol=1e-12)
    assert_allclose(found.slide, 0, atol=1e-13)


@pytest.mark.parametrize(("input_pin", "output_pin"), KEPT)
@pytest.mark.parametrize("seed", range(3))
def test_every_kept_pin_lies_in_its_hole(cirelli, errors, seed, input_pin, output_pin):
    row = errors(25.0, seed)
    found = rccc.solve(cirelli, AT, row, THETA, input_pin=input_pin, output_pin=output_pin)
    shaft = np.array([np.sin(np.radians(25)), 0, np.cos(np.radians(25))])
    fork, follower = links(np.radians(25), THETA, found.output_angle)
    assert_allclose(found.pose.attitude[:, 0], fork, atol=1e-12)
    assert_allclose(found.pose.attitude[:, 2], follower, atol=1e-11)
    assert_allclose(found.pose.origin[:, 0], 0, atol=0)
    assert_allclose(found.pose.origin[:, 2], found.slide[:, 2:] * shaft, atol=1e-13)
    for k, pin in enumerate((input_pin, output_pin)):
        pin_point, pin_axis, hole_point, hole_axis = features(row, cirelli.cross.R, pin)
        arm = 2 * k
        in_hole = found.pose.origin[:, arm] + found.pose.attitude[:, arm] @ hole_point
        on_pin = found.pose.origin[:, 1] + found.pose.attitude[:, 1] @ pin_point
        axis = found.pose.attitude[:, arm] @ hole_axis
        assert_allclose(found.pose.attitude[:, 1] @ pin_axis, axis, atol=1e-11)
        assert_allclose(on_pin - in_hole, found.slide[:, k : k + 1] * axis, atol=1e-13)
        assert_allclose(found.lines.point[:, k + 1], on_pin, atol=1e-13)


@pytest.mark.parametrize("seed", range(4))
def test_output_angle_is_that_of_the_spherical_four_bar_linkage(cirelli, errors, seed):
    """The directions of the axes make a spherical linkage: u1 . u2 is the cross's own, which is quadratic in tan."""
    row = errors(20.0, seed, tilt=0.03)
    found = rccc.solve(cirelli, AT, row, THETA)
    angle, _, _ = four_bar(row, cirelli.cross.R, np.radians(20), THETA)
    assert_allclose(np.exp(1j * found.output_angle), np.exp(1j * angle), atol=1e-11)
    assert np.ptp(found.output_angle - ideal.output_angle(THETA, np.radians(20))) > 1e-3


def four_bar(row, radius, alpha, theta):
    """Output angle by A cos + B sin = D, the branch nearest to the ideal one; NaN where there is none."""
    _, pin_in, _, hole_in = features(row, radius, 3)
    _, pin_out, _, hole_out = features(row, radius, 1)
    tilted = Rotation.from_euler("y", alpha).as_matrix()
    seen = (about_z(theta).as_matrix() @ hole_in) @ tilted  # u1 in axes of the output shaft at rest
    a = seen[:, 0] * hole_out[0] + seen[:, 1] * hole_out[1]
    b = seen[:, 1] * hole_out[0] - seen[:, 0] * hole_out[1]
    d = (pin_in @ pin_out - seen[:, 2] * hole_out[2]) / np.hypot(a, b)
    with np.errstate(invalid="ignore"):
        branches = np.arctan2(b, a) + np.array([[1], [-1]]) * np.arccos(d)
    away = np.abs(np.exp(1j * branches) - np.exp(1j * ideal.output_angle(theta, alpha)))
    return np.where(away[0] < away[1], *branches), d, branches


@pytest.mark.parametrize("seed", range(3))
def test_speed_ratio_is_the_slope_of_the_output_angle(cirelli, errors, seed):
    row, h = errors(20.0, seed), 1e-4
    found = rccc.solve(cirelli, AT, row, THETA)
    ahead, behind = (rccc.solve(cirelli, AT, row, THETA + s).output_angle for s in (h, -h))
    assert_allclose(found.speed_ratio, (ahead - behind) / (2 * h), atol=1e-8)
    ratio = ideal.speed_ratio(THETA, np.radians(20))
    assert_allclose(found.psi, (found.speed_ratio - ratio) / found.speed_ratio, atol=1e-14)
    first = rccc.solve(cirelli, AT, row, [0.1, 0.1 + 2 * np.pi]).output_angle
    assert first[1] - first[0] == pytest.approx(2 * np.pi)


def test_position_errors_slide_the_pairs_and_turn_nothing(cirelli, errors):
    row = errors(seed=5, tilt=0.0)
    found = rccc.solve(cirelli, AT, row, THETA)
    assert_allclose(found.psi, 0, atol=1e-12)
    assert np.ptp(found.slide, axis=0).min() > 5e-6
    moved = rccc.solve(
        cirelli, AT, errors(0.0, hole4__offset_t=1e-4), THETA
    ).slide  # t of arm 4 is -x: along the input pin
    assert_allclose(moved, np.outer(np.ones(73), [-1e-4, 0, 0]), atol=1e-15)


@pytest.mark.parametrize("name", ["pin1__tilt_z", "hole4__tilt_t"])
def test_psi_grows_with_alpha_and_vanishes_for_coaxial_shafts(cirelli, errors, name):
    size = {name: np.radians(0.5)}
    largest = [np.abs(rccc.solve(cirelli, AT, errors(a, **size), THETA).psi).max() for a in (0.0, 5.0, 15.0, 30.0)]
    assert largest[0] < 1e-14
    assert np.all(np.diff(largest) > 1e-5)


@pytest.mark.parametrize("name", ["pin1__tilt_t", "hole4__tilt_z"])
def test_a_tilt_that_leaves_every_angle_between_axes_a_right_one_leaves_psi_zero(cirelli, errors, name):
    found = rccc.solve(cirelli, AT, errors(**{name: np.radians(0.5)}), THETA)
    assert_allclose(found.psi, 0, atol=1e-12)


def test_half_a_turn_exchanges_opposite_pins(cirelli, errors):
    one = errors(pin1__tilt_t=0.01, hole4__tilt_z=0.02, pin3__offset_z=1e-4, hole1__tilt_t=-0.01)
    other = errors(pin2__tilt_t=0.01, hole3__tilt_z=0.02, pin4__offset_z=1e-4, hole2__tilt_t=-0.01)
    found = rccc.solve(cirelli, AT, one, THETA, input_pin=3, output_pin=1)
    turned = rccc.solve(cirelli, AT, other, THETA + np.pi, input_pin=4, output_pin=2)
    for name in ("speed_ratio", "slide", "couple", "cross_loads", "pair_angle"):
        sign = np.array([-1, -1]) if name == "pair_angle" else 1
        assert_allclose(getattr(turned, name), sign * getattr(found, name), atol=1e-10, err_msg=name)
    left_out = rccc.solve(cirelli, AT, other, THETA, input_pin=3, output_pin=1)
    assert_allclose(left_out.psi, 0, atol=1e-13)


def test_no_pose_where_the_spherical_linkage_has_none(cirelli, errors):
    row = errors(89.0, pin1__tilt_t=np.radians(3), hole4__tilt_t=np.radians(3))
    theta = np.linspace(-np.pi, np.pi, 400)
    found = rccc.solve(cirelli, AT, row, theta)
    closes = np.isfinite(found.output_angle)
    _, d, branches = four_bar(row, cirelli.cross.R, np.radians(89), theta)
    assert 0 < closes.sum() < 400
    assert_array_equal(closes, np.abs(d) <= 1)
    away = np.abs(np.exp(1j * (found.output_angle - branches)) - 1).min(axis=0)
    assert away[closes].max() < 1e-6
    assert_array_equal(rccc_statics.mobility(found.lines).dof, np.where(closes, 1, -1))
    for name in ("psi", "couple", "driving_torque", "reactions"):
        value = np.isfinite(getattr(found, name)).reshape(400, -1)
        assert_array_equal(value.all(axis=1), closes, err_msg=name)
        assert_array_equal(value.any(axis=1), closes, err_msg=name)


# --- reactions ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("input_pin", "output_pin"), KEPT)
@pytest.mark.parametrize("alpha", [0.0, 15.0, 30.0])
def test_ideal_joint_passes_the_couple_of_the_closed_form(cirelli, errors, alpha, input_pin, output_pin):
    found = rccc.solve(cirelli, AT, errors(alpha), THETA, input_pin=input_pin, output_pin=output_pin)
    couple = cross_couple(THETA, np.radians(alpha), TORQUE)
    assert_allclose(found.couple, couple, rtol=1e-12)
    shares = found.couple / (2 * cirelli.cross.R)
    assert_allclose(shares, pin_force(THETA, np.radians(alpha), TORQUE, cirelli.cross.R), rtol=1e-12)
    assert_allclose(found.reactions[..., :3], 0, atol=1e-9)
    about_normal = np.zeros((73, 2, 6))
    about_normal[:, 0, 5], about_normal[:, 1, 5] = couple, -couple
    assert_allclose(found.cross_loads, about_normal, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_torque_alone_goes_through_as_a_couple_normal_to_both_pins(cirelli, errors, seed):
    found = rccc.solve(cirelli, AT, errors(seed=seed), THETA)
    u1, u2, a = (found.lines.axis[:, k] for k in (1, 2, 3))
    normal = np.cross(u1, u2)
    expected = TORQUE * normal / np.sum(normal * a, axis=1, keepdims=True)
    assert_allclose(found.reactions[:, 1, 3:], expected, rtol=1e-9)
    assert_allclose(found.reactions[:, 2, 3:], expected, rtol=1e-9)
    assert_allclose(found.reactions[..., :3], 0, atol=1e-8)
    assert_allclose(found.driving_torque, TORQUE * found.speed_ratio, rtol=1e-10)


@pytest.fixture
def loaded(cirelli, errors):
    """A linkage with errors, and arbitrary forces and moments on every link."""
    row = errors(20.0, seed=7)
    found = rccc.solve(cirelli, AT, row, THETA, input_pin=4, output_pin=2)
    external = np.random.default_rng(8).normal(0, [[[300.0] * 3 + [20.0] * 3]], (73, 3, 6))
    return row, found, external, rccc_statics.react(found.lines, external)


def test_every_link_and_the_whole_linkage_are_in_equilibrium(loaded):
    _, found, external, reactions = loaded
    passed = reactions.at_centre
    driven = np.zeros((73, 6))
    driven[:, 5] = reactions.driving_torque
    assert_allclose(external[:, 0] + driven + passed[:, 0] - passed[:, 1], 0, atol=1e-9)
    assert_allclose(external[:, 1] + passed[:, 1] - passed[:, 2], 0, atol=1e-9)
    assert_allclose(external[:, 2] + passed[:, 2] - passed[:, 3], 0, atol=1e-9)
    assert_allclose(external.sum(axis=1) + driven + passed[:, 0] - passed[:, 3], 0, atol=1e-9)
    arm = np.cross(found.lines.point, passed[..., :3])
    assert_allclose(reactions.at_point[..., 3:] + arm, passed[..., 3:], atol=1e-9)


def test_reactions_are_reciprocal_to_what_their_pairs_allow(loaded):
    _, found, _, reactions = loaded
    force, moment = reactions.at_point[..., :3], reactions.at_point[..., 3:]
    turning = np.sum(moment * found.lines.axis, axis=2)
    sliding = np.sum(force * found.lines.axis, axis=2)
    assert_allclose(turning, 0, atol=1e-9)
    assert_allclose(sliding[:, 1:], 0, atol=1e-9)
    assert np.abs(sliding[:, 0]).min() > 1e-3  # the revolute pair does hold the input shaft along its axis


def test_driving_torque_follows_from_virtual_work(cirelli, loaded):
    row, _, external, reactions = loaded
    moving = twists(cirelli, row, THETA, input_pin=4, output_pin=2)
    power = np.sum(external * moving, axis=(1, 2))
    assert_allclose(reactions.driving_torque + power, 0, atol=1e-5)


def test_motion_is_the_one_that_the_constraints_leave(cirelli, errors):
    row = errors(20.0, seed=9)
    moving = twists(cirelli, row, THETA)
    moving[..., :3] /= cirelli.cross.R
    jacobian = rccc_statics.constraint_jacobian(rccc.solve(cirelli, AT, row, THETA).lines)
    assert_allclose(np.einsum("kij,kj->ki", jacobian, moving.reshape(-1, 18)), 0, atol=1e-7)


@pytest.mark.parametrize(("case", "error"), [("ideal_15", {}), ("pos_fork_t_15", {"hole4__offset_t": 1e-4})])
def test_elastic_reference_joints_carry_the_couple_of_the_linkage(cirelli, errors, case, error):
    """Both output pins of the reference solution together; the linkage's output fork has its inertia for a load."""
    theta, alpha, omega = np.arange(180) * 2 * np.pi / 180, np.radians(15), 500 * np.pi / 30
    with np.load(REFERENCE / "loads.npz") as file:
        loads = file[f"{case}__loads"].astype(float)
    couple = np.zeros((180, 3))
    for k, pin in enumerate((1, 2)):
        local = triads()[body(f"pin{pin}")]
        force, torque = loads[:, k, :3] @ local, loads[:, k, 3:] @ local
        couple += torque + np.cross(cirelli.cross.r_b * local[0], force)

    linkage = rccc.solve(cirelli, AT, errors(**error), theta)
    mass, inertia = cirelli.arm.mass, cirelli.arm.inertia
    about_shaft = cirelli.shaft.Js + 2 * (mass * cirelli.cross.R**2 + inertia[2])
    slope = -np.cos(alpha) * np.sin(alpha) ** 2 * np.sin(2 * theta) / (1 - (np.sin(alpha) * np.cos(theta)) ** 2) ** 2
    external = np.zeros((180, 3, 6))
    external[:, 2, 3:] = -(TORQUE + about_shaft * omega**2 * slope)[:, None] * linkage.lines.axis[:, 3]
    passed = rccc_statics.react(linkage.lines, external).at_centre[:, 2, 3:]
    in_cross = np.einsum("kji,kj->ki", linkage.pose.attitude[:, 1], passed)
    assert_allclose(couple, in_cross, atol=0.01 * TORQUE)  # what the hub passes to the pins goes to the output fork


# --- arguments ------------------------------------------------------------------------------------------


def test_one_row_may_come_as_a_scalar_or_as_a_table_of_one(cirelli, errors):
    row = errors(seed=1)
    assert_array_equal(rccc.solve(cirelli, AT, row[0], 0.3).psi, rccc.solve(cirelli, AT, row, [0.3]).psi)


@pytest.mark.parametrize(
    ("change", "kept", "message"),
    [
        ({}, {"input_pin": 1}, "pin 3 or 4"),
        ({}, {"output_pin": 3}, "1 or 2"),
        ({"operation__alpha": np.pi / 2}, {}, "less than 90 deg"),
        ({"operation__alpha": np.nan}, {}, "less than 90 deg"),
    ],
)
def test_what_cannot_be_a_cardan_joint_is_refused(cirelli, errors, change, kept, message):
    with pytest.raises(ValueError, match=message):
        rccc.solve(cirelli, AT, errors(**change), THETA, **kept)


def test_one_joint_at_a_time(cirelli, errors):
    with pytest.raises(ValueError, match="2 joints"):
        rccc.solve(cirelli, AT, np.repeat(errors(), 2), THETA)
