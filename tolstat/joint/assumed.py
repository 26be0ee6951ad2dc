"""``[[assumed]]`` of a joint file or study: values of the joint that nobody measured, and others that are possible."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from tolstat.common.strict import Strict


class Assumed(Strict):
    """Keys of the joint whose values are assumed, and other values that they may have; affects no result."""

    name: Annotated[str, Field(min_length=1, description="what is assumed, as a noun", examples=["contact law"])]
    values: Annotated[
        tuple[Annotated[dict[str, Any], Field(min_length=1, json_schema_extra={"x-table": "keys"})], ...],
        Field(
            min_length=1,
            description="other values, each some keys of the joint, with those that follow from them and are to stay",
            examples=[[{"contact": {"law": "sliced"}}, {"contact": {"law": "uniform"}}]],
        ),
    ]
    because: Annotated[
        str, Field(min_length=1, description="why the value is not known", examples=["no drawing gives it"])
    ]
    varied: Annotated[
        bool, Field(strict=True, description="whether it is varied unless it is asked for by name", examples=[False])
    ] = True
