"""Table of what is drawn: dimensions of a joint, what else it has, its operating points and its drive shaft."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import isnan

import numpy as np

from tolstat.display import text
from tolstat.display.answer import Rows
from tolstat.joint import (
    DriveShaft,
    Joint,
    Linkage,
    OperationOfLinkage,
    OperationOfShaft,
    mechanism_of,
    nominal_errors,
    perturb,
)
from tolstat.joint.ideal import ratio_of_all
from tolstat.joint.model import leaves
from tolstat.study.points import Point

ARRANGEMENTS = {"Z": "the outer shafts point the same way", "W": "the shaft bends the same way at both joints"}
"""What the names of arrangements mean."""
Line = tuple[str, str, str]
"""Dimension, value with its unit, meaning."""


def dimensions(joint: Joint, points: Sequence[Point]) -> Rows:
    """Rows ``dimension``, ``value`` with its unit, ``meaning``; of a drive shaft those of both joints and of the tubes.

    Parameters
    ----------
    joint : Joint
        The nominal joint; of a drive shaft joint 1.
    points : sequence of Point
        Its operating points.
    """
    if isinstance(points[0].operation, OperationOfLinkage):
        of_pins = [*_of_pins(joint, ("eye", "eye")), *_of_points(points), *_of_parts(joint, "a pin")]
        lines = [*_of_linkage(points[0].operation.linkage), *of_pins]
        return [{"dimension": name, "value": value, "meaning": meaning} for name, value, meaning in lines]
    lines = [*_of_joint(joint), *_of_points(points), *_of_parts(joint)]
    if joint2 := points[0].operation.joint2:
        own = [line for line in _of_parts(joint) if line[0] not in ("shaft.output.bearings", "shaft.unbalance")]
        other = [line for line in _of_parts(joint2) if line[0] != "shaft.input.bearings"]
        lines = [*_before("joint1.", [*_of_joint(joint), *own]), *_before("joint2.", [*_of_joint(joint2), *other])]
        lines += _of_points(points)
    shafts = [point.operation for point in points if isinstance(point.operation, OperationOfShaft)]
    if shafts:
        names = _at(points)
        lines += [*_of_shaft(shafts[0].shaft), *_of_spline(shafts, names)]
        waves = ", ".join(f"{100.0 * round(second_order(joint, operation), 6):.3g}" for operation in shafts)
        lines.append(("output speed", f"{waves} %", f"amplitude of its second order by the angles alone{names}"))
    return [{"dimension": name, "value": value, "meaning": meaning} for name, value, meaning in lines]


def _before(prefix: str, lines: Iterable[Line]) -> list[Line]:
    return [(f"{prefix}{name}", value, meaning) for name, value, meaning in lines]


def second_order(joint: Joint, operation: OperationOfShaft) -> float:
    """Second order of the output speed of a drive shaft without errors that turns evenly: amplitude over the mean."""
    row = perturb(joint, operation, nominal_errors(1, mechanism_of(joint, operation)))[0]
    theta = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
    return float(abs(2.0 * np.mean(ratio_of_all(theta, row) * np.exp(-2j * theta))))


def _of_joint(joint: Joint) -> list[Line]:
    rows = [
        ("cross.R", joint.cross.R, "centre of the joint to the middle of pin and hole"),
        ("cross.r_b", joint.cross.r_b, "centre of the joint to a cross bushing"),
        ("arm.l_f", joint.arm.l_f, "middle of a hole to a fork bushing, along the shaft"),
    ]
    return [*((name, _mm(x), meaning) for name, x, meaning in rows), *_of_pins(joint)]


def _of_pins(joint: Joint, words: tuple[str, str] = ("hole", "arm")) -> list[Line]:
    """Lines of pins; `words`: what they turn in, and what carries this."""
    arm, contact, (hole, beam) = joint.arm, joint.contact, words
    rows = [
        ("contact.D_P", contact.D_P, "diameter of the pins"),
        ("contact.D_H", contact.D_H, f"diameter of the {hole}s"),
        ("clearance", 0.5 * (contact.D_H - contact.D_P), "radial clearance"),
        ("contact.z", contact.z, "length of the contact"),
        ("pin.d", joint.pin.d, "diameter of a pin's beam"),
        ("pin.l", joint.pin.l, "length of a pin's beam"),
        ("arm.width", arm.width, f"side of an {beam}'s section along t"),
        ("arm.depth", arm.depth, f"side of an {beam}'s section along e"),
        ("arm.d", arm.d, f"diameter of a round {beam}"),
    ]
    return [(name, _mm(x), meaning) for name, x, meaning in rows if x is not None]


def _of_linkage(linkage: Linkage) -> Iterator[Line]:
    chain, drive = linkage.chain, linkage.drive
    yield "mechanism", f"{len(chain.members) + 1} members, {len(linkage.pair)} pairs", "the ground is a member"
    yield "mobility", f"{chain.mobility}", "ways in which it moves without errors and clearance"
    yield "redundant constraints", f"{chain.redundant}", "beyond those that this mobility leaves room for, eq. (1)"
    yield "largest gap", f"{1e6 * chain.gap:.2g} um", "of a loop at 1000 angles of its ideal motion"
    swings = "" if drive.swing is None else f" from {_deg(drive.swing[0])} to {_deg(drive.swing[1])}"
    yield "drive", f"{drive.member}{swings}", "driven member; the angle zero is the one of the file"
    if linkage.loaded:
        yield "loaded", linkage.loaded, "member that operation.torque acts on"
    for name, force in linkage.force.items():
        way = "turns with it" if force.turns else "keeps its direction"
        yield f"force {name}", f"{np.linalg.norm(force.force):.4g} N on {force.member}", way
    for name, pair in linkage.pair.items():
        own = {} if pair.clearance is None else {"clearance": _mm(pair.clearance)}
        if own := own | leaves(pair.joint):
            yield f"pair {name}", ", ".join(f"{key} {value}" for key, value in own.items()), "its own"
    for name, (low, high) in chain.ranges().items():
        yield name, f"{_deg(low)} to {_deg(high)}", "angle in the member before it, in a period"


def _of_points(points: Sequence[Point]) -> Iterator[Line]:
    """Lines of operating points: of one without a name its misalignment, as a joint file has no more."""
    of_joints = (
        ("of joint 1", "of joint 2") if isinstance(points[0].operation, OperationOfShaft) else ("of the shafts",)
    )
    for name, operation, share in points:
        if isinstance(operation, OperationOfLinkage):
            motion = f"{operation.speed * 30 / np.pi:.5g} rpm, {operation.torque:.5g} N m"
            yield f"operation.{name}".rstrip("."), motion, "speed of the drive, torque on the loaded member"
        elif name:
            alphas = " and ".join(map(_deg, operation.alphas))
            motion = f"{alphas}, {operation.speed * 30 / np.pi:.5g} rpm, {operation.torque:.5g} N m"
            time = "" if isnan(share) else f"; {text.percent(share)} of the time"
            yield f"operation.{name}", motion, f"misalignment {' and '.join(of_joints)}, speed, torque{time}"
        else:
            for key, alpha, of in zip(("operation.alpha", "shaft.alpha"), operation.alphas, of_joints, strict=False):
                yield key, _deg(alpha), f"misalignment {of}"


def _of_parts(joint: Joint, held: str = "the cross") -> Iterator[Line]:
    """Lines of what a joint may have beside its dimensions; `held`: what lies between thrust faces."""
    if joint.thrust is not None:
        yield "thrust.end_play", _mm(joint.thrust.end_play), f"play of {held} between its faces"
    friction = joint.friction
    if friction.mu is not None:
        yield "friction.mu", f"{friction.mu:.5g}", "coefficient of friction around the pins"
        yield "friction.mu_along", f"{friction.mu * friction.ratio:.5g}", "coefficient of friction along the pins"
    for end, borne in (("input", joint.shaft.input), ("output", joint.shaft.output)):
        if borne is not None:
            places = ", ".join(f"{1e3 * place:.5g}" for place in borne.bearings)
            yield f"shaft.{end}.bearings", f"{places} mm", f"bearings of the {end} shaft from the joint's centre"
    if unbalance := joint.shaft.unbalance:
        yield "shaft.unbalance", _gmm(unbalance.size(joint.shaft.mass)), "unbalance of the output shaft"


def _of_shaft(shaft: DriveShaft) -> Iterator[Line]:
    if isinstance(shaft.arrangement, str):
        yield "shaft.arrangement", shaft.arrangement, ARRANGEMENTS[shaft.arrangement]
    else:
        yield "shaft.arrangement", _deg(shaft.arrangement), "plane of joint 2 ahead of that of joint 1"
    yield "shaft.offset", _deg(shaft.offset), "phase of the forks of the tube, against an even output"
    yield "shaft.length", _mm(shaft.length), "from centre to centre of the joints"
    given = (shaft.tube, shaft.tube2 or shaft.tube)
    for number, (tube, lump) in enumerate(zip(given, shaft.tubes.values(), strict=False), 1):
        key, carries = ("tube2", "of joint 2") if number == 2 else ("tube", "of joint 1" if shaft.spline else "")
        size = "" if tube.diameter is None else f"{1e3 * tube.diameter:.5g} x {1e3 * (tube.wall or 0.0):.5g} mm, "
        what = "diameter, wall, mass" if size else "mass"
        yield f"shaft.{key}", f"{size}{lump.mass:.4g} kg", f"tube {carries}: {what}".replace(" :", ":")
        if tube.unbalance:
            yield f"shaft.{key}.unbalance", _gmm(tube.unbalance.size(lump.mass)), "its unbalance"


def _of_spline(shafts: Sequence[OperationOfShaft], names: str) -> Iterator[Line]:
    spline = shafts[0].shaft.spline
    if spline is not None:
        yield "shaft.spline.at", _mm(spline.at), "from joint 1 to the spline"
        yield "shaft.spline.diameter", _mm(spline.diameter), "pitch diameter"
        yield "shaft.spline.mu", f"{spline.mu:.5g}", "coefficient of friction of its flanks"
        held = ", ".join(f"{float(spline.largest_force(np.array(each.torque))):.5g}" for each in shafts)
        yield "spline force", f"{held} N", f"largest axial force that this friction holds{names}"


def _at(points: Sequence[Point]) -> str:
    """``" at drive, hill"``, or nothing of a point without a name."""
    names = ", ".join(point.name for point in points)
    return f" at {names}" if names else ""


def _mm(length: float) -> str:
    return f"{1e3 * length:.5g} mm"


def _gmm(unbalance: float) -> str:
    return f"{1e6 * unbalance:.5g} g*mm"


def _deg(angle: float) -> str:
    return f"{round(float(np.degrees(angle)), 6) + 0.0:.5g} deg"
