"""Values of all loads at one instant, of which results hold the largest: one array, kind after kind (`tables.SPAN`).

They follow from what `dynamics.forces` or `ideal_loads` has written to the work record, and from the output shaft's
speed.
"""

import math

import numpy as np

from tolstat.common.tables import CONTACTS, LOAD_KINDS, SPAN
from tolstat.kernel.mechanics.topology import PSI
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import pick

FORCES, TORQUES, CONTACT_FORCES, SPEED_ERROR = (SPAN[kind].start for kind in ("F", "T", "contact", "psi"))
"""First element of each kind."""
N_LOADS = sum(kind.size for kind in LOAD_KINDS)
N_AVERAGED = sum(kind.size for kind in LOAD_KINDS if kind.averaged)
"""Number of values, and of those whose mean and range are computed, which come first: moduli of the bushing loads."""
INTERPOLATED = np.repeat([kind.interpolated for kind in LOAD_KINDS], [kind.size for kind in LOAD_KINDS])
"""Whether the largest value is interpolated between samples."""


@njit
def modulus(first, bushing, lane, work):
    """Modulus of three components of a bushing's load from `first` on: force (0), torque (3)."""
    square = 0.0
    for i in range(first, first + 3):
        component = pick(work.load[bushing, i], lane)
        square += component * component
    return math.sqrt(square)


@njit
def output_speed(lane, par, work, v):
    """Speed ratio tau and its error Psi, eq. (13), from the velocities `v`, (56,)."""
    omega, rate = pick(par.omega, lane), pick(v[PSI], lane)
    tau = (pick(work.shaft[0], lane) + rate) / omega
    return tau, rate / (omega * tau)


@njit
def other_loads(lane, par, work, v, loads):
    """Write all loads but the bushings' moduli to `loads`, (N_LOADS,); other arguments as in `settle.record`."""
    for pin in range(4):
        for i in range(len(CONTACTS)):
            loads[CONTACT_FORCES + len(CONTACTS) * pin + i] = pick(work.contact[pin, i], lane)
    loads[SPEED_ERROR] = abs(output_speed(lane, par, work, v)[1])


@njit
def all_loads(lane, par, work, v, loads):
    """Write all loads to `loads`, (N_LOADS,); other arguments as in `settle.record`."""
    for b in range(8):
        loads[FORCES + b], loads[TORQUES + b] = modulus(0, b, lane, work), modulus(3, b, lane, work)
    other_loads(lane, par, work, v, loads)


@njit
def loads_to_follow(work, v, loads):
    """Write squares of the bushings' moduli and all other loads to `loads`, (N_LOADS,), in all lanes at once.

    `v`: velocities that ``work`` was evaluated at, (56,).
    """
    for b in range(8):
        for kind in range(2):
            x, y, z = work.load[b, 3 * kind], work.load[b, 3 * kind + 1], work.load[b, 3 * kind + 2]
            loads[(FORCES, TORQUES)[kind] + b] = x * x + y * y + z * z
    for pin in range(4):
        for i in range(len(CONTACTS)):
            loads[CONTACT_FORCES + len(CONTACTS) * pin + i] = work.contact[pin, i]
    loads[SPEED_ERROR] = abs(v[PSI] / (work.shaft[0] + v[PSI]))
