"""Mechanisms of Cardan joints: the joint, and joints in series (docs/model.md, "Parts").

The hub carries pins 1 to 4; pin 1 turns in the hole of arm 4, pin 2 in arm 3, pin 3 in arm 1, pin 4 in arm 2. Arms 1
and 2 belong to the input fork, 3 and 4 to the output fork. `kernel.mechanics.cardan` counts on the order of the parts.
"""

from collections.abc import Collection
from itertools import combinations
from typing import Any

from tolstat.common.mechanism import (
    CLOSED_FORM,
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
            Lump(f"{prefix}hub", members["cross"], "hub"),
            *(Lump(f"{prefix}pin{i}", members["cross"], "pin", PIN_QUARTERS[i - 1]) for i in numbers),
            *(Lump(f"{prefix}hole{i}", members[fork[i]], "arm", ARM_QUARTERS[i - 1]) for i in numbers),
        ),
        shafts=(input_shaft, output_shaft),
        bushings=(
            *(Bushing(f"{prefix}cross{i}", f"{prefix}pin{i}", f"{prefix}hub", "cross", "cross") for i in numbers),
            *(
                Bushing(f"{prefix}fork{i}", f"{prefix}hole{i}", prefix + fork[i], f"{fork[i]} fork", "fork")
                for i in numbers
            ),
        ),
        hinges=(
            Hinge(members["input"], members["cross"], members["input"], X),
            Hinge(members["output"], members["cross"], members["output"], Y),
        ),
        pairs=tuple(
            Pair(f"{prefix}pin{i}", f"{prefix}hole{hole}", members[fork[hole]]) for i, hole in enumerate(HOLE_OF_PIN, 1)
        ),
        unknowns=tuple(name for name in (output_shaft.turns, output_shaft.slides) if name),
        cardan=(members["input"],),
    )


CARDAN = joint("cardan", "", Shaft("input", "input", driven=True), Shaft("output", "output", "psi", "s"))
"""The joint: its output shaft may turn by psi and slide by s."""


def series(number: int) -> Mechanism:
    """Return Cardan joints one behind the other: shafts between them, held on their axes, turn by psi1 and so on."""
    joints = []
    for i in range(1, number + 1):
        before = f"psi{i - 1}" if i > 1 else ""
        ends = (
            Shaft(f"joint{i}.input", f"joint{i}.input", before, driven=True),
            Shaft(f"joint{i}.output", f"joint{i}.output", f"psi{i}"),
        )
        joints.append(joint("", f"joint{i}.", *ends))
    parts = ("members", "lumps", "shafts", "bushings", "hinges", "pairs", "unknowns", "cardan")
    together: dict[str, Any] = {part: sum((getattr(one, part) for one in joints), ()) for part in parts}
    return Mechanism("series", **together)


SERIES = series(2)
"""Two joints in series."""
PARTS = ("thrust", "friction", "input_bearings", "output_bearings", "unbalance", "lateral", "spline")
"""What a mechanism of Cardan joints may have beside: thrust faces, friction of pins, loads of the bearings that carry
its first and its last shaft; unbalance of the last one, displacement of it across its axis, a spline that sticks."""


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
        unbalance="unbalance" in parts,
        spline="spline" in parts,
    )


MECHANISMS = {
    mechanism.name: mechanism
    for base in (CARDAN, SERIES)
    for n in range(len(PARTS) + 1)
    for parts in combinations(PARTS, n)
    for mechanism in [_with(base, parts)]
}
"""Mechanisms by name."""
