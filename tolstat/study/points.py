"""Operating points of a study: one in ``[operation]``, or several in ``[[operation]]``, each with a name."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator, Field, model_validator

from tolstat.common import loads, units
from tolstat.common.errors import Fault, InputError, gather, input_error
from tolstat.common.strict import Strict, did_you_mean, refuse
from tolstat.joint import DriveShaft, Linkage, Operation, OperationOfLinkage, OperationOfShaft, orders
from tolstat.joint.shaft import check_misalignment
from tolstat.study.selection import Reading

ORDERS = {"speed_orders": orders.SpeedOrder, "torque_orders": orders.TorqueOrder}
"""Model of the orders in each field of an operating point."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")


class Point(NamedTuple):
    """An operating point of a campaign.

    Attributes
    ----------
    name : str
        Its name; empty for that of ``[operation]``, which has none.
    operation : Operation
        Misalignment, speed, torque and axial force.
    share : float
        Share of the service time; NaN where none is given.
    """

    name: str
    operation: Operation
    share: float = math.nan

    @property
    def in_words(self) -> str:
        """``"10 deg, 500 rpm, 100 N m"``; an axial force; of several points the share of the time if it is given."""
        at = self.operation
        words = "" if isinstance(at, OperationOfLinkage) else f"{math.degrees(at.alpha):.4g} deg, "
        words += f"{at.speed * 30 / math.pi:.4g} rpm, {at.torque:.4g} N m"
        words += f", axial force {at.axial_force:.4g} N" if at.axial_force else ""
        for name, given in (("speed", at.speed_orders), ("torque", at.torque_orders)):
            words += f", {orders.in_words(given)} of {name}" if given else ""
        words += f", {at.shaft.in_words}" if isinstance(at, OperationOfShaft) else ""
        return f"{words}, {self.share:.4g} of the time" if self.name and not math.isnan(self.share) else words

    @classmethod
    def of(cls, name: str, values: Mapping[str, Any]) -> Point:
        """Return the point that has written these `values`."""
        keys = dict(values)
        share = keys.pop("share")
        for key, order in ORDERS.items():
            keys[key] = tuple(order.model_construct(**wave) for wave in keys.get(key, ()))
        kind: type[Operation] = OperationOfShaft if "shaft" in keys else Operation
        if "shaft" in keys:
            keys["shaft"] = DriveShaft.of(keys["shaft"])
        if "linkage" in keys:
            kind, keys["linkage"] = OperationOfLinkage, Linkage.of(keys["linkage"])
        return cls(name, kind.model_construct(None, **keys), math.nan if share is None else share)

    def values(self) -> dict[str, Any]:
        """JSON values of the point.

        ``alpha`` (rad), ``speed`` (rad/s), ``torque`` (N m), ``axial_force`` (N), ``share`` or null; if there are any,
        ``speed_orders`` and ``torque_orders``, each with ``n``, ``amplitude`` (rad, N m) and ``phase`` (rad), and
        ``shaft`` or ``linkage`` with its keys in SI units; of a linkage neither ``alpha`` nor ``axial_force``.
        """
        values = self.operation.model_dump()
        values = {key: value for key, value in values.items() if key not in ORDERS or value}
        return values | {"share": None if math.isnan(self.share) else self.share}


def check_name(name: str) -> str:
    """Refuse what cannot be the name of a point, as a `PydanticCustomError`."""
    if not _NAME.fullmatch(name):
        raise refuse("{name} is not a name", "use letters, digits, - and _, a letter first", "name")
    return name


class PointEntry(Operation):
    """One of several operating points that all joints are simulated at."""

    name: Annotated[str, AfterValidator(check_name)] = Field(examples=["cruise"])
    """name of the operating point, of several ones"""
    share: Annotated[units.Number | None, Field(gt=0, le=1)] = Field(default=None, examples=["60 %"])
    """share of the service time, for lives and fatigue; given for all points or for none"""
    alpha2: Annotated[units.Angle, AfterValidator(check_misalignment)] | None = Field(default=None, examples=["7 deg"])
    """misalignment of joint 2 of a drive shaft at this point, in place of `shaft.alpha`"""


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

    _split = model_validator(mode="before")(orders.split)


class DrivenPointEntry(DrivenPoint):
    """One of several operating points of a linkage."""

    name: Annotated[str, AfterValidator(check_name)] = Field(examples=["open"])
    """name of the operating point"""
    share: Annotated[units.Number | None, Field(gt=0, le=1)] = Field(default=None, examples=["60 %"])
    """share of the service time, for fatigue; given for all points or for none"""


def read(file: Reading) -> tuple[Point, ...]:
    """Read ``[operation]`` or ``[[operation]]``; empty if there are faults."""
    section, before = file.data.get("operation"), len(file.faults)
    points: list[Point] = []
    if not isinstance(section, list):
        with gather(file.faults):
            points.append(Point("", operation(file), 1.0))
        return tuple(points)
    for number, item in enumerate(section):
        with gather(file.faults):
            model: type[PointEntry | DrivenPointEntry] = PointEntry if file.linkage is None else DrivenPointEntry
            entry = file.model(model, item, "operation", number)
            if entry.name in [point.name for point in points]:
                found = f"a point {entry.name!r} exists already"
                file.fault(f"operation[{number}].name", found, "give each point its own name")
            second = getattr(entry, "alpha2", None)
            of_point = _of_mechanism(file, entry, second)
            if second is not None and file.data.get("shaft") is None:
                file.fault(
                    f"operation[{number}].alpha2", "has no effect: there is one joint", "add [shaft], or remove it"
                )
            points.append(Point(entry.name, of_point, math.nan if entry.share is None else entry.share))
    if not section:
        file.fault("operation", "has no operating point", "add one: [operation]")
    elif len(file.faults) == before:
        _note_shares(file, points)
    return tuple(points) if len(file.faults) == before else ()


def operation(file: Reading) -> Operation:
    """Read ``[operation]``, the only operating point.

    Raises
    ------
    InputError
        With its faults.
    """
    if "operation" not in file.data:
        raise input_error(f"{file.place}: operation", "missing table", "add [operation]")
    model: type[Operation | DrivenPoint] = Operation if file.linkage is None else DrivenPoint
    return _of_mechanism(file, file.model(model, file.data["operation"], "operation"))


def _of_mechanism(file: Reading, read: Operation | DrivenPoint, second: float | None = None) -> Operation:
    """Operating point of the mechanism of the file; of ``[shaft]`` with joint 2 and its misalignment at this point."""
    if file.linkage is not None:
        own = {key: getattr(read, key) for key in DrivenPoint.model_fields}
        if (read.torque or read.torque_orders) and not file.linkage.loaded:
            found, remedy = "has no effect: no member is loaded", 'write mechanism.loaded = "MEMBER", or remove it'
            raise input_error(f"{file.place}: operation.torque", found, remedy)
        return OperationOfLinkage.model_construct(None, **own, linkage=file.linkage)
    values = {key: getattr(read, key) for key in Operation.model_fields}
    if file.shaft is None:
        return Operation.model_construct(**values)
    shaft = file.shaft if second is None else file.shaft.model_copy(update={"alpha": second})
    return OperationOfShaft.model_construct(**values, shaft=shaft)


def _note_shares(file: Reading, points: Sequence[Point]) -> None:
    """Note shares of the time that are given for some points only, or whose sum is not 1."""
    lacking = [number for number, point in enumerate(points) if math.isnan(point.share)]
    total = sum(point.share for point in points)
    if not lacking and abs(total - 1.0) > 1e-6:
        file.fault("operation", f"shares of the time sum to {total:.6g}", "give shares whose sum is 1")
    for number in lacking if len(lacking) < len(points) else []:
        remedy = "give all operating points their share of the time, or none"
        file.fault(f"operation[{number}].share", "missing key", remedy)


def names_of(selection: str, names: Sequence[str], place: str) -> tuple[str, ...]:
    """Points that a selection such as ``"cruise+start"`` names, in the order of `names`.

    Parameters
    ----------
    selection : str
        Names of points, with ``+`` between them; empty for all.
    names : sequence of str
        All points.
    place : str
        Place shown in faults.

    Raises
    ------
    InputError
        When a point does not exist.
    """
    wanted = [name.strip() for name in selection.split("+")] if selection else list(names)
    unknown = [name for name in wanted if name not in names]
    if unknown and not any(names):
        found, remedy = f"no operating point {unknown[0]!r}: there is one, without a name", "leave the point out"
        raise input_error(place, found, remedy)
    if unknown:
        raise InputError([Fault(place, f"no operating point {n!r}", did_you_mean(n, list(names))) for n in unknown])
    return tuple(name for name in names if name in wanted)


def only_one(name: str, names: Sequence[str], place: str) -> None:
    """Refuse what is not the name of one point.

    Raises
    ------
    InputError
        When there is no such point, or `name` selects several.
    """
    if name not in names:
        names_of(name, names, place)
        found = f"{name!r} is no single operating point" if name else "has several operating points"
        raise input_error(place, found, f"give one of them: --point {names[0]}")


def limits_at(limits: Mapping[str, float], chosen: Sequence[str], names: Sequence[str]) -> dict[str, float]:
    """Limits that hold where only some of the operating points are looked at.

    Parameters
    ----------
    limits : mapping
        Limit by load, ``cross1.F`` at all points, ``cross1.F at cruise``.
    chosen : sequence of str
        The points that are looked at.
    names : sequence of str
        All points.

    Returns
    -------
    dict
        A limit that covers all the chosen points has the plain name of its load, the smallest if there are several;
        one that covers some of them keeps its name; others are left out.
    """
    at_points: dict[str, float] = {}
    for key, value in limits.items():
        load, selection = loads.split(key)
        where = set(names_of(selection, names, "limits"))
        if where >= set(chosen):
            at_points[load] = min(value, at_points.get(load, value))
        elif where < set(chosen):
            at_points[key] = value
    return at_points


def at(load: str, chosen: Iterable[str], names: Sequence[str]) -> str:
    """Name of a load at some points: ``"cross1.F at cruise"``; that of the load where all points are chosen."""
    points = list(chosen)
    selection = "" if len(points) == len(names) else "+".join(points)
    return f"{load}{loads.AT}{selection}" if selection else load
