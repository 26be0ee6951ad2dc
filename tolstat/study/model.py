"""Input models of the tables of a study file; `study` reads the file as a whole."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

from pydantic import AfterValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from tolstat.analysis.clustered import LEAST
from tolstat.common import selected_results, units
from tolstat.common.columns import Column
from tolstat.common.loads import Limit
from tolstat.common.solver_options import from_names
from tolstat.common.strict import Strict, described, refuse, whole
from tolstat.common.tables import Options
from tolstat.study import selection
from tolstat.study.selective import SelectiveEntry
from tolstat.study.tolerances.entry import Value

_DEFAULTS = Options()

MAX_ROWS = 10_000_000
"""Maximum number of joints of a list, a grid or a Latin hypercube, whose tables are held in memory."""
MAX_SAMPLES = 1_000_000_000
"""Maximum number of joints of a campaign that is drawn in parts: 30-bit Sobol' sequences end soon after."""

Number = units.Number


Flag = Annotated[bool, Field(strict=True)]


class Solver(Strict):
    """Numerical settings of all joints except those of variants with settings of their own."""

    fidelity: Annotated[
        Literal["dynamic", "quasistatic", "ideal", "auto"],
        described(
            "what is solved: `dynamic`, integration until settled; `quasistatic`, equilibrium at each angle; "
            "`ideal`, closed forms of the joint without errors; `auto`, the cheapest fidelity and steps per revolution "
            "that meet `error_budget`",
            "quasistatic",
        ),
    ] = "dynamic"
    error_budget: Annotated[
        Number,
        described(
            "largest error of a load that `auto` allows, relative to the joint's largest load of the kind",
            0.01,
            ge=1e-6,
            lt=1,
        ),
    ] = 0.005
    method: Annotated[
        Literal["bdf2", "tr_bdf2"],
        described("time integration; `tr_bdf2` damps less and costs twice as much", "tr_bdf2"),
    ] = "bdf2"
    start: Annotated[
        Literal["static", "ramp"],
        described("start from the equilibrium at theta = 0, or from the ideal pose with a torque that rises", "ramp"),
    ] = "static"
    steps_per_rev: Annotated[int, whole(12, 20_000, "equal steps per revolution", 360)] = _DEFAULTS.steps_per_rev
    max_revs: Annotated[int, whole(2, 1000, "most revolutions until a joint settles", 60)] = _DEFAULTS.max_revs
    settle_tol: Annotated[Number, described("closure error below which a joint is settled", 1e-3, gt=0, lt=1)] = (
        _DEFAULTS.settle_tol
    )
    newton_tol: Annotated[
        Number, described("residual that ends Newton's iteration, relative to torque / (2 R)", 1e-7, ge=1e-12, le=1e-2)
    ] = _DEFAULTS.newton_tol
    newton_max_iter: Annotated[int, whole(2, 100, "most Newton iterations of a step", 20)] = _DEFAULTS.newton_max_iter
    max_halvings: Annotated[int, whole(0, 20, "most halvings of a step that Newton's iteration fails on", 8)] = (
        _DEFAULTS.max_halvings
    )
    peak_substeps: Annotated[
        int,
        whole(
            1, 64, "parts of a step where a contact switches on a load's peak; with 1 these steps are not repeated", 1
        ),
    ] = _DEFAULTS.peak_substeps
    max_refinements: Annotated[
        int, whole(0, 4, "most halvings of the steps of a refined joint; 0 leaves all joints at `steps_per_rev`", 0)
    ] = _DEFAULTS.max_refinements
    duration: Annotated[
        int,
        whole(
            1,
            1_000_000_000,
            "revolutions for which the largest loads of a joint that never repeats are estimated",
            1000,
        ),
    ] = _DEFAULTS.duration

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
        own = self.model_dump(include=set(Options._fields))
        return from_names(own | ({"fidelity": "dynamic"} if self.fidelity == "auto" else {}))


SamplingMethod = Literal["random", "sobol", "lhs", "sweep", "cases", "importance", "pick_freeze", "subset"]


def _of_a_file(schema: dict[str, Any]) -> None:
    """Leave out of a schema the method that no file can set."""
    schema["enum"].remove("subset")


class Sampling(Strict):
    """How many joints there are, and how they are drawn."""

    method: Annotated[
        SamplingMethod,
        described(
            "`random`; `sobol`, scrambled Sobol' points; `lhs`, Latin hypercube; `importance`, random, from "
            "[tolerances] and [[proposal]]; `pick_freeze`, joints that share errors, for Sobol' indices; `sweep`, the "
            "grid of [sweep]; `cases`, the joints of [[case]], [[variant]] and [grid]",
            "sobol",
            json_schema_extra=_of_a_file,
        ),
    ] = "random"
    n: Annotated[
        int | None,
        whole(
            1,
            MAX_SAMPLES,
            "number of joints without the nominal one; needed by all methods but `sweep` and `cases`; "
            "with `pick_freeze` of pairs of random joints",
            1024,
        ),
    ] = None
    seed: Annotated[int, described("seed of all draws", 2021, strict=True, ge=0, lt=2**63)] = 0
    nominal_first: Annotated[
        Flag,
        described("whether row 0 is the joint without errors, which statistics leave out; not with `cases`", False),
    ] = True
    groups: Annotated[
        Literal["tolerance", "error"],
        described(
            "what `pick_freeze` exchanges together: all errors of an entry of [tolerances], or each alone", "error"
        ),
    ] = "tolerance"

    replicates: Annotated[
        int,
        described(
            "number of independent randomisations that `n` is divided into, with `sobol` or `lhs`: shares "
            "and quantiles then have intervals",
            8,
            strict=True,
            ge=1,
            le=1000,
        ),
    ] = 1

    joints_per_lot: Annotated[
        int,
        whole(
            1,
            MAX_SAMPLES,
            "joints of a lot, for errors with `lot`; with 1 each joint is its own lot, and all are independent",
            20,
        ),
    ] = 1

    selective: Annotated[
        SelectiveEntry | None,
        described("pins and holes are measured, sorted in classes, and matched class to class", {"classes": 3}),
    ] = None

    @property
    def has_replicates(self) -> bool:
        """Whether the joints are several sets, independent of each other."""
        return self.replicates > 1

    @model_serializer(mode="wrap")
    def _without_foreign_keys(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out `groups` unless the method is ``pick_freeze``, and `replicates` unless there are several.

        Identities of other methods do not have them, nor `joints_per_lot` where each joint is its own lot, nor
        `selective` of one class.
        """
        data: dict[str, Any] = write(self)
        if self.method != "pick_freeze":
            data.pop("groups", None)
        if self.replicates == 1:
            data.pop("replicates", None)
        if self.joints_per_lot == 1:
            data.pop("joints_per_lot", None)
        if not self.is_matched:
            data.pop("selective", None)
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
        if self.replicates > 1 and self.method not in ("sobol", "lhs"):
            raise refuse(f"replicates is given with {self.method!r}", 'remove it, or write method = "sobol" or "lhs"')
        if self.n is not None and self.n % self.replicates:
            least = self.replicates * -(-self.n // self.replicates)
            raise refuse(f"n = {self.n} is no multiple of replicates = {self.replicates}", f"give n = {least}")
        if self.is_matched and self.method != "random":
            raise refuse(f"selective is given with {self.method!r}", 'remove it, or write method = "random"')
        if self.joints_per_lot > 1:
            self._check_lots()
        if self.method != "pick_freeze" and "groups" in self.model_fields_set:
            raise refuse(f"groups is given with {self.method!r}", 'remove it, or write method = "pick_freeze"')
        if self.method == "cases" and self.nominal_first:
            raise refuse(
                "nominal_first is given with 'cases'", "remove it: each group has its own joint without errors"
            )
        return self

    @property
    def is_matched(self) -> bool:
        """Whether pins and holes are sorted in several classes."""
        return self.selective is not None and self.selective.classes > 1

    def _check_lots(self) -> None:
        if self.method != "random":
            raise refuse(f"joints_per_lot is given with {self.method!r}", 'remove it, or write method = "random"')
        least = LEAST * self.joints_per_lot
        if (self.n or 0) < least:
            found = f"{self.n} joints, {self.joints_per_lot} a lot, are fewer than {LEAST} lots"
            raise refuse(found, f"give n = {least} or more, or a smaller joints_per_lot")

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

    @property
    def limit(self) -> Limit:
        """The limit whose exceedance is estimated."""
        return Limit(self.load, tuple(self.levels), tuple(self.levels.values()))

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
    """What is stored of each joint."""

    results: Annotated[
        list[Annotated[str, AfterValidator(_check_pattern)]] | None,
        described(
            "names or patterns of result columns to store beside status and course; all by default",
            ["cross*.[FT]_max"],
            min_length=1,
        ),
    ] = None
    histories: Annotated[
        Literal["none", "full", "harmonics", "cycles", "harmonics+cycles"],
        described(
            "what is stored of the last revolution: all samples, Fourier coefficients, counted load cycles",
            "harmonics+cycles",
        ),
    ] = "none"
    harmonics: Annotated[
        int, whole(0, 10_000, "highest order of the Fourier coefficients, where `histories` has them", 32)
    ] = 16

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


class SweepEntry(Strict):
    """The errors that a name or pattern selects go from one value to another together; several entries make a grid."""

    start: Annotated[Value, described("first value", "0.14 mm", alias="from")]
    stop: Annotated[Value, described("last value", "-0.60 mm", alias="to")]
    points: Annotated[int, whole(2, MAX_ROWS, "number of equally spaced values", 38)]

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
