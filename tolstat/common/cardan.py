"""The Cardan joint as a mechanism (docs/model.md, "Parts").

The hub carries pins 1 to 4; pin 1 turns in the hole of arm 4, pin 2 in arm 3, pin 3 in arm 1, pin 4 in arm 2. Arms 1
and 2 belong to the input fork, 3 and 4 to the output fork, whose shaft may turn by psi and slide by s.
"""

from tolstat.common.mechanism import (
    CLOSED_FORM,
    Bushing,
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


def cardan(name: str = "cardan") -> Mechanism:
    """Return the joint."""
    pins, arms = range(1, 5), range(1, 5)
    fork = {1: "input", 2: "input", 3: "output", 4: "output"}
    return Mechanism(
        name,
        members=(
            Member("input", CLOSED_FORM, True),
            Member("cross", CLOSED_FORM),
            Member("output", CLOSED_FORM, True),
        ),
        lumps=(
            Lump("hub", "cross", "hub"),
            *(Lump(f"pin{i}", "cross", "pin", PIN_QUARTERS[i - 1]) for i in pins),
            *(Lump(f"hole{i}", fork[i], "arm", ARM_QUARTERS[i - 1]) for i in arms),
        ),
        shafts=(Shaft("input", "input", driven=True), Shaft("output", "output", "psi", "s")),
        bushings=(
            *(Bushing(f"cross{i}", f"pin{i}", "hub", "cross", "cross") for i in pins),
            *(Bushing(f"fork{i}", f"hole{i}", fork[i], f"{fork[i]} fork", "fork") for i in arms),
        ),
        hinges=(Hinge("input", "cross", "input", X), Hinge("output", "cross", "output", Y)),
        pairs=tuple(Pair(f"pin{i}", f"hole{k}", fork[k]) for i, k in enumerate(HOLE_OF_PIN, 1)),
        unknowns=("psi", "s"),
        cardan=("input",),
    )


CARDAN = cardan()
