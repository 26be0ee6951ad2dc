"""Operating point of a joint, drive shaft or linkage, and what is simulated there."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from tolstat.common import units
from tolstat.common.cardan import CARDAN, MECHANISMS, named
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import Strict
from tolstat.joint import linked, orders
from tolstat.joint.linkage import Linkage
from tolstat.joint.model import Joint
from tolstat.joint.sections import Unbalance
from tolstat.joint.shaft import DriveShaft, check_misalignment


class Operation(Strict):
    """Operating point of the joint."""

    alpha: Annotated[units.Angle, AfterValidator(check_misalignment)] = Field(examples=["15 deg"])
    """misalignment of the shafts, below 90 deg"""
    speed: Annotated[units.Speed, AfterValidator(units.not_zero)] = Field(examples=["500 rpm"])
    """speed of the input shaft, with orders { mean, orders }, or measured { file }; negative: turns the other way"""
    torque: units.Torque = Field(examples=["100 N*m"])
    """resisting torque on the output shaft, with orders { mean, orders }, or measured { file }; negative: drives the
    output shaft"""
    axial_force: units.Force = Field(default=0.0, examples=["500 N"])
    """axial force on an output shaft that is not rigid along its axis; above zero: pulls it away from the joint"""
    speed_orders: Annotated[orders.SpeedOrders, Field(alias="speed.orders")] = ()
    """orders of the speed, { n, amplitude, phase } each"""
    torque_orders: Annotated[orders.TorqueOrders, Field(alias="torque.orders")] = ()
    """orders of the resisting torque, { n, amplitude, phase } each"""

    _split = model_validator(mode="before")(orders.split)

    @property
    def alphas(self) -> tuple[float, ...]:
        """Misalignment of each joint (rad)."""
        return (self.alpha,)

    @property
    def joint2(self) -> Joint | None:
        """Joint 2 of a drive shaft, if it is another than joint 1."""
        return None

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema of the table as a file writes it."""
        schema = super().__get_pydantic_json_schema__(core, handler)
        orders.join_schemas(handler.resolve_ref_schema(schema)["properties"])
        return schema


class OperationOfShaft(Operation):
    """Operating point of a drive shaft; `alpha` is that of joint 1."""

    shaft: DriveShaft
    """joint 2 and the tubes"""

    @property
    def alphas(self) -> tuple[float, ...]:
        """See `Operation.alphas`."""
        return self.alpha, self.shaft.alpha

    @property
    def joint2(self) -> Joint | None:
        """See `Operation.joint2`."""
        return self.shaft.joint2


class OperationOfLinkage(Operation):
    """Operating point of a linkage: speed of its drive, in periods of a swing that turns to and fro, and torque."""

    alpha: float = Field(default=0.0, exclude=True)
    axial_force: float = Field(default=0.0, exclude=True)
    torque: units.Torque = Field(default=0.0, examples=["100 N*m"])
    """torque on the member that is `loaded`, against its axis"""
    linkage: Linkage
    """the linkage"""

    @property
    def alphas(self) -> tuple[float, ...]:
        """See `Operation.alphas`."""
        return ()


MEANS = ("alpha", "speed", "torque", "axial_force")
"""Numbers of an operating point; errors of it are deviations from them."""
SPLINE = "shaft.spline"
"""Error of what has a `spline.Spline`: its axial force as a share of the largest one, from -1 to 1."""


def joints_of(joint: Joint, operation: Operation) -> tuple[Joint, ...]:
    """Joints by the order of `Mechanism.pair_kinds`: `joint`, both of a drive shaft, or that of each pair."""
    if isinstance(operation, OperationOfLinkage):
        return tuple(linked.joint_of(pair, joint) for pair in operation.linkage.pair.values())
    shaft = shaft_of(operation)
    return (joint,) if shaft is None else (joint, operation.joint2 or joint)


def having(name: str, joint: Joint, operation: Operation) -> Joint:
    """Joint of `joints_of` that a name is about, ``joint2.pin1.offset_t``, ``B_eye.tilt_t``; `joint` of other names."""
    first = name.partition(".")[0]
    if isinstance(operation, OperationOfLinkage):
        pair = operation.linkage.pair.get(first.rpartition("_")[0])
        return joint if pair is None else linked.joint_of(pair, joint)
    return joints_of(joint, operation)[-1] if first == "joint2" else joint


def mechanism_of(joint: Joint, operation: Operation) -> Mechanism:
    """What is simulated: a joint, a drive shaft or a linkage, with the parts that its joints have."""
    if isinstance(operation, OperationOfLinkage):
        return linked.linkage_mechanism(operation.linkage, joint.parts)
    shaft = shaft_of(operation)
    return MECHANISMS[named(CARDAN if shaft is None else shaft.mechanism, parts_of(joint, operation))]


def parts_of(joint: Joint, operation: Operation) -> set[str]:
    """Those of `cardan.PARTS` of what is simulated."""
    shaft = shaft_of(operation)
    return {*joint.parts} if shaft is None else shaft.parts(joint)


def unbalances(joint: Joint, operation: Operation) -> dict[str, tuple[Unbalance | None, float | None]]:
    """Unbalance of each body that may have one, and the mass of the body (kg)."""
    if isinstance(operation, OperationOfLinkage):
        return {}
    shaft, last = shaft_of(operation), joints_of(joint, operation)[-1].shaft
    tubes = {} if shaft is None else shaft.tubes
    return {name: (tube.unbalance, tube.mass) for name, tube in tubes.items()} | {"output": (last.unbalance, last.mass)}


def shaft_of(operation: Operation) -> DriveShaft | None:
    """Drive shaft of an operating point; None of that of a joint."""
    return operation.shaft if isinstance(operation, OperationOfShaft) else None
