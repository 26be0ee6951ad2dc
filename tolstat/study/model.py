"""The tables of a study file that are models of their own; `study` reads the file as a whole."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from tolstat import units
from tolstat.schema import Strict, refuse
from tolstat.study.tolerance_entry import Value
from tolstat.tables import Method, Options, Start

_DEFAULTS = Options()

MAX_ROWS = 10_000_000
"""Most joints of a campaign: what a result file and its tables can hold in memory."""

Number = units.Number
Flag = Annotated[bool, Field(strict=True)]


class Solver(Strict):
    """``[solver]``: numerical settings, the same for every joint."""

    method: Literal["bdf2", "generalized_alpha"] = "bdf2"
    start: Literal["static", "ramp"] = "static"
    steps_per_rev: Annotated[int, Field(strict=True, ge=12, le=20_000)] = _DEFAULTS.steps_per_rev
    max_revs: Annotated[int, Field(strict=True, ge=1, le=1000)] = _DEFAULTS.max_revs
    settle_tol: Annotated[Number, Field(gt=0, lt=1)] = _DEFAULTS.settle_tol
    newton_tol: Annotated[Number, Field(ge=1e-12, le=1e-2)] = _DEFAULTS.newton_tol
    newton_max_iter: Annotated[int, Field(strict=True, ge=2, le=100)] = _DEFAULTS.newton_max_iter
    max_halvings: Annotated[int, Field(strict=True, ge=0, le=20)] = _DEFAULTS.max_halvings
    rho_inf: Annotated[Number, Field(ge=0, le=1)] = _DEFAULTS.rho_inf

    def options(self) -> Options:
        """Return the settings as the kernel takes them."""
        return Options(
            method=Method[self.method.upper()],
            start=Start[self.start.upper()],
            steps_per_rev=self.steps_per_rev,
            max_revs=self.max_revs,
            settle_tol=self.settle_tol,
            newton_tol=self.newton_tol,
            newton_max_iter=self.newton_max_iter,
            max_halvings=self.max_halvings,
            rho_inf=self.rho_inf,
        )


class Sampling(Strict):
    """``[sampling]``: how many joints, and how they are drawn.

    Attributes
    ----------
    n : int, optional
        Number of joints, the nominal one not counted; a sweep has its number from its points.
    method : str
        ``random``, ``sobol``, ``lhs``, or ``sweep``.
    seed : int
        Seed of all draws.
    nominal_first : bool
        Whether row 0 is the joint without errors, kept out of the statistics.
    """

    method: Literal["random", "sobol", "lhs", "sweep"] = "random"
    n: Annotated[int, Field(strict=True, ge=1, le=MAX_ROWS)] | None = None
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] = 0
    nominal_first: Flag = True

    @model_validator(mode="after")
    def _n_or_sweep(self) -> Self:
        if self.method == "sweep" and self.n is not None:
            raise refuse("n is given for a sweep", "leave n out: [sweep] says how many points")
        if self.method != "sweep" and self.n is None:
            raise refuse("missing key n", "add n, the number of joints, for example n = 1024")
        return self


class Output(Strict):
    """``[output]``: what is stored beside the results of each joint."""

    histories: Literal["none", "full", "harmonics"] = "none"
    harmonics: Annotated[int, Field(strict=True, ge=0, le=10_000)] = 16


class Correlation(Strict):
    """One ``[[correlation]]``: every two of the errors named have the correlation `rho`.

    It is the correlation of the normal scores (Gaussian copula): the errors' own where they are normal.
    """

    between: Annotated[list[str], Field(min_length=1)]
    rho: Annotated[Number, Field(gt=-1, lt=1)]


class SweepEntry(Strict):
    """One entry of ``[sweep]``: the errors that a pattern selects go from `start` to `stop` together."""

    start: Annotated[Value, Field(alias="from")]
    stop: Annotated[Value, Field(alias="to")]
    points: Annotated[int, Field(strict=True, ge=2, le=MAX_ROWS)]

    @model_validator(mode="after")
    def _moves(self) -> Self:
        if self.start == self.stop:
            raise refuse("from and to are equal", "a value that does not move belongs to [errors]")
        return self


class SweepAxis(NamedTuple):
    """Errors that take `points` equally spaced values together, from `start` to `stop` (SI)."""

    names: tuple[str, ...]
    start: float
    stop: float
    points: int
