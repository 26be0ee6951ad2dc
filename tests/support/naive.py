"""The joint once more, slowly and plainly: world coordinates, NumPy, one statement for each sentence of the model.

Twin of ``kernel.mechanics.dynamics``: it shares no code with the kernel but the table of parameters. Velocities and
accelerations of bodies come from differences of their world position and attitude in time, so that none of the
kernel's inertial terms is written a second time.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

PIN_AXES = {1: (0, 1), 2: (0, -1), 3: (1, 0), 4: (-1, 0)}
ARM_AXES = {1: (1, 0), 2: (-1, 0), 3: (0, -1), 4: (0, 1)}
ARM_OF_PIN = {1: 4, 2: 3, 3: 1, 4: 2}
Z = np.array([0.0, 0.0, 1.0])


def turn(axis, angle):
    return Rotation.from_rotvec(angle * np.array(axis, float)).as_matrix()


def frames(theta, alpha):
    """Attitudes of I, C and F."""
    beta = np.arctan(np.tan(alpha) * np.sin(theta))
    gamma = np.arcsin(np.sin(alpha) * np.cos(theta))
    i = turn(Z, theta)
    c = i @ turn((1, 0, 0), beta)
    return i, c, c @ turn((0, 1, 0), gamma)


def input_angle(phase, par):
    """Input angle theta at the mean input angle; its orders are sums of cosines and sines."""
    waves = [(par.order[i] * phase, par.speed_order[i]) for i in range(par.n_orders)]
    return phase + sum(cosine * np.cos(x) + sine * np.sin(x) for x, (cosine, sine) in waves)


def resisting_torque(phase, par):
    """Resisting torque T_r, N m."""
    waves = [(par.order[i] * phase, par.torque_order[i]) for i in range(par.n_orders)]
    return par.torque + sum(cosine * np.cos(x) + sine * np.sin(x) for x, (cosine, sine) in waves)


def triad(axes):
    e = np.array([*axes, 0.0])
    return np.array([e, np.cross(Z, e), Z])


class Bodies:
    """World position of reference points and attitude of all bodies at one time."""

    def __init__(self, t, q, par):
        i, c, f = frames(input_angle(par.omega * t, par), par.alpha)
        self.position, self.attitude = {}, {}
        names = ["hub"] + [f"pin{k}" for k in (1, 2, 3, 4)] + [f"arm{k}" for k in (1, 2, 3, 4)]
        for k, name in enumerate(names):
            number = int(name[-1]) if name != "hub" else 0
            frame = c if k < 5 else (i if number < 3 else f)
            e = np.zeros(3) if k == 0 else triad((PIN_AXES if k < 5 else ARM_AXES)[number])[0]
            u, phi = q[6 * k : 6 * k + 3], q[6 * k + 3 : 6 * k + 6]
            self.position[name] = frame @ (par.R * e + u)
            self.attitude[name] = frame @ Rotation.from_rotvec(phi).as_matrix()
        self.position["in"], self.position["out"] = np.zeros(3), f @ (par.slides * q[55] * Z)
        self.attitude["in"], self.attitude["out"] = i, f @ turn(Z, q[54])


def motion(t, q, v, a, par, h=1e-6):
    """Positions, attitudes, velocities and accelerations by central differences along q + v s + a s^2 / 2."""
    before, now, after = (Bodies(t + s, q + v * s + a * s * s / 2, par) for s in (-h, 0.0, h))
    velocity, spin = {}, {}
    for name in now.position:
        velocity[name] = (after.position[name] - before.position[name]) / (2 * h)
        step = Rotation.from_matrix(after.attitude[name] @ before.attitude[name].T).as_rotvec()
        spin[name] = step / (2 * h)
    return now, velocity, spin


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


def stations_of(p, body, velocity, spin, par):
    """Stations of pin p that touch its hole or not: point, normal, penetration, pressing force, force on the pin."""
    pin, arm = f"pin{p}", f"arm{ARM_OF_PIN[p]}"
    a_pin, a_arm = body.attitude[pin], body.attitude[arm]
    centre = body.position[arm] + a_arm @ par.hole_point[ARM_OF_PIN[p] - 1]
    axis = a_arm @ par.hole_axis[ARM_OF_PIN[p] - 1]
    stations = []
    for j in range(par.n_stations):
        point = body.position[pin] + a_pin @ (par.pin_point[p - 1] + par.station_s[j] * par.pin_axis[p - 1])
        d = point - centre
        g = d - (d @ axis) * axis
        n, delta = g / np.linalg.norm(g), np.linalg.norm(g) - par.clearance[p - 1]
        if delta <= 0:
            stations.append((point, n, delta, 0.0, np.zeros(3)))
            continue
        slip = velocity[pin] + np.cross(spin[pin], point - body.position[pin])
        slip = slip - velocity[arm] - np.cross(spin[arm], point - body.position[arm])
        elastic = par.station_k1[j] * delta**2 + par.station_k2[j] * delta
        elastic += par.station_k3[j] * delta ** (13 / 8) / np.sqrt(delta + par.needle_b * par.clearance[p - 1])
        ramp = par.station_weight[j] * smooth_step(delta / par.delta_d)
        pressing = max(0.0, elastic + par.c_d * ramp * (slip @ n))
        tangential = slip - (slip @ n) * n - (slip @ axis) * axis
        stations.append((point, n, delta, pressing, -pressing * n - par.c_t * ramp * tangential))
    return stations


def contacts(t, q, v, par):
    """Contact forces of each pin, (4, 3): of its outermost station, of its innermost one, resultant of all."""
    motions = motion(t, q, v, np.zeros(56), par)
    found = np.zeros((4, 3))
    for p in (1, 2, 3, 4):
        stations = stations_of(p, *motions, par)
        total = np.linalg.norm(sum(f for *_, f in stations))
        found[p - 1] = stations[0][3], stations[-1][3], total
    return found


def forces(t, q, v, par):
    """World force and torque about the reference point of every body, loads of the bushings, contact modes."""
    body, velocity, spin = motion(t, q, v, np.zeros(56), par)
    force = {name: np.zeros(6) for name in body.position}
    loads = np.zeros((8, 6))
    modes: list[str] = []

    def apply(name, f, torque, point):
        force[name] += np.concatenate([f, torque + np.cross(point - body.position[name], f)])

    for k in range(8):
        number = k % 4 + 1
        if k < 4:
            lump, base, local = f"pin{number}", "hub", triad(PIN_AXES[number])
            on_base = par.r_b * local[0]
            on_lump = (par.r_b - par.R) * local[0]
            stiffness, damping = par.k_cross, par.c_cross
        else:
            lump, base, local = f"arm{number}", "in" if number < 3 else "out", triad(ARM_AXES[number])
            lever = (-par.l_f if number < 3 else par.l_f) * Z
            on_base, on_lump = par.R * local[0] + lever, lever
            stiffness, damping = par.k_fork, par.c_fork
        a_base, a_lump = body.attitude[base], body.attitude[lump]
        marker = body.position[lump] + a_lump @ on_lump
        to_marker = local @ a_base.T
        x = to_marker @ (marker - body.position[base] - a_base @ on_base)
        moving = velocity[lump] + np.cross(spin[lump], marker - body.position[lump])
        moving = moving - velocity[base] - np.cross(spin[base], marker - body.position[base])
        phi = Rotation.from_matrix(a_base.T @ a_lump).as_rotvec()
        # rate of the rotation vector, by a short turn
        h = 1e-7
        relative = a_base.T @ (spin[lump] - spin[base])
        turned = Rotation.from_matrix(Rotation.from_rotvec(relative * h).as_matrix() @ a_base.T @ a_lump)
        turned_back = Rotation.from_matrix(Rotation.from_rotvec(-relative * h).as_matrix() @ a_base.T @ a_lump)
        rate = (turned.as_rotvec() - turned_back.as_rotvec()) / (2 * h)
        loads[k] = -stiffness * np.concatenate([x, local @ phi])
        loads[k] -= damping * np.concatenate([to_marker @ moving, local @ rate])
        f, torque = to_marker.T @ loads[k, :3], to_marker.T @ loads[k, 3:]
        apply(lump, f, torque, marker)
        apply(base, -f, -torque, marker)

    for p in (1, 2, 3, 4):
        pin, arm = f"pin{p}", f"arm{ARM_OF_PIN[p]}"
        stations = stations_of(p, body, velocity, spin, par)
        modes.append(contact_mode([(n, delta) for _, n, delta, _, _ in stations]))
        for point, _, _, _, f in stations:
            apply(pin, f, np.zeros(3), point)
            apply(arm, -f, np.zeros(3), point)
    return force, loads, modes


def imbalance(t, q, v, a, par):
    """World momentum rates less forces and torques of every lump, and of the shaft about and along its axis."""
    force, _, _ = forces(t, q, v, par)
    h = 1e-6
    lumps = ["hub"] + [f"pin{k}" for k in (1, 2, 3, 4)] + [f"arm{k}" for k in (1, 2, 3, 4)]
    momentum = []
    for s in (-h, h):
        body, velocity, spin = motion(t + s, q + v * s + a * s * s / 2, v + a * s, a, par)
        momentum.append((body.position, velocity, spin, body.attitude))
    off = {}
    for name in lumps:
        if name == "hub":
            mass, inertia, local = par.hub_mass, par.hub_inertia, np.eye(3)
        else:
            pin = name.startswith("pin")
            mass = par.pin_mass if pin else par.arm_mass
            inertia = par.pin_inertia if pin else par.arm_inertia
            local = triad((PIN_AXES if pin else ARM_AXES)[int(name[-1])])
        linear, angular = [], []
        for _, velocity, spin, attitudes in momentum:
            attitude = attitudes[name] @ local.T
            linear.append(mass * velocity[name])
            angular.append(attitude @ (inertia * (attitude.T @ spin[name])))
        off[name] = np.concatenate(
            [
                (linear[1] - linear[0]) / (2 * h) - force[name][:3],
                (angular[1] - angular[0]) / (2 * h) - force[name][3:],
            ]
        )
    shaft = np.array([np.sin(par.alpha), 0, np.cos(par.alpha)])
    rate = (momentum[1][2]["out"] - momentum[0][2]["out"]) @ shaft / (2 * h)
    off["out"] = par.Js * rate - force["out"][3:] @ shaft + resisting_torque(par.omega * t, par)
    if par.slides:
        place, speed = (np.array([of[k]["out"] @ shaft for of in momentum]) for k in (0, 1))
        support = par.k_a * place.mean() + par.c_a * speed.mean()
        off["axial"] = par.m_s * np.diff(speed)[0] / (2 * h) - force["out"][:3] @ shaft - par.F_a + support
    return off


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
