"""The formulas of a step on a damped oscillator, whose motion is known: order, and estimated error."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.stepping import H_OLD, State, accept, make_state, predict, reset
from tolstat.common.tables import Method, Options
from tolstat.kernel.integrators import trbdf2

DAMPING = 0.2
DURATION = 5.0
DECAY, FREQUENCY = DAMPING / 2, np.sqrt(1 - DAMPING**2 / 4)


def known(t: float) -> tuple[float, float]:
    """Displacement and velocity of q'' = -q - 0.2 q', released from rest at 1."""
    fading = np.exp(-DECAY * t)
    cosine, sine = np.cos(FREQUENCY * t), np.sin(FREQUENCY * t)
    return fading * (cosine + DECAY / FREQUENCY * sine), -fading * sine / FREQUENCY


def released(h: float) -> State:
    """State at rest at 1, and the point one step before."""
    state = make_state(1)
    state.q0[0], state.v0[0], state.a0[0] = 1.0, 0.0, -1.0
    reset(state)
    state.q1[0], state.v1[0] = known(-h)
    state.memory[H_OLD] = h
    return state


def solve_step(h: float, state: State, options: Options) -> None:
    """Solve all stages of a step; one Newton iteration each, since the equation is linear."""
    for stage in range(trbdf2.STAGES if options.method == Method.TR_BDF2 else 1):
        cv, ca, _ = predict(h, stage, state, options)
        change = -(state.a + DAMPING * state.v + state.q) / (ca + DAMPING * cv + 1)
        state.q[:], state.v[:], state.a[:] = state.q + change, state.v + cv * change, state.a + ca * change


@pytest.mark.parametrize("method", list(Method))
def test_order_is_two_over_five_halvings(method: Method) -> None:
    options, errors = Options(method=int(method)), []
    for steps in 100 * 2 ** np.arange(6):
        h = DURATION / steps
        state = released(h)
        for _ in range(steps):
            solve_step(h, state, options)
            accept(h, state, options)
        q, v = known(DURATION)
        errors.append((abs(state.q0[0] - q), abs(state.v0[0] - v)))
    np.testing.assert_allclose(-np.diff(np.log2(errors), axis=0), 2.0, atol=0.2)


@pytest.mark.parametrize("h", [0.05, 0.025])
def test_estimated_error_of_a_step_is_its_error(h: float) -> None:
    state = released(h)
    solve_step(h, state, Options(method=int(Method.TR_BDF2)))
    q, v = known(h)
    assert trbdf2.errors(0, h, state) == pytest.approx((q - state.q[0], v - state.v[0]), rel=0.1)
