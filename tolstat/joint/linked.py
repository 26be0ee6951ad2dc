"""The mechanism that a linkage is, and its parameters that do not depend on the errors of its pins and eyes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.mechanism import (
    DRIVEN,
    GENERAL,
    HELD,
    OBLIQUE,
    SERIES,
    Bushing,
    Face,
    Force,
    Hinge,
    Lump,
    Mechanism,
    Member,
    Pair,
    Shaft,
)
from tolstat.joint import material
from tolstat.joint.chain import GROUND, Chain
from tolstat.joint.linkage import ENDS, GRAVITY, Linkage, PairOf, triad, unit
from tolstat.joint.material import Array
from tolstat.joint.model import Joint, merged
from tolstat.joint.reading import with_own

Table = NDArray[np.void]
LINKAGE = "linkage"
"""Name of all mechanisms that a file describes, with those of `PARTS` that the joint gives them after it."""
PARTS = ("thrust", "friction")
"""What a linkage may have beside: thrust faces, friction of pins."""
STIFF = 1e9
"""Torsional stiffness by which the turn of a driven member is given that has pairs in the ground, N m/rad."""

WITHOUT_CROSS = {"cross": {"r_b": "1 m"}, "hub": {"mass": "1 kg", "inertia": ["1 kg*m^2"] * 3}}
"""What pins of a pair have in place of a hub, which they meet in a joint: nothing of it is used."""


@lru_cache(maxsize=64)
def _mechanism(text: str, parts: tuple[str, ...]) -> Mechanism:
    linkage = Linkage.model_validate_json(text)
    chain, driven, pairs = linkage.chain, linkage.drive.member, linkage.pair
    held = f"{driven}_drive" if linkage.turns_alone else driven
    turning = SERIES if linkage.drive.swing else DRIVEN
    motions = {name: turning if name == driven else SERIES for name in chain.members}
    return Mechanism(
        "+".join((LINKAGE, *parts)),
        members=(
            Member(GROUND, HELD),
            *(Member(name, motions[name], parent=of.parent) for name, of in chain.members.items()),
        ),
        lumps=(
            *(Lump(f"{name}_pin", pair.pin, f"{name}_pin", OBLIQUE) for name, pair in pairs.items()),
            *(Lump(f"{name}_eye", pair.eye, f"{name}_eye", OBLIQUE) for name, pair in pairs.items()),
            *(Lump(name, name, name, OBLIQUE) for name in linkage.member),
        ),
        shafts=(
            Shaft(GROUND, GROUND, carries=False),
            Shaft(held, driven, driven=not linkage.turns_alone, carries=not linkage.turns_alone),
        ),
        bushings=(
            *(
                Bushing(f"{name}_{side}", f"{name}_{side}", member, f"{name}_{side}", side)
                for name, pair in pairs.items()
                for side, member in (("pin", pair.pin), ("eye", pair.eye))
            ),
            *[Bushing(held, driven, held, "drive", "drive")] * linkage.turns_alone,
        ),
        hinges=tuple(Hinge(name, pair.pin, pair.eye, GENERAL) for name, pair in pairs.items()),
        pairs=tuple(Pair(f"{name}_pin", f"{name}_eye", name, name) for name in pairs),
        faces=tuple(
            Face(f"{name}_{word}", f"{name}_pin", end)
            for name, pair in pairs.items()
            for word, end in (("outer", 1), ("inner", -1))
            if "thrust" in parts and end in ENDS[pair.faces]
        ),
        friction="friction" in parts,
        waves=len(chain.members[driven].wave) if SERIES in motions.values() else 0,
        loaded=linkage.loaded,
        forces=tuple(Force(force.member, force.turns) for force in linkage.force.values()),
    )


def linkage_mechanism(linkage: Linkage, parts: Collection[str]) -> Mechanism:
    """Mechanism of a linkage with pins and eyes of a joint that has these parts; others than `PARTS` play none."""
    return _mechanism(linkage.model_dump_json(), tuple(part for part in PARTS if part in parts))


def named(name: str, linkage: Mapping[str, Any]) -> Mechanism:
    """Mechanism of a result file by its name, and the values of the linkage that the file holds."""
    return linkage_mechanism(Linkage.of(linkage), name.split("+")[1:])


def frames(chain: Chain) -> dict[str, tuple[Array, Array]]:
    """Axes, by columns, and origin of each member at the angle zero, in ground axes; it turns about its z."""
    found = {GROUND: (np.eye(3), np.zeros(3))}
    for name, of in chain.members.items():
        z, x, y = triad(of.axis)
        found[name] = np.column_stack([x, y, z]), of.point
    return found


def joint_of(pair: PairOf, joint: Joint, place: str = "joint") -> Joint:
    """Joint whose pins and arms are the pin and the eye of a pair: that of the study, with the keys of the pair.

    Raises
    ------
    InputError
        When they make no valid joint.
    """
    return with_own(joint, merged(WITHOUT_CROSS, pair.joint), place) if pair.joint else joint


def write(params: Table, linkage: Linkage, joint: Joint, mechanism: Mechanism) -> dict[str, Array]:
    """Write parameters of all members, at factor 1 on E; return triads as `bodies.write`."""
    chain, at = linkage.chain, frames(linkage.chain)
    of: dict[str, Any] = {name: [] for name in ("mount", "pivot", "angle", "wave", "k", "c", "marker")}
    for member in mechanism.members:
        axes, origin = at[member.name]
        above, start = at[member.parent or GROUND]
        angle, wave = (0.0, 0.0), np.zeros((mechanism.waves, 2))
        if member.motion == SERIES:
            angle, wave = chain.members[member.name].angle, chain.members[member.name].wave
        of["mount"].append(above.T @ axes)
        of["pivot"].append(above.T @ (origin - start))
        of["angle"].append(angle)
        of["wave"].append(wave)
    of["R"] = 0.5 * chain.size
    of["weight"] = GRAVITY * unit(linkage.down) if linkage.down else np.zeros(3)
    triads, points = _lumps(linkage, mechanism)
    own = {f"{name}_{side}": joint_of(pair, joint) for name, pair in linkage.pair.items() for side in ("pin", "eye")}
    bodies = {name: _body(linkage, own, name) for name in triads}
    of["triad"] = [triads[lump.name] for lump in mechanism.lumps]
    of["mass"], of["inertia"] = ([bodies[name][i] for name in mechanism.lump_kinds] for i in (0, 1))
    of["at"] = [triads[name] @ points[name] for name in mechanism.lump_kinds]
    for bushing in mechanism.bushings:
        mass, inertia = bodies[bushing.lump]
        of_pair = own.get(bushing.lump, joint)
        k = _stiffness(of_pair, bushing.group, triads[bushing.lump])
        lever = points[bushing.lump] - points.get(bushing.base, np.zeros(3))
        of["k"].append(k)
        of["c"].append(material.bushing_damping(k, mass, np.array(inertia), of_pair.bushing.xi))
        of["marker"].append(((0.0, 0.0, 0.0), triads[bushing.lump] @ lever))
    of["pull"], of["pull_at"] = np.zeros((2, len(linkage.force), 3))
    for i, force in enumerate(linkage.force.values()):
        axes, origin = at[force.member]
        of["pull"][i] = axes.T @ force.force if force.turns else force.force
        of["pull_at"][i] = axes.T @ (np.array(force.point) - origin) - points[force.member]
    for name, values in of.items():
        params[name] = values
    return triads


def added_clearances(linkage: Linkage, joint: Joint) -> list[float]:
    """By how much the clearance of each pair is more than that of its contact, m."""
    each = [(pair.clearance, joint_of(pair, joint).contact.clearance) for pair in linkage.pair.values()]
    return [0.0 if clearance is None else clearance - usual for clearance, usual in each]


def _lumps(linkage: Linkage, mechanism: Mechanism) -> tuple[dict[str, Array], dict[str, Array]]:
    """Triad, rows in axes of its member, and reference point in its member (m), of each lump by name."""
    at, found = frames(linkage.chain), {}
    for name, pair in linkage.pair.items():
        of_pin, of_eye = triad(unit(pair.axis), pair.t), triad(unit(pair.axis), pair.eye_t or pair.t)
        found[f"{name}_pin"], found[f"{name}_eye"] = (of_pin, pair.point), (of_eye, pair.point)
    found |= {name: (triad(unit(member.axis)), member.centre) for name, member in linkage.member.items()}
    triads, points = {}, {}
    for lump in mechanism.lumps:
        axes, origin = at[lump.member]
        own, point = found[lump.name]
        triads[lump.name], points[lump.name] = own @ axes, axes.T @ (np.array(point) - origin)
    return triads, points


def _body(linkage: Linkage, own: Mapping[str, Joint], name: str) -> tuple[float, tuple[float, ...]]:
    """Mass and moments of inertia of a lump."""
    if name in linkage.member:
        return linkage.member[name].mass, linkage.member[name].inertia
    of = own[name].pin if name.endswith("_pin") else own[name].arm
    return of.mass, of.inertia


def _stiffness(joint: Joint, group: str, axes: Array) -> Array:
    """Stiffness of a bushing along and about the axes e, t, z of its lump: of pin, eye, or drive.

    The drive turns a member about z of its frame, which is along one of the principal `axes` of the member.
    """
    if group == "drive":
        return np.concatenate([np.zeros(3), STIFF * np.round(axes[:, 2] ** 2)])
    return joint.k_cross if group == "pin" else joint.k_fork
