"""What a mechanism is: its members, lumps, bushings and pairs as data (docs/model.md, "A mechanism").

Kernels know no mechanism: they read its numbers, `numbering`, from the parameters of each joint, and the sizes of their
records follow from it. `common.cardan` has the Cardan joint.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common import elimination

Integers = NDArray[np.int64]

HELD, DRIVEN, CLOSED_FORM, SERIES = range(4)
"""How a member moves: not at all; about its z as the input does; as the closed form of a Cardan joint says; about its z
by an angle that is a Fourier series of the input angle."""
ALONG_Z, OBLIQUE = 4, 5
"""Triad of a pin or hole, in place of a number of quarter turns: e, t, z are the member's z, x, y; as the parameters
say."""
X, Y, Z, GENERAL = range(4)
"""How a pin's member moves in a hole's: it turns about an axis of both, through the origin of both; or in any way."""


class Member(NamedTuple):
    """Rigid link of the ideal mechanism, with the frame that the deviations of its lumps refer to.

    Attributes
    ----------
    name : str
        For the reader.
    motion : int
        `HELD`, `DRIVEN`, `CLOSED_FORM` or `SERIES`.
    about_z : bool
        Whether its frame turns about its own z and its origin is at rest.
    parent : str
        Member in which it turns, one before it: the parameters say where. Empty where the axes of all members meet in
        one point, and of the first member, the ground.
    """

    name: str
    motion: int
    about_z: bool = False
    parent: str = ""


class Lump(NamedTuple):
    """Rigid body with six unknowns.

    Attributes
    ----------
    name : str
        Of a pin or hole, name of its errors: ``pin1.offset_t``.
    member : str
        Whose ideal frame it deviates from.
    kind : str
        Lumps of one kind have the same mass, inertia and distance of the reference point.
    quarters : int
        Quarter turns about z that take the member's axes to the triad (e, t, z), or `ALONG_Z`, or `OBLIQUE`.
    """

    name: str
    member: str
    kind: str
    quarters: int = 0


class Shaft(NamedTuple):
    """Body without unknowns of its own: prescribed, or with a rotation about its z, or a displacement along it, too.

    Attributes
    ----------
    name : str
        Place of its loads: ``input``.
    member : str
        Whose frame it moves in.
    turns, slides : str
        Names of the unknowns psi and s; empty where it has none. Shafts with the same unknown are one body.
    across : tuple of str
        Names of the unknown displacements along x and y of its frame, or none.
    driven : bool
        Whether the torque about it is a load: it drives what is behind it.
    borne : bool
        Whether the loads of its two bearings are loads.
    carries : bool
        Whether what it carries is a load: not of the ground, on which many parts stand.
    """

    name: str
    member: str
    turns: str = ""
    slides: str = ""
    across: tuple[str, ...] = ()
    driven: bool = False
    borne: bool = False
    carries: bool = True


class Bushing(NamedTuple):
    """Elastic connection of a lump with its base, both of one member.

    Attributes
    ----------
    name : str
        Place of its loads: ``cross1``.
    lump, base : str
        A lump; a lump or a shaft.
    kind : str
        Bushings of one kind have the same stiffness, damping and markers.
    group : str
        Bushings of one group are shown together: ``fork``.
    pushed : bool
        Whether a given force along its z acts beside, which pushes the lump along z and the base against it.
    """

    name: str
    lump: str
    base: str
    kind: str
    group: str
    pushed: bool = False


class Hinge(NamedTuple):
    """Motion of a pin's member relative to a hole's.

    Attributes
    ----------
    name : str
        For the reader.
    pin, hole : str
        The members. Those of Cardan joints come first: of each, cross in input, then cross in output.
    axis : int
        `X`, `Y` or `Z` of both members, about which one turns in the other, or `GENERAL`.
    """

    name: str
    pin: str
    hole: str
    axis: int


class Pair(NamedTuple):
    """Pin in a hole, by the names of their lumps, and the hinge between their members.

    Pairs of one `kind` have the same stations, film, friction and faces: those of one Cardan joint, whose names have
    `kind` before them; of a linkage each has a kind of its own, its name.
    """

    pin: str
    hole: str
    hinge: str
    kind: str = ""


class Face(NamedTuple):
    """Thrust face, on which the end of a pin stops (docs/model.md, "Thrust faces").

    Attributes
    ----------
    name : str
        Place of its load: ``thrust1``.
    pin : str
        Lump of the pin.
    end : int
        1: outer end of the pin, 1 along e; -1: its inner end.
    """

    name: str
    pin: str
    end: int = 1


class Force(NamedTuple):
    """Given force on a lump; its direction is that in the ground, or turns with the lump's member."""

    lump: str
    turns: bool = False


class Mechanism(NamedTuple):
    """A mechanism.

    Attributes
    ----------
    name : str
        Name in studies and result files.
    members, lumps, shafts, bushings, hinges, pairs : tuple
        Its parts. Shafts are numbered after the lumps: both are bodies.
    unknowns : tuple of str
        Unknowns of shafts, after six of each lump: rotations first.
    cardan : tuple of str
        First member of each Cardan joint, followed by its cross and its output; each is driven by the one before.
    faces : tuple of Face
        What holds pins along their axes; without any, pins slide freely.
    friction : bool
        Whether pins rub in their holes.
    unbalanced : tuple of str
        Bodies that have an unbalance.
    spline : bool
        Whether the last shaft has a spline that sticks, or one joins two tubes.
    waves : int
        Number of orders in the series of its members' angles.
    loaded : str
        Lump that the resisting torque acts on, against z of its member; empty: it acts on the last unknown rotation.
    forces : tuple of Force
        Given forces.
    roots : tuple of str
        Bushings at whose base the stress is known.
    """

    name: str
    members: tuple[Member, ...]
    lumps: tuple[Lump, ...]
    shafts: tuple[Shaft, ...]
    bushings: tuple[Bushing, ...]
    hinges: tuple[Hinge, ...]
    pairs: tuple[Pair, ...]
    unknowns: tuple[str, ...] = ()
    cardan: tuple[str, ...] = ()
    faces: tuple[Face, ...] = ()
    friction: bool = False
    unbalanced: tuple[str, ...] = ()
    spline: bool = False
    waves: int = 0
    loaded: str = ""
    forces: tuple[Force, ...] = ()
    roots: tuple[str, ...] = ()

    @property
    def placed(self) -> int:
        """Number of members that have a place in their parents: all or none."""
        return len(self.members) if any(member.parent for member in self.members) else 0

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of lumps and shafts."""
        return tuple(body.name for body in self.lumps) + tuple(shaft.name for shaft in self.shafts)

    @property
    def lump_kinds(self) -> tuple[str, ...]:
        """Kinds of lumps, each once."""
        return tuple(dict.fromkeys(lump.kind for lump in self.lumps))

    @property
    def bushing_kinds(self) -> tuple[str, ...]:
        """Kinds of bushings, each once."""
        return tuple(dict.fromkeys(bushing.kind for bushing in self.bushings))

    @property
    def pair_kinds(self) -> tuple[str, ...]:
        """Kinds of pairs, each once."""
        return tuple(dict.fromkeys(pair.kind for pair in self.pairs))

    @property
    def rotations(self) -> tuple[str, ...]:
        """Those of `unknowns` that are rotations."""
        return tuple(name for name in self.unknowns if any(shaft.turns == name for shaft in self.shafts))

    @property
    def is_shaft(self) -> bool:
        """Whether it is a drive shaft, of several Cardan joints one behind the other."""
        return len(self.cardan) > 1

    @property
    def dof(self) -> int:
        """Number of unknowns."""
        return 6 * len(self.lumps) + len(self.unknowns)


@cache
def features(mechanism: Mechanism) -> tuple[str, ...]:
    """Pins and holes, the lumps that have errors: all pins, then all holes, as the lumps are numbered."""
    pins, holes = ({getattr(pair, name) for pair in mechanism.pairs} for name in ("pin", "hole"))
    return tuple(lump.name for names in (pins, holes) for lump in mechanism.lumps if lump.name in names)


def with_play(mechanism: Mechanism, face: Face) -> str:
    """Name of what has the play of a face: the cross of its joint, ``joint1.thrust``, or the pin."""
    return face.name.rstrip("1234") if mechanism.cardan else face.pin


def carried(mechanism: Mechanism) -> list[int]:
    """Numbers of the shafts that carry loads of the mechanism."""
    return [i for i, shaft in enumerate(mechanism.shafts) if shaft.carries]


@cache
def prefixes(mechanism: Mechanism) -> tuple[str, ...]:
    """What stands before the names of the parts of each Cardan joint, ``""`` or ``"joint1."``."""
    return tuple(member.rpartition(".")[0] + "." * ("." in member) for member in mechanism.cardan)


@cache
def numbering(mechanism: Mechanism) -> dict[str, Integers]:
    """What kernels read of a mechanism: numbers from 0, by name; -1 where there is none.

    Returns
    -------
    dict of str to ndarray of int
        Fields of PARAM; see the code, and `elimination.plan`.
    """
    body = {name: i for i, name in enumerate(mechanism.bodies)}
    member = {one.name: i for i, one in enumerate(mechanism.members)}
    hinge = {one.name: i for i, one in enumerate(mechanism.hinges)}
    unknown = {name: i for i, name in enumerate(mechanism.unknowns)}
    lumps = len(mechanism.lumps)
    kinds = [mechanism.bushing_kinds.index(bushing.kind) for bushing in mechanism.bushings]
    edges = {(body[pair.hole], body[pair.pin]): lumps + i for i, pair in enumerate(mechanism.pairs)}
    blocks = []
    for bushing in mechanism.bushings:
        joined = body[bushing.lump], body[bushing.base]
        if joined[1] < lumps:
            edges[joined] = lumps + len(edges)
        blocks.append(edges.get(joined, -1))
    shafts = {shaft.name: shaft for shaft in mechanism.shafts}
    borders = [
        (unknown[name], body[bushing.lump])
        for bushing in mechanism.bushings
        if bushing.base in shafts
        for name in (shafts[bushing.base].turns, shafts[bushing.base].slides, *shafts[bushing.base].across)
        if name
    ]
    held = {bushing.lump: kind for bushing, kind in zip(mechanism.bushings, kinds, strict=True)}
    bases = {bushing.base: kind for bushing, kind in zip(mechanism.bushings, kinds, strict=True)}
    frames = [lump.member for lump in mechanism.lumps] + [shaft.member for shaft in mechanism.shafts]
    numbers: dict[str, object] = {
        "frame": [member[name] for name in frames],
        "quarters": [lump.quarters for lump in mechanism.lumps] + [0] * len(shafts),
        "lump_kind": [mechanism.lump_kinds.index(lump.kind) for lump in mechanism.lumps],
        "held_by": [held[lump.name] if lump.name in held else bases[lump.name] for lump in mechanism.lumps],
        "motion": [one.motion for one in mechanism.members],
        "about_z": [one.about_z for one in mechanism.members],
        "parent": [member.get(one.parent, -1) for one in mechanism.members],
        "turn": [unknown.get(shaft.turns, -1) for shaft in mechanism.shafts],
        "slide": [unknown.get(shaft.slides, -1) for shaft in mechanism.shafts],
        "across": [unknown[shaft.across[0]] if shaft.across else -1 for shaft in mechanism.shafts],
        "carried": carried(mechanism),
        "driven": [i for i, shaft in enumerate(mechanism.shafts) if shaft.driven],
        "bushing_lump": [body[bushing.lump] for bushing in mechanism.bushings],
        "bushing_base": [body[bushing.base] for bushing in mechanism.bushings],
        "bushing_kind": kinds,
        "root": [i for i, bushing in enumerate(mechanism.bushings) if bushing.name in mechanism.roots],
        "pushed": [i for i, bushing in enumerate(mechanism.bushings) if bushing.pushed],
        "bushing_block": blocks,
        "pin": [body[pair.pin] for pair in mechanism.pairs],
        "hole": [body[pair.hole] for pair in mechanism.pairs],
        "hinge": [hinge[pair.hinge] for pair in mechanism.pairs],
        "pair_kind": [mechanism.pair_kinds.index(pair.kind) for pair in mechanism.pairs],
        "hinge_pin": [member[one.pin] for one in mechanism.hinges],
        "hinge_hole": [member[one.hole] for one in mechanism.hinges],
        "hinge_axis": [one.axis for one in mechanism.hinges],
        "face_pair": [[pair.pin for pair in mechanism.pairs].index(face.pin) for face in mechanism.faces],
        "face_end": [face.end for face in mechanism.faces],
        "friction": mechanism.friction,
        "unbalanced": [body[name] for name in mechanism.unbalanced],
        "loaded": [body[name] for name in [mechanism.loaded] if name],
        "pulled": [body[force.lump] for force in mechanism.forces],
        "pull_turns": [force.turns for force in mechanism.forces],
        "borne": [i for i, shaft in enumerate(mechanism.shafts) if shaft.borne],
        "first_filled": lumps + len(edges),
        "cardan": [member[name] for name in mechanism.cardan],
    }
    planned = elimination.plan(lumps, edges, borders)
    return {name: np.array(values, np.int64) for name, values in numbers.items()} | planned


def blocks_of(mechanism: Mechanism) -> int:
    """Number of 6 x 6 blocks of the tangent: of lumps, pairs, bushings between lumps, and those filled in."""
    numbers = numbering(mechanism)
    used = np.concatenate([numbers["between"], numbers["target"], [len(mechanism.lumps) - 1]])
    return int(used.max()) + 1
