"""Joints of one variant of the paper's study with their histories, and the evidence for its statements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.cirelli2021 import rccc
from studies.cirelli2021 import spectra as paper_spectra
from studies.cirelli2021 import tables as paper
from studies.cirelli2021.evidence import Evidence
from tolstat.common.tables import Status
from tolstat.joint import Joint, Operation, operating
from tolstat.store import ResultFile
from tolstat.store.recorded import operation_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Main:
    """The joints of one variant with their histories; row i is one of them.

    Attributes
    ----------
    joint : Joint
        The joint of the variant.
    operation : Operation
        Operating point of the variant, from which that of each joint deviates.
    case : ndarray of int, shape (m,)
        Index of the errors in `PaperStudy.cases`.
    alpha : ndarray, shape (m,)
        Misalignment, rad.
    errors, results : ndarray of ERROR and RESULT, shape (m,)
        Rows of the file.
    gamma : ndarray, shape (m, 8, 2)
        Eq. (14), per cent.
    moduli : ndarray, shape (m, samples, 8, 2)
        Force (N) and torque (N m) over the input angle.
    couple : ndarray, shape (m, samples)
        Couple of cross bushings 1 and 2 about the cross's normal, N m.
    contact : ndarray, shape (m, samples, 4, 3)
        Contact forces of pins 1 to 4, in the order of `load_kinds.CONTACTS`, N.
    tau : ndarray, shape (m, samples)
        Speed ratio.
    """

    joint: Joint
    operation: Operation
    case: NDArray[np.int32]
    alpha: Array
    errors: NDArray[np.void]
    results: NDArray[np.void]
    gamma: Array
    moduli: Array
    couple: Array
    contact: Array
    tau: Array

    @property
    def theta(self) -> Array:
        """Input angle of the samples, rad, shape (samples,)."""
        return np.linspace(0.0, 2.0 * np.pi, self.tau.shape[1], endpoint=False)

    def ideal(self, alpha: float) -> int:
        """Row of the joint without errors at a misalignment, rad."""
        return int(np.flatnonzero((self.case == 0) & (np.abs(self.alpha - alpha) < paper.SAME_ALPHA))[0])

    def rigid_couple(self, row: int) -> Array:
        """Couple that the rigid RCCC linkage passes, the inertia of the output side with it: (samples,), N m."""
        motion = rccc.solve(self.joint, self.operation, self.errors[row], self.theta)
        samples = len(motion.speed_ratio)
        spectrum = 1j * np.fft.rfftfreq(samples, 1.0 / samples) * np.fft.rfft(motion.speed_ratio)
        spectrum[-1] *= samples % 2  # the highest order of an even number of samples has no slope
        point = operating(self.operation, self.errors[row])
        speed, torque = float(point["speed"]), float(point["torque"])
        inertial = output_inertia(self.joint) * speed**2 * np.fft.irfft(spectrum, samples)
        return np.asarray(motion.couple * (1.0 + inertial / torque))

    def evidence(self, cases: tuple[str, ...], printed: Array) -> Evidence:
        """What the statements are tested on; `printed`: revolutions with c_d as printed, (k,)."""
        torque = operating(self.operation, self.errors)["torque"]
        away = [float(np.abs(self.couple[i] - self.rigid_couple(i)).max()) for i in range(len(self.case))]
        return Evidence(
            tuple(cases[i] for i in self.case),
            self.alpha,
            self.gamma,
            self.results["contact_max"],
            self.results["psi_max"],
            paper_spectra.amplitudes(self.moduli),
            100.0 * np.array(away) / np.abs(torque),
            revolutions(self.results),
            printed,
        )


def read(store: ResultFile, joint: Joint, rows: NDArray[np.intp], gamma: Array) -> Main:
    """Take rows of one variant, whose joint is `joint`, from the file; `gamma` is that of all rows of the file."""
    errors, loads = store.errors()[rows], store.histories("loads", rows).astype(np.float64)
    operation = operation_of(store, int(rows[0]))
    return Main(
        joint,
        operation,
        store.design["case"][rows],
        operating(operation, errors)["alpha"],
        errors,
        store.results()[rows],
        gamma[rows],
        paper_spectra.moduli(loads),
        (joint.cross.r_b * loads[:, :, :2, 1] + loads[:, :, :2, 5]).sum(axis=2),
        store.histories("contact", rows).astype(np.float64),
        store.histories("tau", rows).astype(np.float64),
    )


def output_inertia(joint: Joint) -> float:
    """Inertia beyond cross bushings 1 and 2: output shaft, the arms of its fork, and pins 1 and 2; kg m^2.

    All about the output shaft's axis, though the pins turn about the cross's normal.
    """
    total = joint.shaft.Js
    for body in (joint.arm, joint.pin):
        total += 2.0 * (body.mass * joint.cross.R**2 + body.inertia[2])
    return total


def revolutions(results: NDArray[np.void]) -> Array:
    """Revolutions until settled, (n,); infinite where a joint did not settle."""
    return np.where(results["status"] == Status.OK, results["revolutions"], np.inf)
