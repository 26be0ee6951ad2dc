"""A mechanism once more, slowly and plainly: world coordinates, NumPy, one statement for each sentence of the model.

Twin of ``kernel.mechanics.dynamics``: it shares no code with the kernel but the table of parameters and the description
of the mechanism, which it reads by name. Velocities and accelerations of bodies come from differences of their world
position and attitude in time, or `follow` integrates them, so that none of the kernel's inertial terms is written a
second time. The world of a body is that of the Cardan joint that it is part of: z along the input side, the plane of
the joint x-z.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from tests.support.mechanisms import triads
from tolstat.common.cardan import CARDAN
from tolstat.common.mechanism import DRIVEN, HELD, SERIES

Z = np.array([0.0, 0.0, 1.0])
NODES = np.arange(-4, 5)
FIRST = np.array([3, -32, 168, -672, 0, 672, -168, 32, -3]) / 840
SECOND = np.array([-9, 128, -1008, 8064, -14350, 8064, -1008, 128, -9]) / 5040
"""Weights of central differences over nine points, for the first and second derivative."""


def turn(axis, angle):
    return Rotation.from_rotvec(angle * np.array(axis, float)).as_matrix()


def joint_frames(theta, alpha):
    """Attitudes of input, cross and output of one Cardan joint."""
    beta = np.arctan(np.tan(alpha) * np.sin(theta))
    gamma = np.arcsin(np.sin(alpha) * np.cos(theta))
    i = turn(Z, theta)
    c = i @ turn((1, 0, 0), beta)
    return i, c, c @ turn((0, 1, 0), gamma)


def frames(theta, par, mechanism=CARDAN):
    """Attitudes of the members, (n, 3, 3), where the input is at `theta`."""
    return poses(theta, par, mechanism)[0]


def poses(theta, par, mechanism):
    """Attitudes, (n, 3, 3), and origins, (n, 3), of the members, where the input is at `theta`."""
    return placed(theta, par, mechanism) if mechanism.placed else driveline(theta, par, mechanism)


def driveline(theta, par, mechanism):
    """Poses of Cardan joints one behind the other, each bent in its own plane, and of members beside them."""
    found = [turn(Z, {HELD: 0.0, DRIVEN: theta}.get(member.motion, np.nan)) for member in mechanism.members]
    origin, names = np.zeros((len(found), 3)), [member.name for member in mechanism.members]
    plane, centre = np.eye(3), np.zeros(3)
    for joint, name in enumerate(mechanism.cardan):
        plane = plane @ turn(Z, par.plane[joint])
        centre, theta = centre + par.span[joint] * plane @ Z, theta + par.ahead[joint]
        first = names.index(name)
        found[first : first + 3] = plane @ joint_frames(theta, par.alpha[joint])
        origin[first : first + 3] = centre
        plane = plane @ turn((0, 1, 0), par.alpha[joint])
        output = plane.T @ found[first + 2]
        theta = np.arctan2(output[1, 0], output[0, 0])
    return np.array(found), origin


def placed(theta, par, mechanism):
    """Attitudes, (n, 3, 3), and origins, (n, 3), of members that have a place in their parents."""
    pose = {"": (np.eye(3), np.zeros(3))}
    for i, member in enumerate(mechanism.members):
        attitude, origin = pose[member.parent]
        order = np.arange(1, mechanism.waves + 1)
        series = par.wave[i, :, 0] @ np.cos(order * theta) + par.wave[i, :, 1] @ np.sin(order * theta)
        of_series = par.angle[i, 0] + par.angle[i, 1] * theta + series
        angle = {HELD: 0.0, DRIVEN: theta, SERIES: of_series}[member.motion]
        pose[member.name] = attitude @ par.mount[i] @ turn(Z, angle), origin + attitude @ par.pivot[i]
    return tuple(np.array([pose[member.name][k] for member in mechanism.members]) for k in range(2))


def input_angle(phase, par):
    """Input angle theta at the mean input angle; its orders are sums of cosines and sines."""
    waves = [(par.order[i] * phase, par.speed_order[i]) for i in range(par.n_orders)]
    return phase + sum(cosine * np.cos(x) + sine * np.sin(x) for x, (cosine, sine) in waves)


def resisting_torque(phase, par):
    """Resisting torque T_r, N m."""
    waves = [(par.order[i] * phase, par.torque_order[i]) for i in range(par.n_orders)]
    return par.torque + sum(cosine * np.cos(x) + sine * np.sin(x) for x, (cosine, sine) in waves)


def members_of_bodies(mechanism):
    """Number of the member of each body, lumps before shafts."""
    names = [member.name for member in mechanism.members]
    return [names.index(part.member) for part in (*mechanism.lumps, *mechanism.shafts)]


def ideal_attitudes(t, par, mechanism):
    """Attitudes of the ideal frames of all bodies at one time, lumps before shafts, (bodies, 3, 3)."""
    return frames(input_angle(par.omega * t, par), par, mechanism)[members_of_bodies(mechanism)]


def origins(t, par, mechanism):
    """Origins of the ideal frames of all bodies at one time, (bodies, 3)."""
    return poses(input_angle(par.omega * t, par), par, mechanism)[1][members_of_bodies(mechanism)]


def triads_of(par, mechanism):
    """Rows e, t, z of each lump in axes of its member, (lumps, 3, 3)."""
    return par.triad if len(par.triad) else triads(mechanism)


def places(par, mechanism):
    """Reference points of the lumps in axes of their members, (lumps, 3)."""
    kinds = [mechanism.lump_kinds.index(lump.kind) for lump in mechanism.lumps]
    return np.einsum("ba,bak->bk", par.at[kinds], triads_of(par, mechanism))


def of_shafts(values, par, mechanism):
    """Rotation about z and displacement of each shaft by the unknowns `values` of shafts, (shafts, 4)."""
    value = dict(zip(mechanism.unknowns, values, strict=True)) | {"": 0.0}
    return np.array(
        [
            (value[shaft.turns], *[value[name] for name in shaft.across or ("", "")], par.slides * value[shaft.slides])
            for shaft in mechanism.shafts
        ]
    )


class Bodies(NamedTuple):
    """World position of reference points, (n, 3), and attitude, (n, 3, 3), of all bodies, lumps before shafts."""

    position: np.ndarray
    attitude: np.ndarray


def bodies(t, q, par, mechanism=CARDAN):
    """Bodies at one time; `q`: deviations, (dof,)."""
    lumps = len(mechanism.lumps)
    ideal = ideal_attitudes(t, par, mechanism)
    of_lumps, shafts = q[: 6 * lumps].reshape(lumps, 6), of_shafts(q[6 * lumps :], par, mechanism)
    inside = np.concatenate([places(par, mechanism) + of_lumps[:, :3], shafts[:, 1:]])
    vectors = np.concatenate([of_lumps[:, 3:], shafts[:, :1] * Z])
    position = origins(t, par, mechanism) + np.einsum("bij,bj->bi", ideal, inside)
    return Bodies(position, ideal @ Rotation.from_rotvec(vectors).as_matrix())


class Motion(NamedTuple):
    """Bodies, their velocities and angular velocities, and the derivatives of these; all (n, 3)."""

    bodies: Bodies
    velocity: np.ndarray
    spin: np.ndarray
    acceleration: np.ndarray
    spin_rate: np.ndarray


def vee(matrices):
    """Vectors of the skew parts of matrices, (n, 3)."""
    skew = 0.5 * (matrices - matrices.swapaxes(1, 2))
    return np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)


def motion(t, q, v, a, par, mechanism=CARDAN, h=2e-6):
    """Motion by central differences along q + v s + a s^2 / 2.

    The second derivative of an attitude times its transpose has the angular acceleration as skew part.
    """
    at = [bodies(t + s, q + v * s + a * s * s / 2, par, mechanism) for s in h * NODES]
    position, attitude = (np.array([getattr(one, name) for one in at]) for name in Bodies._fields)
    back = attitude[4].swapaxes(1, 2)
    spin = vee(np.tensordot(FIRST, attitude, 1) @ back) / h
    spin_rate = vee(np.tensordot(SECOND, attitude, 1) @ back) / h**2
    velocity, acceleration = np.tensordot(FIRST, position, 1) / h, np.tensordot(SECOND, position, 1) / h**2
    return Motion(at[4], velocity, spin, acceleration, spin_rate)


def smooth_step(x):
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)


def contact_mode(stations):
    """Name of the contact mode by Figure 3 of the paper, from direction and penetration of the end stations."""
    ends = (stations[0], stations[-1])
    sides = [n for n, delta in ends if delta > 0]
    if len(sides) < 2:
        return "ONE_POINT" if sides else "NONE"
    return "TWO_POINT" if sides[0] @ sides[1] < 0 else "UNIFORM"


def kind_of(p, mechanism):
    """Number of the kind of pair p."""
    return mechanism.pair_kinds.index(mechanism.pairs[p].kind)


def needles(delta, p, kind, j, par):
    """Force of the needles at station j of pair p, N."""
    return par.station_k3[kind, j] * delta ** (13 / 8) / np.sqrt(delta + par.needle_b[kind] * par.clearance[p])


def stations_of(p, now, par, mechanism):
    """Stations of the pin of pair p that touch its hole or not: point, normal, penetration, pressing force, force."""
    pin, hole = (mechanism.bodies.index(name) for name in (mechanism.pairs[p].pin, mechanism.pairs[p].hole))
    position, attitude = now.bodies
    centre = position[hole] + attitude[hole] @ par.hole_point[p]
    axis = attitude[hole] @ par.hole_axis[p]
    stations, kind = [], kind_of(p, mechanism)
    for j in range(par.n_stations[kind]):
        point = position[pin] + attitude[pin] @ (par.pin_point[p] + par.station_s[kind, j] * par.pin_axis[p])
        d = point - centre
        g = d - (d @ axis) * axis
        n, delta = g / np.linalg.norm(g), np.linalg.norm(g) - par.clearance[p]
        if delta <= 0:
            stations.append((point, n, delta, 0.0, np.zeros(3)))
            continue
        slip = velocity_at(point, pin, now) - velocity_at(point, hole, now)
        elastic = par.station_k1[kind, j] * delta**2 + par.station_k2[kind, j] * delta
        elastic += needles(delta, p, kind, j, par)
        ramp = par.station_weight[kind, j] * smooth_step(delta / par.delta_d[kind])
        pressing = max(0.0, elastic + par.c_d[kind] * ramp * (slip @ n))
        tangential = slip - (slip @ n) * n - (slip @ axis) * axis
        stations.append((point, n, delta, pressing, -pressing * n - par.c_t[kind] * ramp * tangential))
    return stations


def face_of(i, now, par, mechanism):
    """Thrust face i: where the end of the pin is, direction in which the hole stops it, penetration, pressing force."""
    face = mechanism.faces[i]
    p = [pair.pin for pair in mechanism.pairs].index(face.pin)
    kind = kind_of(p, mechanism)
    pin, hole = (mechanism.bodies.index(name) for name in (face.pin, mechanism.pairs[p].hole))
    position, attitude = now.bodies
    end = position[pin] + attitude[pin] @ (par.pin_point[p] + par.face_at[i, 0] * par.pin_axis[p])
    stop = position[hole] + attitude[hole] @ (par.hole_point[p] + par.face_at[i, 1] * par.hole_axis[p])
    inwards = -face.end * attitude[hole] @ par.hole_axis[p]
    delta = (stop - end) @ inwards
    approach = (velocity_at(end, hole, now) - velocity_at(end, pin, now)) @ inwards
    pressing = par.face_k[kind] * delta + par.face_c[kind] * smooth_step(delta / par.delta_d[kind]) * approach
    return end, inwards, delta, max(0.0, pressing) if delta > 0 else 0.0


def rubbing_of(p, now, par, mechanism):
    """Friction on the pin of pair p at each station that presses: point, force, power that is lost."""
    pin, hole = (mechanism.bodies.index(name) for name in (mechanism.pairs[p].pin, mechanism.pairs[p].hole))
    found, kind = [], kind_of(p, mechanism)
    for point, n, _, pressing, _ in stations_of(p, now, par, mechanism):
        surface = point + par.friction_radius[kind] * n
        w = velocity_at(surface, pin, now) - velocity_at(surface, hole, now)
        w = w - (w @ n) * n
        axis = now.bodies.attitude[hole] @ par.hole_axis[p]
        around_and_along = np.eye(3) + (par.mu_ratio[kind] - 1) * np.outer(axis, axis)
        u = around_and_along @ w
        force = -par.mu[kind] * pressing * around_and_along @ u / np.sqrt(u @ u + par.slip_speed[kind] ** 2)
        found.append((surface, force, -force @ w))
    return found


def velocity_at(point, body, now):
    """Velocity of a point that moves with a body."""
    return now.velocity[body] + np.cross(now.spin[body], point - now.bodies.position[body])


def contacts(t, q, v, par, mechanism=CARDAN):
    """Contact forces of each pin, (pairs, 3): of its outermost station, of its innermost one, resultant of all."""
    now = motion(t, q, v, 0 * q, par, mechanism)
    found = []
    for p in range(len(mechanism.pairs)):
        stations = stations_of(p, now, par, mechanism)
        total = np.linalg.norm(sum(f for *_, f in stations))
        found.append((stations[0][3], stations[-1][3], total))
    return np.array(found)


def vector_rate(relative, spin):
    """Rate of the rotation vector of an attitude that turns with `spin`, all in axes of the base, by short turns."""
    h = 1e-3
    turned = Rotation.from_rotvec(h * np.multiply.outer(NODES, spin / max(1.0, np.linalg.norm(spin)))).as_matrix()
    vectors = Rotation.from_matrix(turned @ relative).as_rotvec()
    return max(1.0, np.linalg.norm(spin)) * (FIRST @ vectors) / h


class Loads(NamedTuple):
    """Forces between bodies.

    Attributes
    ----------
    force : ndarray, shape (bodies, 6)
        World force and torque about the reference point.
    bushing : ndarray, shape (bushings, 6)
        On the lump, along its triad in the base.
    modes : list of str
        Contact mode of each pin.
    thrust : ndarray, shape (faces,)
        Force of each thrust face.
    loss : ndarray, shape (pairs,)
        Power that the friction of each pin takes; 0 where pins do not rub.
    """

    force: np.ndarray
    bushing: np.ndarray
    modes: list[str]
    thrust: np.ndarray
    loss: np.ndarray


def forces(t, q, v, par, mechanism=CARDAN):
    """Loads at a state."""
    return loads_between(motion(t, q, v, 0 * q, par, mechanism), par, mechanism)


def loads_between(now, par, mechanism):
    """Loads of bodies that move as `now` says."""
    position, attitude = now.bodies
    force, loads, modes = np.zeros((len(mechanism.bodies), 6)), [], []

    def apply(body, f, torque, point):
        force[body] += np.concatenate([f, torque + np.cross(point - position[body], f)])

    for bushing in mechanism.bushings:
        lump, base = (mechanism.bodies.index(name) for name in (bushing.lump, bushing.base))
        kind, local = mechanism.bushing_kinds.index(bushing.kind), triads_of(par, mechanism)[lump]
        on_lump, on_base = par.marker[kind] @ local
        marker = position[lump] + attitude[lump] @ on_lump
        to_marker = local @ attitude[base].T
        x = to_marker @ (marker - position[base] - attitude[base] @ on_base)
        moving = velocity_at(marker, lump, now) - velocity_at(marker, base, now)
        relative = attitude[base].T @ attitude[lump]
        phi = Rotation.from_matrix(relative).as_rotvec()
        rate = vector_rate(relative, attitude[base].T @ (now.spin[lump] - now.spin[base]))
        load = -par.k[kind] * np.concatenate([x, local @ phi])
        load -= par.c[kind] * np.concatenate([to_marker @ moving, local @ rate])
        load[2] += par.push * bushing.pushed
        f, torque = to_marker.T @ load[:3], to_marker.T @ load[3:]
        apply(lump, f, torque, marker)
        apply(base, -f, -torque, marker)
        loads.append(load)

    def act(pair, f, point):
        apply(mechanism.bodies.index(pair.pin), f, np.zeros(3), point)
        apply(mechanism.bodies.index(pair.hole), -f, np.zeros(3), point)

    loss = np.zeros(len(mechanism.pairs))
    for p, pair in enumerate(mechanism.pairs):
        stations = stations_of(p, now, par, mechanism)
        modes.append(contact_mode([(n, delta) for _, n, delta, _, _ in stations]))
        for point, _, _, _, f in stations:
            act(pair, f, point)
        for point, f, power in rubbing_of(p, now, par, mechanism) if mechanism.friction else ():
            act(pair, f, point)
            loss[p] += power
    faces = [face_of(i, now, par, mechanism) for i in range(len(mechanism.faces))]
    pair_of = {pair.pin: pair for pair in mechanism.pairs}
    for face, (point, inwards, _, pressing) in zip(mechanism.faces, faces, strict=True):
        act(pair_of[face.pin], pressing * inwards, point)
    return Loads(force, np.array(loads), modes, np.array([pressing for *_, pressing in faces]), loss)


def inertias(attitude, par, mechanism):
    """Mass, (n,), and inertia in world axes, (n, 3, 3), of each lump."""
    kinds = [mechanism.lump_kinds.index(lump.kind) for lump in mechanism.lumps]
    axes = attitude[: len(kinds)] @ triads_of(par, mechanism).swapaxes(1, 2)
    return par.mass[kinds], np.einsum("bij,bj,bkj->bik", axes, par.inertia[kinds], axes)


def applied(t, par, mechanism):
    """World force and torque on each lump that no other body causes, (lumps, 6): weight, unbalance, torque."""
    found = np.zeros((len(mechanism.lumps), 6))
    if mechanism.placed:
        kinds = [mechanism.lump_kinds.index(lump.kind) for lump in mechanism.lumps]
        found[:, :3] = np.multiply.outer(par.mass[kinds], par.weight)
        for force, value, place in zip(mechanism.forces, par.pull, par.pull_at, strict=True):
            lump = mechanism.bodies.index(force.lump)
            own = ideal_attitudes(t, par, mechanism)[lump]
            pulled = own @ value if force.turns else value
            found[lump] += np.concatenate([pulled, np.cross(own @ place, pulled)])
    found[:, :3] += thrown(t, par, mechanism)[: len(found)]
    if mechanism.loaded:
        loaded = mechanism.bodies.index(mechanism.loaded)
        axis = ideal_attitudes(t, par, mechanism)[loaded] @ Z
        found[loaded, 3:] -= resisting_torque(par.omega * t, par) * axis
    return found


def thrown(t, par, mechanism):
    """World force of the unbalance of each body, (bodies, 3): it turns with the body's ideal frame."""
    found = np.zeros((len(mechanism.bodies), 3))
    if mechanism.unbalanced:
        attitudes, still = ideal_attitudes(t, par, mechanism), np.zeros(mechanism.dof)
        spins = motion(t, still, still, still, par, mechanism).spin
        for unbalance, name in zip(par.unbalance, mechanism.unbalanced, strict=True):
            body = mechanism.bodies.index(name)
            found[body] = attitudes[body] @ (*unbalance, 0.0) * (spins[body] @ attitudes[body][:, 2]) ** 2
    return found


def on_shafts(t, force, q, v, par, mechanism):
    """Torque or force that accelerates each unknown of shafts, its ideal acceleration apart, and its inertia."""
    attitudes, own = ideal_attitudes(t, par, mechanism)[len(mechanism.lumps) :], force[len(mechanism.lumps) :]
    axes, found = attitudes @ Z, []
    for u, name in enumerate(mechanism.unknowns):
        i = 6 * len(mechanism.lumps) + u
        turning = [k for k, shaft in enumerate(mechanism.shafts) if shaft.turns == name]
        sliding = [k for k, shaft in enumerate(mechanism.shafts) if shaft.slides == name]
        total = sum(own[k, 3:] @ axes[k] for k in turning) + sum(own[k, :3] @ axes[k] for k in sliding)
        across = [(k, shaft.across.index(name)) for k, shaft in enumerate(mechanism.shafts) if name in shaft.across]
        for k, axis in across:
            total += across_shaft(t, q, v, k, own, par, mechanism)[axis]
        if sliding:
            total += par.F_a - par.k_a * par.slides * q[i] - par.c_a * par.slides * v[i]
        elif name == mechanism.rotations[-1]:
            total -= resisting_torque(par.omega * t, par)
        found.append((total, par.m_s if sliding or across else par.Js[u]))
    return found


def across_shaft(t, q, v, k, own, par, mechanism):
    """Force across shaft k along x and y of its frame: of its arms, of unbalance, of springs in the ground."""
    lumps = len(mechanism.lumps)
    attitude, now = ideal_attitudes(t, par, mechanism)[lumps + k], motion(t, q, v, 0 * q, par, mechanism)
    moved = now.bodies.position[lumps + k] - origins(t, par, mechanism)[lumps + k]
    world = own[k, :3] - par.k_l * moved - par.c_l * now.velocity[lumps + k] + thrown(t, par, mechanism)[lumps + k]
    return attitude.T @ world


def imbalance(t, q, v, a, par, mechanism=CARDAN):
    """World momentum rates less forces and torques of every lump, and of shafts about and along their axes, by name."""
    now, lumps = motion(t, q, v, a, par, mechanism), len(mechanism.lumps)
    force = loads_between(now, par, mechanism).force
    force[:lumps] += applied(t, par, mechanism)
    mass, inertia = inertias(now.bodies.attitude, par, mechanism)
    off = {}
    for b, lump in enumerate(mechanism.lumps):
        torque = inertia[b] @ now.spin_rate[b] + np.cross(now.spin[b], inertia[b] @ now.spin[b])
        off[lump.name] = np.concatenate([mass[b] * now.acceleration[b], torque]) - force[b]
    axes = ideal_attitudes(t, par, mechanism)[lumps:] @ Z
    of_unknowns = on_shafts(t, force, q, v, par, mechanism)
    for name, (total, own_inertia) in zip(mechanism.unknowns, of_unknowns, strict=True):
        for k, shaft in enumerate(mechanism.shafts):
            if shaft.turns == name:
                off[name] = own_inertia * now.spin_rate[lumps + k] @ axes[k] - total
            if name in shaft.across:
                axis = ideal_attitudes(t, par, mechanism)[lumps + k][:, shaft.across.index(name)]
                off[name] = own_inertia * now.acceleration[lumps + k] @ axis - total
            if shaft.slides == name and par.slides:
                off[name] = own_inertia * now.acceleration[lumps + k] @ axes[k] - total
    return off


class World:
    """Unknowns of a mechanism in world coordinates: of each lump place, quaternion, velocity, spin; of shafts q, v."""

    def __init__(self, par, mechanism=CARDAN):
        self.par, self.mechanism, self.lumps = par, mechanism, len(mechanism.lumps)

    def pack(self, position, quaternion, velocity, spin, shafts):
        """One vector of all."""
        return np.concatenate([np.hstack([position, quaternion, velocity, spin]).ravel(), np.ravel(shafts)])

    def unpack(self, y):
        """What `pack` takes; of shafts values and rates."""
        of_lumps = y[: 13 * self.lumps].reshape(self.lumps, 13)
        return (*np.split(of_lumps, [3, 7, 10], axis=1), y[13 * self.lumps :].reshape(2, -1))

    def state(self, t, q, v):
        """Deviations and their rates, in world coordinates."""
        now, n = motion(t, q, v, 0 * q, self.par, self.mechanism), self.lumps
        quaternion = Rotation.from_matrix(now.bodies.attitude[:n]).as_quat()
        of_shafts = q[6 * n :], v[6 * n :]
        return self.pack(now.bodies.position[:n], quaternion, now.velocity[:n], now.spin[:n], of_shafts)

    def deviations(self, t, y):
        """Deviations q of a state in world coordinates."""
        position, quaternion, _, _, shafts = self.unpack(y)
        back = ideal_attitudes(t, self.par, self.mechanism)[: self.lumps].swapaxes(1, 2)
        position = position - origins(t, self.par, self.mechanism)[: self.lumps]
        u = np.einsum("bij,bj->bi", back, position) - places(self.par, self.mechanism)
        phi = Rotation.from_matrix(back @ Rotation.from_quat(quaternion).as_matrix()).as_rotvec()
        return np.concatenate([np.hstack([u, phi]).ravel(), shafts[0]])

    def rate(self, t, y):
        """Derivative of a state in world coordinates: Newton and Euler of each lump; shafts turn and slide."""
        position, quaternion, velocity, spin, (value, speed) = self.unpack(y)
        par, mechanism, n = self.par, self.mechanism, self.lumps
        q, v = (np.concatenate([np.zeros(6 * n), own]) for own in (value, speed))
        ideal = motion(t, q, v, 0 * q, par, mechanism)
        attitude = Rotation.from_quat(quaternion).as_matrix()
        now = Motion(
            Bodies(
                np.concatenate([position, ideal.bodies.position[n:]]),
                np.concatenate([attitude, ideal.bodies.attitude[n:]]),
            ),
            np.concatenate([velocity, ideal.velocity[n:]]),
            np.concatenate([spin, ideal.spin[n:]]),
            np.zeros(0),
            np.zeros(0),
        )
        force = loads_between(now, par, mechanism).force
        force[:n] += applied(t, par, mechanism)
        mass, inertia = inertias(now.bodies.attitude, par, mechanism)
        momentum = np.einsum("bij,bj->bi", inertia, spin)
        faster = np.linalg.solve(inertia, (force[:n, 3:] - np.cross(spin, momentum))[..., None])[..., 0]
        turned = 0.5 * np.hstack(
            [
                quaternion[:, 3:] * spin + np.cross(spin, quaternion[:, :3]),
                -(quaternion[:, :3] * spin).sum(axis=1, keepdims=True),
            ]
        )
        return self.pack(
            velocity, turned, force[:n, :3] / mass[:, None], faster, (speed, self._of_shafts(t, force, q, v, ideal))
        )

    def _of_shafts(self, t, force, q, v, ideal):
        """Second derivatives of the unknowns of shafts; `ideal`: motion without them."""
        axes = ideal_attitudes(t, self.par, self.mechanism)[self.lumps :] @ Z
        found = []
        for name, (total, inertia) in zip(
            self.mechanism.unknowns, on_shafts(t, force, q, v, self.par, self.mechanism), strict=True
        ):
            change = 0.0
            for k, shaft in enumerate(self.mechanism.shafts):
                if shaft.turns == name:
                    change = ideal.spin_rate[self.lumps + k] @ axes[k]
                if shaft.slides == name and not self.par.slides:
                    total, inertia = 0.0, 1.0
            found.append(total / inertia - change)
        return np.array(found)


def follow(t, q, v, end, par, mechanism=CARDAN, rtol=1e-7):
    """Deviations q at the times `end`, (n, dof), of a motion from q, v at `t` on: Radau's method, world coordinates."""
    world = World(par, mechanism)
    ones, n = np.ones((world.lumps, 3)), len(mechanism.unknowns)
    sizes = world.pack(1e-2 * ones, np.ones((world.lumps, 4)), ones, 1e2 * ones, np.repeat([[1.0], [1e2]], n, axis=1))
    found = solve_ivp(world.rate, (t, end[-1]), world.state(t, q, v), "Radau", end, rtol=rtol, atol=1e-2 * rtol * sizes)
    assert found.success, found.message
    return np.array([world.deviations(*at) for at in zip(found.t, found.y.T, strict=True)])


def turns(signal):
    """Values of a periodic signal at which it turns, in order; empty for a constant."""
    x = [a for a, b in zip(signal, [*signal[1:], signal[0]], strict=True) if a != b]
    around = zip([x[-1], *x[:-1]] if x else [], x, [*x[1:], *x[:1]], strict=True)
    return [b for a, b, c in around if (b - a) * (c - b) < 0]


def rainflow(signal):
    """Ranges and means of a periodic signal's cycles: the smallest step between two turns goes first."""
    points, cycles = turns(list(signal)), []
    while points:
        steps = [abs(b - a) for a, b in zip(points, [*points[1:], points[0]], strict=True)]
        i = int(np.argmin(steps))
        j = (i + 1) % len(points)
        cycles.append((steps[i], (points[i] + points[j]) / 2))
        points = [p for k, p in enumerate(points) if k not in (i, j)]
    return [size for size, _ in cycles], [mean for _, mean in cycles]
