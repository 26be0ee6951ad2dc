"""Speed and torque over a revolution: the orders that a study gives.

Orders are waves over the mean input angle, whole numbers of them a revolution. The phase omega t is the mean input
angle (docs/model.md, "Drive and load"):

    theta = phase + sum a_n sin(n phase + p_n)          T_r = T + sum b_n cos(n phase + q_n)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from tolstat.common import units
from tolstat.common.parameters import MAX_ORDERS
from tolstat.common.strict import Strict, refuse
from tolstat.joint.material import Array

MAX_GIVEN = 16
"""Maximum number of orders of the speed, and of the torque, that a study gives."""


def _check_whole(n: object) -> object:
    if isinstance(n, float) and n != int(n):
        found = f"order {n:g} does not repeat after one revolution, which results are of"
        raise refuse(found, "give whole orders; leave half orders of an engine out")
    return n


class Order(Strict):
    """One order: its number, and the phase of its wave."""

    n: Annotated[int, BeforeValidator(_check_whole)] = Field(strict=True, ge=1, examples=[2])
    """waves in a revolution of the input shaft"""
    phase: units.Angle = Field(default=0.0, examples=["30 deg"])
    """phase of the wave where the mean input angle is zero"""


class TorqueOrder(Order):
    """Order of the resisting torque, amplitude cos(n phase + q)."""

    amplitude: Annotated[units.Torque, units.POSITIVE] = Field(examples=["40 N*m"])
    """amplitude of the resisting torque"""


class SpeedOrder(Order):
    """Order of the input angle, amplitude sin(n phase + p), rad."""

    amplitude: Annotated[units.Angle, units.POSITIVE] = Field(examples=["1 deg"])
    """amplitude of the input angle, or of the speed as a share of it: "2 %" """

    @model_validator(mode="before")
    @classmethod
    def _read_share(cls, data: Any) -> Any:
        """Turn a share of the speed into the amplitude of the angle, share / n."""
        if not (isinstance(data, dict) and type(n := data.get("n")) is int and n > 0):
            return data
        try:
            share = units.to_si(data.get("amplitude"), "1")
        except PydanticCustomError:  # an angle, or a fault that the field reports
            return data
        return data | {"amplitude": f"{share / n!r} rad"}


def _check_numbers(orders: Sequence[Order]) -> Sequence[Order]:
    """Refuse an order that is given twice, as a `PydanticCustomError`."""
    numbers = [order.n for order in orders]
    twice = next((n for n in numbers if numbers.count(n) > 1), None)
    if twice is not None:
        raise refuse(f"order {twice} is given twice", "give each order once")
    return orders


def _check_turning(orders: Sequence[SpeedOrder]) -> Sequence[SpeedOrder]:
    """Refuse orders with which the input shaft stops: sum n a_n of 1 and more."""
    total = sum(order.n * order.amplitude for order in orders)
    if not total < 1:
        raise refuse(f"the speed swings by up to {100 * total:.3g} % of its mean", "give orders that swing by less")
    return orders


SpeedOrders = Annotated[
    tuple[SpeedOrder, ...],
    AfterValidator(_check_numbers),
    AfterValidator(_check_turning),
    Field(max_length=MAX_GIVEN),
]
TorqueOrders = Annotated[
    tuple[TorqueOrder, ...],
    AfterValidator(_check_numbers),
    Field(max_length=MAX_GIVEN),
]


def split(data: Any) -> Any:
    """Separate mean and orders of an operating point's ``speed = { mean = ..., orders = [...] }``, and of its torque.

    Raises
    ------
    pydantic_core.PydanticCustomError
        When such a table has another key, or no mean.
    """
    if not isinstance(data, dict):
        return data
    separated = dict(data)
    for key in ("speed", "torque"):
        if not isinstance(table := data.get(key), dict):
            continue
        if unknown := set(table) - {"mean", "orders"}:
            found = f"{key} has an unknown key {min(unknown)!r}"
            raise refuse(found, f"write {key} = {{ mean = ..., orders = [...] }}")
        if "mean" not in table:
            raise refuse(f"{key} has no mean", f"write {key} = {{ mean = ..., orders = [...] }}")
        separated[key] = table["mean"]
        if "orders" in table:
            separated[f"{key}.orders"] = table["orders"]
    return separated


def join_schemas(properties: dict[str, Any]) -> None:
    """Put orders into the JSON schemas of speed and torque, which are a quantity or a table."""
    for key in ("speed", "torque"):
        waves = properties.pop(f"{key}.orders")
        quantity = {name: value for name, value in properties[key].items() if name in ("type", "pattern")}
        table = {"type": "object", "required": ["mean"], "additionalProperties": False}
        table |= {"properties": {"mean": quantity, "orders": waves}}
        signal = {"type": "string", "description": "measured signal, CSV", "examples": ["engine.csv"]}
        file = {"type": "object", "required": ["file"], "additionalProperties": False, "properties": {"file": signal}}
        properties[key] = {name: value for name, value in properties[key].items() if name not in quantity}
        properties[key] |= {"anyOf": [quantity, table, file]}


def parameters(
    speed: Sequence[SpeedOrder], torque: Sequence[TorqueOrder], speed_swing: Array, torque_swing: Array
) -> dict[str, Any]:
    """Orders of joints as the kernel takes them.

    Parameters
    ----------
    speed, torque : sequence of SpeedOrder, sequence of TorqueOrder
        Orders of the operating point.
    speed_swing, torque_swing : ndarray, shape (n,)
        Factors of each joint on the amplitudes.

    Returns
    -------
    dict
        The fields ``n_orders`` to ``torque_order`` of PARAM; empty without orders.
    """
    numbers = sorted({order.n for order in (*speed, *torque)})
    if not numbers:
        return {}
    waves = {name: np.zeros((len(speed_swing), MAX_ORDERS, 2)) for name in ("speed_order", "torque_order")}
    for order in speed:
        of_wave = order.amplitude * np.array([np.sin(order.phase), np.cos(order.phase)])
        waves["speed_order"][:, numbers.index(order.n)] = np.multiply.outer(speed_swing, of_wave)
    for wave in torque:
        of_wave = wave.amplitude * np.array([np.cos(wave.phase), -np.sin(wave.phase)])
        waves["torque_order"][:, numbers.index(wave.n)] = np.multiply.outer(torque_swing, of_wave)
    padded = np.pad(np.array(numbers, float), (0, MAX_ORDERS - len(numbers)))
    return {"n_orders": len(numbers), "order": padded} | waves


def in_words(orders: Sequence[Order]) -> str:
    """``"orders 2 and 4"``."""
    numbers = [str(order.n) for order in orders]
    return f"order {numbers[0]}" if len(numbers) == 1 else f"orders {', '.join(numbers[:-1])} and {numbers[-1]}"
