"""The formulas of the kernel's steps, one joint at a time and step by step.

A plain driver of what the kernel does in lanes: BDF2 and TR-BDF2 on a grid, with bounded halving of a step where
Newton's iteration fails. An unconverged point is never accepted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.common.tables import Method
from tolstat.kernel.integrators import bdf2, trbdf2
from tolstat.kernel.lanes.course import MAX_RATIO
from tolstat.kernel.lanes.rounds import ROUNDOFF, SLOW
from tolstat.kernel.mechanics import dynamics, linsolve, tangent
from tolstat.kernel.simd.jit import njit, njit_inner
from tolstat.kernel.simd.lane import where

TR_BDF2 = int(Method.TR_BDF2)
H_OLD, CV_FACTORISED, STAGED_STEP = range(3)
"""Indices into `State.memory`: last step; cv of the tangent in use (0: none); last step, if its stage is kept."""

residual, solve, eliminate, assemble = dynamics.residual, linsolve.solve, linsolve.factorise, tangent.assemble
bdf2_formula, trial, two_stages = bdf2.formula, bdf2.trial, trbdf2.formula
first, second, GAMMA = trbdf2.first, trbdf2.second, trbdf2.GAMMA


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


def make_state(n: int) -> State:
    """Allocate for `n` unknowns, filled with NaN to expose values that are read before they are written."""
    return State(*(np.full(n, np.nan) for _ in range(11)), np.zeros(3))


@njit
def reset(state):
    """Clear memory; keep only the last accepted point."""
    state.memory[:] = 0.0
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


@njit
def size(state):
    """Largest weighted residual; NaN if any residual is NaN."""
    size = total = 0.0
    for i in range(state.q.size):
        one = abs(state.residual[i]) * state.weight[i]
        size, total = max(size, one), total + one
    return where(total == total, size, total)


@njit
def at_rounding(work, state):
    """Whether the last change of the unknowns is no more than their rounding."""
    step = largest = 0.0
    for i in range(state.q.size):
        step, largest = max(step, abs(work.solution[i])), max(largest, abs(state.q[i]))
    return step <= ROUNDOFF * largest


@njit_inner
def newton(t, cv, ca, par, options, work, state):
    """Solve the equations of motion at time `t`; False where the iteration fails."""
    q, v, a = state.q, state.v, state.a
    before = 0.0
    negligible = False
    for iteration in range(options.newton_max_iter + 1):
        residual(t, q, v, a, par, options, work, state.residual)
        now = size(state)
        if now <= options.newton_tol or (negligible and now < 1e300):
            return True
        if not now < 1e300 or iteration == options.newton_max_iter:
            break
        fresh = state.memory[CV_FACTORISED] != cv or (iteration > 0 and now > SLOW * before)
        if fresh:
            state.memory[CV_FACTORISED] = cv
            assemble(cv, ca, cv, par, work)
            if not eliminate(par, work):
                break
        before = now
        for i in range(q.size):
            work.solution[i] = -state.residual[i]
        solve(q, par, work)
        for i in range(q.size):
            change = work.solution[i]
            q[i] += change
            v[i] += cv * change
            a[i] += ca * change
        negligible = at_rounding(work, state)
    state.memory[CV_FACTORISED] = 0.0
    return False


@njit_inner
def attempt(t, h, par, options, work, state):
    """Try a step `h` (s), all its stages."""
    for stage in range(2 if options.method == TR_BDF2 else 1):
        cv, ca, share = predict(h, stage, state, options)
        if not newton(t + share * h, cv, ca, par, options, work, state):
            return False
    return True


@njit_inner
def advance(t, h, par, options, work, state):
    """Take one step of the output grid; False when the smallest sub-step failed."""
    whole = 1 << options.max_halvings  # progress is counted in sub-steps of the smallest size
    done = level = 0
    while done < whole:
        if options.method != TR_BDF2:
            while level < options.max_halvings and h / (1 << level) > 1.0001 * MAX_RATIO * state.memory[H_OLD] > 0:
                level += 1
        part = h / (1 << level)
        if attempt(t + h * (done / whole), part, par, options, work, state):
            accept(part, state, options)
            done += whole >> level
            while level > 0 and done % (whole >> (level - 1)) == 0:
                level -= 1
        else:
            level += 1
            state.memory[STAGED_STEP] = 0.0
            if level > options.max_halvings:
                return False
    return True
