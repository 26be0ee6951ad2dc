"""Energy balance of one joint in motion: what goes in, what comes out, what is stored and what is lost."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.support.of_cardan import PARAM
from tolstat.common.tables import Options, Status

STORED = ("kinetic", "bushings", "contacts", "support")
GAINS = {
    "input": 1.0,
    "axial": 1.0,
    "load": -1.0,
    "bushing_damping": -1.0,
    "contact_damping": -1.0,
    "film": -1.0,
    "support_damping": -1.0,
    "bushing_moments": 1.0,
}
"""Powers of the balance and the sign with which they change what is stored."""


class Trajectory(NamedTuple):
    """A joint on its output grid.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Time, s.
    points : ndarray, shape (n, 3, dof)
        Deviations q from the ideal motion (m, rad), their rates and accelerations.
    status : Status
        ``OK``, ``NEWTON_FAILED`` or ``OUTSIDE_MODEL``.
    """

    t: NDArray[np.float64]
    points: NDArray[np.float64]
    status: Status


class Balance(NamedTuple):
    """Energies and powers of a joint along its trajectory.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Time at equal steps, s.
    of : ndarray of ENERGY, shape (n,)
        Energies (J) and powers (W) by name, see `kernel.energy`.
    """

    t: NDArray[np.float64]
    of: NDArray[np.void]

    def stored(self) -> NDArray[np.float64]:
        """Kinetic and elastic energy, J, shape (n,)."""
        return np.asarray(np.sum([self.of[name] for name in STORED], axis=0))

    def work(self, name: str) -> NDArray[np.float64]:
        """Time integral of a power from the start, J, shape (n,).

        Of the quintic spline through the samples: of order 6, so that what does not close is the method's error.

        Raises
        ------
        ValueError
            For fewer than six samples.
        """
        from scipy.interpolate import make_interp_spline

        return np.asarray(make_interp_spline(self.t, self.of[name], k=5).antiderivative()(self.t))

    def imbalance(self) -> NDArray[np.float64]:
        """Change of the stored energy since the start less the work done, J, shape (n,): the method's error."""
        stored = self.stored()
        gained = np.sum([sign * self.work(name) for name, sign in GAINS.items()], axis=0)
        return np.asarray(stored - stored[0] - gained)


def follow(joint: NDArray[np.void], options: Options, steps: int) -> Trajectory:
    """Integrate a joint from its start, whether it settles or not.

    Parameters
    ----------
    joint : ndarray of PARAM, shape (1,)
        The joint.
    options : Options
        Numerical settings.
    steps : int
        Steps of the output grid, ``options.steps_per_rev`` to a revolution of the input shaft.

    Returns
    -------
    Trajectory
        ``steps + 1`` points, fewer where a step failed.
    """
    from tests.support import trajectory

    row = joint.view(np.recarray)[0]
    points, status = trajectory.follow(joint, options, steps)
    h = 2.0 * math.pi / (abs(float(row["omega"])) * options.steps_per_rev)
    reached = int(np.isfinite(points[:, 0, 0]).sum())
    return Trajectory(np.asarray(h * np.arange(reached)), points[:reached], status)


def balance(joint: NDArray[np.void], options: Options, trajectory: Trajectory) -> Balance:
    """Energies and powers of a joint along a trajectory of it.

    Parameters
    ----------
    joint : ndarray of PARAM, shape (1,)
        The joint.
    options : Options
        Numerical settings that the trajectory was made with.
    trajectory : Trajectory
        As `follow` gives it.

    Returns
    -------
    Balance
    """
    from tests.support import kernel_energy
    from tolstat.kernel.mechanics.work import make_work

    rows = _gauges(joint)
    of = np.zeros(len(trajectory.t), kernel_energy.ENERGY).view(np.recarray)
    kernel_energy.measure_all(trajectory.t, trajectory.points, rows, options, make_work(), of)
    return Balance(trajectory.t, of.view(np.ndarray))


def _gauges(joint: NDArray[np.void]) -> np.recarray[Any, np.dtype[np.void]]:
    """Rows of PARAM that `kernel.energy.measure` reads deformations and their rates with."""
    rows = np.repeat(np.asarray(joint, PARAM), 3)
    rows["k"][1], rows["c"][1] = 1.0, 0.0
    rows["k"][2], rows["c"][2] = 0.0, 1.0
    rows["c_d"][1] = 0.0
    return rows.view(np.recarray)
