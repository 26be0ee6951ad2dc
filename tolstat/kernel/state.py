"""What an integrator remembers of a second-order system: the trial point, the accepted ones, and counters."""

from typing import NamedTuple

import numpy as np

STEPS, ITERATIONS, HALVINGS, FACTORISATIONS = 0, 1, 2, 3
H_OLD, CV_FACTORISED = 0, 1


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
    aux: np.ndarray  # algorithmic acceleration of generalised-alpha at the last accepted point
    residual: np.ndarray
    scale: np.ndarray  # size of each residual that counts as 1
    memory: np.ndarray  # (2,) last accepted step, cv that the tangent in use was factorised for (0: none)
    counters: np.ndarray  # (4,) steps, Newton iterations, halvings, factorisations


def make_state(n: int) -> State:
    """Allocate for `n` unknowns, filled with NaN so that reading before writing shows."""
    arrays = {name: np.full(n, np.nan) for name in State._fields[:11]}
    return State(**arrays, memory=np.zeros(2), counters=np.zeros(4, np.int64))
