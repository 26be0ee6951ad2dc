"""The formulas of the kernel's steps on any second-order system, one system at a time and step by step.

A plain driver of what the kernel does in lanes: BDF2 and TR-BDF2 on a grid, with bounded halving of a step where
Newton's iteration fails or, for TR-BDF2 with ``rtol``, where the estimated error is above the tolerance. An unconverged
point is never accepted.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tolstat.common.tables import Method
from tolstat.kernel.integrators import bdf2, trbdf2
from tolstat.kernel.lanes.course import MAX_RATIO
from tolstat.kernel.lanes.rounds import ROUNDOFF, SLOW
from tolstat.kernel.simd.jit import njit, njit_inner
from tolstat.kernel.simd.lane import where

TR_BDF2 = int(Method.TR_BDF2)
STEPS, ITERATIONS, HALVINGS, FACTORISATIONS, ATTEMPTS_LEFT = range(5)
"""Indices into `State.counters`; the last is the number of sub-steps that may still be tried."""
UNLIMITED = 2**62
H_OLD, CV_FACTORISED, STAGED_STEP = range(3)
"""Indices into `State.memory`: last step; cv of the tangent in use (0: none); last step, if its stage is kept."""
NO, IF_STALLED, YES = range(3)
"""Does a change end Newton's iteration: no; if the residual stalls; yes."""
ERROR_TO_GROW = 0.1
"""Estimated error, in units of the tolerance, below which a step may be doubled."""
START_LEVEL = 4
"""Level of the first sub-step of BDF2, 1/2^4 of the step: without earlier points it is implicit Euler."""
ROUNDING = 2.0**-49
"""Rounding error of an unknown relative to its size, including that of the operations of a step."""
ABSOLUTE = 1e-9
"""Absolute tolerance beside ``options.rtol``."""

bdf2_formula, trial, two_stages = bdf2.formula, bdf2.trial, trbdf2.formula
first, second, errors, GAMMA = trbdf2.first, trbdf2.second, trbdf2.errors, trbdf2.GAMMA


class State(NamedTuple):
    """Arrays of length n, the number of unknowns, unless said otherwise."""

    q: np.ndarray  # trial point
    v: np.ndarray
    a: np.ndarray
    q0: np.ndarray  # last accepted point
    v0: np.ndarray
    a0: np.ndarray
    q1: np.ndarray  # the accepted point before; in a step of TR-BDF2 v1 is the velocity at its first stage
    v1: np.ndarray
    aux: np.ndarray  # acceleration at the first stage
    residual: np.ndarray
    weight: np.ndarray  # factors that make residuals dimensionless
    memory: np.ndarray  # (3,)
    counters: np.ndarray  # (5,)


def make_state(n: int) -> State:
    """Allocate for `n` unknowns, filled with NaN to expose values that are read before they are written."""
    return State(*(np.full(n, np.nan) for _ in range(11)), np.zeros(3), np.zeros(5, np.int64))


@njit
def reset(state):
    """Clear memory and counters; keep only the last accepted point."""
    state.memory[:] = 0.0
    state.counters[:] = 0
    state.counters[ATTEMPTS_LEFT] = UNLIMITED
    for i in range(state.q.size):
        state.q1[i], state.v1[i], state.aux[i] = state.q0[i], state.v0[i], state.a0[i]


@njit
def predict(h, stage, state, options):
    """Write the trial point of a step `h` (s); return cv, ca and the share of the step at the end of the stage."""
    if options.method == TR_BDF2:
        return predict_stage(h, stage, state)
    of = bdf2_formula(h, state.memory[H_OLD], 0.0)
    for i in range(state.q.size):
        last, before = (state.q0[i], state.v0[i], state.a0[i]), (state.q1[i], state.v1[i])
        state.q[i], state.v[i], state.a[i] = trial(h, of, last, before, False, 0.0)
    return of[0], of[0] * of[0], 1.0


@njit
def predict_stage(h, stage, state):
    """Write the trial point of a stage of TR-BDF2; return values as of `predict`."""
    of = two_stages(h, state.memory[STAGED_STEP])
    for i in range(state.q.size):
        last = state.q0[i], state.v0[i], state.a0[i]
        if stage == 0:
            state.q[i], state.v[i], state.a[i] = first(of, last, state.aux[i])
        else:
            stage_one = state.q[i], state.v[i], state.a[i]
            state.v1[i], state.aux[i] = state.v[i], state.a[i]
            state.q[i], state.v[i], state.a[i] = second(of, last, stage_one)
    return of[0], of[0] * of[0], GAMMA if stage == 0 else 1.0


@njit
def accept(h, state, options):
    """Make the trial point the last accepted one."""
    for i in range(state.q.size):
        state.q1[i] = state.q0[i]
        if options.method != TR_BDF2:
            state.v1[i] = state.v0[i]
        state.q0[i], state.v0[i], state.a0[i] = state.q[i], state.v[i], state.a[i]
    state.memory[H_OLD] = state.memory[STAGED_STEP] = h
    state.counters[STEPS] += 1


@njit
def estimate(h, state, options):
    """Error of q and v at the end of the step in units of ``rtol |y|`` and rounding; the largest of all."""
    worst = 0.0
    if options.method != TR_BDF2 or options.rtol <= 0:
        return worst
    for i in range(state.q.size):
        of_q, of_v = errors(i, h, state)
        size = max(abs(state.q0[i]), abs(state.q[i]))
        speed = max(abs(state.v0[i]), abs(state.v[i]))
        size_q = ABSOLUTE + options.rtol * size + ROUNDING * size
        size_v = ABSOLUTE + options.rtol * speed + ROUNDING * size / h
        worst = max(worst, max(abs(of_q) / size_q, abs(of_v) / size_v))
    return worst


@njit
def scaled_size(cv, ca, state):
    """Largest weighted residual; NaN if any residual is NaN."""
    size = total = 0.0
    for i in range(state.q.size):
        one = abs(state.residual[i]) * state.weight[i]
        size, total = max(size, one), total + one
    return where(total == total, size, total)


@njit
def at_rounding(cv, ca, fresh, options, work, state):
    """`YES` if the last change of the unknowns is no more than their rounding, else `NO`; see `build_advance`."""
    step = largest = 0.0
    for i in range(state.q.size):
        step, largest = max(step, abs(work.solution[i])), max(largest, abs(state.q[i]))
    return YES if step <= ROUNDOFF * largest else NO


def build_advance(
    residual: Any, factorise: Any, solve: Any, size: Any = scaled_size, small: Any = at_rounding, start_level: int = 0
) -> Any:
    """Bind the equations of a system to Newton's iteration and the stepping scheme.

    Parameters
    ----------
    residual : jitted function (t, q, v, a, par, options, work, out) -> None
        Residual of the equations of motion.
    factorise : jitted function (t, q, v, a, cv, ca, par, options, work) -> bool
        Assembles and factorises d(residual)/dq + cv d/dv + ca d/da at the point last evaluated; False when singular.
    solve : jitted function (q, par, work) -> None
        Solves for ``work.solution`` in place.
    size : jitted function (cv, ca, state) -> float
        Norm of ``state.residual`` that is compared with ``options.newton_tol``.
    small : jitted function (cv, ca, fresh, options, work, state) -> int
        Whether the last change, ``work.solution``, ends the iteration: `NO`; `YES`, converged; `IF_STALLED`, converged
        only if the residual does not fall. `fresh`: the change was made with a new tangent.
    start_level : int
        Level of BDF2's first sub-step.

    Returns
    -------
    advance : jitted function (t, h, par, options, work, state) -> bool
        Take one step of the output grid; False when the smallest sub-step failed, or no attempt is left.
    """

    @njit_inner
    def newton(t, cv, ca, par, options, work, state):
        q, v, a = state.q, state.v, state.a
        before = 0.0
        negligible = NO
        for iteration in range(options.newton_max_iter + 1):
            residual(t, q, v, a, par, options, work, state.residual)
            now = size(cv, ca, state)
            if now <= options.newton_tol or (negligible == YES and now < 1e300):
                return True
            if negligible == IF_STALLED and SLOW * before < now <= before / SLOW:
                return True
            if not now < 1e300 or iteration == options.newton_max_iter:
                break
            fresh = state.memory[CV_FACTORISED] != cv or (iteration > 0 and now > SLOW * before)
            if fresh:
                state.memory[CV_FACTORISED] = cv
                state.counters[FACTORISATIONS] += 1
                if not factorise(t, q, v, a, cv, ca, par, options, work):
                    break
            before = now
            for i in range(q.size):
                work.solution[i] = -state.residual[i]
            solve(q, par, work)
            state.counters[ITERATIONS] += 1
            for i in range(q.size):
                change = work.solution[i]
                q[i] += change
                v[i] += cv * change
                a[i] += ca * change
            negligible = small(cv, ca, fresh, options, work, state)
        state.memory[CV_FACTORISED] = 0.0
        return False

    @njit_inner
    def attempt(t, h, par, options, work, state):
        for stage in range(2 if options.method == TR_BDF2 else 1):
            cv, ca, share = predict(h, stage, state, options)
            if not newton(t + share * h, cv, ca, par, options, work, state):
                return False, 0.0
        error = estimate(h, state, options)
        return error <= 1, error

    @njit_inner
    def advance(t, h, par, options, work, state):
        whole = 1 << options.max_halvings  # progress is counted in sub-steps of the smallest size
        done = level = 0
        if options.method != TR_BDF2 and state.memory[H_OLD] == 0:
            level = min(start_level, options.max_halvings)
        while done < whole:
            if options.method != TR_BDF2 or options.rtol > 0:
                while level < options.max_halvings and h / (1 << level) > 1.0001 * MAX_RATIO * state.memory[H_OLD] > 0:
                    level += 1
            if state.counters[ATTEMPTS_LEFT] <= 0:
                return False
            state.counters[ATTEMPTS_LEFT] -= 1
            part = h / (1 << level)
            good, error = attempt(t + h * (done / whole), part, par, options, work, state)
            if good:
                accept(part, state, options)
                done += whole >> level
                while level > 0 and done % (whole >> (level - 1)) == 0 and error < ERROR_TO_GROW:
                    level -= 1
                    error *= 8
            else:
                level += 1
                state.memory[STAGED_STEP] = 0.0
                state.counters[HALVINGS] += 1
                if level > options.max_halvings:
                    return False
        return True

    return advance
