"""The recorded revolution: a ring of samples by input angle, and the closure error between revolutions."""

import math
from typing import NamedTuple

import numpy as np

from tolstat.kernel._jit import njit
from tolstat.kernel.motion import speed_ratio
from tolstat.kernel.topology import PSI


class Ring(NamedTuple):
    """Samples of the last revolution; sample k belongs to theta = 2 pi k / steps_per_rev."""

    loads: np.ndarray  # (steps, 8, 6) N, N m
    contact: np.ndarray  # (steps, 4, 2) N
    mode: np.ndarray  # (steps, 4)
    tau: np.ndarray  # (steps,)
    psi: np.ndarray  # (steps,) Psi, eq. (13)
    modulus: np.ndarray  # (steps, 8, 2) |F|, |T|
    change: np.ndarray  # (steps, 2) largest change of |F| and |T| against the revolution before


def make_ring(steps_per_rev: int) -> Ring:
    """Allocate, filled with NaN."""
    n = steps_per_rev
    shapes = {
        "loads": (n, 8, 6),
        "contact": (n, 4, 2),
        "tau": (n,),
        "psi": (n,),
        "modulus": (n, 8, 2),
        "change": (n, 2),
    }
    return Ring(mode=np.zeros((n, 4), np.uint8), **{name: np.full(shape, np.nan) for name, shape in shapes.items()})


@njit
def record(k, par, work, state, ring):
    """Keep grid point `k` (counted from the start) of the joint, as it was last evaluated."""
    n = ring.tau.size
    s = k % n
    ring.change[s, 0] = ring.change[s, 1] = 0.0
    for b in range(8):
        for first in (0, 1):
            square = 0.0
            for i in range(3):
                load = work.load[b, 3 * first + i]
                ring.loads[s, b, 3 * first + i] = load
                square += load * load
            modulus = math.sqrt(square)
            change = abs(modulus - ring.modulus[s, b, first])  # NaN in the first revolution
            if not change <= ring.change[s, first]:
                ring.change[s, first] = change
            ring.modulus[s, b, first] = modulus
    for pin in range(4):
        ring.contact[s, pin, 0], ring.contact[s, pin, 1] = work.contact[pin, 0], work.contact[pin, 1]
        ring.mode[s, pin] = work.mode[pin]
    tau = (work.shaft[0] + state.v0[PSI]) / par.omega
    ring.tau[s] = tau
    ring.psi[s] = (tau - speed_ratio(2 * math.pi * s / n, par.alpha)) / tau


@njit
def closure_error(ring):
    """Largest change of any bushing load's modulus since the revolution before, relative to the largest of its kind."""
    worst = 0.0
    for kind in (0, 1):
        change = largest = 0.0
        for s in range(ring.tau.size):
            if not ring.change[s, kind] <= change:
                change = ring.change[s, kind]
            for b in range(8):
                largest = max(largest, ring.modulus[s, b, kind])
        error = change / largest if largest > 0 else change
        if not error <= worst:
            worst = error
    return worst


@njit
def summarise(ring, out):
    """Write the statistics of the recorded revolution to a row of RESULT."""
    n = ring.tau.size
    for b in range(8):
        for kind in (0, 1):
            top, low, total = ring.modulus[0, b, kind], ring.modulus[0, b, kind], 0.0
            for s in range(n):
                value = ring.modulus[s, b, kind]
                top, low = max(top, value), min(low, value)
                total += value
            if kind == 0:
                out.F_max[b], out.F_mean[b], out.F_range[b] = top, total / n, top - low
            else:
                out.T_max[b], out.T_mean[b], out.T_range[b] = top, total / n, top - low
    out.psi_max = 0.0
    for pin in range(4):
        for side in (0, 1):
            out.contact_max[pin, side] = 0.0
            for s in range(n):
                out.contact_max[pin, side] = max(out.contact_max[pin, side], ring.contact[s, pin, side])
        for mode in range(4):
            count = 0
            for s in range(n):
                count += ring.mode[s, pin] == mode
            out.mode_share[pin, mode] = count / n
    for s in range(n):
        out.psi_max = max(out.psi_max, abs(ring.psi[s]))
