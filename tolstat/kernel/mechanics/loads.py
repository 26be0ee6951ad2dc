"""Values of all loads at one instant, of which results hold the largest: one array, kind after kind.

They follow from what `dynamics.forces` or `ideal_loads` has written to the work record, and from the speed error Psi.
"""

import math

from tolstat.common.load_kinds import CONTACTS
from tolstat.kernel.mechanics.dynamics import bearing_force
from tolstat.kernel.mechanics.vector import row, turn
from tolstat.kernel.mechanics.work import FORCE
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import where

(FORCES, TORQUES, CONTACT_FORCES, SPEED_ERROR, AXIAL, LATERAL, MOMENT, DRIVE, THRUST, NEAR, FAR, STRESS) = range(12)
LATERAL_ORDERS, MOMENT_ORDERS, DRIVE_ORDERS, PSI_ORDERS, NEAR_ORDERS, FAR_ORDERS = range(12, 18)
NEAR_BALLS, NEAR_ROLLERS, FAR_BALLS, FAR_ROLLERS, LOSS = range(18, 23)
"""Kinds, in the order of `load_kinds.all_kinds`; ``par.begin`` has the first element of each."""
OF_FORCES, OF_TORQUES = range(2)
"""Measures, whose largest load changes are relative to: rows of ``par.measured`` and ``par.of_measure``."""


@njit
def shaft_load(shaft, par, work):
    """Force (N) and moment about O (N m) of joint and unbalance on a shaft, in axes of its ideal frame.

    Along an output shaft that slides the force is what its bearing carries, k_a s + c_a s' - F_a; across one that is
    not held across likewise.

    Parameters
    ----------
    shaft : int
        Its number among the shafts.
    par, work
        As in `write_loads`.
    """
    body = par.lump_kind.shape[0] + shaft
    x, y, z = row(work.force, body)
    m_x, m_y, m_z = work.force[body, 3], work.force[body, 4], work.force[body, 5]
    if par.slide[shaft] >= 0:
        s, rate = work.pos[body, 2], work.vel[body, 2]
        z = where(par.slides > 0, par.k_a * s + par.c_a * rate - par.F_a, z)
        m_x, m_y = m_x - s * y, m_y + s * x
    if par.across[shaft] >= 0:
        x, y = bearing_force(body, par, work)
    return (x, y, z), (m_x, m_y, m_z)


@njit
def bearing_loads(i, force, moment, par):
    """Loads of both bearings of shaft ``par.borne[i]`` along an axis across it: the nearer one's and the farther one's.

    Parameters
    ----------
    i : int
        Number among the shafts whose bearings are known.
    force : float
        Force on the shaft along the axis, N.
    moment : float
        Moment about O on it that a force along the axis, at a place of positive z, adds to, N m.
    par : record of PARAM
        The joint.
    """
    near, far = par.bearing_at[i, 0], par.bearing_at[i, 1]
    at_far = (moment - near * force) / (far - near)
    return force - at_far, at_far


@njit
def write_loads(v, par, work):
    """Write all loads at one instant to ``work.loads``, in place of moduli their squares.

    ``work.output`` gets speed ratio and its error, eq. (13).

    Parameters
    ----------
    v : ndarray, shape (dof,)
        Velocities, m/s and rad/s.
    par : record of PARAM
        The joint, or the joints of all lanes.
    work : record of WORK
        Holds bushing loads, contact forces, and the resultants on the shafts.
    """
    loads, speed, begin = work.loads, work.drive[0], par.begin
    output, rate = par.frame[work.force.shape[0] - 1], 0.0 * speed
    if par.Js.shape[0] > 0:
        rate = v[6 * par.lump_kind.shape[0] + par.Js.shape[0] - 1]
    tau = (work.frame_w[output, 2] + rate) / speed
    work.output[0], work.output[1] = tau, rate / (speed * tau)
    for b in range(work.load.shape[0]):
        for kind in range(2):
            i = 3 * kind
            x, y, z = work.load[b, i], work.load[b, i + 1], work.load[b, i + 2]
            loads[begin[(FORCES, TORQUES)[kind]] + b] = x * x + y * y + z * z
    for pin in range(work.contact.shape[0]):
        for i in range(len(CONTACTS)):
            loads[begin[CONTACT_FORCES] + len(CONTACTS) * pin + i] = work.contact[pin, i]
    if par.Js.shape[0] > 0:
        loads[begin[SPEED_ERROR]] = abs(work.output[1])
    for j in range(par.carried.shape[0]):
        f, m = shaft_load(par.carried[j], par, work)
        loads[begin[AXIAL] + j] = abs(f[2])
        loads[begin[LATERAL] + j] = f[0] * f[0] + f[1] * f[1]
        loads[begin[MOMENT] + j] = m[0] * m[0] + m[1] * m[1]
        for i in range(par.driven.shape[0]):
            if par.driven[i] == par.carried[j]:
                loads[begin[DRIVE] + i] = abs(m[2])
    for face in range(par.face_pair.shape[0]):
        loads[begin[THRUST] + face] = work.face[face, FORCE]
    for i in range(par.borne.shape[0]):
        f, m = shaft_load(par.borne[i], par, work)
        near_x, far_x = bearing_loads(i, f[0], m[1], par)
        near_y, far_y = bearing_loads(i, f[1], -m[0], par)
        loads[begin[NEAR] + i] = near_x * near_x + near_y * near_y
        loads[begin[FAR] + i] = far_x * far_x + far_y * far_y
    for i in range(par.root.shape[0]):
        torsion = par.of_root[i, 1] * work.load[par.root[i], 3]
        t, z = par.of_root[i, 0] * work.load[par.root[i], 4], par.of_root[i, 0] * work.load[par.root[i], 5]
        loads[begin[STRESS] + i] = t * t + z * z + 3 * torsion * torsion


@njit
def complete_loads(par, work):
    """Take the roots of the squares that `write_loads` has written; write the loads of the shafts to ``work.shafts``.

    These are in axes that do not turn: of a Cardan joint's input shaft those of G, of its output shaft Ry(alpha).
    """
    for i in range(work.loads.shape[0]):
        if par.modulus[i] == 1:
            work.loads[i] = math.sqrt(work.loads[i])
    for shaft in range(work.shafts.shape[0]):
        member = par.frame[par.lump_kind.shape[0] + shaft]
        cosine, sine = work.turned[member, 0], work.turned[member, 1]
        first = 0
        for x, y, z in shaft_load(shaft, par, work):
            in_ground = (cosine * x - sine * y, sine * x + cosine * y, z)
            if par.pivot.shape[0] > 0:
                in_ground = turn(work.attitude, member, (x, y, z))
            for k in range(3):
                work.shafts[shaft, first + k] = in_ground[k]
            first += 3


@njit
def size_of(measure, loads, par):
    """Largest of the loads that changes of this measure are relative to."""
    size = 0.0
    for i in range(par.measured[measure, 0], par.measured[measure, 1]):
        size = max(size, loads[i])
    return size
