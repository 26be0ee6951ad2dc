"""Linkages of the reference: mechanisms whose members move by Fourier series, and their parameters.

A lump that is a member itself has the member's name; pins and eyes are held by it, or by a shaft with its name.
"""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.conftest import REFERENCE
from tests.support.held import held
from tolstat import joint as joints
from tolstat.common.mechanism import (
    DRIVEN,
    GENERAL,
    HELD,
    OBLIQUE,
    SERIES,
    Bushing,
    Face,
    Hinge,
    Lump,
    Mechanism,
    Member,
    Pair,
    Shaft,
)
from tolstat.common.parameters import numbers
from tolstat.common.tables import blank_params

Array = NDArray[np.float64]
WAVES = 24
ACTUATOR = 1e9
"""Stiffness by which the turn of a flap is prescribed, N m/rad."""
ENDS = {"outer": 1, "inner": -1}
PARENTS = {
    "hinge": {"ground": "", "flap": "ground"},
    "fourbar": {"ground": "", "crank": "ground", "coupler": "crank", "rocker": "ground"},
    "cranks": {"ground": "", "crank1": "ground", "crank2": "ground", "crank3": "ground", "plate": "crank1"},
    "bennett": {"ground": "", "crank": "ground", "coupler": "crank", "follower": "ground"},
}


@cache
def cases() -> dict[str, dict[str, Any]]:
    """Linkages by name, and what all have in common by the name ``common``."""
    found = json.loads((REFERENCE / "linkages.json").read_text(encoding="utf-8"))
    return {case["name"]: case for case in found["cases"]} | {"common": found["common"]}


def reference(name: str) -> dict[str, Array]:
    """What the reference has of a linkage, see tests/reference/README.md."""
    with np.load(REFERENCE / "linkages.npz") as file:
        return {key.partition("__")[2]: file[key] for key in file.files if key.startswith(f"{name}__")}


def angle_of(case: dict[str, Any], member: str, theta: Array) -> Array:
    """Angle of a member about its z in its parent at the input angles `theta`, continuous."""
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


def series(angle: Array) -> tuple[float, float, Array]:
    """Constant, turns and factors of cosine and sine of an angle at equally spaced input angles of one revolution."""
    n = len(angle)
    turns = round((angle[-1] - angle[0]) / (2 * np.pi))
    theta = 2 * np.pi * np.arange(n) / n
    spectrum = np.fft.rfft(angle - turns * theta) / n
    return spectrum[0].real, turns, np.stack([2 * spectrum[1:].real, -2 * spectrum[1:].imag], axis=1)[:WAVES]


def mount_of(case: dict[str, Any], member: str) -> tuple[Array, Array]:
    """Axes, by columns, and origin of a member in its parent at the angle 0."""

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
    places = {"crank2": case["pairs"].get("ground2"), "crank3": case["pairs"].get("ground3")}
    if member == "plate":
        return np.eye(3), np.array(case["pairs"]["plate1"]["pin"]["point_m"])
    return np.eye(3), np.array(places[member]["pin"]["point_m"]) if places.get(member) else np.zeros(3)


def mechanism_of(name: str) -> Mechanism:
    """The mechanism of a reference linkage; hinges and pairs have one name."""
    case = cases()[name]
    free = [member for member, of in case["members"].items() if not of.get("prescribed")]
    loaded = [member for member in free if "z" in case["members"][member]["load_torque"]]
    members, pairs = PARENTS[case["kind"]], case["pairs"]
    motion = {"ground": HELD, "crank": DRIVEN, "crank1": DRIVEN, "flap": DRIVEN}
    five = [member for member in free if case["members"][member]["free"].startswith("five")]
    return Mechanism(
        name,
        members=tuple(Member(one, motion.get(one, SERIES), parent=parent) for one, parent in members.items()),
        lumps=(
            *(Lump(f"{pair}.pin", of["pin"]["member"], f"{pair}.pin", OBLIQUE) for pair, of in pairs.items()),
            *(Lump(f"{pair}.eye", of["eye"]["member"], f"{pair}.eye", OBLIQUE) for pair, of in pairs.items()),
            *(Lump(member, member, member, OBLIQUE) for member in free),
        ),
        shafts=tuple(
            Shaft(f"shaft of {member}" if member in five else member, member)
            for member in members
            if member not in free or member in five
        ),
        bushings=(
            *(
                Bushing(f"{pair}.{side}", f"{pair}.{side}", of[side]["member"], f"{pair}.{side}", side)
                for pair, of in pairs.items()
                for side in ("pin", "eye")
            ),
            *(
                Bushing(f"turn of {member}", member, f"shaft of {member}", f"turn of {member}", "turn")
                for member in five
            ),
        ),
        hinges=tuple(Hinge(pair, of["pin"]["member"], of["eye"]["member"], GENERAL) for pair, of in pairs.items()),
        pairs=tuple(Pair(f"{pair}.pin", f"{pair}.eye", pair) for pair in pairs),
        faces=tuple(Face(f"{pair}.{side}", f"{pair}.pin", end) for pair in pairs for side, end in ENDS.items()),
        friction=case["friction"] is not None,
        waves=WAVES,
        loaded=loaded[0] if loaded else "",
    )


def parameters(name: str, mechanism: Mechanism) -> np.recarray[Any, Any]:
    """Parameters of a reference linkage, (1,)."""
    case, common = cases()[name], cases()["common"]
    cardan, _ = held(thrust={"end_play": "0.05 mm", "k": "1e8 N/m"})
    params = blank_params(1, mechanism).view(np.recarray)
    row, own = params[0], numbers(mechanism)
    for field in ("c_d", "c_t", "delta_d", "n_stations", "needle_b"):
        row[field] = cardan[field][0]
    for field in ("s", "k1", "k2", "k3", "weight"):
        row[f"station_{field}"] = cardan[f"station_{field}"][0]
    row.omega, row.torque, row.R = case["speed_rpm"] * np.pi / 30, case["load_torque_Nm"], 0.2
    row.weight[:] = case["weight_m_s2"]
    theta = 2 * np.pi * np.arange(720) / 720
    for i, member in enumerate(mechanism.members):
        row.mount[i], row.pivot[i] = mount_of(case, member.name)
        if member.motion == SERIES:
            row.angle[i, 0], row.angle[i, 1], row.wave[i] = series(angle_of(case, member.name, theta))
    for i, lump in enumerate(mechanism.lumps):
        kind = own["lump_kind"][i]
        pair, _, side = lump.name.partition(".")
        if not side:
            of = case["members"][lump.name]
            row.triad[i], row.mass[kind], row.inertia[kind] = np.eye(3), of["mass_kg"], of["inertia_kg_m2"]
            row.at[kind] = of["mass_centre_m"]
            continue
        of = case["pairs"][pair][side]
        e, t = np.array(of["e"]), np.array(of["t"])
        row.triad[i] = e, t, np.cross(e, t)
        row.mass[kind], row.inertia[kind] = common[side]["mass_kg"], common[side]["inertia_kg_m2"]
        row.at[kind] = row.triad[i] @ of["point_m"]
    lumps = {lump.name: i for i, lump in enumerate(mechanism.lumps)}
    for bushing in mechanism.bushings:
        kind = mechanism.bushing_kinds.index(bushing.kind)
        if bushing.group == "turn":
            row.k[kind, 5], row.c[kind, 5] = ACTUATOR, 0.08 * np.sqrt(3 * ACTUATOR)
            row.marker[kind, 1] = row.at[own["lump_kind"][lumps[bushing.lump]]]
            continue
        side, lump = bushing.lump.rpartition(".")[2], lumps[bushing.lump]
        of, xi = common[side], 2 * common["damping_ratio"]
        row.k[kind] = of["K"]
        row.c[kind] = xi * np.sqrt(np.array(of["K"]) * np.array([of["mass_kg"]] * 3 + of["inertia_kg_m2"]))
        place = row.triad[lump].T @ row.at[own["lump_kind"][lump]]
        base = np.zeros(3)
        if bushing.base in lumps:
            base = row.at[own["lump_kind"][lumps[bushing.base]]]
        row.marker[kind, 1] = row.triad[lump] @ (place - base)
    half = 0.5 * joints.load("cirelli2021", {}, "case.toml").contact.z
    for i, pair in enumerate(mechanism.pairs):
        of = case["pairs"][pair.hinge]
        row.clearance[i] = of["clearance_m"]
        for side, lump in (("pin", pair.pin), ("eye", pair.hole)):
            e, t, z = row.triad[lumps[lump]]
            errors = np.array(of[side]["errors_e_t_z_m_rad"])
            turned = errors[4] * t + errors[5] * z
            angle = np.linalg.norm(turned)
            axis = np.cos(angle) * e + np.sinc(angle / np.pi) * np.cross(turned, e)
            name_of = {"pin": "pin", "eye": "hole"}[side]
            row[f"{name_of}_point"][i], row[f"{name_of}_axis"][i] = errors[:3] @ row.triad[lumps[lump]], axis
    for i, face in enumerate(mechanism.faces):
        row.face_at[i] = np.multiply(face.end, (half, half + 0.5 * common["thrust"]["end_play_m"]))
    row.face_k, row.face_c = common["thrust"]["k"], common["thrust"]["c"]
    if case["friction"]:
        row.mu, row.friction_radius = case["friction"]["mu"], case["friction"]["radius_m"]
        row.mu_ratio, row.slip_speed = 1.0, case["friction"]["slip_speed_m_s"]
    return params
