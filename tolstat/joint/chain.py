"""Ideal motion of a closed chain: Newton's iteration on its loop equations, expanded in Fourier series.

All places and directions are in ground axes as the chain stands at the angle zero. A member is moved from there by a
rotation and a shift; along a tree of pairs, from the ground outwards, each member turns in the one before it. The pairs
that are not in the tree close loops: their points coincide and their axes are parallel. These equations are solved all
together, in the sense of least squares; where some are redundant they agree, or the chain does not move.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tolstat.common.errors import InputError, input_error
from tolstat.common.late import interpolate
from tolstat.joint.material import Array

GROUND = "ground"
"""Name of the member that does not move."""
ANGLES = 1440
"""Angles at which the motion is solved, in a revolution of the drive or a period of its swing."""
CHECKED = 1000
"""Angles between these at which the series is checked."""
CLOSES = 1e-9
"""Largest gap of a loop, in units of the largest distance of two points."""
FEW_DIGITS = 1e-4
"""The same that points and axes with too few digits leave, at most."""
RANK = 1e-6
"""Singular value of the loop equations' derivatives, in units of the size, that counts as none."""
COARSE, COARSE_STEPS = math.radians(2.0), 240
"""Largest angle of a step from the angle zero to the start of a swing; steps of the first pass over a period."""
ITERATIONS, LONGEST, ROUNDING = 30, 0.2, 1e-14
"""Most iterations of Newton; longest step, and step that is rounding, rad."""
MOST_WAVES = 96
"""Largest number of orders of a series."""
WAVES = (1, 2, 4, 8, 16, 24, 32, 48, 64, MOST_WAVES)
"""Numbers of orders, of which the least that closes all loops is taken: few of them, for each compiles kernels."""
PLACE = "mechanism"


class Joined(NamedTuple):
    """A pin in an eye: two members, the point and the unit vector of the axis about which one turns in the other."""

    pin: str
    eye: str
    point: Array
    axis: Array


class Turning(NamedTuple):
    """A member that turns in another: its parent, a point and the axis, and its angle as a series.

    Attributes
    ----------
    parent : str
        Member in which it turns.
    point, axis : ndarray, shape (3,)
        Where, at the angle zero.
    angle : tuple of float
        Angle at the phase zero (rad) and its turns in a revolution of the phase.
    wave : ndarray, shape (waves, 2)
        Factors of cosine and sine of each order of the phase, rad.
    """

    parent: str
    point: Array
    axis: Array
    angle: tuple[float, float]
    wave: Array


class Chain(NamedTuple):
    """A chain and its ideal motion.

    Attributes
    ----------
    members : dict of str to Turning
        Members but the ground, each after its parent.
    mobility, redundant : int
        Ways in which it moves; number of constraints beyond those that this leaves room for.
    gap : float
        Largest gap of a loop at `CHECKED` angles, m.
    size : float
        Largest distance of two points, m.
    """

    members: dict[str, Turning]
    mobility: int
    redundant: int
    gap: float
    size: float

    def ranges(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest angle of each member in the one before it over a period, rad."""
        angles = angles_at(self.members, 2.0 * math.pi * np.arange(CHECKED + 1) / CHECKED)
        return {name: (float(of.min()), float(of.max())) for name, of in zip(self.members, angles.T, strict=True)}


class _Loops(NamedTuple):
    """The equations: members with their parent and pair, the angle of the first of which is given; closing pairs."""

    tree: dict[str, tuple[str, Joined]]
    closing: tuple[Joined, ...]
    size: float


def solve(pairs: Mapping[str, Joined], drive: Joined, swing: tuple[float, float] | None = None) -> Chain:
    """Ideal motion of a chain.

    Parameters
    ----------
    pairs : mapping of str to Joined
        Its pairs by name.
    drive : Joined
        Ground, driven member, and the axis of its turn.
    swing : tuple of float, optional
        Angles between which the driven member swings, rad; when left out it turns.

    Raises
    ------
    InputError
        Where members do not hang together, the chain moves in no or in several ways, or loops do not close.
    """
    loops = _loops(pairs, drive)
    phases = 2.0 * math.pi * np.arange(ANGLES + 1) / ANGLES
    driven = phases if swing is None else swing[0] + 0.5 * (swing[1] - swing[0]) * (1.0 - np.cos(phases))
    found = _follow(loops, driven)
    between = 2.0 * math.pi * (np.arange(CHECKED) + 0.5) / CHECKED
    free, redundant = _mobility(loops, found)
    if free != 1:
        raise _not_of_one(loops, free, redundant)
    for waves in WAVES:
        members = _series(loops, found, waves)
        gap = float(_gaps(loops, angles_at(members, between)).max())
        if gap <= CLOSES * loops.size:
            return Chain(members, free, redundant, gap, loops.size)
    raise input_error(PLACE, f"moves too abruptly: {MOST_WAVES} orders leave a gap of {gap:.2g} m", "swing it less far")


def _loops(pairs: Mapping[str, Joined], drive: Joined) -> _Loops:
    """Hang each member on one that is nearer to the ground, by the first pair that does."""
    tree, closing, left = {drive.eye: (GROUND, drive)}, [], list(pairs.values())
    for pair in left:
        if {pair.pin, pair.eye} == {GROUND, drive.eye} and _on_axis(pair, drive):
            left.remove(pair)  # the drive turns the member in it
            break
    reached = [GROUND, drive.eye]
    for parent in reached:  # grows; the nearer to the ground, the earlier
        for pair in [pair for pair in left if parent in (pair.pin, pair.eye)]:
            left.remove(pair)
            child = pair.eye if pair.pin == parent else pair.pin
            if child in reached:
                closing.append(pair)
            else:
                tree[child] = parent, pair
                reached.append(child)
    if left:
        names = sorted({name for pair in left for name in (pair.pin, pair.eye)})
        raise input_error(PLACE, f"{', '.join(names)} do not hang together with the drive", "add a pair")
    points = np.array([drive.point, *(pair.point for pair in pairs.values())])
    size = float(np.linalg.norm(points[:, None] - points[None], axis=-1).max())
    return _Loops(tree, tuple(closing), size or 1.0)


def _on_axis(pair: Joined, drive: Joined) -> bool:
    """Whether a pair lies on the axis of the drive."""
    apart = np.cross(pair.point - drive.point, drive.axis)
    return bool(np.allclose(apart, 0.0) and np.allclose(np.cross(pair.axis, drive.axis), 0.0))


def rotations(axis: Array, angles: Array) -> Array:
    """Rotations about a unit vector, (n, 3, 3), by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross))


def moved(tree: Mapping[str, tuple[str, Array, Array]], angles: Array) -> dict[str, tuple[Array, Array]]:
    """Rotation, (n, 3, 3), and shift, (n, 3), of each member from where it is at the angle zero.

    `tree`: parent, point and axis of each member but the ground; `angles`: (n, members).
    """
    n = len(angles)
    found = {GROUND: (np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3)))}
    for i, (member, (parent, point, axis)) in enumerate(tree.items()):
        turn, shift = found[parent]
        own = turn @ rotations(axis, angles[:, i])
        found[member] = own, shift + (turn - own) @ point
    return found


def _equations(loops: _Loops, angles: Array) -> tuple[Array, Array]:
    """Gaps of all loops, (n, equations), and their derivatives by the angles, (n, equations, members), m.

    Three equations are the gap of the points, three that of the axes, times the size.
    """
    tree = {member: (parent, pair.point, pair.axis) for member, (parent, pair) in loops.tree.items()}
    at, names, n = moved(tree, angles), list(loops.tree), len(angles)
    gaps = np.zeros((n, len(loops.closing), 6))
    slopes = np.zeros((n, len(loops.closing), 6, len(names)))
    for number, (pin, eye, point, axis) in enumerate(loops.closing):
        places = {member: at[member][0] @ point + at[member][1] for member in (pin, eye)}
        axes = {member: at[member][0] @ axis for member in (pin, eye)}
        gaps[:, number, :3] = places[pin] - places[eye]
        gaps[:, number, 3:] = loops.size * np.cross(axes[eye], axes[pin])
        for sign, end, other in ((1.0, pin, eye), (-1.0, eye, pin)):
            member = end
            while member != GROUND:
                parent, pair = loops.tree[member]
                turn, shift = at[parent]
                about, arm = turn @ pair.axis, places[end] - (turn @ pair.point + shift)
                i = names.index(member)
                slopes[:, number, :3, i] += sign * np.cross(about, arm)
                slopes[:, number, 3:, i] += sign * loops.size * np.cross(axes[other], np.cross(about, axes[end]))
                member = parent
    return gaps.reshape(n, -1), slopes.reshape(n, -1, len(names))


def _gaps(loops: _Loops, angles: Array) -> Array:
    return np.asarray(np.abs(_equations(loops, angles)[0]).max(axis=1, initial=0.0))


def _follow(loops: _Loops, driven: Array) -> Array:
    """Angles of the members, (angles, members), from the angle zero of the drive on and along `driven`."""
    start = np.zeros(len(loops.tree))
    for angle in np.linspace(0.0, driven[0], 1 + math.ceil(abs(driven[0]) / COARSE)):
        start = _one(loops, start, float(angle))
    steps = max(1, len(driven) // COARSE_STEPS)
    coarse, before = [start], start
    for angle in driven[steps::steps]:
        guess = 2.0 * coarse[-1] - before
        before = coarse[-1]
        coarse.append(_one(loops, guess, float(angle)))
    index = np.arange(len(driven))
    found = np.asarray(interpolate.CubicSpline(index[::steps], np.array(coarse))(index))
    found[:, 0] = driven
    return _closed(loops, found)


def _one(loops: _Loops, guess: Array, angle: float) -> Array:
    """Angles that close all loops near a guess, that of the drive as given."""
    return np.asarray(_closed(loops, np.array([[angle, *guess[1:]]]))[0])


def _closed(loops: _Loops, guess: Array) -> Array:
    """Angles of the members, (n, members), that close all loops near a guess, those of the drive as given."""
    angles = guess.copy()
    for _ in range(ITERATIONS if angles.shape[1] > 1 else 0):
        gaps, slopes = _equations(loops, angles)
        step = -(np.linalg.pinv(slopes[:, :, 1:], rcond=RANK) @ gaps[:, :, None])[:, :, 0]
        size = np.abs(step).max(axis=1, keepdims=True)
        angles[:, 1:] += step * np.minimum(1.0, LONGEST / np.maximum(size, LONGEST))
        if size.max() < ROUNDING:
            break
    left = _gaps(loops, angles)
    open_at = np.flatnonzero(~(left <= CLOSES * loops.size))
    if not len(open_at):
        return angles
    raise _open(loops, math.degrees(guess[open_at[0], 0]), left[open_at[0]])


def _open(loops: _Loops, angle: float, gap: float) -> InputError:
    """Fault of a chain that leaves a gap (m) at an angle of the drive, degrees."""
    is_rounded = gap < FEW_DIGITS * loops.size
    remedy = "give points and axes with more digits" if is_rounded else "check points and axes"
    if angle == 0.0:
        return input_error(PLACE, f"a loop has a gap of {gap:.3g} m at the angle zero", remedy)
    free, redundant = _mobility(loops, np.zeros((1, len(loops.tree))))
    if free < 1 and not is_rounded:
        return _not_of_one(loops, free, redundant)
    found = f"the drive cannot turn to {angle:.1f} deg: a loop leaves a gap of {gap:.2g} m there"
    return input_error(PLACE, found, f"{remedy}, or let it swing: drive.swing = [...]")


def _not_of_one(loops: _Loops, free: int, redundant: int) -> InputError:
    """Fault of a chain that moves in `free` ways, with this number of redundant equations."""
    ways = "does not move" if free < 1 else f"moves in {free} ways"
    found = (
        f"{ways}: {len(loops.tree)} members move, {6 * len(loops.closing)} equations of loops, {redundant} redundant"
    )
    remedy = "check axes, or add or remove a member or a pair: one drive needs a mobility of one"
    return input_error(PLACE, found, remedy)


def _mobility(loops: _Loops, found: Array) -> tuple[int, int]:
    """Ways in which the chain moves, and the number of redundant equations: by the largest rank at twelve angles."""
    rank = 0
    if loops.closing:
        slopes = _equations(loops, found[:: max(1, len(found) // 12)])[1]
        values = np.linalg.svd(slopes, compute_uv=False)
        rank = int((values > RANK * loops.size).sum(axis=1).max())
    return len(loops.tree) - rank, 5 * len(loops.closing) - rank


def _series(loops: _Loops, found: Array, waves: int) -> dict[str, Turning]:
    """Fourier series of the members' angles."""
    members, phase = {}, 2.0 * math.pi * np.arange(ANGLES) / ANGLES
    for i, (member, (parent, pair)) in enumerate(loops.tree.items()):
        turns = round((found[-1, i] - found[0, i]) / (2.0 * math.pi))
        if abs(found[-1, i] - found[0, i] - 2.0 * math.pi * turns) > 1e-6:
            found_text = f"{member} is not back after a revolution of the drive"
            raise input_error(PLACE, found_text, "let it swing: drive.swing = [...]")
        spectrum = np.fft.rfft(found[:-1, i] - turns * phase) / ANGLES
        wave = np.stack([2.0 * spectrum.real, -2.0 * spectrum.imag], axis=1)[1 : waves + 1]
        members[member] = Turning(parent, pair.point, pair.axis, (float(spectrum[0].real), float(turns)), wave)
    return members


def angles_at(members: Mapping[str, Turning], phases: Array) -> Array:
    """Angles of the members at phases (rad), (n, members), by their series."""
    found = []
    for of in members.values():
        order = np.arange(1, len(of.wave) + 1) * phases[:, None]
        found.append(of.angle[0] + of.angle[1] * phases + np.cos(order) @ of.wave[:, 0] + np.sin(order) @ of.wave[:, 1])
    return np.stack(found, axis=1)
