"""Input models of the tables of a study file; `study` reads the file as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

from pydantic import AfterValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from tolstat.common import selected_results, units
from tolstat.common.columns import Column
from tolstat.common.strict import Strict, refuse
from tolstat.common.tables import Fidelity, Method, Options, Start
from tolstat.study import selection
from tolstat.study.tolerances.entry import Value

_DEFAULTS = Options()

MAX_ROWS = 10_000_000
"""Maximum number of joints of a list, a grid or a Latin hypercube, whose tables are held in memory."""
MAX_SAMPLES = 1_000_000_000
"""Maximum number of joints of a campaign that is drawn in parts: 30-bit Sobol' sequences end soon after."""

Number = units.Number
Flag = Annotated[bool, Field(strict=True)]


class Solver(Strict):
    """``[solver]``: numerical settings of all joints except those of variants with settings of their own.

    Attributes
    ----------
    fidelity : str
        ``dynamic``: integration until settled; ``quasistatic``: equilibrium at each angle; ``ideal``: closed forms of
        the joint without errors; ``auto``: the cheapest fidelity and steps per revolution that meet `error_budget`.
    error_budget : float
        Largest error of a load that ``auto`` allows, relative to the joint's largest load of the kind.
    peak_substeps : int
        Number of parts of a step where a contact switches on a load's peak, see `kernel.revolution.closeup`; with 1
        these steps are not repeated.
    max_refinements : int
        Maximum number of times that the steps of a refined joint are halved to estimate their error, see `refinement`;
        0 leaves all joints at `steps_per_rev`.
    duration : int
        Revolutions for which the largest loads of a joint that never repeats are estimated, see `stationary`.
    """

    fidelity: Literal["dynamic", "quasistatic", "ideal", "auto"] = "dynamic"
    error_budget: Annotated[Number, Field(ge=1e-6, lt=1)] = 0.005
    method: Literal["bdf2", "generalized_alpha", "tr_bdf2"] = "bdf2"
    start: Literal["static", "ramp"] = "static"
    steps_per_rev: Annotated[int, Field(strict=True, ge=12, le=20_000)] = _DEFAULTS.steps_per_rev
    max_revs: Annotated[int, Field(strict=True, ge=2, le=1000)] = _DEFAULTS.max_revs
    settle_tol: Annotated[Number, Field(gt=0, lt=1)] = _DEFAULTS.settle_tol
    newton_tol: Annotated[Number, Field(ge=1e-12, le=1e-2)] = _DEFAULTS.newton_tol
    newton_max_iter: Annotated[int, Field(strict=True, ge=2, le=100)] = _DEFAULTS.newton_max_iter
    max_halvings: Annotated[int, Field(strict=True, ge=0, le=20)] = _DEFAULTS.max_halvings
    rho_inf: Annotated[Number, Field(ge=0, le=1)] = _DEFAULTS.rho_inf
    peak_substeps: Annotated[int, Field(strict=True, ge=1, le=64)] = _DEFAULTS.peak_substeps
    max_refinements: Annotated[int, Field(strict=True, ge=0, le=4)] = _DEFAULTS.max_refinements
    duration: Annotated[int, Field(strict=True, ge=1, le=1_000_000_000)] = _DEFAULTS.duration

    @model_validator(mode="after")
    def _auto(self) -> Self:
        auto = self.fidelity == "auto"
        if not auto and "error_budget" in self.model_fields_set:
            raise refuse(
                f"error_budget is given with fidelity {self.fidelity!r}", 'remove it, or write fidelity = "auto"'
            )
        if auto and "steps_per_rev" in self.model_fields_set:
            raise refuse("steps_per_rev is given with fidelity 'auto'", "remove it: auto chooses it")
        return self

    def options(self) -> Options:
        """Return the settings for the kernel; ``auto``, which a campaign resolves, becomes ``dynamic``."""
        return Options(
            method=int(Method[self.method.upper()]),
            start=int(Start[self.start.upper()]),
            steps_per_rev=self.steps_per_rev,
            max_revs=self.max_revs,
            settle_tol=self.settle_tol,
            newton_tol=self.newton_tol,
            newton_max_iter=self.newton_max_iter,
            max_halvings=self.max_halvings,
            rho_inf=self.rho_inf,
            peak_substeps=self.peak_substeps,
            max_refinements=self.max_refinements,
            duration=self.duration,
            fidelity=int(Fidelity.DYNAMIC if self.fidelity == "auto" else Fidelity[self.fidelity.upper()]),
        )


SamplingMethod = Literal["random", "sobol", "lhs", "sweep", "cases", "importance", "pick_freeze", "subset"]


class Sampling(Strict):
    """``[sampling]``: how many joints, and how they are drawn.

    Attributes
    ----------
    n : int, optional
        Number of joints without the nominal one; not for sweeps and cases, whose points and list give the number.
    method : str
        ``random``, ``sobol``, ``lhs``; ``sweep``: a grid of errors; ``cases``: joints listed one by one;
        ``importance``: random, from the tolerances and ``[[proposal]]``;
        ``pick_freeze``: for Sobol' indices, `n` times two random joints, and for each group of errors the first of the
        two with that group's errors of the second (Saltelli et al. 2010); ``subset``: not in a file, see `Subset`.
    groups : str
        Groups of ``pick_freeze``: ``tolerance``, all errors of an entry of ``[tolerances]``, or ``error``, each alone.
    seed : int
        Seed of all draws.
    nominal_first : bool
        Whether row 0 is the joint without errors, which statistics leave out. Never with ``cases``, where each group
        has its own joint without errors.
    """

    method: SamplingMethod = "random"
    n: Annotated[int, Field(strict=True, ge=1, le=MAX_SAMPLES)] | None = None
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] = 0
    nominal_first: Flag = True
    groups: Literal["tolerance", "error"] = "tolerance"

    @model_serializer(mode="wrap")
    def _without_foreign_keys(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out `groups` unless the method is ``pick_freeze``: identities of other methods do not have it."""
        data: dict[str, Any] = write(self)
        if self.method != "pick_freeze":
            data.pop("groups", None)
        return data

    @model_validator(mode="before")
    @classmethod
    def _ideal_in_each_group(cls, data: Any) -> Any:
        listed = isinstance(data, Mapping) and data.get("method") == "cases"
        return {"nominal_first": False, **data} if listed else data

    @model_validator(mode="after")
    def _n_where_drawn(self) -> Self:
        drawn = self.method not in ("sweep", "cases")
        if not drawn and self.n is not None:
            raise refuse(f"n is given with {self.method!r}", "leave n out: the file lists the joints")
        if drawn and self.n is None:
            raise refuse("missing key n", "add n, the number of joints, for example n = 1024")
        if self.method == "lhs" and self.n is not None and self.n > MAX_ROWS:
            raise refuse(f"a Latin hypercube of {self.n} joints", f"give at most n = {MAX_ROWS}, or another method")
        if self.method != "pick_freeze" and "groups" in self.model_fields_set:
            raise refuse(f"groups is given with {self.method!r}", 'remove it, or write method = "pick_freeze"')
        if self.method == "cases" and self.nominal_first:
            raise refuse(
                "nominal_first is given with 'cases'", "remove it: each group has its own joint without errors"
            )
        return self

    @property
    def first_sample(self) -> int:
        """Row of the first random joint: 1 if row 0 is the nominal joint, else 0."""
        return int(self.nominal_first)

    def samples(self, rows: range) -> range:
        """Numbers, among the random joints, of those in some rows."""
        return range(max(0, rows.start - self.first_sample), max(0, rows.stop - self.first_sample))


class Subset(Sampling):
    """How the joints of a subset simulation are drawn, see `analysis.subset`; `n` is their present number.

    Attributes
    ----------
    per_level : int
        Joints per level.
    p0 : float
        Share of them that seeds the next level.
    load : str
        Load whose exceedance is estimated, ``cross1.F``.
    above : float
        Value of the load whose exceedance is estimated, SI.
    unresolved : str
        Whether a joint without a valid load counts as above every level or below.
    """

    FROM_STUDY: ClassVar[tuple[str, ...]] = ("seed", "nominal_first")
    """Fields that have the values of the study whose tolerances are used."""

    method: SamplingMethod = "subset"
    per_level: Annotated[int, Field(strict=True, ge=20, le=MAX_ROWS)]
    p0: Annotated[Number, Field(gt=0, le=0.5)]
    load: str
    above: Number
    unresolved: Literal["above", "below"] = "below"

    @model_validator(mode="after")
    def _whole_seeds(self) -> Self:
        seeds = self.per_level * self.p0
        if abs(seeds - round(seeds)) > 1e-9 or seeds < 2:
            found = f"p0 x n = {self.p0:g} x {self.per_level} = {seeds:g} seeds"
            raise refuse(found, "give n and p0 whose product is a whole number of at least 2")
        return self


def _check_pattern(pattern: str) -> str:
    if selection.select(pattern, selected_results.NAMES):
        return pattern
    anywhere = f"*.{pattern}"
    halves = selection.select(anywhere, selected_results.NAMES)
    remedy = f"did you mean {anywhere!r}?" if halves else selection.suggestion(pattern, selected_results.NAMES)
    raise refuse(f"{pattern!r} selects nothing", remedy)


class Output(Strict):
    """``[output]``: what is stored of each joint.

    Attributes
    ----------
    results : list of str, optional
        Names or patterns of result columns to store beside those that are always stored; all by default.
    histories : str
        What is stored beside the results.
    harmonics : int
        Fourier coefficients up to this order, where `histories` has them.
    """

    results: Annotated[list[Annotated[str, AfterValidator(_check_pattern)]], Field(min_length=1)] | None = None
    histories: Literal["none", "full", "harmonics", "cycles", "harmonics+cycles"] = "none"
    harmonics: Annotated[int, Field(strict=True, ge=0, le=10_000)] = 16

    def identity(self) -> dict[str, Any]:
        """Settings that determine what is stored: names instead of patterns, no names if all results are kept."""
        selected = [
            name for pattern in self.results or () for name in selection.select(pattern, selected_results.NAMES)
        ]
        names = selected_results.chosen(selected) if self.results else None
        rest = self.model_dump(exclude={"results"})
        return rest if names is None else rest | {"results": names}

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of the results that are kept."""
        return selected_results.columns({selected_results.KEY: self.identity().get("results")})


class CaseEntry(Strict):
    """One ``[[case]]``: the joint with these errors."""

    name: Annotated[str, Field(min_length=1)]
    errors: Annotated[dict[str, Any], Field(min_length=1)]


class Range(Strict):
    """One entry of ``vary``: a key of the joint goes from `start` to `stop`, given as in the file."""

    start: Annotated[Any, Field(alias="from")]
    stop: Annotated[Any, Field(alias="to")]


class VariantEntry(Strict):
    """One ``[[variant]]``: another joint, or a family of them.

    Attributes
    ----------
    name : str
        Name of the family; entries of one name make one family.
    joint : dict
        Keys in place of those of ``[joint]``, which may name another `base` too.
    points : int, optional
        Number of joints of a family; needed with `vary`.
    design : str
        ``line``: all keys of `vary` go from one end to the other together; ``sobol``: a scrambled Sobol' sequence
        fills the box.
    seed : int
        Seed of the scrambling.
    vary : dict
        Keys of the joint that the family varies, each with its range.
    cases : list of str, optional
        Cases to run; all by default. The joint without errors is always run.
    operation, solver : dict
        Keys in place of those of ``[operation]`` and ``[solver]``.
    note : str
        Note for the reader of the report.
    """

    name: Annotated[str, Field(min_length=1)]
    joint: Annotated[dict[str, Any], Field(default_factory=dict)]
    points: Annotated[int, Field(strict=True, ge=2, le=10_000)] | None = None
    design: Literal["line", "sobol"] = "line"
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] = 0
    vary: Annotated[dict[str, Any], Field(default_factory=dict)]
    cases: list[str] | None = None
    operation: Annotated[dict[str, Any], Field(default_factory=dict)]
    solver: Annotated[dict[str, Any], Field(default_factory=dict)]
    note: str = ""

    @model_validator(mode="after")
    def _family(self) -> Self:
        if bool(self.vary) != (self.points is not None):
            given, lacking = ("vary", "points") if self.vary else ("points", "vary")
            raise refuse(f"{given} without {lacking}", f"add {lacking}")
        if self.seed and self.design != "sobol":
            raise refuse("seed without a random design", 'remove it, or write design = "sobol"')
        return self


class SweepEntry(Strict):
    """One entry of ``[sweep]``: the errors that a pattern selects go from `start` to `stop` together."""

    start: Annotated[Value, Field(alias="from")]
    stop: Annotated[Value, Field(alias="to")]
    points: Annotated[int, Field(strict=True, ge=2, le=MAX_ROWS)]

    @model_validator(mode="after")
    def _moves(self) -> Self:
        if self.start == self.stop:
            raise refuse("from and to are equal", "write a constant value in [errors]")
        return self


class SweepAxis(NamedTuple):
    """Errors that take `points` equally spaced values together, from `start` to `stop` (SI)."""

    names: tuple[str, ...]
    start: float
    stop: float
    points: int
