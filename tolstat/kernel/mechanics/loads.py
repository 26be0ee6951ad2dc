"""Values of all loads at one instant, of which results hold the largest: one array, kind after kind (`SPAN`).

They follow from what `dynamics.forces` or `ideal_loads` has written to the work record, and from the speed error Psi.
"""

import math

import numpy as np

from tolstat.common.load_kinds import CONTACTS, LOAD_KINDS, SPAN, measure_of
from tolstat.kernel.mechanics.vector import row
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import where

FORCES, TORQUES, CONTACT_FORCES, SPEED_ERROR = (SPAN[key].start for key in ("F", "T", "contact", "psi"))
AXIAL, LATERAL, MOMENT, DRIVE = (SPAN[key].start for key in ("axial", "lateral", "moment", "drive"))
"""First element of each kind."""
_INSTANT = [kind for kind in LOAD_KINDS if not kind.orders]
_SIZES = [kind.size for kind in _INSTANT]
N_LOADS, N_INSTANT = sum(kind.size for kind in LOAD_KINDS), sum(_SIZES)
N_AVERAGED = sum(kind.size for kind in LOAD_KINDS if kind.averaged)
"""Number of values; of those that exist at one instant; of those whose mean and range are computed. Each come first."""
INTERPOLATED = np.repeat([kind.interpolated for kind in _INSTANT], _SIZES)
MODULUS = np.repeat([kind.modulus for kind in _INSTANT], _SIZES)
"""Whether the largest value is interpolated between samples; whether `write_loads` writes its square."""
_MEASURES = list(dict.fromkeys(measure_of(kind).key for kind in LOAD_KINDS if kind.decides))
MEASURES = np.array([[SPAN[key].start, SPAN[key].stop] for key in _MEASURES])
"""First and last + 1 of the loads whose largest one changes are relative to, (measures, 2): forces, torques."""
N_MEASURES, OF_FORCES, OF_TORQUES = len(MEASURES), _MEASURES.index("F"), _MEASURES.index("T")
"""Number of measures, and which of them are those of forces and of torques."""


def _deciding():
    """Loads that decide, by measure: one array of all, and where those of each measure lie in it."""
    deciding, bounds = [], [0]
    for key in _MEASURES:
        kinds = [kind for kind in LOAD_KINDS if kind.decides and measure_of(kind).key == key]
        kinds.sort(key=lambda kind: kind.key != key)
        deciding += [i for kind in kinds for i in range(SPAN[kind.key].start, SPAN[kind.key].stop)]
        bounds.append(len(deciding))
    return np.array(deciding), np.array([bounds[:-1], bounds[1:]]).T


DECIDING, OF_MEASURE = _deciding()
"""Loads that decide on settling, closer look and steps; those compared with measure m are number ``OF_MEASURE[m, 0]``
to ``OF_MEASURE[m, 1] - 1`` of them, first the loads that measure."""
N_DECIDING = len(DECIDING)
OTHERS = np.setdiff1d(np.arange(N_INSTANT), DECIDING)
"""Loads at one instant that do not decide."""


@njit
def shaft_load(shaft, par, work):
    """Force (N) and moment about O (N m) that the joint exerts on a shaft, in axes of its ideal frame.

    Along an output shaft that slides the force is what its bearing carries, k_a s + c_a s' - F_a.

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
    return (x, y, z), (m_x, m_y, m_z)


@njit
def write_loads(v, par, work):
    """Write all loads at one instant to ``work.loads``, in place of moduli (`MODULUS`) their squares.

    ``work.output`` gets speed ratio and its error, eq. (13).

    Parameters
    ----------
    v : ndarray, shape (56,)
        Velocities, m/s and rad/s.
    par : record of PARAM
        The joint, or the joints of all lanes.
    work : record of WORK
        Holds bushing loads, contact forces, and the resultants on the shafts.
    """
    loads, speed = work.loads, work.drive[0]
    output = work.force.shape[0] - 1
    rate = v[6 * par.lump_kind.shape[0] + par.Js.shape[0] - 1]
    tau = (work.frame_w[par.frame[output], 2] + rate) / speed
    work.output[0], work.output[1] = tau, rate / (speed * tau)
    for b in range(work.load.shape[0]):
        for kind in range(2):
            i = 3 * kind
            x, y, z = work.load[b, i], work.load[b, i + 1], work.load[b, i + 2]
            loads[(FORCES, TORQUES)[kind] + b] = x * x + y * y + z * z
    for pin in range(work.contact.shape[0]):
        for i in range(len(CONTACTS)):
            loads[CONTACT_FORCES + len(CONTACTS) * pin + i] = work.contact[pin, i]
    loads[SPEED_ERROR] = abs(work.output[1])
    for shaft in range(work.shafts.shape[0]):
        f, m = shaft_load(shaft, par, work)
        loads[AXIAL + shaft] = abs(f[2])
        loads[LATERAL + shaft] = f[0] * f[0] + f[1] * f[1]
        loads[MOMENT + shaft] = m[0] * m[0] + m[1] * m[1]
        if shaft == 0:
            loads[DRIVE] = abs(m[2])


@njit
def complete_loads(par, work):
    """Take the roots of the squares that `write_loads` has written; write the loads of the shafts to ``work.shafts``.

    These are forces and moments on the input shaft in G, on the output shaft in Ry(alpha): axes that do not turn.
    """
    for i in range(N_INSTANT):
        if MODULUS[i]:
            work.loads[i] = math.sqrt(work.loads[i])
    for shaft in range(work.shafts.shape[0]):
        member = par.frame[par.lump_kind.shape[0] + shaft]
        cosine, sine = work.turned[member, 0], work.turned[member, 1]
        first = 0
        for x, y, z in shaft_load(shaft, par, work):
            work.shafts[shaft, first] = cosine * x - sine * y
            work.shafts[shaft, first + 1] = sine * x + cosine * y
            work.shafts[shaft, first + 2] = z
            first += 3


@njit
def size_of(measure, loads):
    """Largest of the loads that changes of this measure are relative to."""
    size = 0.0
    for i in range(MEASURES[measure, 0], MEASURES[measure, 1]):
        size = max(size, loads[i])
    return size
