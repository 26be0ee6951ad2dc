"""Input models of the tables of a study file; `study` reads the file as a whole."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from tolstat.analysis.clustered import LEAST
from tolstat.common.columns import KEPT, Column, kept_columns, kept_names, result_columns
from tolstat.common.loads import Limit
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import Strict, refuse
from tolstat.common.tables import Options, from_names
from tolstat.common.units import Number
from tolstat.study import selection
from tolstat.study.tolerances.entry import Value

_DEFAULTS = Options()

MAX_ROWS = 10_000_000
"""Maximum number of joints of a list or a grid, whose tables are held in memory."""
MAX_SAMPLES = 1_000_000_000
"""Maximum number of joints of a campaign that is drawn in parts."""

Flag = Annotated[bool, Field(strict=True)]


class Solver(Strict):
    """Numerical settings of all joints except those of variants with settings of their own."""

    fidelity: Literal["dynamic", "quasistatic", "ideal", "auto"] = Field(default="dynamic", examples=["quasistatic"])
    """what is solved: `dynamic`, integration until settled; `quasistatic`, equilibrium at each angle; `ideal`, closed
    forms of the joint without errors; `auto`, the cheapest fidelity and steps per revolution that meet
    `error_budget`"""
    error_budget: Annotated[Number, Field(ge=1e-6, lt=1)] = Field(default=0.005, examples=[0.01])
    """largest error of a load that `auto` allows, relative to the joint's largest load of the kind"""
    method: Literal["bdf2", "tr_bdf2"] = Field(default="bdf2", examples=["tr_bdf2"])
    """time integration; `tr_bdf2` damps less and costs twice as much"""
    start: Literal["static", "ramp"] = Field(default="static", examples=["ramp"])
    """start from the equilibrium at theta = 0, or from the ideal pose with a torque that rises"""
    steps_per_rev: int = Field(default=_DEFAULTS.steps_per_rev, strict=True, ge=12, le=20_000, examples=[360])
    """equal steps per revolution"""
    max_revs: int = Field(default=_DEFAULTS.max_revs, strict=True, ge=2, le=1000, examples=[60])
    """most revolutions until a joint settles"""
    settle_tol: Annotated[Number, Field(gt=0, lt=1)] = Field(default=_DEFAULTS.settle_tol, examples=[1e-3])
    """closure error below which a joint is settled"""
    newton_tol: Annotated[Number, Field(ge=1e-12, le=1e-2)] = Field(default=_DEFAULTS.newton_tol, examples=[1e-7])
    """residual that ends Newton's iteration, relative to torque / (2 R)"""
    newton_max_iter: int = Field(default=_DEFAULTS.newton_max_iter, strict=True, ge=2, le=100, examples=[20])
    """most Newton iterations of a step"""
    max_halvings: int = Field(default=_DEFAULTS.max_halvings, strict=True, ge=0, le=20, examples=[8])
    """most halvings of a step that Newton's iteration fails on"""
    peak_substeps: int = Field(default=_DEFAULTS.peak_substeps, strict=True, ge=1, le=64, examples=[1])
    """parts of a step where a contact switches on a load's peak; with 1 these steps are not repeated"""
    max_refinements: int = Field(default=_DEFAULTS.max_refinements, strict=True, ge=0, le=4, examples=[0])
    """most halvings of the steps of a refined joint; 0 leaves all joints at `steps_per_rev`"""
    duration: int = Field(default=_DEFAULTS.duration, strict=True, ge=1, le=1_000_000_000, examples=[1000])
    """revolutions for which the largest loads of a joint that never repeats are estimated"""

    @model_validator(mode="after")
    def _auto(self) -> Self:
        auto = self.fidelity == "auto"
        if not auto and "error_budget" in self.model_fields_set:
            found = f"error_budget is given with fidelity {self.fidelity!r}"
            raise refuse(found, 'remove it, or write fidelity = "auto"')
        if auto and "steps_per_rev" in self.model_fields_set:
            raise refuse("steps_per_rev is given with fidelity 'auto'", "remove it: auto chooses it")
        return self

    def options(self) -> Options:
        """Return the settings for the kernel; ``auto``, which a campaign resolves, becomes ``dynamic``."""
        settings = self.model_dump(include=set(Options._fields))
        return from_names(settings | ({"fidelity": "dynamic"} if self.fidelity == "auto" else {}))


SamplingMethod = Literal["random", "sweep", "cases", "subset"]


def _of_a_file(schema: dict[str, Any]) -> None:
    """Leave out of a schema the method that no file can set."""
    schema["enum"].remove("subset")


class Sampling(Strict):
    """How many joints there are, and how they are drawn."""

    method: SamplingMethod = Field(default="random", json_schema_extra=_of_a_file, examples=["sweep"])
    """`random`, from the tolerances; `sweep`, the grid of [sweep]; `cases`, the joints of [[case]], [[variant]] and
    [grid]"""
    n: int | None = Field(default=None, strict=True, ge=1, le=MAX_SAMPLES, examples=[1024])
    """number of joints without the nominal one; needed by all methods but `sweep` and `cases`"""
    seed: int = Field(default=0, strict=True, ge=0, lt=2**63, examples=[2021])
    """seed of all draws"""
    nominal_first: Flag = Field(default=True, examples=[False])
    """whether row 0 is the joint without errors, which statistics leave out; not with `cases`"""
    joints_per_lot: int = Field(default=1, strict=True, ge=1, le=MAX_SAMPLES, examples=[20])
    """joints of a lot, for errors with `lot`; with 1 each joint is its own lot, and all are independent"""

    @model_serializer(mode="wrap")
    def _without_foreign_keys(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out `joints_per_lot` of one: it has no effect."""
        return {key: value for key, value in write(self).items() if key != "joints_per_lot" or value > 1}

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
        if self.joints_per_lot > 1 and self.method != "random":
            raise refuse(f"joints_per_lot is given with {self.method!r}", 'remove it, or write method = "random"')
        least = LEAST * self.joints_per_lot
        if self.joints_per_lot > 1 and (self.n or 0) < least:
            found = f"{self.n} joints, {self.joints_per_lot} a lot, are fewer than {LEAST} lots"
            raise refuse(found, f"give n = {least} or more, or a smaller joints_per_lot")
        if self.method == "cases" and self.nominal_first:
            remedy = "remove it: each group has its own joint without errors"
            raise refuse("nominal_first is given with 'cases'", remedy)
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
        Name of the limit whose exceedance is estimated: ``cross1.F``, ``cross*.F``, ``any limit``.
    levels : dict of str to float
        Level of each load of the limit, SI.
    unresolved : str
        Whether a joint without a valid load counts as above every level or below.
    """

    FROM_STUDY: ClassVar[tuple[str, ...]] = ("seed", "nominal_first")
    """Fields that have the values of the study whose tolerances are used."""

    method: SamplingMethod = "subset"
    per_level: Annotated[int, Field(strict=True, ge=20, le=MAX_ROWS)]
    p0: Annotated[Number, Field(gt=0, le=0.5)]
    load: str
    levels: Annotated[dict[str, Number], Field(min_length=1)]
    unresolved: Literal["above", "below"] = "below"

    def limit(self, mechanism: Mechanism) -> Limit:
        """The limit whose exceedance is estimated, of the study's mechanism."""
        return Limit(self.load, tuple(self.levels), tuple(self.levels.values()), mechanism)

    @model_validator(mode="after")
    def _whole_seeds(self) -> Self:
        seeds = self.per_level * self.p0
        if abs(seeds - round(seeds)) > 1e-9 or seeds < 2:
            found = f"p0 x n = {self.p0:g} x {self.per_level} = {seeds:g} seeds"
            raise refuse(found, "give n and p0 whose product is a whole number of at least 2")
        return self


class Output(Strict):
    """What is stored of each joint."""

    results: list[str] | None = Field(default=None, min_length=1, examples=[["cross*.[FT]_max"]])
    """names or patterns of result columns to store beside status and course; all by default"""
    histories: Literal["none", "full", "harmonics", "cycles", "harmonics+cycles"] = Field(
        default="none", examples=["harmonics+cycles"]
    )
    """what is stored of the last revolution: all samples, Fourier coefficients, counted load cycles"""
    harmonics: int = Field(default=16, strict=True, ge=0, le=10_000, examples=[32])
    """highest order of the Fourier coefficients, where `histories` has them"""

    def unknown(self, mechanism: Mechanism) -> Iterator[tuple[int, str, str]]:
        """Number of each pattern of `results` that selects nothing, what is wrong with it, and the remedy."""
        names = [column.name for column in result_columns(mechanism)]
        for number, pattern in enumerate(self.results or ()):
            if not selection.select(pattern, names):
                anywhere = f"*.{pattern}"
                remedy = selection.suggestion(pattern, names)
                if selection.select(anywhere, names):
                    remedy = f"did you mean {anywhere!r}?"
                yield number, f"{pattern!r} selects nothing", remedy

    def identity(self, mechanism: Mechanism) -> dict[str, Any]:
        """Settings that determine what is stored: names instead of patterns, no names if all results are kept."""
        every = [column.name for column in result_columns(mechanism)]
        selected = [name for pattern in self.results or () for name in selection.select(pattern, every)]
        names = kept_names(selected, mechanism) if self.results else None
        rest = self.model_dump(exclude={"results"})
        return rest if names is None else rest | {"results": names}

    def columns(self, mechanism: Mechanism) -> tuple[Column, ...]:
        """Columns of the results that are kept."""
        return kept_columns({KEPT: self.identity(mechanism).get("results")}, mechanism)


class SweepEntry(Strict):
    """The errors that a name or pattern selects go from one value to another together; several entries make a grid."""

    start: Value = Field(alias="from", examples=["0.14 mm"])
    """first value"""
    stop: Value = Field(alias="to", examples=["-0.60 mm"])
    """last value"""
    points: int = Field(strict=True, ge=2, le=MAX_ROWS, examples=[38])
    """number of equally spaced values"""

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
