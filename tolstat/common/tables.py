"""The tables that every stage reads and writes: row i is joint i in each of them.

A table is described by a tuple of `Field`; from it come the NumPy dtype that the kernel works on, and the columns of
the result file and of every CSV (`columns`). SI units throughout.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

BUSHINGS = tuple(f"cross{i}" for i in (1, 2, 3, 4)) + tuple(f"fork{i}" for i in (1, 2, 3, 4))
PINS = tuple(f"pin{i}" for i in (1, 2, 3, 4))
HOLES = tuple(f"hole{i}" for i in (1, 2, 3, 4))
CHANNELS = {
    f"{bushing}.{load}": "N" if load[0] == "F" else "N*m"
    for bushing in BUSHINGS
    for load in ("F_e", "F_t", "F_z", "T_e", "T_t", "T_z", "F", "T")
}
"""Unit of every load whose cycles are counted: components of a bushing's force and torque, and their moduli."""
CONTACTS = ("outer", "inner", "resultant")
"""Contact forces of a pin: normal force of its outermost and of its innermost station, and the resultant of all."""
OUTER, INNER, RESULTANT = range(3)
MAX_STATIONS = 16
"""Maximum number of contact stations of a pin."""
STEPS_PER_ITERATION = 5
"""Number of explicit steps that take the time of a Newton iteration."""
MAX_ITERATIONS = 40
"""Upper bound on a joint's Newton iterations per step of the longest run allowed, so that no joint blocks a campaign.
Joints that never settle take some 8 to 10."""


class Status(IntEnum):
    """Outcome of a joint's simulation. ``PENDING`` is the fill value of a new file and marks the rows still to run."""

    PENDING = 0
    OK = 1
    NOT_SETTLED = 2
    NEWTON_FAILED = 3
    NOT_FINITE = 4
    OUTSIDE_MODEL = 5
    NOT_PERIODIC = 6
    TIMEOUT = 7
    CRASHED = 8
    INVALID_INPUT = 9
    NOT_RESOLVED = 10
    STATIONARY = 11

    @property
    def label(self) -> str:
        """Name as it is written to the user: ``"not_settled"``."""
        return self.name.lower()


UNSETTLED = (Status.NOT_SETTLED, Status.NOT_PERIODIC, Status.NOT_RESOLVED)
"""States of a joint whose results would change with other revolutions or with finer steps."""

VALID = (Status.OK, Status.STATIONARY)
"""States of a joint whose largest loads count in statistics; those of a stationary joint have an interval."""

SIMULATED = (*VALID, *UNSETTLED)
"""States of a joint that has results."""

FAILED = tuple(s for s in Status if s not in SIMULATED and s != Status.PENDING)
"""States of a joint that has no results."""

STATUS_TEXT = {
    Status.PENDING: "not simulated yet",
    Status.OK: "settled; results valid",
    Status.NOT_SETTLED: "closure error still above solver.settle_tol after all revolutions, and largest loads that "
    "still change; results are those of the last revolutions",
    Status.NOT_PERIODIC: "not the same in each revolution: quasi-periodic or chaotic, see motion, and not stationary; "
    "results are those of the last revolutions",
    Status.NOT_RESOLVED: "largest loads not confirmed by finer steps (refinement_change, NaN if these failed); results "
    "are those of the finest steps taken",
    Status.STATIONARY: "never the same in each revolution, but its largest loads are as large in the first half of the "
    "revolutions watched as in the second: results are the largest of solver.duration revolutions, estimated, with an "
    "interval (lower, upper); of a sub-harmonic joint those of its whole period",
    Status.TIMEOUT: "took longer than the time allowed to a joint; results are NaN",
    Status.CRASHED: "its process died with it twice; results are NaN",
    Status.INVALID_INPUT: "parameters are not finite numbers; results are NaN",
    Status.NEWTON_FAILED: "a step failed at the smallest sub-step, or the joint took too many; results are NaN",
    Status.NOT_FINITE: "the solution overflowed; results are NaN",
    Status.OUTSIDE_MODEL: "negative clearance (interference fit), |alpha| of 90 deg or more, no speed, or stiffness "
    "not positive: the model has no meaning there; results are NaN",
}


class Method(IntEnum):
    """Time integration method."""

    BDF2 = 0
    GENERALIZED_ALPHA = 1
    TR_BDF2 = 2


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


class Motion(IntEnum):
    """Class of a joint's motion; its period is counted in revolutions of the input shaft."""

    UNKNOWN = 0
    PERIODIC = 1
    SLOW = 2
    SUBHARMONIC = 3
    QUASI_PERIODIC = 4
    CHAOTIC = 5

    @property
    def label(self) -> str:
        """Name as it is written to the user: ``"quasi_periodic"``."""
        return self.name.lower()


MOTION_TEXT = {
    Motion.UNKNOWN: "not known: no results, or fewer revolutions than it takes to tell",
    Motion.PERIODIC: "the same in each revolution",
    Motion.SLOW: "still settling: its closure error falls, or neighbouring motions converge",
    Motion.SUBHARMONIC: "the same after 2 to 8 revolutions, see period",
    Motion.QUASI_PERIODIC: "repeats in no number of revolutions, and neighbouring motions stay neighbours",
    Motion.CHAOTIC: "repeats in no number of revolutions, and neighbouring motions part exponentially",
}


class Field(NamedTuple):
    """One column, or a small array of columns, of a table.

    Attributes
    ----------
    name : str
        Identifier, the same from TOML key to file and CSV header.
    unit : str
        SI unit, ``"1"`` for a pure number.
    description : str
        One sentence for the reader of the file.
    dtype : str
        NumPy scalar type.
    shape : tuple of int
        ``()`` for a scalar column.
    """

    name: str
    unit: str
    description: str
    dtype: str = "f8"
    shape: tuple[int, ...] = ()


class Options(NamedTuple):
    """Numerical settings of the solver; see `study.Solver`."""

    method: int = int(Method.BDF2)
    start: int = int(Start.STATIC)
    steps_per_rev: int = 180
    max_revs: int = 20
    settle_tol: float = 1e-4
    newton_tol: float = 1e-6
    newton_max_iter: int = 12
    max_halvings: int = 16
    rho_inf: float = 0.8
    rtol: float = 0.0
    atol: float = 0.0
    fidelity: int = int(Fidelity.DYNAMIC)
    peak_substeps: int = 16
    max_refinements: int = 3
    duration: int = 100


class HistorySpec(NamedTuple):
    """What a load history holds for each joint: an array of `shape`, without the leading axis of joints.

    `axes` are the names of its axes.
    """

    shape: tuple[int, ...]
    dtype: str
    unit: str
    description: str
    axes: tuple[str, ...] = ()

    def blank(self, n: int) -> NDArray[Any]:
        """Return a placeholder for `n` joints without history, (n, ...): NaN (0 for integers) throughout."""
        dtype = np.dtype(self.dtype)
        return np.full((n, *self.shape), np.nan if dtype.kind == "f" else 0, dtype)


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


def dtype_of(fields: tuple[Field, ...]) -> np.dtype[np.void]:
    """Aligned structured dtype of a table."""
    return np.dtype([(f.name, f.dtype, f.shape) for f in fields], align=True)


def _error_fields() -> tuple[Field, ...]:
    fields = []
    for feature in PINS + HOLES:
        kind = "pin" if feature.startswith("pin") else "hole"
        for axis in "etz":
            text = f"position error of the {kind} axis along {axis}"
            fields.append(Field(f"{feature}.offset_{axis}", "m", text))
        for axis in "tz":
            fields.append(Field(f"{feature}.tilt_{axis}", "rad", f"angular error of the {kind} axis about {axis}"))
        fields.append(Field(f"{feature}.diameter", "m", f"deviation of the {kind}'s diameter from nominal"))
    fields += [
        Field("operation.alpha", "rad", "misalignment of the shafts"),
        Field("operation.speed", "rad/s", "angular velocity of the input shaft"),
        Field("operation.torque", "N*m", "resisting torque on the output shaft"),
        Field(
            "material.E_factor",
            "1",
            "factor on Young's modulus: bushings, their damping, contact coefficients",
        ),
    ]
    return tuple(fields)


ERROR_FIELDS = _error_fields()
"""Manufacturing errors (deviations from nominal, zero for the nominal joint) and the operating point."""

PARAM_FIELDS = (
    Field("alpha", "rad", "misalignment"),
    Field("omega", "rad/s", "angular velocity of the input shaft"),
    Field("torque", "N*m", "resisting torque T_r"),
    Field("Js", "kg*m^2", "inertia of the output shaft"),
    Field("R", "m", "distance of the pins' and arms' reference points from O"),
    Field("r_b", "m", "distance of the cross bushings' markers from O"),
    Field("l_f", "m", "distance of the fork bushings' markers from the hole centre along z"),
    Field("hub_mass", "kg", "mass of the hub"),
    Field("hub_inertia", "kg*m^2", "inertia of the hub about x, y, z of C", shape=(3,)),
    Field("pin_mass", "kg", "mass of a pin"),
    Field("pin_inertia", "kg*m^2", "inertia of a pin about e, t, z", shape=(3,)),
    Field("arm_mass", "kg", "mass of an arm"),
    Field("arm_inertia", "kg*m^2", "inertia of an arm about e, t, z", shape=(3,)),
    Field("k_cross", "N/m, N*m/rad", "cross bushing stiffness: force e, t, z, torque e, t, z", shape=(6,)),
    Field("c_cross", "N*s/m, N*m*s/rad", "cross bushing damping, same order", shape=(6,)),
    Field("k_fork", "N/m, N*m/rad", "fork bushing stiffness, same order", shape=(6,)),
    Field("c_fork", "N*s/m, N*m*s/rad", "fork bushing damping, same order", shape=(6,)),
    Field("c_d", "N*s/m", "normal contact damping"),
    Field("c_t", "N*s/m", "tangential contact damping (lubricant film)"),
    Field("delta_d", "m", "penetration over which contact damping rises"),
    Field("n_stations", "1", "contact stations per pin", "i8"),
    Field("station_s", "m", "signed distance of each station from P along the pin, falling", shape=(MAX_STATIONS,)),
    Field("station_k1", "N/m^2", "quadratic coefficient of each station's force", shape=(MAX_STATIONS,)),
    Field("station_k2", "N/m", "linear coefficient of each station's force", shape=(MAX_STATIONS,)),
    Field("station_weight", "1", "weight of each station's damping and film", shape=(MAX_STATIONS,)),
    Field("clearance", "m", "radial clearance c of each pin", shape=(4,)),
    Field("pin_point", "m", "P less the pin's reference point, in axes of C", shape=(4, 3)),
    Field("pin_axis", "1", "direction of the pin axis, in axes of C", shape=(4, 3)),
    Field(
        "hole_point",
        "m",
        "hole centre less the arm's reference point, in axes of the arm's frame",
        shape=(4, 3),
    ),
    Field("hole_axis", "1", "direction of the hole axis, in axes of the arm's frame", shape=(4, 3)),
)
"""Parameters of one joint for the kernel. Pin fields are indexed by pin, hole fields by arm (hole k: arm k)."""


LARGEST = {"F": "bushing force", "T": "bushing torque", "contact": "contact force", "psi": "|Psi|"}
"""Kinds of largest loads: results hold them as ``F_max`` and so on."""


def _load_fields() -> list[Field]:
    fields = []
    for load, unit, noun in (("F", "N", "force"), ("T", "N*m", "torque")):
        for stat, text in (("max", "largest"), ("mean", "mean"), ("range", "largest less smallest")):
            description = f"{text} modulus of the bushing {noun} over the revolutions that count"
            fields.append(Field(f"{load}_{stat}", unit, description, shape=(8,)))
    return fields


def _ends() -> list[Field]:
    """Interval of the largest loads of each kind."""
    fields = []
    for load, noun in LARGEST.items():
        for end in ("lower", "upper"):
            text = f"{end} end of the interval of the largest {noun} of a stationary joint, in units of it; of others 1"
            fields.append(Field(f"{load}_{end}", "1", text))
    return fields


RESULT_FIELDS = (
    Field("status", "1", "see Status", "u1"),
    Field("settled", "1", "1 when the closure error is below solver.settle_tol", "u1"),
    Field("closure", "1", "closure error of the last revolution"),
    Field("closure_trend", "1", "change of log10(closure) a revolution, fitted to the last revolutions"),
    Field("motion", "1", "class of the motion, see Motion", "u1"),
    Field("period", "1", "revolutions after which the motion repeats; 0 where it does not or is not known", "u1"),
    Field("lyapunov", "1", "largest Lyapunov exponent a revolution, of joints that neither settle nor repeat"),
    Field("failed_step", "1", "step of the output grid at which the joint failed, from 1; -1 if it did not", "i4"),
    Field("failed_theta", "rad", "input angle at the start of that step, less whole revolutions"),
    Field("revolutions", "1", "revolutions integrated, the recorded one included"),
    Field("steps_per_rev", "1", "steps of the last revolution: others than solver.steps_per_rev if refined", "i4"),
    Field(
        "step_error", "1", "mean estimated error of the uniform steps, as a load relative to the largest of its kind"
    ),
    Field(
        "refinement_change",
        "1",
        "largest change of a largest load by the last halving of steps, relative to its kind's",
    ),
    Field("steps", "1", "steps taken, sub-steps included; quasistatic: angles solved", "i4"),
    Field("newton_iterations", "1", "Newton iterations", "i4"),
    Field("halvings", "1", "times that a step was halved; quasistatic: angles that Newton's iteration missed", "i4"),
    Field("factorisations", "1", "times that the tangent was factorised", "i4"),
    *_load_fields(),
    Field(
        "contact_max",
        "N",
        "largest contact force of the pin: of its outermost station, of its innermost one, resultant of all stations",
        shape=(4, len(CONTACTS)),
    ),
    Field("mode_share", "1", "share of the revolutions that count in each contact mode", shape=(4, 4)),
    Field("psi_max", "1", "largest |Psi|, relative error of the speed ratio, eq. (13)"),
    *_ends(),
)

DESIGN_FIELDS = (
    Field("variant", "1", "index of the joint's variant in the attribute design", "i4"),
    Field("case", "1", "index of the joint's errors among the cases of the attribute design; 0 has none", "i4"),
    Field("group", "1", "joints of one group differ in their case only; the one without errors comes first", "i4"),
)
"""Variant, case and group of each joint of a study that lists its joints (``sampling.method = "cases"``)."""

LEDGER_FIELDS = (
    Field("attempt", "1", "what gave the results: 0 the study's settings, k those of entry k - 1 of `retries`", "i4"),
    Field("errors_check", "1", "checksum of the joint's row, errors and design", "u8"),
    Field("results_check", "1", "checksum of `errors_check`, `attempt` and the joint's results, status included", "u8"),
)
"""Origin of each joint's results, and checksums of its rows."""

DESIGN = dtype_of(DESIGN_FIELDS)
ERROR = dtype_of(ERROR_FIELDS)
PARAM = dtype_of(PARAM_FIELDS)
RESULT = dtype_of(RESULT_FIELDS)


def without_results(n: int, status: Status) -> NDArray[np.void]:
    """Return the rows of `n` joints without results, (n,), dtype RESULT: NaN, and `status`."""
    results = np.zeros(n, RESULT)
    for field in RESULT_FIELDS:
        if np.dtype(field.dtype).kind == "f":
            results[field.name] = np.nan
    results["status"], results["failed_step"] = status, -1
    return results
