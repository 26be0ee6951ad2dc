"""Mechanisms of Cardan joints: the joint, and the drive shaft of two joints (docs/model.md, "Parts").

The hub carries pins 1 to 4; pin 1 turns in the hole of arm 4, pin 2 in arm 3, pin 3 in arm 1, pin 4 in arm 2. Arms 1
and 2 belong to the input fork, 3 and 4 to the output fork. `kernel.mechanics.cardan` counts on the order of the parts.
"""

from collections.abc import Collection
from itertools import combinations, pairwise

from tolstat.common.mechanism import (
    CLOSED_FORM,
    GENERAL,
    OBLIQUE,
    Bushing,
    Face,
    Hinge,
    Lump,
    Mechanism,
    Member,
    Pair,
    Shaft,
    X,
    Y,
)

PIN_QUARTERS, ARM_QUARTERS = (1, 3, 0, 2), (0, 2, 3, 1)
"""Quarter turns about z that take the axes of the frame to the triads of pins and arms 1 to 4."""
HOLE_OF_PIN = (4, 3, 1, 2)
"""Number of the arm in whose hole each pin turns."""


def joint(name: str, prefix: str, input_shaft: Shaft, output_shaft: Shaft) -> Mechanism:
    """Return a Cardan joint between two shafts; `prefix`: what stands before the names of its parts."""
    numbers, members = range(1, 5), {part: prefix + part for part in ("input", "cross", "output")}
    fork = {1: "input", 2: "input", 3: "output", 4: "output"}
    return Mechanism(
        name,
        members=tuple(Member(member, CLOSED_FORM, part != "cross") for part, member in members.items()),
        lumps=(
            Lump(f"{prefix}hub", members["cross"], f"{prefix}hub"),
            *(Lump(f"{prefix}pin{i}", members["cross"], f"{prefix}pin", PIN_QUARTERS[i - 1]) for i in numbers),
            *(Lump(f"{prefix}hole{i}", members[fork[i]], f"{prefix}arm", ARM_QUARTERS[i - 1]) for i in numbers),
        ),
        shafts=(input_shaft, output_shaft),
        bushings=(
            *(
                Bushing(f"{prefix}cross{i}", f"{prefix}pin{i}", f"{prefix}hub", f"{prefix}cross", "cross")
                for i in numbers
            ),
            *(
                Bushing(f"{prefix}fork{i}", f"{prefix}hole{i}", members[fork[i]], f"{members[fork[i]]} fork", "fork")
                for i in numbers
            ),
        ),
        hinges=(
            Hinge(members["input"], members["cross"], members["input"], X),
            Hinge(members["output"], members["cross"], members["output"], Y),
        ),
        pairs=tuple(
            Pair(f"{prefix}pin{i}", f"{prefix}hole{hole}", members[fork[hole]], prefix)
            for i, hole in enumerate(HOLE_OF_PIN, 1)
        ),
        unknowns=tuple(name for name in (output_shaft.turns, output_shaft.slides) if name),
        cardan=(members["input"],),
    )


CARDAN = joint("cardan", "", Shaft("input", "input", driven=True), Shaft("output", "output", "psi", "s"))
"""The joint: its output shaft may turn by psi and slide by s."""


def drive_shaft(name: str, *tubes: str) -> Mechanism:
    """Return two joints and what is between them: a tube, or two that a spline joins.

    Tubes are lumps in the frame of joint 1's output, and so are the arms of joint 2 on them, whose triads are oblique.
    """
    outer = Shaft("input", "joint1.input", driven=True), Shaft("output", "joint2.output", "psi", "s")
    one, two = (joint("", f"joint{i}.", outer[0], outer[1]) for i in (1, 2))
    tube, body = "joint1.output", {"joint1.input": "input", "joint1.output": tubes[0]}
    body |= {"joint2.input": tubes[-1], "joint2.output": "output"}

    def on_tube(lump: Lump) -> Lump:
        of_tube = lump.member == "joint2.input"
        return lump._replace(member=tube, kind="joint2.arm of tube", quarters=OBLIQUE) if of_tube else lump

    return Mechanism(
        name,
        members=one.members + two.members,
        lumps=(*one.lumps, *map(on_tube, two.lumps), *(Lump(part, tube, part) for part in tubes)),
        shafts=outer,
        bushings=(
            *(bushing._replace(base=body.get(bushing.base, bushing.base)) for bushing in one.bushings + two.bushings),
            *(Bushing("spline", after, before, "spline", "spline", pushed=True) for before, after in pairwise(tubes)),
        ),
        hinges=(*one.hinges, two.hinges[0]._replace(hole=tube, axis=GENERAL), two.hinges[1]),
        pairs=one.pairs + two.pairs,
        unknowns=two.unknowns,
        cardan=one.cardan + two.cardan,
        spline=len(tubes) > 1,
    )


SHAFT = drive_shaft("shaft", "tube")
"""Drive shaft of two joints and a tube."""
SPLINED = drive_shaft("splined shaft", "tube1", "tube2")
"""Drive shaft of two joints and two tubes, which slide in one another by a spline."""
PARTS = ("thrust", "friction", "input_bearings", "output_bearings", "unbalance", "lateral", "spline", "root")
"""What a mechanism of Cardan joints may have beside: thrust faces, friction of pins, loads of the bearings that carry
its first and its last shaft; unbalance of the tubes and of the last shaft, displacement of that across its axis, a
spline that sticks; stress at the roots of the pins."""


BALANCED = ("tube", "tube1", "tube2", "output")
"""Bodies that may have an unbalance."""


def named(base: Mechanism, parts: Collection[str]) -> str:
    """Name in `MECHANISMS` of a mechanism with some of `PARTS`: ``cardan+thrust+friction``."""
    return "+".join((base.name, *(part for part in PARTS if part in parts)))


def _with(base: Mechanism, parts: Collection[str]) -> Mechanism:
    ends = {base.shafts[i].name for i, end in ((0, "input"), (-1, "output")) if f"{end}_bearings" in parts}
    pins = [pair.pin for pair in base.pairs] if "thrust" in parts else []
    across = ("x", "y") if "lateral" in parts else ()
    *first, last = (shaft._replace(borne=shaft.name in ends) for shaft in base.shafts)
    return base._replace(
        name=named(base, parts),
        shafts=(*first, last._replace(across=across)),
        unknowns=(*base.unknowns, *across),
        faces=tuple(Face(pin.replace("pin", "thrust"), pin) for pin in pins),
        friction="friction" in parts,
        unbalanced=tuple(body for body in base.bodies if body in BALANCED) if "unbalance" in parts else (),
        spline=base.spline or "spline" in parts,
        roots=tuple(bushing.name for bushing in base.bushings if bushing.group == "cross") if "root" in parts else (),
    )


MECHANISMS = {
    mechanism.name: mechanism
    for base in (CARDAN, SHAFT, SPLINED)
    for n in range(len(PARTS) + 1)
    for parts in combinations(PARTS, n)
    for mechanism in [_with(base, parts)]
}
"""Mechanisms by name."""
