"""How large is the numerical error of a campaign? Compare its joints with the same joints under other settings.

Errors are relative to the largest load of the kind in the joint, or of the kind that measures it (`Kind.measure`): a
force to the largest ``|F|`` of its bushings, a torque to the largest ``|T|``, a contact force to the largest one of all
pins, Psi to itself; at least to `LEAST_SIZE` of the largest one of all joints and operating points that are compared: a
joint without misalignment has no loss that an error could be relative to. Loads that a campaign does not store are NaN
in all of its joints and are left out of these maxima; without any load of its measure, a load is relative to the
largest of its own kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.binomial import half_width
from tolstat.common.load_kinds import Kind, kinds, measure_of
from tolstat.common.loads import FloatArray, Results, load_of, of_kind
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import SIMULATED, Status

REFERENCE, FIDELITY = "reference", "fidelity"
HALF_STEP_SHARE = 4 / 3
"""Richardson extrapolation: half the step changes the result of a method of order 2 by 3/4 of its error."""
USUAL = 0.95
"""Quantile over the joints at which a report gives the error."""
LEAST_SIZE = 0.01
"""Share of the largest load of a kind among joints that errors are relative to at least."""
LEAST_NEAR = 50
"""Minimum number of verified joints near a limit for which the numerical error there is known."""


class Spread(NamedTuple):
    """Distribution of an error over joints.

    Attributes
    ----------
    n : int
        Joints with a finite error.
    median, usual, worst : float
        Median, 95 % quantile and maximum of the error's modulus; `usual` is the maximum for fewer than twenty joints.
        NaN if no joint has an error.
    """

    n: int
    median: float
    usual: float
    worst: float


@cache
def observables(mechanism: Mechanism) -> tuple[str, ...]:
    """Largest loads of a joint whose error is evaluated: all that can have a limit, kind by kind."""
    return tuple(name for kind in kinds(mechanism).values() for _, name in kind.loads())


@cache
def _number_of_kind(mechanism: Mechanism) -> NDArray[np.intp]:
    """Number of the kind of each of the `observables`, in the order of the registry."""
    keys = list(kinds(mechanism))
    return np.array([keys.index(load_of(name, mechanism).kind.key) for name in observables(mechanism)])


def loads(results: NDArray[np.void], mechanism: Mechanism) -> FloatArray:
    """Collect the largest loads of joints, (m,) table RESULT, as (m, loads): SI, in the order of `observables`."""
    return np.concatenate([of_kind(results, kind) for kind in kinds(mechanism).values()], axis=1)


def size(results: Results, kind: Kind) -> FloatArray:
    """Reference value of the observables of a kind in each joint, (m,), SI."""
    largest = _largest(of_kind(results, measure_of(kind)))
    return largest if kind == measure_of(kind) or not np.isnan(largest).all() else _largest(of_kind(results, kind))


def _largest(values: FloatArray) -> FloatArray:
    """Largest of several values of each joint, (m, loads) -> (m,); NaN propagates unless in all joints."""
    known = ~np.isnan(values).all(axis=0)
    return values[:, known].max(axis=1) if known.any() else np.full(len(values), np.nan)


def differences(base: NDArray[np.void], other: NDArray[np.void], mechanism: Mechanism) -> FloatArray:
    """Difference of `base` and `other`, relative to the largest load of the measure in `other`, see `LEAST_SIZE`.

    Parameters
    ----------
    base, other : ndarray of RESULT, shape (m,)
        The same joints, simulated in two ways.
    mechanism : Mechanism
        What was simulated.

    Returns
    -------
    ndarray, shape (m, loads)
        `base` less `other`, in the order of `observables`; NaN where a joint is not settled in `base` or has no
        results in `other`.
    """
    of_base, sizes = (np.column_stack([size(t, kind) for kind in kinds(mechanism).values()]) for t in (base, other))
    largest = np.fmax.reduce(of_base[base["status"] == Status.OK], axis=0, initial=0.0)
    sizes = np.maximum(sizes, LEAST_SIZE * largest)[:, _number_of_kind(mechanism)]
    changed = loads(base, mechanism) - loads(other, mechanism)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(sizes == 0, 0.0, changed / sizes)
    relative[(base["status"] != Status.OK) | ~np.isin(other["status"], SIMULATED)] = np.nan
    return np.asarray(relative)


def estimate(changes: Mapping[str, FloatArray]) -> FloatArray:
    """Estimate the numerical error from the changes under other settings.

    Parameters
    ----------
    changes : mapping of str to ndarray, shape (m, loads)
        `differences` from each check: ``finer``, or ``half_step``, ``newton`` and ``settling``; if made, ``method``
        and ``fidelity``.

    Returns
    -------
    ndarray, shape (m, loads)
        Error of steps and tolerances (the larger of the change with finer ones, extrapolated, and the change under
        another method) plus the error of a fidelity below dynamic; relative, not negative.
    """
    steps = HALF_STEP_SHARE * np.abs(_of_steps(changes))
    if "method" in changes:
        steps = np.fmax(steps, np.abs(changes["method"]))
    others = (np.abs(changes[name]) for name in ("newton", "settling", FIDELITY) if name in changes)
    return np.asarray(sum(others, steps))


def numerical(base: NDArray[np.void], checks: Mapping[str, NDArray[np.void]], mechanism: Mechanism) -> FloatArray:
    """Numerical error of joints, fidelity included: measured where the reference settled, estimated otherwise.

    Returns
    -------
    ndarray, shape (m, loads)
        Relative, not negative; NaN where neither is available.
    """
    changes = {name: differences(base, results, mechanism) for name, results in checks.items()}
    return np.abs(_measured_or(estimate(changes), changes, checks))


def corrections(base: NDArray[np.void], checks: Mapping[str, NDArray[np.void]], mechanism: Mechanism) -> FloatArray:
    """What the largest loads lack, with its sign: to be added to them, relative to the largest load of the kind.

    Parameters
    ----------
    base : ndarray of RESULT, shape (m,)
        Joints as the campaign simulated them.
    checks : mapping of str to ndarray of RESULT, shape (m,)
        The same joints in each check.
    mechanism : Mechanism
        What was simulated.

    Returns
    -------
    ndarray, shape (m, loads)
        Difference to the reference where that settled; otherwise the sum of the changes under half the step
        (extrapolated), the smaller tolerances, and dynamic fidelity. NaN where neither is known.
    """
    changes = {name: -differences(base, results, mechanism) for name, results in checks.items()}
    changed = HALF_STEP_SHARE * _of_steps(changes)
    for name in ("newton", "settling", FIDELITY):
        changed = changed + changes.get(name, 0.0)
    return _measured_or(changed, changes, checks)


def _of_steps(changes: Mapping[str, FloatArray]) -> FloatArray:
    return changes["finer" if "finer" in changes else "half_step"]


def _measured_or(
    estimated: FloatArray, changes: Mapping[str, FloatArray], checks: Mapping[str, NDArray[np.void]]
) -> FloatArray:
    """Difference to the reference where that settled, otherwise what is estimated, (m, loads)."""
    if REFERENCE not in changes:
        return estimated
    settled = (checks[REFERENCE]["status"] == Status.OK)[:, None] & np.isfinite(changes[REFERENCE])
    return np.where(settled, changes[REFERENCE], estimated)


def corrected(
    values: FloatArray, sizes: FloatArray, lacking: FloatArray, confidence: float = 0.95
) -> tuple[FloatArray, FloatArray]:
    """Loads of all joints with the numerical error of joints near a limit put right, as far as these tell it.

    Each joint gets the correction of one of the joints near the limit, so that shares above the limit are those of
    corrected loads; both results differ by the interval of the mean correction (Student's t).

    Parameters
    ----------
    values, sizes : ndarray, shape (n,)
        Load of each joint, and the largest load of its kind in the joint.
    lacking : ndarray, shape (m,)
        `corrections` of m >= 2 joints near the limit.
    confidence : float
        Confidence level of the interval of the mean.

    Returns
    -------
    low, high : ndarray, shape (n,)

    Examples
    --------
    Loads 1 to 2 % too small at joints near the limit:

    >>> low, high = corrected(np.full(4, 100.0), np.full(4, 100.0), np.linspace(0.01, 0.02, 50))
    >>> bool((low > 100.9).all() and (high < 102.1).all() and (low < high).all())
    True
    """
    margin = float(half_width(confidence, lacking.size - 1)) * float(lacking.std(ddof=1)) / np.sqrt(lacking.size)
    drawn = lacking[np.random.default_rng(2024).integers(lacking.size, size=values.size)]
    return values + sizes * (drawn - margin), values + sizes * (drawn + margin)


def usual(base: NDArray[np.void], checks: Mapping[str, NDArray[np.void]], mechanism: Mechanism) -> dict[str, float]:
    """Numerical error that the share `USUAL` of the joints stays below, by kind of load; NaN if unknown."""
    values = by_kind(numerical(base, checks, mechanism), mechanism)
    return {kind: spread(values[:, k]).usual for k, kind in enumerate(kinds(mechanism))}


def by_kind(errors: FloatArray, mechanism: Mechanism) -> FloatArray:
    """Largest error of each kind in each joint, (m, loads) -> (m, kinds); NaN as in `_largest`."""
    kind_of = _number_of_kind(mechanism)
    return np.column_stack([_largest(np.abs(errors[:, kind == kind_of])) for kind in range(len(kinds(mechanism)))])


def share_below_largest(joints: int, confidence: float = 0.95) -> float:
    """Share of all joints that is below the largest of `joints` chosen at random, at least, with this confidence.

    It is the `confidence` bound of order statistics: all of the joints chosen are among the share q of the joints with
    the smallest values with probability q ** joints.

    Examples
    --------
    >>> [round(share_below_largest(n), 3) for n in (20, 59, 299)]
    [0.861, 0.95, 0.99]
    """
    return float((1.0 - confidence) ** (1.0 / joints))


def spread(errors: FloatArray) -> Spread:
    """Distribution of the error's modulus over joints, (m,); errors that are not finite are left out."""
    known = np.abs(errors[np.isfinite(errors)])
    if not known.size:
        return Spread(0, np.nan, np.nan, np.nan)
    usual = float(np.quantile(known, USUAL, method="higher"))
    return Spread(known.size, float(np.median(known)), usual, float(known.max()))
