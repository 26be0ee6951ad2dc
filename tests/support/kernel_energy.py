"""Energies of a joint and the powers that change them, at one state.

With them

    d/dt (kinetic + bushings + contacts + support)
        = input + axial - load - bushing_damping - contact_damping - film - support_damping + bushing_moments

holds exactly along a solution. The last is the power of what is not the gradient of a potential: a bushing's moment
K phi works on the angular velocity, its potential phi . K phi / 2 changes with the rate of the rotation vector.

Deformations are read off the force functions of the joint: a second row of parameters has springs of stiffness 1 and
no damper, a third dampers of 1 and no spring.
"""

import math

from tests.support.mechanisms import PSI, S, body
from tolstat.common.fields import Field, dtype_of
from tolstat.kernel.codes import RAMP
from tolstat.kernel.mechanics.bushing import bushing_load
from tolstat.kernel.mechanics.contact import contact_load, smooth_step
from tolstat.kernel.mechanics.dynamics import forces, mass_of, resisting_torque
from tolstat.kernel.mechanics.triad import to_triad
from tolstat.kernel.mechanics.vector import add, cross, dot, row, sub, turn_back
from tolstat.kernel.mechanics.work import DELTA, FORCE, V_NORMAL, V_TANGENT
from tolstat.kernel.simd.jit import njit

INPUT, OUTPUT = body("input"), body("output")
"""Numbers of the shafts."""
ENERGY_FIELDS = (
    Field("kinetic", "J", "kinetic energy of the lumps and the output shaft, absolute motion"),
    Field("bushings", "J", "elastic energy of the 8 bushings"),
    Field("contacts", "J", "elastic energy of the contact stations"),
    Field("support", "J", "elastic energy of the output shaft's axial support"),
    Field("input", "W", "power of the drive on the input shaft"),
    Field("axial", "W", "power of the axial force on the output shaft"),
    Field("load", "W", "power that the resisting torque takes"),
    Field("bushing_damping", "W", "power that the bushings' dampers take"),
    Field("contact_damping", "W", "power that the contacts' normal damping takes"),
    Field("film", "W", "power that the lubricant film takes"),
    Field("support_damping", "W", "power that the axial damping of the output shaft takes"),
    Field("bushing_moments", "W", "power of the bushings' elastic moments beyond their potential"),
)
ENERGY = dtype_of(ENERGY_FIELDS)


@njit
def output_speed(v, par, work):
    """Angular velocity of the output shaft, rad/s."""
    return work.frame_w[par.frame[OUTPUT], 2] + v[PSI]


@njit
def kinetic_energy(v, par, work):
    """Kinetic energy of the lumps and the output shaft in the ground frame, J."""
    energy = 0.5 * par.Js[0] * output_speed(v, par, work) ** 2 + 0.5 * par.slides * par.m_s * v[S] ** 2
    for lump in range(par.lump_kind.shape[0]):
        mass, inertia = mass_of(lump, par)
        omega = row(work.frame_w, par.frame[lump])
        velocity = add(row(work.vel, lump), cross(omega, row(work.pos, lump)))
        w = to_triad(lump, turn_back(work.rot, lump, add(omega, row(work.spin, lump))), par)
        energy += 0.5 * mass * dot(velocity, velocity)
        for k in range(3):
            energy += 0.5 * inertia[k] * w[k] ** 2
    return energy


@njit
def bushing_energy(i, par, springs, dampers, work, out):
    """Add the elastic energy and the powers of bushing `i`."""
    base, lump, kind = par.bushing_base[i], par.bushing_lump[i], par.bushing_kind[i]
    stiffness, damping = par.k[kind], par.c[kind]
    w = to_triad(lump, turn_back(work.rot, base, sub(row(work.spin, lump), row(work.spin, base))), par)
    bushing_load(i, springs, work)
    elastic_moment = (work.load[i, 3], work.load[i, 4], work.load[i, 5])
    for k in range(6):
        out.bushings += 0.5 * stiffness[k] * work.load[i, k] ** 2
    bushing_load(i, dampers, work)
    for k in range(3):
        rate, turning = -work.load[i, k], -work.load[i, 3 + k]
        out.bushing_damping += damping[k] * rate**2 + damping[3 + k] * turning * w[k]
        out.bushing_moments += stiffness[3 + k] * elastic_moment[k] * (w[k] - turning)


@njit
def needle_energy(k3, delta, lost):
    """Integral of k3 x^(9/8) sqrt(x/(x + lost)) up to `delta`, J, by Simpson's rule in x^(1/8)."""
    n, total = 200, 0.0
    for i in range(n + 1):
        u = (i / n) * delta**0.125
        x = u**8
        if x > 0:
            total += (1 if i == n else 4 if i % 2 else 2) * x**1.625 / math.sqrt(x + lost) * 8 * u**7
    return k3 * total * delta**0.125 / (3 * n)


@njit
def contact_energy(pin, par, springs, work, out):
    """Add the elastic energy and the powers of the contact of `pin`; ``work.station`` holds the full forces."""
    kind = par.pair_kind[pin]
    for j in range(par.n_stations[kind]):
        out.contact_damping += work.station[pin, j, FORCE] * work.station[pin, j, V_NORMAL]
    contact_load(pin, springs, work)
    for j in range(par.n_stations[kind]):
        station, weight = work.station[pin, j], par.station_weight[kind, j]
        delta = station[DELTA]
        if delta <= 0:
            continue
        out.contact_damping -= station[FORCE] * station[V_NORMAL]
        out.film += par.c_t[kind] * weight * smooth_step(delta / par.delta_d[kind]) * station[V_TANGENT] ** 2
        out.contacts += (par.station_k1[kind, j] * delta / 3 + par.station_k2[kind, j] / 2) * delta**2
        out.contacts += needle_energy(par.station_k3[kind, j], delta, par.needle_b[kind] * par.clearance[pin])


@njit
def measure(t, q, v, rows, options, work, out):
    """Energies and powers of one state.

    Parameters
    ----------
    t : float
        Time, s.
    q, v : ndarray, shape (dof,)
        Unknowns and their rates; m and rad.
    rows : ndarray of PARAM, shape (3,)
        The joint; the same with bushing stiffness 1, no bushing damping and no contact damping; the same with bushing
        stiffness 0 and damping 1.
    options : Options
        ``start`` decides whether the resisting torque is ramped.
    work : record of WORK
        Rewritten.
    out : record of ENERGY
        Written.
    """
    par = rows[0]
    forces(t, q, v, par, work)
    out.kinetic = kinetic_energy(v, par, work)
    out.input = -work.force[INPUT, 5] * work.drive[0]
    out.load = resisting_torque(t, par, work, options.start == RAMP) * output_speed(v, par, work)
    out.support, out.axial = 0.5 * par.slides * par.k_a * q[S] ** 2, par.slides * par.F_a * v[S]
    out.support_damping = par.slides * par.c_a * v[S] ** 2
    out.bushings = out.contacts = 0.0
    out.bushing_damping = out.contact_damping = out.film = out.bushing_moments = 0.0
    for pin in range(par.pin.shape[0]):
        contact_energy(pin, par, rows[1], work, out)
    for i in range(par.bushing_lump.shape[0]):
        bushing_energy(i, par, rows[1], rows[2], work, out)


@njit
def measure_all(t, points, rows, options, work, out):
    """`measure` every state of a trajectory: ``points``, shape (n, 3, dof), at times `t`, to `out`, shape (n,)."""
    for k in range(t.size):
        measure(t[k], points[k, 0], points[k, 1], rows, options, work, out[k])
