"""The joint as a second-order system: forces at one state, residual of the equations of motion, accelerations.

The equations of motion are in docs/model.md, "Coordinates and equations of motion". Residuals are forces and torques
about the reference points in axes of the ideal frames, in the order of the unknowns.
"""

import math

from tolstat.kernel.codes import RAMP
from tolstat.kernel.mechanics.bushing import accumulate, bushing_load
from tolstat.kernel.mechanics.contact import contact_load, smooth_step
from tolstat.kernel.mechanics.friction import rub
from tolstat.kernel.mechanics.motion import ideal_motion
from tolstat.kernel.mechanics.rotation import about_z, coefficients, exponential, spin, spin_bias, spin_rate, unspin
from tolstat.kernel.mechanics.thrust import thrust_load
from tolstat.kernel.mechanics.triad import from_triad, to_triad
from tolstat.kernel.mechanics.vector import add, axpy, cross, dot, put, row, scale, sub, turn, turn_back
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import where


@njit
def mass_of(body, par):
    """Mass and principal inertia of a lump, about the axes of its triad."""
    kind = par.lump_kind[body]
    return par.mass[kind], (par.inertia[kind, 0], par.inertia[kind, 1], par.inertia[kind, 2])


@njit
def set_bodies(q, v, par, work):
    """Write position, attitude and velocity of every body relative to its ideal frame to `work`; `q`, `v`: (n,)."""
    lumps = par.lump_kind.shape[0]
    for body in range(lumps):
        i = 6 * body
        phi = (q[i + 3], q[i + 4], q[i + 5])
        at = from_triad(body, row(par.at, par.lump_kind[body]), par)
        put(work.pos, body, add(at, (q[i], q[i + 1], q[i + 2])))
        put(work.vel, body, (v[i], v[i + 1], v[i + 2]))
        s = coefficients(dot(phi, phi))
        put(work.series, body, s)
        exponential(phi, s, work.rot, body)
        put(work.spin, body, spin(phi, s, (v[i + 3], v[i + 4], v[i + 5])))
    for shaft in range(par.turn.shape[0]):
        turn, slide, still = 6 * lumps + par.turn[shaft], 6 * lumps + par.slide[shaft], 0.0 * q[0]
        turned = shifted = (still, still)
        if par.turn[shaft] >= 0:
            turned = (q[turn], v[turn])
        if par.slide[shaft] >= 0:
            shifted = (par.slides * q[slide], par.slides * v[slide])
        place_shaft(lumps + shaft, turned, shifted, work)
        if par.across[shaft] >= 0:
            for k in range(2):
                i = 6 * lumps + par.across[shaft] + k
                work.pos[lumps + shaft, k], work.vel[lumps + shaft, k] = q[i], v[i]


@njit
def place_shaft(body, turned, shifted, work):
    """Write position, attitude and velocities of a shaft.

    Parameters
    ----------
    body : int
        Its number.
    turned, shifted : tuple of float
        Rotation about z (rad) and its rate; displacement along z (m) and its rate.
    work : record of WORK
        Written.
    """
    zero = turned[0] - turned[0]  # of the type of the angle: tuples of one type go through one compiled version
    put(work.pos, body, (zero, zero, shifted[0]))
    put(work.vel, body, (zero, zero, shifted[1]))
    about_z(turned[0], work.rot, body)
    put(work.spin, body, (zero, zero, turned[1]))


@njit
def forces(t, q, v, par, work):
    """Evaluate all bushings and contacts at one state; write ``work.force`` and loads; arguments as in `residual`."""
    ideal_motion(par.omega * t, par, work)
    set_bodies(q, v, par, work)
    for body in range(work.force.shape[0]):
        for k in range(6):
            work.force[body, k] = 0.0
    if par.pivot.shape[0] > 0:
        weigh(par, work)
        pull(par, work)
    for i in range(work.load.shape[0]):
        bushing_load(i, par, work)
    for pin in range(work.contact.shape[0]):
        contact_load(pin, par, work)
    for face in range(par.face_pair.shape[0]):
        thrust_load(face, par, work)
    if par.friction == 1:
        for pin in range(work.contact.shape[0]):
            rub(pin, par, work)
    throw(par, work)


@njit
def weigh(par, work):
    """Add the weight of every lump."""
    g = (par.weight[0], par.weight[1], par.weight[2])
    for body in range(par.lump_kind.shape[0]):
        mass, _ = mass_of(body, par)
        f = scale(mass, turn_back(work.attitude, par.frame[body], g))
        for k in range(3):
            work.force[body, k] += f[k]


@njit
def pull(par, work):
    """Add the given forces of members, at their ideal places."""
    for i in range(par.pulled.shape[0]):
        body, f, at = par.pulled[i], row(par.pull, i), row(par.pull_at, i)
        if par.pull_turns[i] == 0:
            f = turn_back(work.attitude, par.frame[body], f)
        accumulate(work.force, body, f, cross(at, f))


@njit
def throw(par, work):
    """Add the forces of unbalances, which turn with the frames of their bodies."""
    for i in range(par.unbalanced.shape[0]):
        body = par.unbalanced[i]
        speed = work.frame_w[par.frame[body], 2]
        for k in range(2):
            work.force[body, k] += par.unbalance[i, k] * speed * speed


@njit
def resisting_torque(t, par, work, ramped):
    """Resisting torque T_r, N m; with `ramped` it rises by the cubic step over the first quarter revolution."""
    if not ramped:
        return work.drive[2]
    return work.drive[2] * smooth_step(t * abs(par.omega) / (0.5 * math.pi))


@njit
def turning_torque(u, par, work):
    """Torque of the arms on the shaft that turns by unknown `u` (N m), and its ideal acceleration (rad/s^2)."""
    total = change = 0.0 * work.drive[0]
    for shaft in range(par.turn.shape[0]):
        if par.turn[shaft] == u:
            body = par.lump_kind.shape[0] + shaft
            total += work.force[body, 5]
            change = work.frame_dw[par.frame[body], 2]
    return total, change


@njit
def axial_force(shaft, q, v, par, work):
    """Force along a shaft that accelerates it, N: of its arms, F_a, and of the bearings; 0 if it is held."""
    lumps = par.lump_kind.shape[0]
    s = 6 * lumps + par.slide[shaft]
    return par.slides * (work.force[lumps + shaft, 2] + par.F_a - par.k_a * q[s] - par.c_a * v[s])


@njit
def lateral_force(body, par, work):
    """Force across a shaft that accelerates it, N, along x and y: of its arms, of its unbalance and of the bearings."""
    x, y = bearing_force(body, par, work)
    return work.force[body, 0] - x, work.force[body, 1] - y


@njit
def bearing_force(body, par, work):
    """Force of a shaft that is not held across on its bearings, N, along x and y: k_l and c_l rest in the ground."""
    turning = work.frame_w[par.frame[body], 2]
    x, y = work.pos[body, 0], work.pos[body, 1]
    return (
        par.k_l * x + par.c_l * (work.vel[body, 0] - turning * y),
        par.k_l * y + par.c_l * (work.vel[body, 1] + turning * x),
    )


@njit
def turning_across(body, par, work):
    """What the turning of the frame adds to the acceleration of a shaft along x and y, m/s^2."""
    turning, change = work.frame_w[par.frame[body], 2], work.frame_dw[par.frame[body], 2]
    x, y = work.pos[body, 0], work.pos[body, 1]
    along, across = 2 * work.vel[body, 0] - turning * y, 2 * work.vel[body, 1] + turning * x
    return -turning * across - change * y, turning * along + change * x


@njit
def in_turning_frame(body, x, dx, w, a, par, work):
    """Absolute acceleration, angular velocity and angular acceleration of a lump, in axes of its ideal frame.

    `x`, `dx`: position and velocity; `w`: angular velocity; `a`: as in `body_inertia`; relative to that frame.
    """
    ddx, dw = a
    member = par.frame[body]
    if par.about_z[member] == 0:
        omega, domega = row(work.frame_w, member), row(work.frame_dw, member)
        centripetal = cross(omega, axpy(2.0, dx, cross(omega, x)))
        acceleration = add(add(ddx, centripetal), cross(domega, x))
        if par.pivot.shape[0] > 0:
            acceleration = add(acceleration, row(work.origin_a, member))
        return acceleration, add(omega, w), add(add(domega, dw), cross(omega, w))
    turning, change = work.frame_w[member, 2], work.frame_dw[member, 2]
    along, across = 2 * dx[0] - turning * x[1], 2 * dx[1] + turning * x[0]
    acceleration = (ddx[0] - turning * across - change * x[1], ddx[1] + turning * along + change * x[0], ddx[2])
    angular = (dw[0] - turning * w[1], dw[1] + turning * w[0], dw[2] + change)
    return acceleration, (w[0], w[1], w[2] + turning), angular


@njit
def body_inertia(body, a, par, work):
    """Mass times absolute acceleration of a lump (N), and the rate of its angular momentum (N m).

    `a`: acceleration and angular acceleration relative to the ideal frame, (u'', w'), m/s^2 and rad/s^2.
    """
    mass, inertia = mass_of(body, par)
    x, dx, w = row(work.pos, body), row(work.vel, body), row(work.spin, body)
    acceleration, total, angular = in_turning_frame(body, x, dx, w, a, par, work)
    total = to_triad(body, turn_back(work.rot, body, total), par)
    angular = to_triad(body, turn_back(work.rot, body, angular), par)
    momentum = (inertia[0] * total[0], inertia[1] * total[1], inertia[2] * total[2])
    rate = (inertia[0] * angular[0], inertia[1] * angular[1], inertia[2] * angular[2])
    rate = add(rate, cross(total, momentum))
    return scale(mass, acceleration), turn(work.rot, body, from_triad(body, rate, par))


@njit
def residual(t, q, v, a, par, options, work, out):
    """Inertia terms minus forces at one state; zero when `a` is the acceleration.

    Parameters
    ----------
    t : float
        Time, s.
    q, v, a : ndarray, shape (n,)
        Unknowns and their first and second derivatives; m and rad.
    par : record of PARAM
        The joint.
    options : Options
        ``start`` decides whether the resisting torque is ramped.
    work : record of WORK
        Scratch; holds the state and the loads afterwards.
    out : ndarray, shape (n,)
        Written: N and N m.
    """
    forces(t, q, v, par, work)
    lumps, rotations = par.lump_kind.shape[0], par.Js.shape[0]
    resisting = resisting_torque(t, par, work, options.start == RAMP)
    for i in range(par.loaded.shape[0]):
        work.force[par.loaded[i], 5] -= resisting
    for body in range(lumps):
        i = 6 * body
        phi, rate = (q[i + 3], q[i + 4], q[i + 5]), (v[i + 3], v[i + 4], v[i + 5])
        dw = spin_rate(phi, row(work.series, body), rate, (a[i + 3], a[i + 4], a[i + 5]))
        f, torque = body_inertia(body, ((a[i], a[i + 1], a[i + 2]), dw), par, work)
        for k in range(3):
            out[i + k] = f[k] - work.force[body, k]
            out[i + 3 + k] = torque[k] - work.force[body, 3 + k]
    for u in range(rotations):
        torque_of_arms, change = turning_torque(u, par, work)
        i = 6 * lumps + u
        out[i] = par.Js[u] * (change + a[i]) - torque_of_arms
        if u == rotations - 1:
            out[i] += resisting
    for shaft in range(par.slide.shape[0]):
        if par.slide[shaft] >= 0:
            i = 6 * lumps + par.slide[shaft]
            out[i] = par.slides * par.m_s * a[i] - axial_force(shaft, q, v, par, work)
        if par.across[shaft] >= 0:
            i, force = 6 * lumps + par.across[shaft], lateral_force(lumps + shaft, par, work)
            added = turning_across(lumps + shaft, par, work)
            out[i] = par.m_s * (a[i] + added[0]) - force[0]
            out[i + 1] = par.m_s * (a[i + 1] + added[1]) - force[1]


@njit
def acceleration(t, q, v, par, options, work, out):
    """Second derivatives of the unknowns, for integrators of q'' = f(t, q, q'); arguments as in `residual`."""
    forces(t, q, v, par, work)
    lumps, rotations = par.lump_kind.shape[0], par.Js.shape[0]
    zero = (0.0, 0.0, 0.0)
    resisting = resisting_torque(t, par, work, options.start == RAMP)
    for i in range(par.loaded.shape[0]):
        work.force[par.loaded[i], 5] -= resisting
    for body in range(lumps):
        i = 6 * body
        phi, rate = (q[i + 3], q[i + 4], q[i + 5]), (v[i + 3], v[i + 4], v[i + 5])
        f, torque = body_inertia(body, (zero, spin_bias(phi, row(work.series, body), rate)), par, work)
        mass, inertia = mass_of(body, par)
        torque = sub((work.force[body, 3], work.force[body, 4], work.force[body, 5]), torque)
        torque = to_triad(body, turn_back(work.rot, body, torque), par)
        dw = (torque[0] / inertia[0], torque[1] / inertia[1], torque[2] / inertia[2])
        ddphi = unspin(phi, turn(work.rot, body, from_triad(body, dw, par)))
        for k in range(3):
            out[i + k] = (work.force[body, k] - f[k]) / mass
            out[i + 3 + k] = ddphi[k]
    for u in range(rotations):
        total, change = turning_torque(u, par, work)
        if u == rotations - 1:
            total -= resisting
        out[6 * lumps + u] = total / par.Js[u] - change
    for shaft in range(par.slide.shape[0]):
        if par.slide[shaft] >= 0:
            along = axial_force(shaft, q, v, par, work) / where(par.slides > 0, par.m_s, 1.0)
            out[6 * lumps + par.slide[shaft]] = along
        if par.across[shaft] >= 0:
            i, force = 6 * lumps + par.across[shaft], lateral_force(lumps + shaft, par, work)
            added = turning_across(lumps + shaft, par, work)
            out[i], out[i + 1] = force[0] / par.m_s - added[0], force[1] / par.m_s - added[1]
