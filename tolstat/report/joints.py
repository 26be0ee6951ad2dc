"""Joints on the page: the worst ones with their histories, contact modes, and those that failed or did not settle."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from tolstat.common.tables import BUSHINGS, PINS, STATUS_TEXT, Mode, Status
from tolstat.display import drawing, style, text
from tolstat.display.blocks import Block, Panel, Panels, Section, Table, Text
from tolstat.questions.causes import angles_figure as angles
from tolstat.report.findings import Findings, Worst

ERRORS = 4
"""Number of errors listed for each joint."""
SIGNIFICANT = 0.05
MODE_COLOURS = ("#E6E6E6", style.COLOURS[3], style.COLOURS[1], style.COLOURS[0])


def worst_section(found: Findings) -> Section:
    """The joints with the largest of the leading loads."""
    blocks: list[Block] = []
    panels = [_history_panel(worst, found) for worst in found.worst if worst.revolutions is not None]
    blocks += [Panels(panels)] if panels else []
    for worst in found.worst:
        rows = []
        for joint in worst.joints:
            errors = ",  ".join(f"{name} {z:+.1f} σ" for name, z in list(joint.scores.items())[:ERRORS])
            rows.append([str(joint.row), text.value(joint.value, worst.unit), joint.status.label, errors])
        head = ["row", worst.load, "status", "largest errors, in standard deviations"]
        blocks.append(Table(f"Largest {worst.load}", head, rows, frozenset({0, 2, 3})))
    blocks.append(Text("Any of them again, in full: tolstat replay FILE --row ROW --out trace.csv", small=True))
    return Section("worst", "The worst joints", blocks)


def _history_panel(worst: Worst, found: Findings) -> Panel:
    assert worst.revolutions is not None
    rows = ", ".join(f"row {joint.row} up to {text.value(joint.value, worst.unit)}" for joint in worst.joints[:3])
    return Panel(
        f"worst-{worst.load.replace('.', '-')}",
        f"{worst.load} of the worst joints over the revolution",
        f"Histories of the worst joints: {rows}",
        partial(_histories, worst=worst, found=found),
        (4.9, 3.3),
    )


def _histories(ax: Axes, worst: Worst, found: Findings) -> None:
    revolutions = worst.revolutions
    assert revolutions is not None
    bushing, _, letter = worst.load.partition(".")
    loads = (revolutions.F if letter == "F" else revolutions.T)[:, :, BUSHINGS.index(bushing)]
    theta, loads = angles.theta_axis(ax, revolutions.angles), angles.closed(loads)
    of_row = dict(zip(revolutions.rows.tolist(), loads, strict=True))
    for i, joint in enumerate(joint for joint in worst.joints if joint.row in of_row):
        label = f"row {joint.row}"
        ax.plot(theta, of_row[joint.row], color=style.COLOURS[i], ls=style.DASHES[i], lw=1.3, label=label)
    angle = next((angle for angle in found.angles if angle.load == worst.load), None)
    if angle is not None:
        low, _, high = angles.closed(angle.spread)
        around = angles.theta_axis(ax, angle.angles)
        ax.fill_between(around, low, high, color=style.FAINT, alpha=0.25, lw=0, label="5 to 95 %")
    limit = found.campaign.limits.get(worst.load)
    if limit is not None:
        ax.axhline(limit, color=style.INK, lw=1.2, ls=(0.0, (8.0, 3.0)), label="limit")
    unit = text.UNITS.get(worst.unit, worst.unit)
    ax.set(ylabel=f"|{worst.load}| [{unit}]", ylim=(0.0, 1.3 * np.nanmax(loads)))
    ax.legend(loc="upper right", ncols=3, columnspacing=1.2, handlelength=2.0)


def modes_section(found: Findings) -> Section:
    """Contact modes: mean share of the revolution that each pin spends in each mode."""
    words = [mode.name.lower().replace("_", " ") for mode in Mode]
    rows = [[pin, *(text.percent(share) for share in line)] for pin, line in zip(PINS, found.modes, strict=True)]
    said = "; ".join(f"{row[0]}: " + ", ".join(f"{w} {v}" for w, v in zip(words, row[1:], strict=True)) for row in rows)
    panel = Panel("modes", "Contact modes", said, partial(_modes, found=found, words=words), (4.9, 2.0), 0.6)
    note = "Share of the revolution that each pin spends in each mode, mean of the settled joints. None: the pin "
    note += "touches nothing; one point: one end; two point: both ends, on opposite sides; uniform: along the hole."
    table = Table("Mean share of the revolution", ["pin", *words], rows)
    return Section("modes", "How the pins touch", [Panels([panel]), table, Text(note, small=True)])


def _modes(ax: Axes, found: Findings, words: list[str]) -> None:
    drawing.rows(ax, list(PINS))
    left = np.zeros(4)
    for k, word in enumerate(words):
        share = 100.0 * found.modes[:, k]
        ax.barh(range(4), share, left=left, height=0.62, color=MODE_COLOURS[k], edgecolor="white", label=word)
        left += share
    ax.set(xlim=(0.0, 100.0), xlabel="share of the revolution [%]")
    drawing.legend_above(ax, *ax.get_legend_handles_labels())


def lost_section(found: Findings) -> Section:
    """Joints without a valid result: number, reason, and how their errors differ from those of settled joints."""
    states = {status.label: status for status in Status}
    rows = [[name, str(count), STATUS_TEXT[states[name]]] for name, count in found.counts.items() if count]
    blocks: list[Block] = [Table("What became of the joints", ["status", "joints", "meaning"], rows, frozenset({0, 2}))]
    if not found.lost:
        said = "No joint failed, and all settled." if found.counts["ok"] else "No joint has been simulated yet."
        return Section("lost", "Failed and unsettled joints", [*blocks, Text(said)])
    if found.lost_errors is not None:
        blocks.append(Panels([_lost_panel(found)]))
        blocks.append(Text(_lost_note(found), small=True))
    else:
        blocks.append(Text("Too few, or too few settled ones, to compare their errors: ten on either side are needed."))
    rows = [[str(joint.row), joint.status, joint.remedy] for joint in found.lost]
    blocks.append(Table("The first of them", ["row", "status", "what to do"], rows, frozenset({0, 1, 2})))
    return Section("lost", "Failed and unsettled joints", blocks)


def _lost_panel(found: Findings) -> Panel:
    table = found.lost_errors
    assert table is not None
    top = table.head(10)
    said = "; ".join(
        f"{row['error']}: larger {row['direction']:.2f}, farther from the middle {row['size']:.2f}"
        for row in top.head(4).to_dict("records")
    )
    return Panel(
        "lost-errors",
        "Failures in the space of errors",
        f"Probability that a joint without a valid result has the larger error than a settled one. {said}",
        partial(_lost, found=found),
        (4.9, drawing.rows_height(len(top)) + 0.2),
        1.2,
    )


def _lost(ax: Axes, found: Findings) -> None:
    table = found.lost_errors
    assert table is not None
    top = table.head(10)
    drawing.rows(ax, list(top["error"]))
    for shift, key, label in ((-0.16, "direction", "larger"), (0.16, "size", "farther from the middle")):
        colour = style.COLOURS[0 if key == "direction" else 1]
        place = np.arange(len(top)) + shift
        if top[f"{key}_lower"].notna().any():
            ax.hlines(place, top[f"{key}_lower"], top[f"{key}_upper"], color=colour, lw=1.4)
        ax.plot(top[key], place, "o" if key == "direction" else "D", ms=4.5, color=colour, ls="", label=label)
    ax.axvline(0.5, color=style.INK, lw=0.9)
    ax.set(xlim=(0.0, 1.0), xlabel="probability that the lost joint has the error that is …")
    drawing.legend_above(ax, *ax.get_legend_handles_labels())


def _lost_note(found: Findings) -> str:
    table = found.lost_errors
    assert table is not None
    marked = table[(table["direction_p"] < SIGNIFICANT) | (table["size_p"] < SIGNIFICANT)]["error"]
    said = f"Beyond chance (Wilcoxon–Mann–Whitney, Holm): {', '.join(marked)}." if len(marked) else ""
    return said or "No error plays a part beyond chance (Wilcoxon–Mann–Whitney, Holm)."
