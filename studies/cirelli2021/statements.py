"""What Cirelli et al. (2021) say in words, each sentence tested on the joints of a study.

The paper names no direction. Each sentence has its own criterion, `Answer.criterion`: those that say that something
stays away or dominates must hold in every direction; those that say how far a change reaches take the largest of all
directions, and `together` tells whether one direction can give both sizes.
"""

from __future__ import annotations

import numpy as np

from studies.cirelli2021 import dynamics as paper_dynamics
from studies.cirelli2021.evidence import Answer, Evidence, signed
from studies.cirelli2021.tables import INPUT_SIDE, OUTPUT_SIDE

UNAFFECTED = 1.6
"""Largest Gamma that the paper prints on the input side, where it calls influence negligible (Table 6), per cent."""
ONE_PIN = 16.0
"""Smallest Gamma_F of cross bushing 1 that the paper prints for a position error (Table 5), per cent."""
FORCE, TORQUE = (15.0, 19.0), (20.0, 32.0)
"""Sizes of the changes that the paper names, per cent."""


def answers(evidence: Evidence) -> list[Answer]:
    """Test every sentence."""
    loads = (output_side, input_springs, one_pin, angular_torque, force_size, torque_size, together)
    motion = paper_dynamics
    last = (motion.spectrum, motion.marginal, motion.psi_grows, motion.analytic, motion.settling)
    return [test(evidence) for test in (*loads, milder_force, milder_torque, *last, motion.settling_printed)]


def output_side(e: Evidence) -> Answer:
    """Errors load the output side and leave the input fork and cross bushings 3 and 4 alone."""
    largest = np.abs(e.gamma[:, INPUT_SIDE]).max(axis=(1, 2))
    rows = e.rows()
    worst = int(rows[np.nanargmax(largest[rows])])
    quiet = int((largest[rows] <= UNAFFECTED).sum())
    names = sorted({e.cases[i] for i in rows[largest[rows] > UNAFFECTED]})
    text = f"largest |Γ| on the input side {largest[worst]:.1f} % ({e.name(worst)}); at most {UNAFFECTED} % in {quiet} "
    text += f"of {len(rows)} joints" + (f", more in {', '.join(names)}" if names else "")
    claim = "Errors act on cross bushings 1, 2 and the output fork; the input side is not affected."
    criterion = f"every direction: |Γ| of the input side at most {UNAFFECTED} %, the largest printed there"
    return Answer("output_side", claim, criterion, quiet == len(rows), text)


def input_springs(e: Evidence) -> Answer:
    """Contact springs between cross and input fork do not feel the errors."""
    rows = e.rows()
    ideal = np.array([e.contact[e.ideal(i), 2:].max() for i in rows])
    change = 100.0 * np.abs(e.contact[rows, 2:].max(axis=(1, 2)) / ideal - 1.0)
    worst = int(np.argmax(change))
    text = f"largest change of their force {change[worst]:.1f} % ({e.name(int(rows[worst]))}), "
    text += f"median {np.median(change):.1f} %"
    claim = "The springs between cross and input fork are not affected."
    criterion = f"every direction: change at most {UNAFFECTED} %"
    return Answer("input_springs", claim, criterion, bool(change[worst] <= UNAFFECTED), text)


def one_pin(e: Evidence) -> Answer:
    """A position error raises the force of cross bushing 1 by 16 % or more and leaves bushing 2 as it is."""
    rows = e.rows("Pos")
    first, second = e.gamma[rows, 0, 0], e.gamma[rows, 1, 0]
    apart = np.abs(first - second)
    worst = int(np.argmax(apart))
    text = f"Γ_F of bushing 1 at most {first.max():.1f} %; from bushing 2 it differs by at most {apart[worst]:.2f} "
    text += f"points ({e.name(int(rows[worst]))})"
    claim = "Position errors raise the force of cross bushing 1 (16–19 %) and do not touch bushing 2."
    criterion = f"some position error: Γ_F of bushing 1 at least {ONE_PIN:g} %; every one: |Γ_F| of bushing 2 below 1 %"
    yes = bool((first >= ONE_PIN).any() and (np.abs(second) < 1.0).all())
    return Answer("one_pin", claim, criterion, yes, text)


def angular_torque(e: Evidence) -> Answer:
    """Angular errors change torques more than position errors do, whatever their directions."""
    largest = np.abs(e.gamma[:, OUTPUT_SIDE, 1]).max(axis=1)
    ang, pos = largest[e.rows("Ang")], largest[e.rows("Pos")]
    text = f"largest |Γ_T| on the output side: angular {ang.min():.1f} to {ang.max():.1f} %, position {pos.min():.1f} "
    text += f"to {pos.max():.1f} %"
    criterion = "the least of all angular errors above the largest of all position errors"
    yes = bool(ang.min() > pos.max())
    return Answer("angular_torque", "Angular errors dominate the torques.", criterion, yes, text)


def force_size(e: Evidence) -> Answer:
    """The largest increase of a force lies between 15 and 19 %."""
    return _size(e, 0, "force_size", "Force changes reach 15–19 %.", FORCE)


def torque_size(e: Evidence) -> Answer:
    """The largest increase of a torque lies between 20 and 32 %."""
    return _size(e, 1, "torque_size", "Torque changes reach 20–32 % (“31 % higher than the ideal case”).", TORQUE)


def _size(e: Evidence, load: int, key: str, claim: str, span: tuple[float, float]) -> Answer:
    rows = e.rows()
    value = e.gamma[rows][:, OUTPUT_SIDE, load]
    up, down = value.max(axis=1), value.min(axis=1)
    high, low = int(np.argmax(up)), int(np.argmin(down))
    text = f"largest increase {signed(up[high])} ({e.name(int(rows[high]))}), largest decrease {signed(down[low])} "
    text += f"({e.name(int(rows[low]))})"
    criterion = f"the largest increase of all directions lies between {span[0]:g} and {span[1]:g} %"
    return Answer(key, claim, criterion, bool(span[0] <= round(float(up[high]), 1) <= span[1]), text)


def together(e: Evidence) -> Answer:
    """One error raises a force by 15 % and a torque by 20 % at the same time."""
    rows = e.rows()
    force, torque = (e.gamma[rows][:, OUTPUT_SIDE, load].max(axis=1) for load in (0, 1))
    both = np.flatnonzero((force >= FORCE[0]) & (torque >= TORQUE[0]))
    if both.size:
        text = f"{both.size} of {len(rows)} joints: " + ", ".join(e.name(int(rows[i])) for i in both)
    else:
        strong, turned = int(np.argmax(force)), int(np.argmax(torque))
        text = f"none of {len(rows)} joints: {e.name(int(rows[strong]))} has {signed(force[strong])} and "
        text += f"{signed(torque[strong])}, {e.name(int(rows[turned]))} {signed(force[turned])} and "
        text += f"{signed(torque[turned])}"
    claim = "One error raises forces by 15 % and torques by 20 % at once (Ang fork at 0°: 17.6 and 31.6 %)."
    criterion = f"some direction: an increase of a force by {FORCE[0]:g} % or more and of a torque by {TORQUE[0]:g} %"
    return Answer("together", claim, criterion, bool(both.size), text)


def milder_force(e: Evidence) -> Answer:
    """Output side forces change less at the larger misalignment."""
    return _milder(e, 0, "milder_force", "α = 15° mitigates the force changes.")


def milder_torque(e: Evidence) -> Answer:
    """Output side torques change less at the larger misalignment."""
    return _milder(e, 1, "milder_torque", "α = 15° mitigates the torque changes.")


def _milder(e: Evidence, load: int, key: str, claim: str) -> Answer:
    ends = [e.rows(alpha=float(a)) for a in (e.alpha.min(), e.alpha.max())]
    largest = [np.abs(e.gamma[rows][:, OUTPUT_SIDE, load]).max(axis=1) for rows in ends]
    less = int((largest[1] < largest[0]).sum())
    text = f"largest change over all errors {largest[0].max():.1f} % at 0°, {largest[1].max():.1f} % at 15°; mean of "
    text += (
        f"the errors {largest[0].mean():.1f} % and {largest[1].mean():.1f} %; milder in {less} of {len(ends[0])} errors"
    )
    return Answer(key, claim, "every direction: milder at 15° than at 0°", less == len(ends[0]), text)
