"""Quasi-static revolution: equilibrium at each input angle under the inertial loads of the ideal motion.

The residual is that of the dynamic joint with the deviations' velocities and accelerations zero; the frames' angular
velocities and accelerations stay, and with them centrifugal loads, the output shaft's inertia and the drag of pins that
turn in their holes. The predictor extrapolates through the solutions at the last four angles, or the last three if
three predicted the last angle better (after a contact has switched). Newton's iteration corrects it, with a tangent
kept from angle to angle. If Newton fails, it starts from the solution at the previous angle; if that fails too, from
where pseudo-transient continuation leads from there.
"""

import math

from tolstat.kernel.integrators.state import AHEAD, HALVINGS, STEPS
from tolstat.kernel.mechanics.loads import SPEED_ERROR
from tolstat.kernel.mechanics.motion import drive_and_load, speed_ratio
from tolstat.kernel.mechanics.topology import PSI
from tolstat.kernel.simd.jit import njit, njit_inner
from tolstat.kernel.simd.lane import where


@njit
def angle_time(k, n, par):
    """Time (s) at angle `k` of `n` in the second revolution, when a torque ramp at the start has ended."""
    return 2 * math.pi * (n + k) / (n * abs(par.omega))


@njit
def extrapolate(begins, known, state):
    """Predictor: write the trial point of the next angle, in lanes that begin one.

    It extrapolates through the last four equally spaced angles; through three if no more are known or if three
    predicted the last angle better; with fewer than three it repeats the last solution.

    Parameters
    ----------
    begins : bool
        Mask: whether a lane begins an angle.
    known : int
        Number of angles solved.
    state : State
        ``q0``, ``q1``, ``aux`` and ``a1`` hold the last to the fourth last solution; ``q`` is written.
    """
    cubic, square = (known > 3) & (state.memory[AHEAD] > 0), known > 2
    for i in range(state.q.size):
        by_four = 4 * (state.q0[i] + state.aux[i]) - 6 * state.q1[i] - state.a1[i]
        by_three = 3 * (state.q0[i] - state.q1[i]) + state.aux[i]
        guess = where(cubic, by_four, where(square, by_three, state.q0[i]))
        state.q[i] = where(begins, guess, state.q[i])


@njit
def repeat_last(state):
    """Set the trial point to the solution at the previous angle."""
    for i in range(state.q.size):
        state.q[i] = state.q0[i]


@njit
def keep(solved, state):
    """Accept the trial point as the last solution, in lanes that have solved an angle.

    ``state.memory[AHEAD]`` becomes 1 if four angles predicted this solution better than three, else 0.
    """
    by_three = by_four = 0.0 * state.q[0]
    for i in range(state.q.size):
        third = state.q[i] - 3 * (state.q0[i] - state.q1[i]) - state.aux[i]
        by_three += abs(third)
        by_four += abs(third - (state.q0[i] - 3 * (state.q1[i] - state.aux[i]) - state.a1[i]))
        state.a1[i] = where(solved, state.aux[i], state.a1[i])
        state.aux[i] = where(solved, state.q1[i], state.aux[i])
        state.q1[i] = where(solved, state.q0[i], state.q1[i])
        state.q0[i] = where(solved, state.q[i], state.q0[i])
    state.memory[AHEAD] = where(solved, where(by_four < by_three, 1.0, 0.0), state.memory[AHEAD])


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
        samples[s].tau = speed_ratio(theta, par.alpha) + error
        samples[s].psi = error / samples[s].tau
        samples[s].loads[SPEED_ERROR] = abs(samples[s].psi)


def build_quasistatic(hold, relax, record):
    """Bind the equilibrium solvers of a system to a revolution.

    Parameters
    ----------
    hold, relax : jitted functions
        As `equilibrium.build_equilibrium` returns them.
    record : jitted function (k, lane, par, work, v, samples) -> None
        Records an angle, see `settle.record`.

    Returns
    -------
    jitted function (first, par, options, work, state, ring) -> bool
        Solves one revolution from the equilibrium ``state.q0`` at theta = 0; False if no equilibrium was found at an
        angle. `first`: whether it is the first revolution.
    """

    @njit_inner
    def revolution(first, par, options, work, state, ring):
        n = ring.samples.size
        for k in range(0 if first else 1, n + 1):
            t = angle_time(k, n, par)
            extrapolate(True, state.counters[STEPS], state)
            if not hold(t, par, options, work, state):
                state.counters[HALVINGS] += 1
                repeat_last(state)
                if not hold(t, par, options, work, state):
                    relax(t, par, options, work, state)
                    repeat_last(state)
                    if not hold(t, par, options, work, state):
                        return False
            keep(True, state)
            state.counters[STEPS] += 1
            record(k, 0, par, work, state.v0, ring.samples)
            ring.samples[k % n].tau = state.q0[PSI]
        return True

    return revolution
