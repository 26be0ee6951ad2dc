"""Speed and torque over a revolution: orders that the study gives, and those of the other joint of a drive shaft.

Orders are waves over the mean input angle, whole numbers of them a revolution. The phase omega t is the mean input
angle (docs/model.md, "Drive and load"):

    theta = phase + sum a_n sin(n phase + p_n)          T_r = T + sum b_n cos(n phase + q_n)

This joint sees its partner as an ideal one (docs/drive.md, "A joint of a drive shaft"). A partner before this joint
turns its input unevenly: orders of the input angle. A partner after it loads its output unevenly: orders of the
resisting torque. Both follow from the closed form of the ideal joint, row by row, since misalignment, speed and torque
scatter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from tolstat.common import units
from tolstat.common.parameters import MAX_ORDERS
from tolstat.common.strict import Strict, refuse
from tolstat.joint import ideal
from tolstat.joint.material import Array

MAX_GIVEN = 16
"""Maximum number of orders of the speed, and of the torque, that a study gives."""
SAMPLES = 512
"""Number of angles of a revolution that waves are expanded from."""
SMALLEST = 1e-9
"""Smallest amplitude that is kept: of the angle in rad, of the torque relative to the largest order or the mean."""
MOST_TORSION = 0.05
"""Largest change of an order by torsion of the intermediate shaft, which the model leaves out."""


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


def check_misalignment(alpha: float) -> float:
    """Refuse an angle at which a joint cannot turn, as a `PydanticCustomError`."""
    if not abs(alpha) < np.pi / 2:
        raise refuse("a Cardan joint cannot turn at {alpha}", "give less than 90 deg", "alpha")
    return alpha


class Partner(Strict):
    """The other joint of the drive shaft, on the same intermediate shaft."""

    position: Literal["before", "after"] = Field(examples=["after"])
    """where the partner is: before this joint, towards the input, or after it"""
    alpha: Annotated[units.Angle, AfterValidator(check_misalignment)] = Field(examples=["12 deg"])
    """misalignment of the partner, below 90 deg"""
    offset: units.Angle = Field(default=0.0, examples=["90 deg"])
    """angle by which the fork of the intermediate shaft at its output end is turned ahead of the fork at its input end,
    less the angle between the planes of the two joints"""
    inertia: units.Inertia = Field(examples=["0.02 kg*m^2"])
    """moment of inertia behind the second joint of the shaft"""
    stiffness: units.RotaryStiffness | None = Field(default=None, examples=["2e4 N*m/rad"])
    """torsional stiffness of the intermediate shaft"""

    @property
    def in_words(self) -> str:
        """``"behind a joint of 12 deg"``."""
        side = "behind" if self.position == "before" else "before"
        turned = f", offset {math.degrees(self.offset):.4g} deg" if self.offset else ""
        return f"{side} a joint of {math.degrees(self.alpha):.4g} deg{turned}"

    def torsion(self, speed: float, n: int) -> float:
        """Relative change of order `n` by torsion of the intermediate shaft at a speed (rad/s); NaN if not known.

        x / (1 - x) with x = (n speed)^2 inertia / stiffness; infinite at and beyond resonance.
        """
        if self.stiffness is None:
            return math.nan
        x = (n * speed) ** 2 * self.inertia / self.stiffness
        return x / (1 - x) if x < 1 else math.inf

    def check_torsion(self, speed: float, n: int) -> None:
        """Refuse a shaft so soft that torsion changes orders up to `n`, as a `PydanticCustomError`."""
        if self.torsion(speed, n) > MOST_TORSION:
            assert self.stiffness is not None
            resonance = math.sqrt(self.stiffness / self.inertia) * 30 / math.pi
            found = f"order {n} is near the torsional resonance of the intermediate shaft at {resonance:.4g} rpm"
            raise refuse(found, f"give a partner.stiffness with which it changes by less than {MOST_TORSION:.0%}")


def add_partner(partner: Partner, params: NDArray[np.void]) -> None:
    """Write what a partner makes of speed and torque to joints that have the orders of the drive shaft's ends.

    Parameters
    ----------
    partner : Partner
        The other joint of the drive shaft.
    params : ndarray of PARAM, shape (n,)
        Joints; ``speed_order`` is that of the drive shaft's input, ``torque`` and ``torque_order`` those of its output,
        over the phase of its first joint. Rewritten, and of a second joint ``Js``.
    """
    phase = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    ahead = 0.5 * np.pi + partner.offset  # of the second joint's input angle, before the first joint's output angle
    if partner.position == "before":
        theta, _, _, torque = ideal.input_motion(phase - ahead, params)
        turned = ideal.output_angle(theta, partner.alpha) + ahead - phase
        params["Js"] = partner.inertia
    else:
        theta, slope, bend, torque = ideal.input_motion(phase, params)
        turned = theta - phase
        second, _, acceleration = _second_joint(partner, params, theta, slope, bend)
        torque = (torque + partner.inertia * acceleration) * second
    _expand(turned, torque, params)


def output_motion(partner: Partner, params: NDArray[np.void]) -> tuple[Array, Array]:
    """Motion of the output of a drive shaft of two ideal joints.

    Parameters
    ----------
    partner : Partner
        The second joint.
    params : ndarray of PARAM, shape (n,)
        First joints, with the orders of the input speed.

    Returns
    -------
    ratio, acceleration : ndarray, shape (n, `SAMPLES`)
        Speed relative to the mean input speed, and acceleration (rad/s^2), over the phase.
    """
    theta, slope, bend, _ = ideal.input_motion(2 * np.pi * np.arange(SAMPLES) / SAMPLES, params)
    return _second_joint(partner, params, theta, slope, bend)[1:]


def _second_joint(
    partner: Partner, params: NDArray[np.void], theta: Array, slope: Array, bend: Array
) -> tuple[Array, Array, Array]:
    """Speed ratio of the ideal joint after this one, its output speed over the mean input speed, its acceleration."""
    alpha = params["alpha"]
    ratio, steepness = ideal.speed_ratio(theta, alpha), ideal.steepness(theta, alpha)
    angle = ideal.output_angle(theta, alpha) + 0.5 * np.pi + partner.offset
    turning, bending = ratio * slope, steepness * slope**2 + ratio * bend
    second = ideal.speed_ratio(angle, partner.alpha)
    acceleration = second * bending + ideal.steepness(angle, partner.alpha) * turning**2
    return second, second * turning, params["omega"][:, None] ** 2 * acceleration


def _expand(turned: Array, torque: Array, params: NDArray[np.void]) -> None:
    """Write waves over the phase, (n, `SAMPLES`), as orders: the largest `MAX_ORDERS`; rad and N m."""
    waves = {}
    size = np.zeros(SAMPLES // 2 + 1)
    for name, values in (("speed_order", turned), ("torque_order", torque)):
        spectrum = np.fft.rfft(values, axis=1) / SAMPLES
        spectrum[:, 1:] *= 2
        waves[name] = np.stack([spectrum.real, -spectrum.imag], axis=2)
        if name == "torque_order":
            params["torque"], waves[name][:, 0] = spectrum[:, 0].real, 0.0
            spectrum = spectrum / np.maximum(np.abs(spectrum).max(axis=1, keepdims=True), np.finfo(float).tiny)
            spectrum[:, 0] = 0.0
        size = np.maximum(size, np.abs(spectrum).max(axis=0))
    largest = np.argsort(-size, kind="stable")[:MAX_ORDERS]
    numbers = np.sort(largest[size[largest] > SMALLEST])
    params["n_orders"] = len(numbers)
    params["order"] = np.pad(numbers.astype(float), (0, MAX_ORDERS - len(numbers)))
    for name, values in waves.items():
        params[name] = 0.0
        params[name][:, : len(numbers)] = values[:, numbers]
