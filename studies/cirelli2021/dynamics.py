"""What Cirelli et al. (2021) say of spectra, speed ratio and settling, each sentence tested on a study's joints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studies.cirelli2021.evidence import Answer, Evidence
from studies.cirelli2021.tables import OUTPUT_SIDE, SAME_ALPHA

Array = NDArray[np.float64]

MARGINAL = 1e-3
"""Error of the speed ratio that is called marginal here."""
GROWTH = 1.0
"""Growth of an amplitude that counts as another frequency content, points of the ideal joint's mean load."""
ANALYTIC = 1.0
"""Difference from the analytic couple that counts as a match, per cent of the resisting torque."""
REVOLUTIONS = 20


def growth(e: Evidence) -> Array:
    """Growth of each amplitude against the ideal joint at the same misalignment.

    Returns
    -------
    ndarray, shape (m, orders - 1, 8, 2)
        Orders 1 and up; per cent of the ideal joint's mean load.
    """
    ideal = e.spectra[[e.ideal(row) for row in range(len(e.cases))]]
    return np.asarray(100.0 * (e.spectra[:, 1:] - ideal[:, 1:]) / ideal[:, :1])


def spectrum(e: Evidence) -> Answer:
    """No multiple of the input speed grows against the ideal joint."""
    rows = e.rows()
    grown = growth(e)[rows][:, :, OUTPUT_SIDE]
    largest = grown.max(axis=(1, 2, 3))
    worst = int(np.argmax(largest))
    order, _, load = (int(i) for i in np.unravel_index(int(np.argmax(grown[worst])), grown[worst].shape))
    more = int((largest >= GROWTH).sum())
    text = f"{more} of {len(rows)} joints; largest growth {largest[worst]:.1f} points: order {order + 1} of a "
    text += f"{('force', 'torque')[load]} ({e.name(int(rows[worst]))}). All loads stay periodic in one revolution"
    criterion = f"every direction: no order of an output side load grows by {GROWTH:g} % of the ideal joint's mean"
    return Answer("spectrum", "The frequency content of the loads does not change.", criterion, more == 0, text)


def marginal(e: Evidence) -> Answer:
    """Errors of the speed ratio are marginal."""
    worst = int(np.argmax(e.psi))
    text = f"largest |Ψ| {e.psi[worst]:.1e} ({e.name(worst)})"
    criterion = f"every direction: |Ψ| at most {MARGINAL:g}"
    yes = bool(e.psi[worst] <= MARGINAL)
    return Answer("marginal", "The error of the speed ratio stays marginal.", criterion, yes, text)


def psi_grows(e: Evidence) -> Answer:
    """The error of the speed ratio is larger at the larger misalignment."""
    straight, bent = (e.psi[np.abs(e.alpha - a) < SAME_ALPHA] for a in (e.alpha.min(), e.alpha.max()))
    text = f"|Ψ| at most {straight.max():.1e} at 0°, at least {bent.min():.1e} at 15°"
    criterion = "smallest |Ψ| of all directions at 15° above the largest at 0°"
    return Answer("psi_grows", "Ψ grows with α.", criterion, bool(bent.min() > straight.max()), text)


def analytic(e: Evidence) -> Answer:
    """The joint without errors moves and is loaded as the analytic solution says."""
    rows = e.ideals()
    psi, couple = float(e.psi[rows].max()), float(e.couple[rows].max())
    text = f"largest |Ψ| {psi:.1e}; largest difference of the couple {couple:.2f} %"
    criterion = f"ideal joint at both α: |Ψ| at most {MARGINAL:g}, couple through the cross within {ANALYTIC:g} % of "
    criterion += "T_r of the rigid linkage's with inertia"
    claim = "Once settled, results match those of the analytic solution."
    return Answer("analytic", claim, criterion, psi <= MARGINAL and couple <= ANALYTIC, text)


def settling(e: Evidence) -> Answer:
    """All joints are settled after twenty revolutions, contact damping in SI units."""
    return _settling(e.revolutions, "settling", "Steady state after twenty revolutions (c_d in SI units).")


def settling_printed(e: Evidence) -> Answer:
    """All joints are settled after twenty revolutions, contact damping as printed."""
    return _settling(e.revolutions_printed, "settling_printed", "The same with c_d as printed, 3.71·10⁸ N s/m.")


def _settling(revolutions: Array, key: str, claim: str) -> Answer:
    criterion = f"every joint settled within {REVOLUTIONS} revolutions"
    if not revolutions.size:
        return Answer(key, claim, criterion, False, "not run")
    done = revolutions <= REVOLUTIONS
    text = f"{int(done.sum())} of {done.size} joints within {REVOLUTIONS}; median {np.median(revolutions):.1f}, "
    finite = np.isfinite(revolutions)
    text += f"most {revolutions[finite].max():.1f} revolutions" if finite.any() else "none settled"
    text += "" if finite.all() else f", {int((~finite).sum())} not settled"
    return Answer(key, claim, criterion, bool(done.all()), text)
