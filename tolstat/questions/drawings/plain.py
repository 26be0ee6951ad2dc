"""Plain picture of any mechanism from its geometry: members as lines, pins in their holes as circles, three views.

Everything is drawn at the mean input angle 0, without errors; a mechanism whose members have places of their own in
pale lines at other angles, too.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tolstat.common.mechanism import Mechanism, carried
from tolstat.display.answer import Axes, Panel
from tolstat.display.drawing import WIDTH
from tolstat.display.style import COLOURS, DASHES, INK
from tolstat.kernel.mechanics.bushing import markers
from tolstat.kernel.mechanics.motion import ideal_motion, to_hole
from tolstat.kernel.mechanics.triad import from_triad
from tolstat.kernel.mechanics.work import work_dtype
from tolstat.questions.drawings.views import MARKED, Array, Look

VIEWS = {"side": (2, 0), "top": (2, 1), "front": (0, 1)}
"""Axes to the right and upwards of each view; 0, 1, 2 are x, y, z."""
LEFT, BELOW, ABOVE = 0.66, 0.48, 0.26
"""Room beside and below a view for its scales, above it for its title, inches."""
LINES: tuple[Look, ...] = tuple(
    {"color": colour, "ls": dash, "lw": width, "zorder": 3.0 - 0.1 * width}
    for colour, dash, width in zip((COLOURS[0], COLOURS[2], INK, COLOURS[3]), DASHES, (4.2, 3.2, 2.2, 1.6), strict=True)
)
"""Looks of members: where lines coincide, each is seen beside or between the others."""
PIN: Look = {"marker": "o", "ms": 9.0, "mfc": "none", "mec": INK, "mew": 1.3, "zorder": 4, "label": "pin"}
BUSHING: Look = {"marker": "s", "ms": 4.5, "mfc": "white", "mec": INK, "mew": 0.9, "zorder": 3, "label": "bushing"}
ON_LINES: Look = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8}
NAME: Look = {"textcoords": "offset points", "ha": "center", "va": "center", "size": 8.0, "zorder": 5, "bbox": ON_LINES}
PALE: Look = {"color": INK, "lw": 0.8, "alpha": 0.25, "zorder": 1.0, "label": "at other input angles"}
PHASES = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)[1:]
"""Other input angles at which members are drawn, rad."""
FOOT = 0.25
"""Length of a shaft that is sketched where members have places of their own, relative to R."""
STRONG: Look = {"color": MARKED, "fontweight": "bold"}


class Frame(NamedTuple):
    """Frame of a member: origin, shape (3,), m, and attitude, shape (3, 3)."""

    origin: Array
    attitude: Array


Group = Mapping[str, Frame]
"""Frames of the members by name, in common axes."""


class Part(NamedTuple):
    """Pin, bushing or shaft as it is drawn.

    Attributes
    ----------
    member : str
        Its member.
    points : ndarray, shape (n, 3)
        Middle of the pin; lump, marker and base of the bushing; both ends of the shaft, the outer one last; mm.
    look : dict
        Of the sign at its place.
    """

    member: str
    points: Array
    look: Look

    @property
    def place(self) -> Array:
        """Where its name stands, shape (3,), mm."""
        place: Array = self.points[:2][-1]
        return place


def frames(mechanism: Mechanism, row: Any, phase: float = 0.0) -> Group:
    """Frames of the members by their ideal motion, at a mean input angle (rad); `row`: record of PARAM."""
    work = np.zeros(1, work_dtype(mechanism)).view(np.recarray)[0]
    ideal_motion(phase, row, work)
    if mechanism.placed:
        return {one.name: Frame(work.origin[i], work.attitude[i]) for i, one in enumerate(mechanism.members)}
    c, s = work.turned[0]
    found = {mechanism.members[0].name: np.array([(c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)])}
    for _ in mechanism.hinges:  # each pass reaches another member, until all are reached
        for k, (_, pin, hole, _) in enumerate(mechanism.hinges):
            relative = np.transpose([to_hole(k, tuple(axis), row, work) for axis in np.eye(3)])
            if hole in found:
                found.setdefault(pin, found[hole] @ relative)
            elif pin in found:
                found[hole] = found[pin] @ relative.T
    # the axis of a hinge goes through the origins of both members
    return {name: Frame(np.zeros(3), attitude) for name, attitude in found.items()}


def views(mechanism: Mechanism, row: Any, group: Group, marked: Collection[str] = ()) -> Panel:
    """Three views, all to one scale; bushings, pins and shafts in `marked` stand out.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    row : record of PARAM
        Its parameters.
    group : mapping
        Frames of its members, see `frames`.
    marked : collection of str
        Names such as ``"cross1"``, ``"pin3"``, ``"output"``.
    """
    parts = _parts(mechanism, row, group)
    phases = PHASES if mechanism.placed else ()
    others = [part for phase in phases for part in _parts(mechanism, row, frames(mechanism, row, phase)).values()]
    moved = [part.points for part in others if len(part.points) > 1]
    span = np.ptp(np.concatenate([*moved, *(part.points for part in parts.values())]), axis=0)
    size = span + 0.5 * np.max(span)
    scale = (WIDTH - 2.0 * LEFT - 0.2) / (size[2] + size[0])
    title = "The mechanism in three views"
    pairs = ", ".join(f"{pair.pin} in {pair.hole}" for pair in mechanism.pairs)
    there = ", ".join(sorted(parts.keys() & set(marked)))
    words = f"{title} at the mean input angle 0: {pairs}.{f' Marked: {there}.' if there else ''}"
    legend = 0.24 * -(-(len({part.member for part in parts.values()}) + 2 + bool(moved)) // 3)
    height = scale * (size[0] + size[1]) + 2.0 * (BELOW + ABOVE) + legend
    draw = partial(_draw, parts=parts, size=size, scale=scale, height=height, marked=marked, moved=moved)
    return Panel("plain", title, words, draw, (WIDTH, height), bare=True)


def _parts(mechanism: Mechanism, row: Any, group: Group) -> dict[str, Part]:
    """Pins, bushings and shafts by name."""
    member = {lump.name: lump.member for lump in mechanism.lumps}
    member |= {shaft.name: shaft.member for shaft in mechanism.shafts}
    at = {body: np.zeros(3) for body in member}
    for i, lump in enumerate(mechanism.lumps):
        at[lump.name] += from_triad(i, tuple(row.at[row.lump_kind[i]]), row)
    still = {shaft.name for shaft in mechanism.shafts if not shaft.carries}
    drawn: list[tuple[str, str, list[Array], Look]] = []
    feet = {mechanism.shafts[i].name: list[float]() for i in carried(mechanism)}
    for i, bushing in enumerate(mechanism.bushings):
        marker = at[bushing.base] + markers(i, row)[1]
        end = marker if bushing.base in still else at[bushing.base]
        if bushing.base in feet:
            end = marker * (0.0, 0.0, 1.0)
            feet[bushing.base].append(marker[2])
        drawn.append((bushing.name, bushing.lump, [at[bushing.lump], marker, end], BUSHING))
    for name, z in feet.items():
        low, high, foot = min(z, default=0.0), max(z, default=0.0), row.R * (FOOT if mechanism.placed else 1.0)
        ends = sorted((low - foot * (low <= 0.0), high + foot * (high >= 0.0)), key=abs)
        drawn.append((name, name, [np.array([0.0, 0.0, end]) for end in ends], {}))
    of_bushings = {name: points for name, _, points, _ in drawn}  # of a linkage they have the names of pins and eyes
    drawn += [(pair.pin, pair.pin, of_bushings.get(pair.pin, [at[pair.pin]]), PIN) for pair in mechanism.pairs]
    return {
        name: Part(member[body], 1e3 * (group[member[body]].origin + points @ group[member[body]].attitude.T), look)
        for name, body, points, look in drawn
    }


def _draw(ax: Axes, parts: dict[str, Part], size: Array, scale: float, height: float, **others: Any) -> None:
    """Draw the views, of a size in mm and a scale in inches a mm, and above them the legend; `others` as in `_view`."""
    ax.axis("off")
    ax.set_box_aspect(height / WIDTH)
    points = np.concatenate([*others["moved"], *(part.points for part in parts.values())])
    ends = 0.5 * (points.min(axis=0) + points.max(axis=0)) + np.multiply.outer((-0.5, 0.5), size)
    right_of, over = 2.0 * LEFT + scale * size[2], 2.0 * BELOW + ABOVE + scale * size[1]
    corners = ((LEFT, over), (LEFT, BELOW), (right_of, BELOW))
    for (title, (right, up)), (x, y) in zip(VIEWS.items(), corners, strict=True):
        box = (x / WIDTH, y / height, scale * size[right] / WIDTH, scale * size[up] / height)
        view = ax.inset_axes(box, xlim=ends[:, right], ylim=ends[:, up])
        view.set(xlabel=f"{'xyz'[right]} [mm]", ylabel=f"{'xyz'[up]} [mm]")
        view.set_title(title, fontsize=8.8)
        _view(view, parts, title, **others)
    entries = {label: handle for handle, label in zip(*view.get_legend_handles_labels(), strict=True)}
    ax.legend(entries.values(), entries, loc="upper left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)


def _view(view: Axes, parts: dict[str, Part], title: str, marked: Collection[str], moved: Sequence[Array]) -> None:
    """Draw the parts in one view, with the names of pins and of what is marked; `moved`: lines at other angles, mm."""
    for points in moved:
        view.plot(*points[:, VIEWS[title]].T, **PALE)
    axes, members, names = list(VIEWS[title]), list[str](), dict[tuple[float, ...], list[str]]()
    reach = 0.2 * np.ptp(view.get_xlim()), 0.08 * np.ptp(view.get_ylim())
    for name, part in parts.items():
        is_line = bool(np.ptp(part.points, axis=0).any())
        members += [part.member] * (is_line and part.member not in members)
        look: Look = LINES[members.index(part.member) % 4] if is_line else {}
        line, sign = look | {"label": part.member}, part.look
        if name in marked:
            line, sign = line | {"color": MARKED, "label": ""}, sign and sign | {"mec": MARKED, "mew": 2.4, "label": ""}
        if is_line:
            view.plot(*part.points[:, axes].T, gid=f"{title}.{name}.line", **line)
        if sign:
            view.plot(*part.place[axes], ls="", gid=f"{title}.{name}", **sign)
    for name in reversed(parts):
        if name in marked or parts[name].look is PIN:
            at = parts[name].place[axes]
            near = (other for other in names if (abs(at - other) < reach).all())
            names.setdefault(next(near, tuple(at)), []).append(name)
    for (x, y), together in names.items():
        up, heights = y > np.dot(view.get_ylim(), (0.55, 0.45)), [parts[name].place[axes[1]] for name in together]
        outside, away = (x, max(heights) if up else min(heights)), 11.0 if up else -11.0
        for look, some in ((NAME, set(together) - set(marked)), (NAME | STRONG, set(together) & set(marked))):
            if some:
                words = ", ".join(sorted(some))
                view.annotate(words, outside, (0.0, away), **look)
                away *= 2.0
