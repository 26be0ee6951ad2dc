"""Attributes of a result file that are JSON, read through models as strict as those of a study.

A result file may come from anybody, and its checksums can be made by anybody: what a file states is checked before
memory is taken or files are opened because of it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import h5py
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    TypeAdapter,
    ValidationError,
    create_model,
)

from tolstat.common import units
from tolstat.common.loads import LOADS, split
from tolstat.common.solver_options import CODES
from tolstat.common.strict import MAX_DEPTH, Strict, depth, dotted
from tolstat.common.tables import FINEST_STEPS, Options
from tolstat.store.result_file import text
from tolstat.study.model import Sampling, Solver, Subset
from tolstat.study.points import check_name
from tolstat.study.widths import STEPS

MAX_TEXT_BYTES = 64_000_000
"""Largest size of a JSON attribute that is read, bytes."""
MAX_SHOWN = 5
"""Most faults of an attribute that a message lists."""


def _load(name: str) -> str:
    if split(name)[0] not in LOADS:
        raise ValueError("is not a load")
    return name


def _point(name: str) -> str:
    return check_name(name) if name else name  # also a group and a folder of histories have this name


def _points(found: dict[str, Any]) -> dict[str, Any]:
    if len(found) > 1 and "" in found:
        raise ValueError("has a point without a name among others")
    return found


class _File(Strict):
    """Base of what a file states: no text for a number, nothing infinite."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


Count = Annotated[int, Field(ge=0)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
LoadName = Annotated[str, AfterValidator(_load)]
PointName = Annotated[str, AfterValidator(_point)]
Step: Any = Literal[STEPS]
Steps = Annotated[int, Field(ge=12, le=max(20_000, 2 * FINEST_STEPS))]


def _no_text(value: object) -> object:
    if isinstance(value, str):
        raise ValueError("is not a number")
    return value


def _option(name: str) -> Any:
    if name in CODES:
        return Literal[tuple(code.name.lower() for code in CODES[name])]
    if name in Solver.model_fields:
        known = Solver.model_fields[name]
        return Annotated[(known.annotation, *known.metadata, BeforeValidator(_no_text))]
    return Annotated[float, Field(ge=0, lt=1)]  # rtol, atol


_OPTIONS: dict[str, Any] = {name: (_option(name), ...) for name in Options._fields}
SolverOptions: Any = create_model("SolverOptions", __base__=_File, **_OPTIONS)
"""Options of the solver, with the bounds of a study's ``[solver]``."""


class PointRecord(_File):
    """An operating point, with the bounds of a study's ``[operation]``, see `study.points.Point.values`."""

    alpha: Annotated[float, Field(gt=-math.pi / 2, lt=math.pi / 2)]
    speed: Annotated[float, AfterValidator(units.not_zero)]
    torque: float
    axial_force: float
    share: Annotated[float, Field(gt=0, le=1)] | None


class RungRecord(_File):
    """A rung of the pilot of ``solver.fidelity = "auto"``."""

    fidelity: Literal["ideal", "quasistatic", "dynamic"]
    steps_per_rev: Steps
    worst: float | None
    q95: float | None
    errors: dict[LoadName, float | None]
    cost: float
    differing: Count


class FidelityRecord(_File):
    """What ``solver.fidelity = "auto"`` chose, see `solver.fidelity.Choice`."""

    fidelity: Literal["ideal", "quasistatic", "dynamic"]
    steps_per_rev: Steps
    met: bool
    reason: str
    budget: float
    margin: float
    joints: Count
    loads: list[LoadName]
    table: list[RungRecord]


class LooksRecord(_File):
    """Looks of a stop rule at a campaign that was extended since."""

    reached: Literal[False]
    looks: list[Count]


class StopRecord(_File):
    """Why a campaign ended early, see `campaign.stop_rule.Outcome.record`."""

    rule: str
    reached: bool
    joints: Count
    n_unresolved: Count
    above: Count
    estimate: float
    lower: float
    upper: float
    confidence: Annotated[float, Field(gt=0, lt=1)]
    confidence_of_a_look: Annotated[float, Field(gt=0, lt=1)]
    looks: list[Count]


class RetryRecord(_File):
    """Settings of a retry, see `campaign.remedy.Retry.entry`."""

    status: list[str]
    settings: dict[str, str | float | bool]
    options: SolverOptions


class VariantRecord(_File):
    """A joint that the study lists."""

    family: str
    values: dict[str, JsonValue]
    note: str


class DesignRecord(_File):
    """The joints that the study lists."""

    cases: list[str]
    variants: list[VariantRecord]


class DistributionRecord(_File):
    """Distribution of a changed tolerance; only its factor is read."""

    model_config = ConfigDict(extra="allow")

    factor: float


class WidthRecord(_File):
    """Tolerances made wider or narrower, see `campaign.what_if`."""

    kind: Literal["width"]
    label: str
    step: Step
    words: str
    seed: Count
    tolerances: Annotated[dict[str, DistributionRecord], Field(min_length=1)]


class ExchangeRecord(_File):
    """Errors of other samples."""

    kind: Literal["exchange"]
    label: str
    seed: Count
    names: list[str]


class AsDrawnRecord(_File):
    """Further samples, nothing changed."""

    kind: Literal["as drawn"]
    label: str
    seed: Count


Dimensions = dict[str, Annotated[int, Field(ge=0, le=10_000)]]
MODELS: dict[str, TypeAdapter[Any]] = {
    "limits": TypeAdapter(dict[LoadName, Positive]),
    "points": TypeAdapter(Annotated[dict[PointName, PointRecord], Field(min_length=1), AfterValidator(_points)]),
    "joint": TypeAdapter(dict[str, Any]),
    "identity": TypeAdapter(dict[str, Any]),
    "options": TypeAdapter(SolverOptions),
    "sampling": TypeAdapter(create_model("SamplingRecord", __base__=Sampling, dimensions=(Dimensions, ...))),
    "subset": TypeAdapter(create_model("SubsetRecord", __base__=Subset, dimensions=(Dimensions, ...))),
    "fidelity": TypeAdapter(FidelityRecord),
    "versions": TypeAdapter(dict[str, str]),
    "retries": TypeAdapter(list[RetryRecord]),
    "stop": TypeAdapter(StopRecord | LooksRecord),
    "design": TypeAdapter(DesignRecord),
    "histories": TypeAdapter(dict[str, list[Any]]),
    "change": TypeAdapter(Annotated[WidthRecord | ExchangeRecord | AsDrawnRecord, Field(discriminator="kind")]),
}
"""Model of each attribute that is JSON; ``sampling`` of a subset simulation has its own."""


def read(file: h5py.Group, name: str, default: object = None) -> Any:
    """Read an attribute that is JSON.

    Parameters
    ----------
    file : h5py.Group
        The file, or the group that has the attribute.
    name : str
        Name of the attribute, one of `MODELS`.
    default : object, optional
        What a missing or empty attribute means.

    Raises
    ------
    KeyError
        When it is missing and there is no default.
    ValueError
        With its faults, when it does not fit its model.
    """
    if default is not None and name not in file.attrs:
        return default
    if file.attrs.get_id(name).get_storage_size() > MAX_TEXT_BYTES:
        raise ValueError(f"attribute {name} is too long")
    held = text(file.attrs, name)
    value = json.loads(held)
    if default is not None and not value and type(value) is type(default):
        return default
    if depth(value) > MAX_DEPTH:
        raise ValueError(f"attribute {name} is nested deeper than {MAX_DEPTH}")
    subset = name == "sampling" and isinstance(value, Mapping) and value.get("method") == "subset"
    try:
        found = MODELS["subset" if subset else name].validate_json(held, strict=True)
    except ValidationError as error:
        # the location alone names the value: values of a file that is not trusted are not quoted
        faults = [f"{dotted(one['loc'])} {one['msg']}".strip()[:200] for one in error.errors(include_url=False)]
        more = [f"and {len(faults) - MAX_SHOWN} more"] if len(faults) > MAX_SHOWN else []
        raise ValueError(f"attribute {name}: {'; '.join(faults[:MAX_SHOWN] + more)}") from None
    if isinstance(found, BaseModel) and (missing := sorted(set(found.model_dump()) - set(value))):
        raise ValueError(f"attribute {name}: missing key {missing[0]}")  # a study may leave it out, a file never does
    return value
