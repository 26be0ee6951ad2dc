"""Values of all loads at one instant, of which results hold the largest: one array, kind after kind (`SPAN`).

They follow from what `dynamics.forces` or `ideal_loads` has written to the work record, and from the speed error Psi.
"""

import math

import numpy as np

from tolstat.common.load_kinds import CONTACTS, LOAD_KINDS, SPAN, measure_of
from tolstat.kernel.mechanics.topology import INPUT_SHAFT, PSI
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import pick, where

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
def output_speed(lane, work, v):
    """Speed ratio tau and its error Psi, eq. (13), from the velocities `v`, (56,)."""
    speed, rate = pick(work.drive[0], lane), pick(v[PSI], lane)
    tau = (pick(work.shaft[0], lane) + rate) / speed
    return tau, rate / (speed * tau)


@njit
def shaft_load(shaft, lane, par, work):
    """Force (N) and moment about O (N m) that the joint exerts on a shaft, in axes of its ideal frame.

    Along an output shaft that slides the force is what its bearing carries, k_a s + c_a s' - F_a.

    Parameters
    ----------
    shaft : int
        0 input shaft, 1 output shaft.
    lane, par, work
        As in `write_loads`.
    """
    body = INPUT_SHAFT + shaft
    x, y, z = pick(work.force[body, 0], lane), pick(work.force[body, 1], lane), pick(work.force[body, 2], lane)
    m_x, m_y = pick(work.force[body, 3], lane), pick(work.force[body, 4], lane)
    m_z = pick(work.force[body, 5], lane)
    if shaft == 1:
        s, rate = pick(work.pos[body, 2], lane), pick(work.vel[body, 2], lane)
        carried = pick(par.k_a, lane) * s + pick(par.c_a, lane) * rate - pick(par.F_a, lane)
        z = where(pick(par.slides, lane) > 0, carried, z)
        m_x, m_y = m_x - s * y, m_y + s * x
    return (x, y, z), (m_x, m_y, m_z)


@njit
def write_loads(lane, psi, par, work):
    """Write all loads at one instant to ``work.loads``, in place of moduli (`MODULUS`) their squares.

    Parameters
    ----------
    lane : int
        Lane of the joint, or `ALL` for all lanes at once.
    psi : float
        Error of the speed ratio, eq. (13).
    par : record of PARAM
        The joint.
    work : record of WORK
        Holds bushing loads, contact forces, and the resultants on the shafts.
    """
    loads = work.loads
    for b in range(8):
        for kind in range(2):
            i = 3 * kind
            x, y, z = pick(work.load[b, i], lane), pick(work.load[b, i + 1], lane), pick(work.load[b, i + 2], lane)
            loads[(FORCES, TORQUES)[kind] + b] = x * x + y * y + z * z
    for pin in range(4):
        for i in range(len(CONTACTS)):
            loads[CONTACT_FORCES + len(CONTACTS) * pin + i] = pick(work.contact[pin, i], lane)
    loads[SPEED_ERROR] = abs(psi)
    for shaft in range(2):
        f, m = shaft_load(shaft, lane, par, work)
        loads[AXIAL + shaft] = abs(f[2])
        loads[LATERAL + shaft] = f[0] * f[0] + f[1] * f[1]
        loads[MOMENT + shaft] = m[0] * m[0] + m[1] * m[1]
        if shaft == 0:
            loads[DRIVE] = abs(m[2])


@njit
def load_at(i, lane, work):
    """Load `i` of the joint in a lane, from ``work.loads``."""
    load = pick(work.loads[i], lane)
    return math.sqrt(load) if MODULUS[i] else load


@njit
def size_of(measure, loads):
    """Largest of the loads that changes of this measure are relative to."""
    size = 0.0
    for i in range(MEASURES[measure, 0], MEASURES[measure, 1]):
        size = max(size, loads[i])
    return size
