"""Quasi-static revolution: equilibrium at each input angle under the inertial loads of the ideal motion.

The residual is that of the dynamic joint with the deviations' velocities and accelerations zero; the frames' angular
velocities and accelerations stay, and with them centrifugal loads, the output shaft's inertia and the drag of pins that
turn in their holes. The predictor extrapolates through the solutions at the last four angles, or the last three if
three predicted the last angle better (after a contact has switched). Newton's iteration corrects it, with a tangent
kept from angle to angle. If Newton fails, it starts from the solution at the previous angle; if that fails too, from
where pseudo-transient continuation leads from there.
"""

import math

from tolstat.kernel.codes import AHEAD
from tolstat.kernel.mechanics.cardan import ideal_ratio
from tolstat.kernel.mechanics.loads import SPEED_ERROR
from tolstat.kernel.mechanics.motion import drive_and_load
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import where


@njit
def angle_time(k, n, par):
    """Time (s) at angle `k` of `n` in the second revolution, when a torque ramp at the start has ended."""
    return 2 * math.pi * (n + k) / (n * abs(par.omega))


@njit
def extrapolate(begins, known, motion):
    """Predictor: write the trial point of the next angle, in lanes that begin one.

    It extrapolates through the last four equally spaced angles; through three if no more are known or if three
    predicted the last angle better; with fewer than three it repeats the last solution.

    Parameters
    ----------
    begins : bool
        Mask: whether a lane begins an angle.
    known : int
        Number of angles solved.
    motion : record of MOTION, read as lanes
        ``q0``, ``q1``, ``aux`` and ``a1`` hold the last to the fourth last solution; ``q`` is written.
    """
    cubic, square = (known > 3) & (motion.memory[AHEAD] > 0), known > 2
    for i in range(motion.q.shape[0]):
        by_four = 4 * (motion.q0[i] + motion.aux[i]) - 6 * motion.q1[i] - motion.a1[i]
        by_three = 3 * (motion.q0[i] - motion.q1[i]) + motion.aux[i]
        guess = where(cubic, by_four, where(square, by_three, motion.q0[i]))
        motion.q[i] = where(begins, guess, motion.q[i])


@njit
def keep(solved, motion):
    """Accept the trial point as the last solution, in lanes that have solved an angle.

    ``motion.memory[AHEAD]`` becomes 1 if four angles predicted this solution better than three, else 0.
    """
    by_three = by_four = 0.0 * motion.q[0]
    for i in range(motion.q.shape[0]):
        third = motion.q[i] - 3 * (motion.q0[i] - motion.q1[i]) - motion.aux[i]
        by_three += abs(third)
        by_four += abs(third - (motion.q0[i] - 3 * (motion.q1[i] - motion.aux[i]) - motion.a1[i]))
        motion.a1[i] = where(solved, motion.aux[i], motion.a1[i])
        motion.aux[i] = where(solved, motion.q1[i], motion.aux[i])
        motion.q1[i] = where(solved, motion.q0[i], motion.q1[i])
        motion.q0[i] = where(solved, motion.q[i], motion.q0[i])
    motion.memory[AHEAD] = where(solved, where(by_four < by_three, 1.0, 0.0), motion.memory[AHEAD])


@njit
def speed_ratios(par, samples):
    """Write ``tau`` and its error Psi, eq. (13), of the samples.

    Before, ``tau`` holds the output shaft's angular deviation. Its derivative with respect to the phase is taken by
    periodic central differences.
    """
    n = samples.size
    by_sample = n / (4 * math.pi) if par.omega > 0 else -n / (4 * math.pi)
    first, before = samples[0].tau, samples[n - 1].tau
    for s in range(n):
        here, ahead = samples[s].tau, samples[s + 1].tau if s + 1 < n else first
        theta, slope, _, _ = drive_and_load(math.copysign(2 * math.pi * s / n, par.omega), par)
        error = (ahead - before) * by_sample / slope
        before = here
        samples[s].tau = ideal_ratio(theta, par) + error
        samples[s].psi = error / samples[s].tau
        samples[s].loads[par.begin[SPEED_ERROR]] = abs(samples[s].psi)
