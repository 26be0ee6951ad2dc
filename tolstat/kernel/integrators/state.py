"""State of an integrator of a second-order system: the trial point, the accepted points, and counters."""

from typing import NamedTuple

import numpy as np

STEPS, ITERATIONS, HALVINGS, FACTORISATIONS, ATTEMPTS_LEFT, ALLOWED = range(6)
"""Indices into ``State.counters``; `ALLOWED` is the number of iterations at which Newton's iteration gives up."""
UNLIMITED = 2**62
H_OLD, CV_FACTORISED, AHEAD, STAGED_STEP, LAST_ITERATION_BELOW, TOLERANCE, FORCE, TORQUE, TRAPEZOIDAL = range(9)
MEMORY = 9
"""Indices into ``State.memory``: last accepted step, s; cv of the tangent in use (0: none); whether `ahead` is used
(1); length of the last step if its first stage is kept (else 0); weighted residual up to which one more iteration needs
no check; for error-controlled steps: tolerance, and the force (N) and torque (N m) that errors are relative to; whether
BDF2 gives way to the trapezoidal rule (1)."""


class State(NamedTuple):
    """Arrays of length n, the number of unknowns, unless said otherwise."""

    q: np.ndarray  # trial point
    v: np.ndarray
    a: np.ndarray
    q0: np.ndarray  # last accepted point
    v0: np.ndarray
    a0: np.ndarray
    q1: np.ndarray  # the accepted point before
    v1: np.ndarray
    a1: np.ndarray
    aux: np.ndarray  # algorithmic acceleration of generalised-alpha at the last accepted point
    residual: np.ndarray
    weight: np.ndarray  # factors that make residuals dimensionless
    ahead: np.ndarray  # expected change of q in the next step, where a better prediction than a Taylor series is known
    memory: np.ndarray  # (9,) indices `H_OLD` to `TRAPEZOIDAL`
    counters: np.ndarray  # (6,) steps, Newton iterations, halvings, factorisations, attempts at a step still allowed,
    # Newton iterations allowed


def make_state(n: int) -> State:
    """Allocate for `n` unknowns, filled with NaN to expose values that are read before they are written."""
    arrays = {name: np.zeros(shape, dtype) for name, (dtype, shape) in layout(n).items()}
    for name in State._fields[:13]:
        arrays[name][...] = np.nan
    arrays["counters"][ALLOWED] = UNLIMITED
    return State(**arrays)


def layout(n: int) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Type and shape of each array."""
    arrays: dict[str, tuple[str, tuple[int, ...]]] = dict.fromkeys(State._fields[:13], ("f8", (n,)))
    return arrays | {"memory": ("f8", (MEMORY,)), "counters": ("i8", (6,))}


def record_dtype(n: int) -> np.dtype[np.void]:
    """Type of the record with the same arrays: passing it counts no references, and its shapes are constants."""
    return np.dtype([(name, *kind) for name, kind in layout(n).items()])


def make_state_record(n: int) -> np.record:
    """Allocate the record."""
    state = np.zeros(1, record_dtype(n)).view(np.recarray)[0]
    for name in State._fields[:13]:
        state[name][...] = np.nan
    state["counters"][ALLOWED] = UNLIMITED
    return state
