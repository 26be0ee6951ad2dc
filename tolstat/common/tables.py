"""The tables that every stage reads and writes: row i is joint i in each of them.

A table is described by a tuple of `fields.Field`; from it come the NumPy dtype that the kernel works on, and the
columns of the result file and of every CSV (`columns`). SI units throughout.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import IntEnum
from functools import cache
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.error_fields import error_fields
from tolstat.common.fields import Field, dtype_of
from tolstat.common.load_kinds import JOINT, OVER, Kind, kinds
from tolstat.common.mechanism import Mechanism
from tolstat.common.parameters import numbers, param_fields

SCHEMA_VERSION = 15
"""Version of the result file: raise it with every change of its layout, and so of the fields of errors and results."""
STEPS_PER_ITERATION = 5
"""Number of explicit steps that take the time of a Newton iteration."""
LIFE_EXPONENT = 10 / 3
"""Power of the load in the rating life of roller bearings (ISO 281)."""
MAX_ITERATIONS = 40
"""Upper bound on a joint's Newton iterations per step of the longest run allowed, so that no joint blocks a campaign.
Joints that never settle take some 8 to 10."""
MAX_TILT, MAX_SHIFT = 0.1, 0.1
"""Range of the model: largest tilt of an axis, rad, and largest offset and clearance as shares of R. Drawings allow a
tenth of it at most; numbers beyond it are mostly in another unit."""
MOST_ITERATIONS = 3_000_000
"""Newton iterations that the refinement of a joint may take: half a minute of a core."""


def iterations_allowed(steps_per_rev: int, max_revs: int) -> int:
    """Newton iterations of a joint, over all its simulations, at which it is given up.

    They suffice for the longest run with uniform steps twice, in lanes and alone, and for a refinement. An explicit
    step counts as ``1 / STEPS_PER_ITERATION``.
    """
    return min(MOST_ITERATIONS + 2 * MAX_ITERATIONS * steps_per_rev * max_revs, 2**31 - 1)


class Status(IntEnum):
    """Outcome of a joint's simulation. ``PENDING`` is the fill value of a new file and marks the rows still to run."""

    PENDING = 0
    OK = 1
    NOT_SETTLED = 2
    NEWTON_FAILED = 3
    NOT_FINITE = 4
    OUTSIDE_MODEL = 5
    CRASHED = 8  # 6 and 7 were states of joints in files of earlier versions
    INVALID_INPUT = 9
    NOT_RESOLVED = 10
    STATIONARY = 11

    @property
    def label(self) -> str:
        """Name as it is written to the user: ``"not_settled"``."""
        return self.name.lower()


UNSETTLED = (Status.NOT_SETTLED, Status.NOT_RESOLVED)
"""States of a joint whose results would change with other revolutions or with finer steps."""

VALID = (Status.OK, Status.STATIONARY)
"""States of a joint whose largest loads count in statistics; those of a stationary joint have an interval."""

SIMULATED = (*VALID, *UNSETTLED)
"""States of a joint that has results."""

FAILED = tuple(s for s in Status if s not in SIMULATED and s != Status.PENDING)
"""States of a joint that has no results."""

_SEVERITY = np.zeros(max(Status) + 1, np.uint8)
for _rank, _states in enumerate(((Status.STATIONARY,), UNSETTLED, FAILED, (Status.PENDING,)), 1):
    _SEVERITY[[int(state) for state in _states]] = _rank


def deciding(status: Sequence[NDArray[np.uint8]]) -> NDArray[np.intp]:
    """Index of the operating point that decides the status of each joint, (n,).

    A joint is pending if it is so anywhere, else failed, unsettled or stationary; ``OK`` only if it is at all points.

    Parameters
    ----------
    status : sequence of (n,) arrays
        Status of the joints at each operating point.
    """
    return np.asarray(np.argmax(_SEVERITY[np.stack(status)], axis=0))


def worst_status(status: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Status of joints over operating points, (n,); see `deciding`."""
    first = status[0]
    return first if all(codes is first for codes in status) else np.choose(deciding(status), status)


STATUS_TEXT = {
    Status.PENDING: "not simulated yet",
    Status.OK: "settled; results valid",
    Status.NOT_SETTLED: "closure error still above solver.settle_tol after all revolutions, and largest loads that "
    "still change; results are those of the last revolutions",
    Status.NOT_RESOLVED: "largest loads not confirmed by finer steps (refinement_change, NaN if these failed); results "
    "are those of the finest steps taken",
    Status.STATIONARY: "never the same in each revolution, but its largest loads are as large in the first half of the "
    "revolutions watched as in the second: results are the largest of solver.duration revolutions, estimated, with an "
    "interval (lower, upper); of a sub-harmonic joint those of its whole period",
    Status.CRASHED: "its process died with it twice; results are NaN",
    Status.INVALID_INPUT: "a parameter is not a finite number, or shaft.spline not from -1 to 1; results are NaN",
    Status.NEWTON_FAILED: "a step failed at the smallest sub-step, or too many iterations were spent; results are NaN",
    Status.NOT_FINITE: "the solution overflowed; results are NaN",
    Status.OUTSIDE_MODEL: "negative clearance (interference fit), an axis tilted by more than 0.1 rad (5.7 deg), an "
    "offset or a clearance above a tenth of R, |alpha| of 90 deg or more, no speed, stiffness not positive, or "
    "negative friction: the model has no meaning there; errors are in m and rad; results are NaN",
}


class Method(IntEnum):
    """Time integration method."""

    BDF2 = 0
    TR_BDF2 = 1


class Start(IntEnum):
    """How a joint is started: torque ramp from the ideal pose, or from static equilibrium at theta = 0."""

    RAMP = 0
    STATIC = 1


class Fidelity(IntEnum):
    """Mechanical model that is solved: integration, equilibrium at each angle, or closed forms; ``auto`` chooses."""

    DYNAMIC = 0
    QUASISTATIC = 1
    IDEAL = 2


FINEST_STEPS = 360
"""Largest number of steps per revolution that ``solver.fidelity = "auto"`` chooses."""


class Mode(IntEnum):
    """Contact mode of a pin (Cirelli et al. 2021, Figure 3)."""

    NONE = 0
    ONE_POINT = 1
    TWO_POINT = 2
    UNIFORM = 3


class Options(NamedTuple):
    """Numerical settings of the solver; see `study.Solver`."""

    method: int = int(Method.BDF2)
    start: int = int(Start.STATIC)
    steps_per_rev: int = 180
    max_revs: int = 20
    settle_tol: float = 1e-4
    newton_tol: float = 6e-6
    newton_max_iter: int = 12
    max_halvings: int = 16
    rtol: float = 0.0
    fidelity: int = int(Fidelity.DYNAMIC)
    peak_substeps: int = 40
    max_refinements: int = 3
    duration: int = 100


def follows_error(options: Options) -> bool:
    """Whether steps are error-controlled: dynamic TR-BDF2 with a tolerance."""
    return options.method == Method.TR_BDF2 and options.rtol > 0 and options.fidelity == Fidelity.DYNAMIC


class Variant(NamedTuple):
    """One of the joints that the cases are run with.

    Attributes
    ----------
    family : str
        Name under which the study lists it; other variants may share it.
    values : dict
        Values that define it, by dotted key of a joint file: keys that the study writes for it, and all others in
        which it differs from the study's joint. Keys that the study writes for it in the sections operation and solver
        start with ``operation.`` and ``solver.``. SI floats, strings for choices.
    note : str
        Note of the study on it.
    """

    family: str
    values: dict[str, Any]
    note: str = ""


class Simulation(NamedTuple):
    """Output of simulating n joints: RESULT rows, and the requested histories by name, each with leading axis n."""

    results: np.ndarray[tuple[int], np.dtype[np.void]]
    histories: dict[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]


FACTORS = ("material.E_factor", "operation.speed_swing", "operation.torque_swing")
"""Errors that are factors, 1 for the nominal joint."""


def _result_fields(mechanism: Mechanism) -> tuple[Field, ...]:
    pins, of_loads = tuple(pair.pin for pair in mechanism.pairs), kinds(mechanism).values()
    return (
        Field("status", "1", "see Status", "u1"),
        Field("settled", "1", "1 when the closure error is below solver.settle_tol", "u1"),
        Field("closure", "1", "closure error of the last revolution"),
        Field(
            "closure_trend",
            "1",
            "change of log10(closure) a revolution, fitted to the last revolutions; "
            "after refinement 0 if it shows no fall",
        ),
        Field("period", "1", "revolutions after which the motion repeats; 0 where it does not or is not known", "u1"),
        Field("failed_step", "1", "step of the output grid at which the joint failed, from 1; -1 if it did not", "i4"),
        Field("failed_theta", "rad", "input angle at the start of that step, less whole revolutions"),
        Field("revolutions", "1", "revolutions integrated, the recorded one included"),
        Field("steps_per_rev", "1", "steps of the last revolution: others than solver.steps_per_rev if refined", "i4"),
        Field(
            "step_error",
            "1",
            "mean estimated error of the uniform steps, as a load relative to the largest of its kind",
        ),
        Field(
            "refinement_change",
            "1",
            "largest change of a largest load by the last halving of steps, relative to its kind's",
        ),
        Field("steps", "1", "steps taken, sub-steps included; quasistatic: angles solved", "i4"),
        Field("newton_iterations", "1", "Newton iterations", "i4"),
        Field(
            "halvings", "1", "times that a step was halved; quasistatic: angles that Newton's iteration missed", "i4"
        ),
        Field("factorisations", "1", "times that the tangent was factorised", "i4"),
        *(field for kind in of_loads if kind.places != JOINT for field in kind.statistics().values()),
        Field(
            "mode_share",
            "1",
            "share of the revolutions that count in each contact mode",
            shape=(len(pins), len(Mode)),
            columns=tuple(f"{pin}.share_{mode.name.lower()}" for pin in pins for mode in Mode),
        ),
        Field(
            "equivalent_load",
            "N",
            "dynamic equivalent load of the pin's bearing: by laminae if its dimensions are given, else the resultant "
            f"contact force; mean with exponent 10/3, weighted by the travel of the pin in its hole, {OVER}",
            shape=(len(pins),),
            columns=tuple(f"{pin}.equivalent_load" for pin in pins),
        ),
        *(
            Field(name, unit, f"{meaning} {OVER}", shape=(len(pins),), columns=tuple(f"{pin}.{name}" for pin in pins))
            for name, unit, meaning in (
                ("tilt", "rad", "largest tilt of the loaded pin in its hole"),
                (
                    "line_load",
                    "N/m",
                    "largest load of a needle's lamina by its length (NaN without dimensions, or of an ideal joint)",
                ),
            )
        ),
        *(field for kind in of_loads if kind.places == JOINT for field in kind.statistics().values()),
        *(field for kind in of_loads for field in kind.ends()),
        Field(
            "clearance",
            "m",
            "radial clearance of the pin in its hole",
            shape=(len(pins),),
            columns=tuple(f"{pin}.radial_clearance" for pin in pins),
        ),
    )


DESIGN_FIELDS = (
    Field("variant", "1", "index of the joint's variant in `design` of the metadata", "i4"),
    Field("case", "1", "index of the joint's errors among the cases of the metadata; 0 has none", "i4"),
    Field("group", "1", "joints of one group differ in their case only; the one without errors comes first", "i4"),
)
"""Variant, case and group of each joint of a study that lists its joints (``sampling.method = "cases"``)."""

LEDGER_FIELDS = (
    Field("attempt", "1", "what gave the results: 0 the study's settings, k those of entry k - 1 of `retries`", "i4"),
)
"""Origin of each joint's results."""

DESIGN = dtype_of(DESIGN_FIELDS)


class Tables(NamedTuple):
    """Tables of a mechanism: fields of errors and results, and the types of rows.

    `KERNEL_RESULT` has the same bytes as `RESULT`: ``largest``, ``average`` and ``range`` hold the statistics of all
    loads, kind after kind as in `load_kinds.spans`, in place of ``F_max``, ``F_mean``, ``F_range`` and so on.
    """

    error_fields: tuple[Field, ...]
    result_fields: tuple[Field, ...]
    ERROR: np.dtype[np.void]
    PARAM: np.dtype[np.void]
    RESULT: np.dtype[np.void]
    KERNEL_RESULT: np.dtype[np.void]


@cache
def tables(mechanism: Mechanism) -> Tables:
    """Tables of a mechanism."""
    errors, results = error_fields(mechanism), _result_fields(mechanism)
    return Tables(
        errors, results, dtype_of(errors), dtype_of(param_fields(mechanism)), *_layouts(results, kinds(mechanism))
    )


def blank_params(n: int, mechanism: Mechanism) -> NDArray[np.void]:
    """Return `n` rows of PARAM that hold the numbers of the mechanism, and zeros."""
    params = np.zeros(n, tables(mechanism).PARAM)
    for name, values in numbers(mechanism).items():
        params[name] = values
    return params


def _layouts(fields: tuple[Field, ...], of: Mapping[str, Kind]) -> tuple[np.dtype[np.void], np.dtype[np.void]]:
    """RESULT, and the same bytes with one array for each statistic of all loads."""
    arrays = {"max": "largest", "mean": "average", "range": "range"}
    of_loads = {
        array: [kind.statistics()[name] for kind in of.values() if name in kind.statistics()]
        for name, array in arrays.items()
    }
    others = [field for field in fields if not any(field in alike for alike in of_loads.values())]
    sizes = {array: sum(math.prod(field.shape) for field in alike) for array, alike in of_loads.items()}
    joined = [Field(array, "", "", shape=(size,)) for array, size in sizes.items()]
    return dtype_of([*others, *chain.from_iterable(of_loads.values())]), dtype_of([*others, *joined])


def for_kernels(table: NDArray[np.void], mechanism: Mechanism) -> np.recarray[Any, np.dtype[np.void]]:
    """View of a table RESULT, of any shape, as KERNEL_RESULT."""
    return table.view(np.ndarray).view(tables(mechanism).KERNEL_RESULT).view(np.recarray)


def without_results(n: int, status: Status, mechanism: Mechanism) -> NDArray[np.void]:
    """Return the rows of `n` joints without results, (n,), dtype RESULT: NaN, and `status`."""
    results = np.zeros(n, tables(mechanism).RESULT)
    for field in tables(mechanism).result_fields:
        if np.dtype(field.dtype).kind == "f":
            results[field.name] = np.nan
    results["status"], results["failed_step"] = status, -1
    return results


CODES: dict[str, type[IntEnum]] = {"method": Method, "start": Start, "fidelity": Fidelity}
"""Options that are names in a study and in a result file."""


def to_names(options: Options) -> dict[str, Any]:
    """Return the options by name, with ``method``, ``start`` and ``fidelity`` as a study writes them."""
    values = options._asdict()
    return values | {name: code(values[name]).name.lower() for name, code in CODES.items()}


def from_names(values: Mapping[str, Any]) -> Options:
    """Return the options that `to_names` has written."""
    return Options(**{k: int(CODES[k][v.upper()]) if k in CODES else v for k, v in values.items()})
