"""Operating points of a study: one in ``[operation]``, or several in ``[[operation]]``, each with a name."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import AfterValidator, Field

from tolstat.common import loads, strict, units
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import did_you_mean, refuse
from tolstat.joint import Operation, orders
from tolstat.joint.orders import Partner

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
        words = f"{math.degrees(at.alpha):.4g} deg, {at.speed * 30 / math.pi:.4g} rpm, {at.torque:.4g} N m"
        words += f", axial force {at.axial_force:.4g} N" if at.axial_force else ""
        for name, given in (("speed", at.speed_orders), ("torque", at.torque_orders)):
            words += f", {orders.in_words(given)} of {name}" if given else ""
        words += f", {at.partner.in_words}" if at.partner else ""
        return f"{words}, {self.share:.4g} of the time" if self.name and not math.isnan(self.share) else words

    @classmethod
    def of(cls, name: str, values: Mapping[str, Any]) -> Point:
        """Return the point that has written these `values`."""
        keys = dict(values)
        share = keys.pop("share")
        for key, order in ORDERS.items():
            keys[key] = tuple(order.model_construct(**wave) for wave in keys.get(key, ()))
        keys["partner"] = Partner.model_construct(**keys["partner"]) if "partner" in keys else None
        return cls(name, Operation.model_construct(None, **keys), math.nan if share is None else share)

    def values(self) -> dict[str, Any]:
        """JSON values of the point.

        ``alpha`` (rad), ``speed`` (rad/s), ``torque`` (N m), ``axial_force`` (N), ``share`` or null; if there are any,
        ``speed_orders`` and ``torque_orders``, each with ``n``, ``amplitude`` (rad, N m) and ``phase`` (rad), and
        ``partner`` with its keys in SI units.
        """
        values = self.operation.model_dump()
        values = {key: value for key, value in values.items() if key not in (*ORDERS, "partner") or value}
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


def read(section: Any, place: str) -> tuple[Point, ...]:
    """Read ``[operation]`` or ``[[operation]]``.

    Raises
    ------
    InputError
        With every fault.
    """
    if not isinstance(section, list):
        return (Point("", strict.validate(Operation, section, place, prefix=("operation",)), 1.0),)
    faults: list[Fault] = []
    points: list[Point] = []
    for number, item in enumerate(section):
        try:
            entry = strict.validate(PointEntry, item, place, prefix=("operation", number))
        except InputError as error:
            faults += error.faults
            continue
        if entry.name in [point.name for point in points]:
            where = f"{place}: operation[{number}].name"
            faults.append(Fault(where, f"a point {entry.name!r} exists already", "give each point its own name"))
        operation = Operation.model_construct(**{key: getattr(entry, key) for key in Operation.model_fields})
        points.append(Point(entry.name, operation, math.nan if entry.share is None else entry.share))
    if not section:
        faults.append(Fault(f"{place}: operation", "has no operating point", "add one: [operation]"))
    elif not faults:
        faults += _faults_of_shares(points, place)
    if faults:
        raise InputError(faults)
    return tuple(points)


def _faults_of_shares(points: Sequence[Point], place: str) -> list[Fault]:
    lacking = [number for number, point in enumerate(points) if math.isnan(point.share)]
    if lacking and len(lacking) < len(points):
        remedy = "give all operating points their share of the time, or none"
        return [Fault(f"{place}: operation[{number}].share", "missing key", remedy) for number in lacking]
    total = sum(point.share for point in points)
    if not lacking and abs(total - 1.0) > 1e-6:
        return [Fault(f"{place}: operation", f"shares of the time sum to {total:.6g}", "give shares whose sum is 1")]
    return []


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
        raise InputError([Fault(place, found, remedy)])
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
        raise InputError([Fault(place, found, f"give one of them: --point {names[0]}")])


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
