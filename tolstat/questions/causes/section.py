"""Causes on the page: indices of the leading loads, shares against the shaft angle; and the worst joints."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tolstat.common.aside import mapped
from tolstat.common.channels import CHANNELS
from tolstat.common.errors import TolstatError
from tolstat.common.loads import unit_text
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Table, Text
from tolstat.display.table import as_block
from tolstat.questions.causes import angles_figure, pairs_section, rendering, tail_section
from tolstat.questions.causes.angles import AgainstAngle, against_angle
from tolstat.questions.causes.query import Causes, causes_of
from tolstat.store.view import View

JOINTS = 20_000
"""Maximum number of joints (the first ones) used for causes: more add little and take memory."""
ALONE, IN_ALL = "alone (first order), 95 %", "in all (bounds of the total index)"


def sections(view: View, asked: Asked) -> list[Section]:
    """Sections ``pairs``, ``causes`` and ``worst`` of the leading loads; none for a sweep or without a valid joint.

    The causes of a load with a long tail are those of its logarithm. What cannot be evaluated is left out, and a note
    says why.
    """
    if view.method == "sweep" or not view.count(*VALID):
        return []
    made = pairs_section.sections(view, asked)
    with asked.noting("causes and worst joints are left out"):
        logarithmic = frozenset(load.name for load in view.loads(view.leading) if load.long_tailed)
        is_design = bool(view.study.groups)
        if len(view.points) > 1:
            asked = replace(asked, replay=0)  # histories are those of one operating point
        causes, against = _causes(view, asked, logarithmic, is_design)
        made += [_section(causes, against, logarithmic)] if causes or against else []
        made += [tail_section.section(view, view.leading, against, asked.replay > 0)] if view.leading else []
        return made
    return []


def _causes(
    view: View, asked: Asked, logarithmic: Container[str], is_design: bool
) -> tuple[list[Causes], list[AgainstAngle]]:
    """Causes of the leading loads, over the joints and at each shaft angle."""
    causes: list[Causes] = []
    against: list[AgainstAngle] = []
    with asked.noting("causes are left out"):
        view.check("index")
        jobs = [partial(causes_of, view, load, log=load in logarithmic, joints=JOINTS) for load in view.leading]
        tried = mapped([partial(_tried, job) for job in jobs], min(asked.processes, 2))
        for load, job, found in zip(view.leading, jobs, tried, strict=True):
            with asked.noting(f"no causes of {load}"):
                causes.append(found or job())  # which raises what it raised before
        followed = [load for load in view.leading if load in CHANNELS]
        if asked.replay and followed and not is_design:
            with asked.noting("nothing against the shaft angle"):
                against = against_angle(view, followed, asked.replay, logarithmic)
    return causes, against


def _tried(job: Callable[[], Causes]) -> Causes | None:
    """Result of a job; None where it cannot be had."""
    try:
        return job()
    except TolstatError:
        return None


def _section(causes: Sequence[Causes], against: Sequence[AgainstAngle], logarithmic: Container[str]) -> Section:
    blocks: list[Block] = []
    if causes:
        blocks.append(Text(_introduction(causes, logarithmic)))
        blocks.append(Panels([_tornado_panel(found, _quantity(found.load, logarithmic)) for found in causes]))
    for found in causes:
        title = f"{_quantity(found.load, logarithmic)}: share of the variance, direction, and part in the tail"
        blocks.append(as_block(title, rendering.columns(found), rendering.largest(found, rendering.SHOWN)))
        notes = rendering.note(found, found.load in logarithmic).splitlines()
        blocks += [Text(text.sentence(line), small=True) for line in notes]
    if against:
        pairs = [_angle_panels(angle, _quantity(angle.load, logarithmic)) for angle in against]
        blocks.append(Panels([panel for pair in pairs for panel in pair]))
        blocks.append(_angle_table(against))
        blocks.append(Text(angles_figure.note(against[0], against[0].load in logarithmic), small=True))
    return Section("causes", "Which errors are the cause", blocks)


def _quantity(load: str, logarithmic: Container[str]) -> str:
    """Name of the decomposed quantity: the load, or its logarithm for a load with a long tail."""
    return f"log {load}" if load in logarithmic else load


def _introduction(causes: Sequence[Causes], logarithmic: Container[str]) -> str:
    said = [
        "Bars: share of a load's variance that vanishes when the error is removed (first-order index).",
        "The rest up to 100 % comes from errors that act together.",
    ]
    if any(rendering.has_narrow_bounds(found.table) for found in causes):
        said.append("Grey: share that the error takes part in, alone or with others (bounds of the total index).")
    if any(found.load in logarithmic for found in causes):
        said.append("Where a few joints with large loads dominate the variance, it is that of the logarithm.")
    if causes[0].table["first_lower"].isna().all():
        said.append("No intervals: the samples are not independent.")
    return " ".join(said)


def _tornado_panel(causes: Causes, quantity: str) -> Panel:
    part = causes.table.head(rendering.SHOWN)
    top = ", ".join(f"{row['error']} {100 * row['first']:.1f} %" for row in part.head(5).to_dict("records"))
    return Panel(
        f"tornado-{causes.load}",
        f"{quantity}: share of the variance by error",
        f"Largest first-order indices: {top}; all errors alone {100 * causes.additive:.0f} %",
        partial(_tornado, causes=causes, quantity=quantity),
        (4.9, drawing.rows_height(len(part)) + 0.25),
        left := drawing.rows_left(list(part["error"])),
        drawing.legend_room([ALONE, *([IN_ALL] if rendering.has_narrow_bounds(causes.table) else [])], left),
    )


def _tornado(ax: Axes, causes: Causes, quantity: str) -> None:
    part = causes.table.head(rendering.SHOWN)
    place = np.arange(len(part))
    drawing.rows(ax, list(part["error"]))
    first = 100.0 * part["first"].clip(lower=0.0).to_numpy()
    ax.barh(place, first, height=0.5, color=style.COLOURS[0], zorder=2)
    handles: list[Patch | Line2D] = [Patch(color=style.COLOURS[0])]
    labels = [ALONE]
    if rendering.has_narrow_bounds(causes.table):
        low, high = (100.0 * part[f"total_{end}"].to_numpy() for end in ("lower", "upper"))
        ax.barh(place, high - low, left=low, height=0.74, color=drawing.GREY, alpha=0.45, zorder=1)
        handles.append(Patch(color=drawing.GREY, alpha=0.45))
        labels.append(IN_ALL)
    if part["first_lower"].notna().any():
        low, high = (100.0 * part[f"first_{end}"].to_numpy() for end in ("lower", "upper"))
        ax.hlines(place, low, high, color=style.INK, lw=1.2, zorder=3)
    ax.set_xlim(0.0, None)
    drawing.legend_above(ax, handles, labels)
    ax.set_xlabel(f"share of the variance of {quantity} [%]")


def _angle_panels(angle: AgainstAngle, quantity: str) -> list[Panel]:
    key, unit = angle.load, unit_text(angle.unit)
    middle = angle.spread[1]
    loads = Panel(
        f"angle-{key}",
        f"{angle.load} over the revolution",
        f"Median of the joints between {middle.min():.4g} and {middle.max():.4g} {unit} over the shaft angle; "
        f"95 % of the joints stay below {angle.spread[2].max():.4g} {unit} everywhere",
        partial(_with_legend, draw=angles_figure.loads, angle=angle),
        (4.9, 3.1),
        top=drawing.legend_room(angles_figure.LOADS),
    )
    estimates = list(zip(angle.names, angle.overall.estimate, strict=True))
    top = ", ".join(f"{name} {100 * share:.1f} %" for name, share in estimates[: angles_figure.LINES])
    shares = Panel(
        f"angle-shares-{key}",
        f"{quantity}: share of the variance against the shaft angle",
        f"Over the whole revolution: {top}",
        partial(_with_legend, draw=angles_figure.shares, angle=angle),
        (4.9, 3.1),
        top=drawing.legend_room(angle.names[: angles_figure.LINES]),
    )
    return [loads, shares]


def _with_legend(ax: Axes, draw: Callable[[Axes, AgainstAngle], None], angle: AgainstAngle) -> None:
    draw(ax, angle)
    drawing.legend_above(ax, *ax.get_legend_handles_labels())


def _angle_table(against: Sequence[AgainstAngle]) -> Table:
    head, rows = ["error"], []
    for angle in against:
        head += [f"{angle.load}, %", "95 % interval"]
    order = dict.fromkeys(name for angle in against for name in angle.names[: angles_figure.LINES])
    for name in order:
        cells = [name]
        for angle in against:
            i = angle.names.index(name)
            estimate, low, high = (100.0 * part[i] for part in angle.overall[:3])
            cells += [f"{estimate:.1f}", "-" if np.isnan(low) else f"{low:.1f} .. {high:.1f}"]
        rows.append(cells)
    sums = [f"{100 * float(np.nansum(angle.overall.estimate)):.0f}" for angle in against]
    rows.append(["all errors alone", *(cell for share in sums for cell in (share, ""))])
    return Table("Share of the variance over the whole revolution, every angle weighted by its variance", head, rows)
