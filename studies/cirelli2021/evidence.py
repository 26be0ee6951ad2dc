"""What the statements of Cirelli et al. (2021) are tested on, and the form of an answer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.cirelli2021.tables import SAME_ALPHA

Array = NDArray[np.float64]


class Evidence(NamedTuple):
    """One joint with all its errors at both misalignments; row i is one of them.

    Attributes
    ----------
    cases : tuple of str
        Name of the errors of each row; ``"ideal"`` for none.
    alpha : ndarray, shape (m,)
        Misalignment, rad.
    gamma : ndarray, shape (m, 8, 2)
        Gamma of force and torque with sign, per cent.
    contact : ndarray, shape (m, 4, 3)
        Largest contact forces of each pin, in the order of `load_kinds.CONTACTS`, N.
    psi : ndarray, shape (m,)
        Largest error of the speed ratio.
    spectra : ndarray, shape (m, orders, 8, 2)
        Mean and amplitudes of force (N) and torque (N m) at multiples of the input speed.
    couple : ndarray, shape (m,)
        Largest difference of the couple through the cross from that of the rigid linkage with the inertia of the output
        side, per cent of the resisting torque.
    revolutions, revolutions_printed : ndarray, shape (m,), (k,)
        Revolutions until settled, c_d in SI and as printed; infinite where a joint did not settle.
    """

    cases: tuple[str, ...]
    alpha: Array
    gamma: Array
    contact: Array
    psi: Array
    spectra: Array
    couple: Array
    revolutions: Array
    revolutions_printed: Array

    def rows(self, word: str = "", alpha: float | None = None) -> NDArray[np.intp]:
        """Rows with errors whose name starts with `word`, at one misalignment (rad) or at all."""
        named = np.array([name != "ideal" and name.startswith(word) for name in self.cases])
        here = np.ones(len(named), bool) if alpha is None else np.abs(self.alpha - alpha) < SAME_ALPHA
        return np.flatnonzero(named & here)

    def ideals(self) -> NDArray[np.intp]:
        """Rows without errors."""
        return np.array([i for i, name in enumerate(self.cases) if name == "ideal"], np.intp)

    def ideal(self, row: int) -> int:
        """Row without errors at the misalignment of `row`."""
        rows = self.ideals()
        return int(rows[np.abs(self.alpha[rows] - self.alpha[row]) < SAME_ALPHA][0])

    def name(self, row: int) -> str:
        """Errors and misalignment of a row for the reader."""
        return f"{self.cases[row]} at {np.degrees(self.alpha[row]):.0f}°"


class Answer(NamedTuple):
    """One sentence of the paper and what came of it.

    Attributes
    ----------
    key : str
        Short identifier.
    claim : str
        What the paper says.
    criterion : str
        What it takes to be answered yes.
    yes : bool
        Whether it holds.
    figures : str
        The numbers that decide.
    """

    key: str
    claim: str
    criterion: str
    yes: bool
    figures: str


def signed(value: float) -> str:
    """Per cent with one digit and its sign, no sign at zero."""
    text = f"{value:+.1f} %"
    return text if value and float(f"{value:.1f}") else "0.0 %"
