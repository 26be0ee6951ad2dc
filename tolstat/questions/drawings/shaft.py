"""Picture of a drive shaft to scale: shafts and tubes from the side and from above, forks seen along the tube."""

from __future__ import annotations

from functools import partial

import numpy as np

from tolstat.display.answer import Axes, Panel
from tolstat.display.drawing import WIDTH
from tolstat.display.style import COLOURS, DASHES, FAINT, INK
from tolstat.joint import Joint, OperationOfShaft, joints_of
from tolstat.questions.drawings.views import Array, Look

LEFT, RIGHT, SCALE, TITLE, LEAST, FORKS = 0.62, 0.1, 0.5, 0.26, 0.75, 1.25
"""Room beside a view, below it for its scale and above it for its title; least height of a view, size of forks; in."""
LINES = {"tube": (1, COLOURS[0], 5.0), "input shaft": (0, COLOURS[1], 2.4), "output shaft": (2, COLOURS[2], 2.4)}
"""Number of the first end of each line, its colour and width."""
SPLINE: Look = {"marker": "|", "ls": "", "ms": 14.0, "mew": 2.0, "color": INK}
JOINT: Look = {"marker": "o", "ls": "", "ms": 7.0, "mfc": "white", "mec": INK, "mew": 1.4, "zorder": 5}
BEARING: Look = {"marker": "^", "ls": "", "ms": 6.0, "mfc": "white", "mec": INK, "mew": 1.1, "zorder": 5}
ARROW: Look = {"arrowstyle": "->", "color": INK, "ls": DASHES[3]}
NAME: Look = {"textcoords": "offset points", "ha": "center", "va": "center", "size": 8.0}


def picture(joint: Joint, operation: OperationOfShaft) -> Panel:
    """Return the picture at an operating point, without errors, at the mean input angle 0."""
    shaft = operation.shaft
    ends, bearings = points_of(joint, operation)
    reach = np.ptp(ends, axis=0)
    scale = (WIDTH - LEFT - RIGHT) / (1.06 * reach[2])
    heights = [max(LEAST, 1.2 * scale * reach[axis] + 0.5) for axis in (0, 1)]
    size = WIDTH, TITLE + sum(heights) + 2 * (SCALE + TITLE) + FORKS
    words = (
        f"Drive shaft of {1e3 * shaft.length:.4g} mm: joint 1 of {np.degrees(operation.alpha):.4g} deg, "
        f"{shaft.in_words}; from the side, in the plane of joint 1; from above; and the forks, seen along the tube"
    )
    draw = partial(_draw, ends=ends, bearings=bearings, operation=operation, heights=heights, scale=scale, size=size)
    return Panel("drive-shaft", "The drive shaft, to scale", words, draw, size, bare=True)


def points_of(joint: Joint, operation: OperationOfShaft) -> tuple[Array, Array]:
    """Outer end of the input shaft, joints 1 and 2, outer end of the output shaft, (4, 3); bearings, (n, 3); mm.

    z is along the input shaft, x in the plane of joint 1. Shafts without bearings are sketched.
    """
    shaft, (first, second) = operation.shaft, operation.alphas
    c, s = np.cos(first), np.sin(first)
    of_tube = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    behind = of_tube @ (np.sin(second) * np.cos(shaft.plane), np.sin(second) * np.sin(shaft.plane), np.cos(second))
    centres = np.array([np.zeros(3), of_tube @ (0.0, 0.0, 1e3 * shaft.length)])
    ends, bearings = [], []
    one, two = joints_of(joint, operation)
    for own, centre, away in zip((one.shaft.input, two.shaft.output), centres, ((0.0, 0.0, -1.0), behind), strict=True):
        places = [] if own is None else [1e3 * place for place in own.bearings]
        ends.append(centre + 1.1 * max(places, default=200.0 * shaft.length) * np.array(away))
        bearings += [centre + place * np.array(away) for place in places]
    return np.array([ends[0], *centres, ends[1]]), np.reshape(bearings, (-1, 3))


def _draw(
    ax: Axes,
    ends: Array,
    bearings: Array,
    operation: OperationOfShaft,
    heights: list[float],
    scale: float,
    size: tuple[float, float],
) -> None:
    """Draw the views, of heights in inches and a scale in inches a mm, and the forks below them."""
    ax.axis("off")
    ax.set_box_aspect(size[1] / size[0])
    middle, wide, bottom = 0.5 * (ends.min(axis=0) + ends.max(axis=0)), WIDTH - LEFT - RIGHT, size[1] - TITLE
    spline = operation.shaft.spline
    for title, axis, height in (("side", 0, heights[0]), ("top", 1, heights[1])):
        bottom -= height
        view = ax.inset_axes((LEFT / WIDTH, bottom / size[1], wide / WIDTH, height / size[1]))
        bottom -= SCALE + TITLE
        view.set_title(title, fontsize=8.8)
        half = 0.5 * np.array([wide, height]) / scale
        view.set(xlim=middle[2] + half[0] * np.array([-1, 1]), ylim=middle[axis] + half[1] * np.array([-1, 1]))
        view.set(xlabel="z [mm]", ylabel=f"{'xy'[axis]} [mm]")
        for name, (i, colour, width) in LINES.items():
            of_line = ends[i : i + 2, [2, axis]].T
            view.plot(*of_line, color=colour, lw=width, label=name, solid_capstyle="butt", gid=f"{title}.{name}")
        if spline is not None:
            at = ends[1] + spline.at / operation.shaft.length * (ends[2] - ends[1])
            view.plot(at[2], at[axis], label="spline", gid=f"{title}.spline", **SPLINE)
        if len(bearings):
            view.plot(*bearings[:, [2, axis]].T, label="bearing", gid=f"{title}.bearings", **BEARING)
        view.plot(*ends[1:3, [2, axis]].T, label="Cardan joint", gid=f"{title}.joints", **JOINT)
        for number, (place, alpha) in enumerate(zip(ends[1:3], operation.alphas, strict=True), 1):
            view.annotate(f"joint {number}, {np.degrees(alpha):.4g}°", place[[2, axis]], (0.0, 14.0), **NAME)
    box = (0.2 / WIDTH, 0.05 / size[1], FORKS / WIDTH, FORKS / size[1])
    forks = ax.inset_axes(box)
    _draw_forks(forks, operation)
    entries = {
        label: handle for one in (view, forks) for handle, label in zip(*one.get_legend_handles_labels(), strict=True)
    }
    ax.legend(
        entries.values(), entries, loc="lower left", bbox_to_anchor=((FORKS + 0.6) / WIDTH, 0.0), ncols=2, frameon=False
    )


def _draw_forks(view: Axes, operation: OperationOfShaft) -> None:
    """Forks on the tube, and the planes in which both joints bend, seen along the tube at the mean input angle 0."""
    shaft = operation.shaft
    view.set_title("forks on the tube", fontsize=8.8)
    # at the mean input angle 0 the output fork of joint 1 stands across its plane
    turned = 0.5 * np.pi, 0.5 * np.pi + shaft.offset + shaft.plane
    for number, (angle, length, width) in enumerate(zip(turned, (1.0, 0.8), (5.0, 2.2), strict=True), 1):
        x, y = length * np.cos(angle), length * np.sin(angle)
        colour, label = (FAINT, INK)[number - 1], f"fork of joint {number}"
        view.plot([-y, y], [-x, x], color=colour, lw=width, label=label, gid=f"fork.{number}")
    for number, angle in enumerate((0.0, shaft.plane), 1):
        x, y = np.sin(angle), np.cos(angle)
        view.annotate("", (1.1 * x, 1.1 * y), (0.0, 0.0), arrowprops=ARROW)
        view.annotate(f"plane {number}", (1.32 * x, 1.32 * y), (0.0, 0.0), **NAME)
    view.set(xlim=(-1.6, 1.6), ylim=(-1.6, 1.6), xticks=[], yticks=[])
    view.spines[:].set_visible(False)
