"""How large is the numerical error of a campaign? Its joints beside the same joints simulated in other ways.

Errors are relative to the largest load of the kind in the joint: a force to the largest |F| of its eight bushings, a
torque to the largest |T|, a contact force to that of the four pins, Psi to itself. Loads that a campaign does not keep
are NaN in all of its joints and left out of these.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.tables import BUSHINGS, PINS, SIMULATED, Status

FloatArray = NDArray[np.float64]

KINDS = ("F", "T", "contact", "psi")
OBSERVABLES = (
    *(f"{bushing}.{letter}" for letter in "FT" for bushing in BUSHINGS),
    *(f"{pin}.contact" for pin in PINS),
    "psi",
)
"""Largest loads of a joint that are judged, by the names that limits have."""
KIND_OF = np.array([0] * 8 + [1] * 8 + [2] * 4 + [3])
UNITS = ("N", "N*m", "N", "1")

REFERENCE, FIDELITY = "reference", "fidelity"
HALF_STEP_SHARE = 4 / 3
"""A method of order 2 that takes half the step keeps a quarter of its error: the other three are what changes."""
USUAL = 0.95
"""Share of the joints that the error put into a report covers."""


class Spread(NamedTuple):
    """Distribution of an error over joints.

    Attributes
    ----------
    n : int
        Joints that have one.
    median, usual, worst : float
        Of the error's modulus; `usual` covers 95 % of the joints (the worst one of fewer than twenty). NaN without any.
    """

    n: int
    median: float
    usual: float
    worst: float


def loads(results: NDArray[np.void]) -> FloatArray:
    """Largest loads of joints, (m,) table RESULT, as (m, 21): SI, in the order of `OBSERVABLES`."""
    contact = results["contact_max"].max(axis=2)
    return np.concatenate([results["F_max"], results["T_max"], contact, results["psi_max"][:, None]], axis=1)


def sizes(results: NDArray[np.void]) -> FloatArray:
    """Largest load of the kind of each observable in each joint, (m, 21), SI."""
    return np.asarray(_largest(loads(results))[:, KIND_OF])


def size(results: NDArray[np.void], observable: str) -> FloatArray:
    """Largest load of the kind of one observable in each joint, (m,), SI: a column of `sizes`."""
    kind = KINDS[KIND_OF[OBSERVABLES.index(observable)]]
    fields = {"F": "F_max", "T": "T_max", "contact": "contact_max", "psi": "psi_max"}
    values = results[fields[kind]].reshape(len(results), -1)
    held = ~np.isnan(values).all(axis=0)
    return values[:, held].max(axis=1) if held.any() else np.full(len(results), np.nan)


def _largest(values: FloatArray) -> FloatArray:
    """Largest of each kind, (m, 21) -> (m, 4); NaN is kept, but for an observable that no joint has."""
    known = ~np.isnan(values).all(axis=0)
    largest = np.full((len(values), len(KINDS)), np.nan)
    for kind in range(len(KINDS)):
        of_kind = values[:, known & (kind == KIND_OF)]
        if of_kind.shape[1]:
            largest[:, kind] = of_kind.max(axis=1)
    return largest


def differences(base: NDArray[np.void], other: NDArray[np.void]) -> FloatArray:
    """How far `other` is from `base`, relative to the largest load of the kind.

    Parameters
    ----------
    base, other : ndarray of RESULT, shape (m,)
        The same joints, simulated in two ways.

    Returns
    -------
    ndarray, shape (m, 21)
        Of `base` less `other`, in the order of `OBSERVABLES`; NaN where a joint is not settled in `base` or has no
        results in `other`.
    """
    size = sizes(other)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(size == 0, 0.0, (loads(base) - loads(other)) / size)
    found[(base["status"] != Status.OK) | ~np.isin(other["status"], SIMULATED)] = np.nan
    return np.asarray(found)


def estimate(changes: Mapping[str, FloatArray]) -> FloatArray:
    """Estimate the numerical error from what other settings change.

    Parameters
    ----------
    changes : mapping of str to ndarray, shape (m, 21)
        `differences` to the checks ``half_step``, ``newton``, ``settling`` and, where made, ``method``, ``fidelity``.

    Returns
    -------
    ndarray, shape (m, 21)
        Error of the steps (the larger of what half the step, extrapolated, and another method change), plus that of
        Newton's stopping, of settling, and of a joint simulated below dynamic fidelity; relative, not negative.
    """
    steps = HALF_STEP_SHARE * np.abs(changes["half_step"])
    if "method" in changes:
        steps = np.fmax(steps, np.abs(changes["method"]))
    others = (np.abs(changes[name]) for name in ("newton", "settling", FIDELITY) if name in changes)
    return np.asarray(sum(others, steps))


def numerical(base: NDArray[np.void], checks: Mapping[str, NDArray[np.void]]) -> FloatArray:
    """Numerical error of joints, with that of fidelity: measured where the reference settled, estimated otherwise.

    Returns
    -------
    ndarray, shape (m, 21)
        Relative, not negative; NaN where there is neither.
    """
    changes = {name: differences(base, results) for name, results in checks.items()}
    found = estimate(changes)
    if REFERENCE in changes:
        measured = np.abs(changes[REFERENCE])
        settled = (checks[REFERENCE]["status"] == Status.OK)[:, None] & np.isfinite(measured)
        found = np.where(settled, measured, found)
    return found


def by_kind(errors: FloatArray) -> FloatArray:
    """Largest error of each kind in each joint, (m, 21) -> (m, 4); NaN is kept, but for an observable without any."""
    return _largest(np.abs(errors))


def spread(errors: FloatArray) -> Spread:
    """Distribution of the moduli of errors of joints, (m,), those that are NaN left out."""
    known = np.abs(errors[np.isfinite(errors)])
    if not known.size:
        return Spread(0, np.nan, np.nan, np.nan)
    usual = float(np.quantile(known, USUAL, method="higher"))
    return Spread(known.size, float(np.median(known)), usual, float(known.max()))
