"""What Cirelli et al. (2021) say in words, each sentence tested on the joints of a study.

A sentence is answered yes when it holds in every direction that the study runs, since the paper names none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.paper import INPUT_SIDE, OUTPUT_SIDE, SAME_ALPHA

Array = NDArray[np.float64]

UNAFFECTED = 1.6
"""Largest Gamma that the paper prints on the input side, where it calls influence negligible (Table 6), per cent."""
MARGINAL = 1e-3
"""Error of the speed ratio that is called marginal here."""
NOTICED = 1.0
"""Amplitude that counts as part of a spectrum, per cent of the ideal joint's mean load."""
REVOLUTIONS = 20


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
    contact : ndarray, shape (m, 4, 2)
        Largest normal force on the outer and inner half of each pin, N.
    psi : ndarray, shape (m,)
        Largest error of the speed ratio.
    spectra : ndarray, shape (m, orders, 8, 2)
        Mean and amplitudes of force (N) and torque (N m) at multiples of the input speed.
    revolutions, revolutions_printed : ndarray, shape (m,), (k,)
        Revolutions until settled, c_d in SI and as printed; infinite where a joint did not settle.
    """

    cases: tuple[str, ...]
    alpha: Array
    gamma: Array
    contact: Array
    psi: Array
    spectra: Array
    revolutions: Array
    revolutions_printed: Array

    def rows(self, word: str = "", alpha: float | None = None) -> NDArray[np.intp]:
        """Rows with errors whose name starts with `word`, at one misalignment (rad) or at all."""
        named = np.array([name != "ideal" and name.startswith(word) for name in self.cases])
        here = np.ones(len(named), bool) if alpha is None else np.abs(self.alpha - alpha) < SAME_ALPHA
        return np.flatnonzero(named & here)

    def ideal(self, row: int) -> int:
        """Row without errors at the misalignment of `row`."""
        same = np.abs(self.alpha - self.alpha[row]) < SAME_ALPHA
        return next(int(i) for i in np.flatnonzero(same) if self.cases[i] == "ideal")

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
    yes : bool
        Whether it holds.
    figures : str
        The numbers that decide.
    """

    key: str
    claim: str
    yes: bool
    figures: str


def answers(evidence: Evidence) -> list[Answer]:
    """Test every sentence."""
    tests = (output_side, input_springs, one_pin, angular_torque, force_size, torque_size, milder_force, milder_torque)
    return [test(evidence) for test in (*tests, spectrum, marginal, psi_grows, settling, settling_printed)]


def output_side(e: Evidence) -> Answer:
    """Errors load the output side and leave the input fork and cross bushings 3 and 4 alone."""
    largest = np.abs(e.gamma[:, INPUT_SIDE]).max(axis=(1, 2))
    rows = e.rows()
    worst = int(rows[np.nanargmax(largest[rows])])
    quiet = int((largest[rows] <= UNAFFECTED).sum())
    other = rows[largest[rows] > UNAFFECTED]
    names = sorted({e.cases[i] for i in other})
    text = f"largest |Γ| on the input side {largest[worst]:.1f} % ({e.name(worst)}); at most {UNAFFECTED} % in {quiet} "
    text += f"of {len(rows)} joints" + (f", more in {', '.join(names)}, which load all eight bushings" if names else "")
    claim = "Errors act on cross bushings 1, 2 and the output fork; the input side is not affected."
    return Answer("output_side", claim, quiet == len(rows), text)


def input_springs(e: Evidence) -> Answer:
    """Contact springs between cross and input fork do not feel the errors."""
    rows = e.rows()
    ideal = np.array([e.contact[e.ideal(i), 2:].max() for i in rows])
    change = 100.0 * np.abs(e.contact[rows, 2:].max(axis=(1, 2)) / ideal - 1.0)
    worst = int(np.argmax(change))
    text = f"largest change of their force {change[worst]:.1f} % ({e.name(int(rows[worst]))}), "
    text += f"median {np.median(change):.1f} %"
    claim = "The springs between cross and input fork are not affected."
    return Answer("input_springs", claim, bool(change[worst] <= UNAFFECTED), text)


def one_pin(e: Evidence) -> Answer:
    """A position error raises the force of cross bushing 1 by 16 % or more and leaves bushing 2 as it is."""
    rows = e.rows("Pos")
    first, second = e.gamma[rows, 0, 0], e.gamma[rows, 1, 0]
    apart = np.abs(first - second)
    worst = int(np.argmax(apart))
    text = f"Γ_F of bushing 1 at most {first.max():.1f} %; from bushing 2 it differs by at most {apart[worst]:.2f} "
    text += f"points ({e.name(int(rows[worst]))})"
    claim = "Position errors raise the force of cross bushing 1 (16–19 %) and do not touch bushing 2."
    return Answer("one_pin", claim, bool((first >= 16.0).any() and (np.abs(second) < 1.0).all()), text)


def angular_torque(e: Evidence) -> Answer:
    """Angular errors change torques more than position errors do, whatever their directions."""
    largest = np.abs(e.gamma[:, OUTPUT_SIDE, 1]).max(axis=1)
    ang, pos = largest[e.rows("Ang")], largest[e.rows("Pos")]
    text = f"largest |Γ_T| on the output side: angular {ang.min():.1f} to {ang.max():.1f} %, position {pos.min():.1f} "
    text += f"to {pos.max():.1f} %"
    return Answer("angular_torque", "Angular errors dominate the torques.", bool(ang.min() > pos.max()), text)


def force_size(e: Evidence) -> Answer:
    """The largest increase of a force lies between 15 and 19 %."""
    return _size(e, 0, "force_size", "Force changes reach 15–19 %.", (15.0, 19.0))


def torque_size(e: Evidence) -> Answer:
    """The largest increase of a torque lies between 20 and 32 %."""
    return _size(e, 1, "torque_size", "Torque changes reach 20–32 % (“31 % higher than the ideal case”).", (20.0, 32.0))


def _size(e: Evidence, load: int, key: str, claim: str, span: tuple[float, float]) -> Answer:
    rows = e.rows()
    value = e.gamma[rows][:, OUTPUT_SIDE, load]
    up, down = value.max(axis=1), value.min(axis=1)
    high, low = int(np.argmax(up)), int(np.argmin(down))
    text = f"largest increase {up[high]:+.1f} % ({e.name(int(rows[high]))}), largest decrease {down[low]:+.1f} % "
    text += f"({e.name(int(rows[low]))})"
    return Answer(key, claim, bool(span[0] <= round(float(up[high]), 1) <= span[1]), text)


def milder_force(e: Evidence) -> Answer:
    """Output side forces change less at the larger misalignment."""
    return _milder(e, 0, "milder_force", "α = 15° mitigates the force changes.")


def milder_torque(e: Evidence) -> Answer:
    """Output side torques change less at the larger misalignment."""
    return _milder(e, 1, "milder_torque", "α = 15° mitigates the torque changes.")


def _milder(e: Evidence, load: int, key: str, claim: str) -> Answer:
    ends = [e.rows(alpha=float(a)) for a in (e.alpha.min(), e.alpha.max())]
    largest = [np.abs(e.gamma[rows][:, OUTPUT_SIDE, load]).max(axis=1) for rows in ends]
    less = int((largest[1] < largest[0]).sum())
    text = f"largest change over all errors {largest[0].max():.1f} % at 0°, {largest[1].max():.1f} % at 15°; mean of "
    text += (
        f"the errors {largest[0].mean():.1f} % and {largest[1].mean():.1f} %; milder in {less} of {len(ends[0])} errors"
    )
    return Answer(key, claim, less == len(ends[0]), text)


def spectrum(e: Evidence) -> Answer:
    """No multiple of the input speed comes up that the ideal joint's loads do not have."""
    added = []
    for row in e.rows():
        mean = e.spectra[e.ideal(row), :1]
        grown = 100.0 * e.spectra[row, 1:] / mean
        had = 100.0 * e.spectra[e.ideal(row), 1:] / mean
        fresh = np.where((grown >= NOTICED) & (had < NOTICED), grown, 0.0)[:, OUTPUT_SIDE]
        if fresh.max() > 0.0:
            order, _, load = (int(i) for i in np.unravel_index(int(np.argmax(fresh)), fresh.shape))
            added.append((float(fresh.max()), order + 1, ("force", "torque")[load], int(row)))
    if not added:
        text = f"no order above {NOTICED:.0f} % of the mean that the ideal joint does not have"
    else:
        size, multiple, name, joint = max(added)
        text = (
            f"in {len(added)} of {len(e.rows())} joints an order comes up that the ideal joint has not; largest: order "
        )
        text += (
            f"{multiple} of a {name}, {size:.1f} % of its mean ({e.name(joint)}). All stay periodic in one revolution"
        )
    return Answer("spectrum", "The frequency content of the loads does not change.", not added, text)


def marginal(e: Evidence) -> Answer:
    """Errors of the speed ratio are marginal."""
    worst = int(np.argmax(e.psi))
    text = f"largest |Ψ| {e.psi[worst]:.1e} ({e.name(worst)}), {MARGINAL:g} counted as marginal"
    return Answer("marginal", "The error of the speed ratio stays marginal.", bool(e.psi[worst] <= MARGINAL), text)


def psi_grows(e: Evidence) -> Answer:
    """The error of the speed ratio is larger at the larger misalignment."""
    straight, bent = (e.psi[np.abs(e.alpha - a) < SAME_ALPHA] for a in (e.alpha.min(), e.alpha.max()))
    text = f"|Ψ| at most {straight.max():.1e} at 0°, at least {bent.min():.1e} at 15°"
    return Answer("psi_grows", "Ψ grows with α.", bool(bent.min() > straight.max()), text)


def settling(e: Evidence) -> Answer:
    """All joints are settled after twenty revolutions, contact damping in SI units."""
    return _settling(e.revolutions, "settling", "Steady state after twenty revolutions (c_d in SI units).")


def settling_printed(e: Evidence) -> Answer:
    """All joints are settled after twenty revolutions, contact damping as printed."""
    return _settling(e.revolutions_printed, "settling_printed", "The same with c_d as printed, 3.71·10⁸ N s/m.")


def _settling(revolutions: Array, key: str, claim: str) -> Answer:
    if not revolutions.size:
        return Answer(key, claim, False, "not run")
    done = revolutions <= REVOLUTIONS
    text = f"{int(done.sum())} of {done.size} joints within {REVOLUTIONS}; median {np.median(revolutions):.1f}, "
    finite = np.isfinite(revolutions)
    text += f"most {revolutions[finite].max():.1f} revolutions" if finite.any() else "none settled"
    text += "" if finite.all() else f", {int((~finite).sum())} not settled"
    return Answer(key, claim, bool(done.all()), text)
