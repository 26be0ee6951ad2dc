"""The recorded revolution: a ring of samples by input angle, and the closure error between revolutions."""

import math
from typing import NamedTuple

import numpy as np

from tolstat.kernel._jit import njit
from tolstat.kernel.lane import pick
from tolstat.kernel.state import make_state_record
from tolstat.kernel.topology import N_DOF, PSI
from tolstat.kernel.trail import Trail, make_trail
from tolstat.kernel.vector import larger

SAMPLE = np.dtype(
    [
        ("loads", "f8", (8, 6)),  # N, N m
        ("contact", "f8", (4, 2)),  # N
        ("modulus", "f8", (8, 2)),  # |F|, |T|
        ("change", "f8", (2,)),  # largest change of |F| and |T| against the revolution before
        ("tau", "f8"),
        ("psi", "f8"),  # Psi, eq. (13)
        ("mode", "u1", (4,)),
        ("q", "f8", (N_DOF,)),  # m, rad
    ],
    align=True,
)
"""Sample k of a revolution belongs to theta = 2 pi k / steps_per_rev."""


def make_samples(joints: int, steps_per_rev: int) -> np.recarray:
    """Allocate revolutions, shape (joints, steps_per_rev), filled with NaN."""
    samples = np.zeros((joints, steps_per_rev), SAMPLE)
    for name in SAMPLE.names:
        if name != "mode":
            samples[name] = np.nan
    return samples.view(np.recarray)


class Ring(NamedTuple):
    """The last revolution of a joint, and what else is remembered of it."""

    samples: np.recarray  # (steps_per_rev,) SAMPLE
    trail: Trail  # of the revolutions before
    shadow: np.record  # State of a neighbour of the joint, see `classify`


def make_ring(steps_per_rev: int, max_revs: int) -> Ring:
    """Allocate, filled with NaN."""
    return Ring(make_samples(1, steps_per_rev)[0], make_trail(steps_per_rev, max_revs), make_state_record(N_DOF))


@njit
def record(k, lane, par, work, state, samples):
    """Keep grid point `k` (counted from the start) of the joint in `lane`, as it was last evaluated."""
    sample = samples[k % samples.size]
    sample.change[0] = sample.change[1] = 0.0
    for b in range(8):
        for kind in (0, 1):
            square = 0.0
            for i in range(3):
                load = pick(work.load[b, 3 * kind + i], lane)
                sample.loads[b, 3 * kind + i] = load
                square += load * load
            modulus = math.sqrt(square)
            change = abs(modulus - sample.modulus[b, kind])  # NaN in the first revolution
            sample.change[kind] = larger(sample.change[kind], change)
            sample.modulus[b, kind] = modulus
    for pin in range(4):
        for side in (0, 1):
            sample.contact[pin, side] = pick(work.contact[pin, side], lane)
        sample.mode[pin] = int(pick(work.mode[pin], lane))
    omega, rate = pick(par.omega, lane), pick(state.v0[PSI], lane)
    sample.tau = (pick(work.shaft[0], lane) + rate) / omega
    sample.psi = rate / (omega * sample.tau)


@njit
def foresee(k, q, ahead, samples):
    """Keep the unknowns of grid point `k`; expect of the next step the change that it brought a revolution ago.

    Returns
    -------
    float
        1 when there was one, else 0: then nothing is known.
    """
    here, following = samples[k % samples.size], samples[(k + 1) % samples.size]
    for i in range(N_DOF):
        ahead[i] = following.q[i] - here.q[i]
        here.q[i] = q[i]
    return 1.0 if k > samples.size else 0.0


@njit
def keep(k, ring):
    """Keep what `record` has kept of grid point `k`, and at the end of a revolution its statistics, beyond it."""
    n, trail = ring.samples.size, ring.trail
    s, r = k % n, ((k - 1) // n) % trail.revolution.size
    stride = -(-n // trail.modulus.shape[1])
    if s % stride == 0:
        trail.modulus[r, s // stride] = ring.samples[s].modulus
    if s == 0:
        summarise(ring.samples, trail.revolution[r])


@njit
def closure_error(samples):
    """Largest change of any bushing load's modulus since the revolution before, relative to the largest of its kind."""
    worst = 0.0
    for kind in (0, 1):
        change = largest = 0.0
        for s in range(samples.size):
            change = larger(change, samples[s].change[kind])
            for b in range(8):
                largest = max(largest, samples[s].modulus[b, kind])
        error = change / largest if largest > 0 else change
        worst = larger(worst, error)
    return worst


@njit
def peak(before, here, ahead):
    """Height of the parabola through three samples, of which `here` is the largest: a peak lies between samples.

    Where contacts switch, the peak is a kink and not a parabola; the height is then off by an eighth at most of the
    larger drop to a neighbour.
    """
    bend = 2 * here - before - ahead
    return here + (ahead - before) ** 2 / (8 * bend) if bend > 0 else here


@njit
def extremes(values):
    """Largest and smallest height of a closed curve given at equally spaced angles, shape (n,)."""
    n = values.size
    top = low = 0
    for s in range(n):
        if values[s] > values[top]:
            top = s
        if values[s] < values[low]:
            low = s
    highest = peak(values[top - 1], values[top], values[(top + 1) % n])
    lowest = -peak(-values[low - 1], -values[low], -values[(low + 1) % n])
    return highest, lowest


@njit
def summarise(samples, out):
    """Write the statistics of the recorded revolution to a row of RESULT."""
    n = samples.size
    for b in range(8):
        for kind in (0, 1):
            top, low = extremes(samples.modulus[:, b, kind])
            low = max(low, 0.0)
            total = 0.0
            for s in range(n):
                total += samples[s].modulus[b, kind]
            if kind == 0:
                out.F_max[b], out.F_mean[b], out.F_range[b] = top, total / n, top - low
            else:
                out.T_max[b], out.T_mean[b], out.T_range[b] = top, total / n, top - low
    out.psi_max = 0.0
    for pin in range(4):
        for side in (0, 1):
            out.contact_max[pin, side], _ = extremes(samples.contact[:, pin, side])
        for mode in range(4):
            count = 0
            for s in range(n):
                count += samples[s].mode[pin] == mode
            out.mode_share[pin, mode] = count / n
    for s in range(n):
        out.psi_max = max(out.psi_max, abs(samples[s].psi))
