"""Input models of joints that are listed one by one: ``[[case]]`` and ``[[variant]]``; `listing` reads them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from tolstat.common.strict import Strict, refuse


class CaseEntry(Strict):
    """A joint with these errors; the joint without errors is always run, too."""

    name: Annotated[str, Field(min_length=1, description="name of the case", examples=["tilt"])]
    errors: Annotated[
        dict[str, Any],
        Field(
            min_length=1,
            description="errors by name or pattern, as in [errors]",
            examples=[{"pin1.tilt_z": "0.5 deg"}],
            json_schema_extra={"x-table": "errors"},
        ),
    ]


class Range(Strict):
    """One entry of ``vary``: a key of the joint goes from `start` to `stop`, given as in the file."""

    start: Annotated[
        Any,
        Field(alias="from", description="value of the first joint, a quantity of the key's unit", examples=["76.0 mm"]),
    ]
    stop: Annotated[
        Any,
        Field(alias="to", description="value of the last joint, a quantity of the key's unit", examples=["75.6 mm"]),
    ]


class VariantEntry(Strict):
    """Another joint, or a family of them."""

    name: Annotated[
        str,
        Field(
            min_length=1, description="name of the family; entries of one name make one family", examples=["clearance"]
        ),
    ]
    joint: Annotated[
        dict[str, Any],
        Field(
            default_factory=dict,
            description="keys in place of those of [joint], which may name another `base`, too",
            examples=[{"contact": {"law": "point"}}],
            json_schema_extra={"x-table": "overrides"},
        ),
    ]
    points: Annotated[
        int | None,
        Field(
            strict=True, ge=2, le=10_000, description="number of joints of a family; needed with `vary`", examples=[21]
        ),
    ] = None
    design: Annotated[
        Literal["line", "sobol"],
        Field(
            description="`line`: all keys of `vary` go from one end to the other together; `sobol`: a scrambled Sobol' "
            "sequence fills the box",
            examples=["sobol"],
        ),
    ] = "line"
    seed: Annotated[
        int, Field(strict=True, ge=0, lt=2**63, description="seed of the scrambling of `sobol`", examples=[2021])
    ] = 0
    vary: Annotated[
        dict[str, Any],
        Field(
            default_factory=dict,
            description="keys of the joint that the family varies, each with its range",
            examples=[{"cross.R": {"from": "60 mm", "to": "90 mm"}}],
            json_schema_extra={"x-table": "vary"},
        ),
    ]
    cases: Annotated[
        list[str] | None,
        Field(
            description="names of the cases to run; all by default; the joint without errors is always run",
            examples=[["tilt"]],
        ),
    ] = None
    operation: Annotated[
        dict[str, Any],
        Field(
            default_factory=dict,
            description="keys in place of those of [operation]",
            examples=[{"torque": "0 N*m"}],
            json_schema_extra={"x-table": "operation"},
        ),
    ]
    solver: Annotated[
        dict[str, Any],
        Field(
            default_factory=dict,
            description="keys in place of those of [solver]",
            examples=[{"steps_per_rev": 720}],
            json_schema_extra={"x-table": "solver"},
        ),
    ]
    note: Annotated[str, Field(description="note for the reader of the report", examples=["long free flight"])] = ""

    @model_validator(mode="after")
    def _family(self) -> Self:
        if bool(self.vary) != (self.points is not None):
            given, lacking = ("vary", "points") if self.vary else ("points", "vary")
            raise refuse(f"{given} without {lacking}", f"add {lacking}")
        if self.seed and self.design != "sobol":
            raise refuse("seed without a random design", 'remove it, or write design = "sobol"')
        return self
