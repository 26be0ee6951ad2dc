"""What became of the joints, on the page: contact modes, and joints without a valid load."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from tolstat.common.load_kinds import PINS
from tolstat.common.tables import FAILED, STATUS_TEXT, UNSETTLED, VALID, Mode, Status
from tolstat.display import drawing, style, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Panel, Panels, Section, Table, Text
from tolstat.questions.joints import query, tolerances
from tolstat.store.view import View

SIGNIFICANT = 0.05
PARTS = ("larger", "farther from the middle")
MODE_COLOURS = ("#E6E6E6", style.COLOURS[3], style.COLOURS[1], style.COLOURS[0])


def sections(view: View, asked: Asked) -> list[Section]:
    """Contact modes if the study keeps them, joints without a valid load once any is simulated, tolerances if drawn."""
    found = [_modes_section(view)] if np.isfinite(view.mode_share).any() else []
    if view.count(*VALID, *FAILED, *UNSETTLED):
        found.append(_status_section(view, asked))
    if view.sampled:
        with asked.noting("the meaning of the tolerances is not shown"):
            found.append(tolerances.section(view))
    return found


def _modes_section(view: View) -> Section:
    """Contact modes: mean share of the revolution that each pin spends in each mode."""
    words = [mode.name.lower().replace("_", " ") for mode in Mode]
    rows = [[pin, *(text.percent(share) for share in line)] for pin, line in zip(PINS, view.mode_share, strict=True)]
    said = "; ".join(f"{row[0]}: " + ", ".join(f"{w} {v}" for w, v in zip(words, row[1:], strict=True)) for row in rows)
    panel = Panel("modes", "Contact modes", said, partial(_modes, view=view, words=words), (4.9, 2.0), 0.6, 0.28)
    note = "Share of the revolution that each pin spends in each mode, mean of the settled joints. None: the pin "
    note += "touches nothing; one point: one end; two point: both ends, on opposite sides; uniform: along the hole."
    table = Table("Mean share of the revolution", ["pin", *words], rows)
    return Section("modes", "How the pins touch", [Panels([panel], beside=[table]), Text(note, small=True)])


def _modes(ax: Axes, view: View, words: list[str]) -> None:
    drawing.rows(ax, list(PINS))
    left = np.zeros(4)
    for k, word in enumerate(words):
        share = 100.0 * view.mode_share[:, k]
        ax.barh(range(4), share, left=left, height=0.62, color=MODE_COLOURS[k], edgecolor="white", label=word)
        left += share
    ax.set(xlim=(0.0, 100.0), xlabel="share of the revolution [%]")
    drawing.legend_above(ax, *ax.get_legend_handles_labels())


def _status_section(view: View, asked: Asked) -> Section:
    """Number of joints by status; reasons of those without a valid load, and how their errors differ."""
    counts = {status: view.count(status) for status in Status}
    rows = [[s.label, str(count), STATUS_TEXT[s]] for s, count in counts.items() if count]
    blocks: list[Block] = [
        Table("Number of joints by status", ["status", "joints", "meaning"], rows, frozenset({0, 2}))
    ]
    joints = query.without_load(view)
    if not joints:
        blocks.append(Text("All joints that were simulated have valid loads."))
        return Section("failed", "Failed and unsettled joints", blocks)
    table = None
    if view.method != "sweep" and view.count(*VALID):
        with asked.noting("errors of failed and unsettled joints are not compared"):
            table = query.their_errors(view)
    if table is not None:
        blocks.append(Panels([_errors_panel(table)], beside=[Text(_errors_note(table), small=True)]))
    else:
        said = "Their errors are not compared with those of the others, which takes ten joints or more on either side, "
        blocks.append(Text(said + "drawn from the tolerances with equal weight."))
    rows = [[str(joint.row), joint.status, joint.remedy] for joint in joints]
    blocks.append(Table("The first of them", ["row", "status", "what to do"], rows, frozenset({0, 1, 2})))
    return Section("failed", "Failed and unsettled joints", blocks)


def _errors_panel(table: pd.DataFrame) -> Panel:
    top = table.head(10)
    said = "; ".join(
        f"{row['error']}: larger {row['direction']:.2f}, farther from the middle {row['size']:.2f}"
        for row in top.head(4).to_dict("records")
    )
    return Panel(
        "errors-without-load",
        "Failures in the space of errors",
        f"Probability that a joint without a valid result has the larger error than a settled one. {said}",
        partial(_errors, table=table),
        (4.9, drawing.rows_height(len(top)) + 0.2),
        left := drawing.rows_left(list(top["error"])),
        drawing.legend_room(PARTS, left),
    )


def _errors(ax: Axes, table: pd.DataFrame) -> None:
    top = table.head(10)
    drawing.rows(ax, list(top["error"]))
    for shift, key, label in ((-0.16, "direction", PARTS[0]), (0.16, "size", PARTS[1])):
        colour = style.COLOURS[0 if key == "direction" else 1]
        place = np.arange(len(top)) + shift
        if top[f"{key}_lower"].notna().any():
            ax.hlines(place, top[f"{key}_lower"], top[f"{key}_upper"], color=colour, lw=1.4)
        ax.plot(top[key], place, "o" if key == "direction" else "D", ms=4.5, color=colour, ls="", label=label)
    ax.axvline(0.5, color=style.INK, lw=0.9)
    ax.set(xlim=(0.0, 1.0), xlabel="probability that the joint without a valid load has the error that is …")
    drawing.legend_above(ax, *ax.get_legend_handles_labels())


def _errors_note(table: pd.DataFrame) -> str:
    marked = table[(table["direction_p"] < SIGNIFICANT) | (table["size_p"] < SIGNIFICANT)]["error"]
    said = f"Beyond chance (Wilcoxon–Mann–Whitney, Holm): {', '.join(marked)}." if len(marked) else ""
    return said or "No error plays a part beyond chance (Wilcoxon–Mann–Whitney, Holm)."
