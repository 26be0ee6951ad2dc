"""Linkages of the reference, as a study describes them, and the table of parameters that this gives."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.conftest import REFERENCE
from tolstat import joint as joints
from tolstat.common.mechanism import Mechanism
from tolstat.joint.linkage import ForceOn, Linkage
from tolstat.joint.linked import frames
from tolstat.joint.operation import OperationOfLinkage

Array = NDArray[np.float64]
DRIVEN = {"hinge": "flap", "fourbar": "crank", "cranks": "crank1", "bennett": "crank"}
PARENTS = {"plate": "crank1", "coupler": "crank"}
"""Members that the reference has in another one than the ground."""
ERRORS = ("offset_e", "offset_t", "offset_z", "", "tilt_t", "tilt_z")


@cache
def cases() -> dict[str, dict[str, Any]]:
    """Linkages by name, and what all have in common by the name ``common``."""
    found = json.loads((REFERENCE / "linkages.json").read_text(encoding="utf-8"))
    return {case["name"]: case for case in found["cases"]} | {"common": found["common"]}


@cache
def reference(name: str) -> dict[str, Array]:
    """What the reference has of a linkage, see tests/reference/README.md."""
    with np.load(REFERENCE / "linkages.npz") as file:
        return {key.partition("__")[2]: file[key] for key in file.files if key.startswith(f"{name}__")}


def angle_of(case: dict[str, Any], member: str, theta: Array) -> Array:
    """Angle of a member about its z in its parent at the input angles `theta`, continuous, by closed forms.

    Four-bar: triangle of coupler and rocker (Freudenstein 1955); Bennett (1903): the tangents of the half angles
    have a constant product.
    """
    a, b, c, d = case["parameters"]
    if case["kind"] == "fourbar":
        x, y = d - a * np.cos(theta), -a * np.sin(theta)
        length = np.hypot(x, y)
        inner = np.arccos((b * b + length**2 - c * c) / (2 * b * length))
        coupler = np.unwrap(np.arctan2(y, x) + inner)
        joint = np.stack([a * np.cos(theta) + b * np.cos(coupler), a * np.sin(theta) + b * np.sin(coupler)])
        return coupler - theta if member == "coupler" else np.unwrap(np.arctan2(joint[1], joint[0] - d))
    if case["kind"] == "bennett":
        factor = np.sin(0.5 * (d + c)) / np.sin(0.5 * (d - c))
        return np.unwrap(2 * np.arctan2(factor * np.cos(0.5 * theta), np.sin(0.5 * theta)))
    return -theta if member == "plate" else theta


def _mount(case: dict[str, Any], member: str) -> tuple[Array, Array]:
    """Axes, by columns, and origin of a member in its parent at the angle 0 about its z."""

    def about_x(angle: float) -> Array:
        return np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])

    a, b, c, d = case["parameters"]
    if case["kind"] == "fourbar":
        return np.eye(3), {"coupler": np.array([a, 0, 0]), "rocker": np.array([d, 0, 0])}.get(member, np.zeros(3))
    if case["kind"] == "bennett":
        places = {
            "coupler": (about_x(c), np.array([a, 0, 0])),
            "follower": (about_x(-d), np.array([-b, 0, 0])),
        }
        return places.get(member, (np.eye(3), np.zeros(3)))
    pairs = {"crank2": "ground2", "crank3": "ground3", "plate": "plate1"}
    return np.eye(3), np.array(case["pairs"][pairs[member]]["pin"]["point_m"] if member in pairs else np.zeros(3))


def pose(case: dict[str, Any], member: str, theta: float = 0.0) -> tuple[Array, Array]:
    """Axes, by columns, and origin of a member of the reference in ground axes at an input angle."""
    axes, origin = np.eye(3), np.zeros(3)
    for one in ("", member) if member not in PARENTS else (PARENTS[member], member):
        if one in ("", "ground"):
            continue
        mount, place = _mount(case, one)
        angle = theta if one == DRIVEN[case["kind"]] else float(angle_of(case, one, np.array([theta, theta + 1e-9]))[0])
        cosine, sine = np.cos(angle), np.sin(angle)
        turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
        axes, origin = axes @ mount @ turn, origin + axes @ place
    return axes, origin


def _place(point: Array) -> list[str]:
    return [f"{float(x)!r} m" for x in point]


@cache
def linkage_of(name: str) -> Linkage:
    """Linkage of the reference."""
    case = cases()[name]
    at = {member: pose(case, member) for member in case["members"]}
    free = {member: of for member, of in case["members"].items() if not of.get("prescribed")}
    members = {
        member: {
            "mass": f"{of['mass_kg']} kg",
            "centre": _place(at[member][1] + at[member][0] @ of["mass_centre_m"]),
            "inertia": [f"{x} kg*m^2" for x in of["inertia_kg_m2"]],
            "axis": list(at[member][0][:, 0]),
        }
        for member, of in free.items()
    }
    pairs = {}
    for pair, of in case["pairs"].items():
        axes, origin = at[of["pin"]["member"]]
        pairs[pair] = {side: of[side]["member"] for side in ("pin", "eye")} | {
            "point": _place(origin + axes @ of["pin"]["point_m"]),
            "axis": list(axes @ of["pin"]["e"]),
            "t": list(axes @ of["pin"]["t"]),
            "eye_t": list(at[of["eye"]["member"]][0] @ of["eye"]["t"]),
            "clearance": f"{of['clearance_m']} m",
        }
    driven = DRIVEN[case["kind"]]
    drive = {"member": driven} | ({} if driven in free else {"point": ["0 m"] * 3, "axis": [0, 0, 1]})
    loaded = [member for member in free if "z" in free[member]["load_torque"]]
    down = {"down": [0, 0, -1]} if any(case["weight_m_s2"]) else {}
    values = {"member": members, "pair": pairs, "drive": drive, "loaded": "".join(loaded), **down}
    return Linkage.model_validate(values)


def _joint(case: dict[str, Any]) -> joints.Joint:
    """Joint whose pins and arms are the pins and eyes of the reference."""
    common = cases()["common"]

    def bushing(side: str, order: tuple[str, ...]) -> dict[str, str]:
        units = ["N/m"] * 3 + ["N*m/rad"] * 3
        return {name: f"{k} {unit}" for name, k, unit in zip(order, common[side]["K"], units, strict=True)}

    bodies = {
        name: {
            "mass": f"{common[side]['mass_kg']} kg",
            "inertia": [f"{x} kg*m^2" for x in common[side]["inertia_kg_m2"]],
        }
        for name, side in (("pin", "pin"), ("arm", "eye"))
    }
    thrust = common["thrust"]
    values: dict[str, Any] = bodies | {
        "bushing": {
            "cross": bushing("pin", ("k_z", "k_x", "k_y", "k_tz", "k_bx", "k_by")),
            "fork": bushing("eye", ("k_y", "k_x", "k_z", "k_by", "k_bx", "k_tz")),
        },
        "thrust": {"end_play": f"{thrust['end_play_m']} m", "k": f"{thrust['k']} N/m"},
    }
    if case["friction"]:
        values["friction"] = {"mu": case["friction"]["mu"], "radius": f"{case['friction']['radius_m']} m"}
    return joints.load("cirelli2021", values, "case.toml")


def operation_of(name: str, pulled: bool = False) -> tuple[joints.Joint, OperationOfLinkage]:
    """Joint and operating point of a linkage of the reference, or of one whose first member forces pull, too."""
    case, linkage = cases()[name], linkage_of(name)
    speed = case["speed_rpm"] * np.pi / 30
    if pulled:
        member = next(iter(linkage.member))
        forces = {
            name: ForceOn(member=member, point=["1 mm", "20 mm", "-7 mm"], force=["30 N", "-40 N", "9 N"], turns=turns)
            for name, turns in (("follower", True), ("fixed", False))
        }
        linkage = linkage.model_copy(update={"force": forces})
    values = {"speed": speed, "torque": case["load_torque_Nm"], "linkage": linkage}
    return _joint(case), OperationOfLinkage.model_construct(None, **values)


@cache
def mechanism_of(name: str, pulled: bool = False) -> Mechanism:
    """The mechanism of a linkage of the reference."""
    return joints.mechanism_of(*operation_of(name, pulled))


def parameters(name: str, mechanism: Mechanism, pulled: bool = False) -> np.recarray[Any, Any]:
    """Parameters of a linkage of the reference, with its errors, (1,)."""
    errors = joints.nominal_errors(1, mechanism)
    for pair, of in cases()[name]["pairs"].items():
        for side in ("pin", "eye"):
            for error, value in zip(ERRORS, of[side]["errors_e_t_z_m_rad"], strict=True):
                if error:
                    errors[f"{pair}_{side}.{error}"] = value
    return joints.perturb(*operation_of(name, pulled), errors).view(np.recarray)


def name_in_reference(name: str) -> str:
    """Name of a pin, an eye or a member in the reference."""
    pair, _, side = name.rpartition("_")
    return f"{pair}.{side}" if side in ("pin", "eye") else name


def in_member(name: str, side: dict[str, Any]) -> Array:
    """Point of a pin or eye in axes of the member here."""
    axes, origin = frames(linkage_of(name).chain)[side["member"]]
    own_axes, own_origin = pose(cases()[name], side["member"])
    return np.asarray(axes.T @ (own_origin + own_axes @ side["point_m"] - origin))


def turned(name: str, member: str) -> Array:
    """What takes vectors in axes of a member of the reference to those of the member here."""
    return np.asarray(frames(linkage_of(name).chain)[member][0].T @ pose(cases()[name], member)[0])
