"""The recorded revolution: a ring buffer of samples by input angle, and the closure error between revolutions."""

import math
from functools import cache

import numpy as np

from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import sizes
from tolstat.common.mechanism import Mechanism
from tolstat.kernel.mechanics.dynamics import forces
from tolstat.kernel.mechanics.loads import LOSS, OF_FORCES, OF_TORQUES, complete_loads, size_of, write_loads
from tolstat.kernel.mechanics.scale import centring_stiffness, stiffness
from tolstat.kernel.mechanics.vector import larger
from tolstat.kernel.mechanics.work import DAMPING, FORCE, SLOPE
from tolstat.kernel.revolution.bearing import STRIDE, record_ends, write_bearings, write_equivalent_loads
from tolstat.kernel.revolution.orders import write_orders
from tolstat.kernel.simd.borrow import fetch
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import pick


@cache
def sample_dtype(mechanism):
    """Type SAMPLE; sample k of a revolution belongs to theta = 2 pi k / steps_per_rev."""
    pins, shafts = len(mechanism.pairs), len(mechanism.shafts)
    return np.dtype(
        [
            ("components", "f8", (len(mechanism.bushings), 6)),  # of bushing loads along and about e, t, z; N, N m
            ("loads", "f8", (sizes(mechanism).instant,)),  # kind after kind
            (
                "change",
                "f8",
                (2, 2),
            ),  # by measure, largest change in a revolution: of bushing loads, of all that decide
            ("s", "f8"),  # displacement of the output shaft along its axis, m
            ("shafts", "f8", (shafts, 6)),  # force and moment about O on each shaft, in axes that do not turn
            ("tau", "f8"),
            ("psi", "f8"),  # its error, eq. (13)
            ("loss", "f8", (pins if mechanism.friction else 0,)),  # power of each pin's friction, W
            ("mode", "u1", (pins,)),
            ("pressed", "u4", (pins,)),  # bit j: station j of the pin carries a force; the next bit: its face
            ("stuck", "u2", (pins,)),  # bit j: station j sticks
            ("ends", "f8", (pins, 3)),  # of every `STRIDE`-th sample, see `bearing.record_ends`; m^2
            ("q", "f8", (mechanism.dof,)),  # m, rad
            ("v", "f8", (mechanism.dof,)),  # per s
        ],
        align=True,
    )


STICKS = 0.5
"""Slope of friction along the sliding, relative to that across it, above which a station sticks: it slides with less
than the slip speed."""
BUSHINGS_ONLY, ALL_LOADS = 0, 1
"""Columns of its ``change``: bushing loads, and s as a force; with them what the shafts carry."""


def make_samples(joints: int, steps_per_rev: int, mechanism: Mechanism = CARDAN) -> np.recarray:
    """Allocate revolutions, shape (joints, steps_per_rev), filled with NaN."""
    dtype = sample_dtype(mechanism)
    samples = np.zeros((joints, steps_per_rev), dtype)
    for name in dtype.names:
        if dtype[name].base.kind == "f":
            samples[name] = np.nan
    return samples.view(np.recarray)


@njit
def grid_step(par, options):
    """Length of a step of the output grid, s."""
    return 2 * math.pi / (abs(par.omega) * options.steps_per_rev)


@njit
def pressed(pin, lane, par, work):
    """Which stations of `pin` carry a force, and whether a face does, as bits."""
    bits, stations = 0, par.n_stations[par.pair_kind[pin]]
    for j in range(stations):
        if pick(work.station[pin, j, FORCE], lane) > 0:
            bits |= 1 << j
    for face in range(par.face_pair.shape[0]):
        if par.face_pair[face] == pin and pick(work.face[face, FORCE], lane) > 0:
            bits |= 1 << stations
    return bits


@njit
def stuck(pin, lane, par, work):
    """Which stations of `pin` stick, as bits."""
    bits = 0
    if par.friction == 1:
        for j in range(par.n_stations[par.pair_kind[pin]]):
            rubbing = work.rubbing[pin, j]
            if pick(rubbing[SLOPE], lane) > STICKS * pick(rubbing[DAMPING], lane):
                bits |= 1 << j
    return bits


@njit
def replace(i, lane, work, sample):
    """Record load `i` in `sample`; return its change since the revolution before, NaN in the first one."""
    load, before = pick(work.loads[i], lane), sample.loads[i]
    sample.loads[i] = load
    return abs(load - before)


@njit
def record(k, lane, par, work, samples):
    """Record a grid point, and the change of the loads that decide since the revolution before.

    Parameters
    ----------
    k : int
        Number of the grid point, counted from the start; it overwrites sample k modulo n.
    lane : int
        Lane of the joint; has no effect where there is one joint only.
    par : record of PARAM
        The joint.
    work : record of WORK
        The joint's last evaluation, with complete loads (`loads.complete_loads`).
    samples : ndarray of SAMPLE, shape (n,)
        Written.
    """
    sample = samples[k % samples.size]
    fetch(samples[(k + 2) % samples.size])
    sample.tau, sample.psi = pick(work.output[0], lane), pick(work.output[1], lane)
    s = pick(work.pos[work.pos.shape[0] - 1, 2], lane)
    shift = centring_stiffness(lane, par) * abs(s - sample.s)
    for measure in range(par.of_measure.shape[0]):
        change = shift if measure == OF_FORCES else 0.0
        first, last = par.of_measure[measure, 0], par.of_measure[measure, 1]
        others = first + par.measured[measure, 1] - par.measured[measure, 0]
        for j in range(first, others):
            change = larger(change, replace(par.deciding[j], lane, work, sample))
        sample.change[measure, BUSHINGS_ONLY] = change
        for j in range(others, last):
            change = larger(change, replace(par.deciding[j], lane, work, sample))
        sample.change[measure, ALL_LOADS] = change
    sample.s = s
    for i in par.others:
        sample.loads[i] = pick(work.loads[i], lane)
    for b in range(work.load.shape[0]):
        for i in range(6):
            sample.components[b, i] = pick(work.load[b, i], lane)
    for shaft in range(work.shafts.shape[0]):
        for i in range(6):
            sample.shafts[shaft, i] = pick(work.shafts[shaft, i], lane)
    for pin in range(work.loss.shape[0]):
        sample.loss[pin] = pick(work.loss[pin], lane)
    for pin in range(work.mode.shape[0]):
        sample.mode[pin] = int(pick(work.mode[pin], lane))
        sample.pressed[pin], sample.stuck[pin] = pressed(pin, lane, par, work), stuck(pin, lane, par, work)
        if k % samples.size % STRIDE == 0:
            record_ends(pin, lane, par, work, sample.ends[pin])


@njit
def record_loads(lane, work, loads):
    """Write all loads at one instant to `loads`, shape (n,); other arguments as of `record`."""
    for i in range(loads.shape[0]):
        loads[i] = pick(work.loads[i], lane)


@njit
def predict_increment(k, q, v, ahead, samples):
    """Store the motion at grid point `k`; predict the increment of the next step by that of one revolution earlier.

    In the first revolution the polynomial through the last five grid points is continued.

    Parameters
    ----------
    k : int
        Number of the grid point, counted from the start.
    q, v : ndarray, shape (dof,)
        Unknowns (m, rad) and velocities (per s).
    ahead : ndarray, shape (dof,)
        Written: predicted increment of q.
    samples : ndarray of SAMPLE, shape (n,)
        The last revolution; written.

    Returns
    -------
    float
        1 if there is a prediction, 0 at the first four grid points.
    """
    n = samples.size
    here, following = samples[k % n], samples[(k + 1) % n]
    before = samples[(k - 1) % n], samples[(k - 2) % n], samples[(k - 3) % n], samples[(k - 4) % n]
    if k > n:
        for i in range(ahead.shape[0]):
            ahead[i] = following.q[i] - here.q[i]
    for i in range(ahead.shape[0]):
        here.q[i], here.v[i] = q[i], v[i]
    if k <= n:
        for i in range(ahead.shape[0]):
            ahead[i] = 4 * here.q[i] - 10 * before[0].q[i] + 10 * before[1].q[i] - 5 * before[2].q[i] + before[3].q[i]
    return 1.0 if k >= 5 else 0.0


@njit
def closure_error(first, last, column, par, samples):
    """Largest change of a load that decides since the revolution before, relative to its measure.

    Changes count at samples `first` to `last` - 1; `column`: those of bushing loads, `BUSHINGS_ONLY`, or `ALL_LOADS`.
    """
    worst = 0.0
    for measure in range(par.measured.shape[0]):
        change = largest = 0.0
        for s in range(first, last):
            change = larger(change, samples[s].change[measure, column])
        for s in range(samples.size):
            largest = max(largest, size_of(measure, samples[s].loads, par))
        error = change / largest if largest > 0 else change
        worst = larger(worst, error)
    return worst


@njit
def peak(before, here, ahead):
    """Height of the parabola through three samples of which `here` is the largest: peaks lie between samples.

    Where contacts switch, the peak is a kink and not a parabola; the height is then off by at most an eighth of the
    larger drop to a neighbour.
    """
    bend = 2 * here - before - ahead
    return here + (ahead - before) ** 2 / (8 * bend) if bend > 0 else here


@njit
def highest(values):
    """Largest value of a periodic curve given at equally spaced angles, shape (n,), by a parabola."""
    n, top = values.size, 0
    for s in range(n):
        if values[s] > values[top]:
            top = s
    return peak(values[top - 1], values[top], values[(top + 1) % n])


@njit
def lowest(values):
    """Smallest value of such a curve."""
    n, low = values.size, 0
    for s in range(n):
        if values[s] < values[low]:
            low = s
    return -peak(-values[low - 1], -values[low], -values[(low + 1) % n])


@njit
def third_differences(s, body, samples):
    """Largest third differences at sample `s` of displacements (m) and rotations (rad) of a lump."""
    q0, q1, q2, q3 = samples[s - 3].q, samples[s - 2].q, samples[s - 1].q, samples[s].q
    shift = turn = 0.0
    for i in range(6 * body, 6 * body + 3):
        j = i + 3
        by_shift, by_turn = abs(q3[i] - q0[i] - 3 * (q2[i] - q1[i])), abs(q3[j] - q0[j] - 3 * (q2[j] - q1[j]))
        shift, turn = by_shift if by_shift > shift else shift, by_turn if by_turn > turn else turn
    return shift, turn


@njit
def third_differences_of_loads(s, samples):
    """Largest third differences at sample `s` of a component of a bushing's force (N) and torque (N m)."""
    c0, c1 = samples[s - 3].components, samples[s - 2].components
    c2, c3 = samples[s - 1].components, samples[s].components
    force = torque = 0.0
    for bushing in range(c0.shape[0]):
        for i in range(6):
            third = abs(c3[bushing, i] - c0[bushing, i] - 3 * (c2[bushing, i] - c1[bushing, i]))
            if i < 3:
                force = max(force, third)
            else:
                torque = max(torque, third)
    return force, torque


@njit
def is_sharp(par):
    """Whether a joint has thrust faces or friction: its forces change within a step where one sets in."""
    return par.friction == 1 or par.face_pair.shape[0] > 0


@njit
def step_error(par, samples):
    """Estimated error of a BDF2 step, as a load relative to the largest one: mean over the recorded revolution.

    A step of BDF2 errs by 2/9 of the third difference of an unknown (Hairer, Wanner: Solving ODEs I, III.2); the
    stiffness of the lump's bushing converts it to a load. Of a joint with faces or friction third differences of the
    bushing loads themselves count: where sliding reverses its cross moves far without load.
    """
    by_loads = is_sharp(par)
    force = torque = 0.0
    for s in range(samples.size):
        force = max(force, size_of(OF_FORCES, samples[s].loads, par))
        torque = max(torque, size_of(OF_TORQUES, samples[s].loads, par))
    total = 0.0
    for s in range(samples.size):
        by_shift = by_turn = 0.0
        if by_loads:
            by_shift, by_turn = third_differences_of_loads(s, samples)
        else:
            for body in range(par.lump_kind.shape[0]):
                k, k_turn = stiffness(body, par)
                shift, turn = third_differences(s, body, samples)
                by_shift, by_turn = max(by_shift, k * shift), max(by_turn, k_turn * turn)
        total += max(by_shift / force, by_turn / torque)
    return 2 / 9 * total / samples.size


@njit
def summarise(par, samples, out):
    """Write the statistics of the recorded revolution of the joint `par` to a row of KERNEL_RESULT."""
    n = samples.size
    for i in range(par.modulus.shape[0]):
        if i < out.average.shape[0]:
            top, low = highest(samples.loads[:, i]), lowest(samples.loads[:, i])
            total = 0.0
            for s in range(n):
                total += samples[s].loads[i]
            out.largest[i], out.average[i], out.range[i] = top, total / n, top - max(low, 0.0)
        elif par.interpolated[i] == 1:
            out.largest[i] = highest(samples.loads[:, i])
        else:
            out.largest[i] = 0.0
            for s in range(n):
                out.largest[i] = max(out.largest[i], samples[s].loads[i])
    for pin in range(out.mode_share.shape[0]):
        for mode in range(out.mode_share.shape[1]):
            count = 0
            for s in range(n):
                count += samples[s].mode[pin] == mode
            out.mode_share[pin, mode] = count / n
    write_equivalent_loads(par, samples, out)
    write_of_revolution(par, samples, out)


@njit
def write_of_revolution(par, samples, out):
    """Write the loads that belong to a whole revolution, the recorded one, to a row of KERNEL_RESULT."""
    write_orders(par, samples, out)
    write_bearings(par, samples, out)
    if par.friction == 1:
        write_losses(par, samples, out)


@njit
def write_losses(par, samples, out):
    """Write the mean power of friction over the recorded revolution, of each pin and of all."""
    first, pins = par.begin[LOSS], par.pin.shape[0]
    out.largest[first + pins] = 0.0
    for pin in range(pins):
        total = 0.0
        for s in range(samples.size):
            total += samples[s].loss[pin]
        out.largest[first + pin] = total / samples.size
        out.largest[first + pins] += out.largest[first + pin]


@njit
def sample(times, states, par, work, samples):
    """Record the loads along a solution.

    Parameters
    ----------
    times, states : ndarray, shapes (m,) and (m, 2 dof)
        The solution, s; m and rad, per s.
    par, work : records of PARAM and WORK
        The joint; scratch.
    samples : ndarray of SAMPLE, shape (m,)
        Written.
    """
    dof = work.solution.shape[0]
    for k in range(times.size):
        forces(times[k], states[k, :dof], states[k, dof:], par, work)
        write_loads(states[k, dof:], par, work)
        complete_loads(par, work)
        record(k, 0, par, work, samples)
