"""A stand-in for the solver with loads from two errors; apart from the tests, so that a worker need not import them."""

from __future__ import annotations

import os
import signal

import numpy as np

from tests.support.of_cardan import RESULT
from tolstat.common.tables import Simulation, Status
from tolstat.solver import stationary


def stand_in(params, options, **given):
    """Loads at 100 N m from one tilt and one offset: 640 N, 40 N a sigma of the tilt, 15 N a sigma of the offset."""
    results = np.zeros(len(params), RESULT)
    tilt = -params["pin_axis"][:, 0, 2] / 0.0029  # about t of pin 1: its axis leaves along z
    offset = params["pin_point"][:, 1, 2] / 5e-5
    factor = params["torque"] / 100.0
    results["F_max"][:] = (factor * (640.0 + 40.0 * np.abs(tilt) + 15.0 * np.abs(offset)))[:, None]
    results["status"], results["settled"] = Status.OK, 1
    stationary.fill_intervals(results)
    return Simulation(results, {})


def killing(params, options, tilt, **given):
    """Stand in for the solver; a joint with this tilt kills its process."""
    if tilt in params["pin_axis"][:, 0, 2]:
        os.kill(os.getpid(), signal.SIGKILL)
    return stand_in(params, options)
