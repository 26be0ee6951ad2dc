"""Linkages of a study: ``[mechanism]``, and operating points without misalignment."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from tolstat.common import units
from tolstat.common.errors import InputError, gather
from tolstat.common.strict import Strict
from tolstat.joint import Linkage, orders
from tolstat.study.selection import Reading


class DrivenPoint(Strict):
    """Operating point of a linkage."""

    speed: Annotated[units.Speed, AfterValidator(units.not_zero)] = Field(examples=["30 rpm"])
    """speed of the driven member, with orders { mean, orders }; of one that swings, periods: "30 rpm" is one in 2 s"""
    torque: units.Torque = Field(default=0.0, examples=["40 N*m"])
    """torque on the member `mechanism.loaded`, against its axis, with orders { mean, orders }"""
    speed_orders: Annotated[orders.SpeedOrders, Field(alias="speed.orders")] = ()
    """orders of the speed, { n, amplitude, phase } each"""
    torque_orders: Annotated[orders.TorqueOrders, Field(alias="torque.orders")] = ()
    """orders of the torque, { n, amplitude, phase } each"""
    name: Annotated[str | None, Field(examples=["open"])] = None
    """name of the operating point, of several ones"""
    share: Annotated[units.Number | None, Field(gt=0, le=1)] = Field(default=None, examples=["60 %"])
    """share of the service time, for fatigue; given for all points or for none"""

    _split = model_validator(mode="before")(orders.split)


def read(file: Reading) -> Linkage | None:
    """``[mechanism]``: members and pairs. What follows reads names of its errors and loads: its faults end the reading."""
    if "mechanism" not in file.data:
        return None
    before = len(file.faults)
    with gather(file.faults):
        linkage = file.model(Linkage, file.data["mechanism"], "mechanism")
        for key, *texts in linkage.faults():
            file.fault(f"mechanism.{key}", *texts)
        if "shaft" in file.data:
            file.fault("shaft", "has no effect beside a mechanism", "remove one of the two")
        if len(file.faults) == before:
            with _gather_as(file, "mechanism"):
                _ = linkage.chain
    if len(file.faults) > before:
        file.finish()
    return linkage


@contextmanager
def _gather_as(file: Reading, key: str) -> Iterator[None]:
    """Note the faults that are raised inside as those of a key."""
    try:
        yield
    except InputError as error:
        for fault in error.faults:
            file.fault(key, fault.found, fault.remedy)
