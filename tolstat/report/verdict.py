"""The verdict on the page: the decision with which it begins, and the share of the joints above each limit."""

from __future__ import annotations

import re
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from tolstat.common.draw_records import METHODS
from tolstat.common.loads import load_of
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Card, Decision, Panel, Panels, Section, Table, Text
from tolstat.display.table import Column, Rows, as_block, has
from tolstat.questions import accuracy, capability
from tolstat.questions.exceedance import query as exceedance
from tolstat.questions.exceedance.curves_figure import LIMIT_DASH
from tolstat.questions.exceedance.rendering import AT_POINTS, LIMITS, above, at_points
from tolstat.questions.show import section as show
from tolstat.report.headline import WORDS, Headline, ends, headline, share_of, tells_yield, verdict
from tolstat.store import known_parts
from tolstat.store.view import View


def section(view: View, asked: Asked) -> Section:
    """Decide on the limits: question, verdict, drawing with the worst bushing marked, numbers behind the verdict."""
    found = headline(view, asked.accepted)
    load = found.load if found else next(iter(view.leading), "")
    head = Decision(
        question_of(view.store.study_text), _answer(view, found), _cards(view, found), show.worst(view, load, asked)
    )
    notes = (Text(f"{note[0].upper()}{note[1:]}.", small=True) for note in asked.notes)
    return Section("verdict", "Verdict", [head, *_points(view), *notes], lead=True)


def limits(view: View, asked: Asked) -> list[Section]:
    """Share of the joints above each limit; none without limits, and for joints that are no sample of a production."""
    if not (view.sampled and view.limits):
        return []
    rows = exceedance.limit_rows(view)
    verdicts = [verdict(row, asked.accepted) for row in rows]
    words = {row["load"]: WORDS.get(said, "") for row, said in zip(rows, verdicts, strict=True)}
    kept = Column("kept by itself", lambda row: words[row["load"]], shown=lambda _: asked.judges)
    block = as_block(
        "Joints above each limit, in numbers", (LIMITS[0], kept, *LIMITS[1:]), rows, verdicts if asked.judges else ()
    )
    said = (
        f"{row['load']} above {text.value(row['level'], row['unit'])}: {text.percent(row['estimate'])}, "
        f"95 % interval {text.span(row['lower'], row['upper'])}"
        for row in rows
    )
    panel = Panel(
        "forest",
        "Share of the joints above each limit",
        "; ".join(said),
        partial(_forest, rows=rows, accepted=asked.accepted),
        (4.9, drawing.rows_height(len(rows))),
        max(1.4, drawing.rows_left(_above(rows))),
    )
    how = [Text(line, small=True) for line in _how(view, asked)]
    points = exceedance.point_rows(view)
    each = [as_block(AT_POINTS.capitalize(), at_points(view), points)] if points else []
    return [Section("limits", "Each limit", [Panels([panel], beside=how), block, *each])]


def _points(view: View) -> list[Table]:
    """Operating points, and of the joints that keep all limits there; none of a file with one point."""
    if len(view.parts) == 1:
        return []
    rows = []
    for part in view.parts:
        point = part.store.points[part.points[0]]
        row = {"point": point.name, "operation": point._replace(share=np.nan).in_words, "share": point.share}
        if part.sampled and part.limits and tells_yield(part):
            found = capability.together(capability.good(part), len(part.limits))
            row |= {"kept": found.value if found.decides else WORDS["none"]}
        rows.append(row)
    return [as_block("Operating points", POINTS, rows)]


POINTS = (
    Column("point", lambda row: str(row["point"])),
    Column("misalignment, speed, torque", lambda row: str(row["operation"])),
    Column("of the time", lambda row: text.percent(row["share"]), shown=has("share")),
    Column("keep all limits there", lambda row: str(row.get("kept", WORDS["none"])), shown=has("kept")),
)
"""Columns of the table of operating points."""


def question_of(text: str) -> str:
    """Question of a study: the paragraph ``# Question: ...`` of its opening comment; empty if there is none."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("#").strip())
    found = re.search(r"^Question:\s*(.*?)(?=^\w[\w ]*:|\Z)", "\n".join(lines), flags=re.DOTALL | re.MULTILINE)
    return " ".join(found[1].split()) if found else ""


def _answer(view: View, found: Headline | None) -> Card:
    if found is None:
        why = "The study sets no limits" if view.sampled else f"Joints of a {METHODS[view.method]} are no sample"
        return Card("", f"{why}, so there is no verdict.", "")
    note = " ".join(text.sentence(note) for note in found.notes)
    return Card(found.value, found.words, note, "open" if found.answer in ("none", "searched") else found.answer)


def _cards(view: View, found: Headline | None) -> list[Card]:
    """Unless the verdict says it, the yield and the limit exceeded most; next delivery, number of joints, errors."""
    cards = []
    if found is not None and tells_yield(view):
        row = capability.good(view)
        if found.answer:
            together = capability.together(row, len(view.limits))
            cards.append(Card(together.value, together.words, "Yield"))
        if predicted := capability.delivered(row, len(view.limits)):
            interval = text.ends(row["next_lower"], row["next_upper"], ".0f")
            cards.append(Card(interval, predicted, "95 % prediction interval"))
    if found is not None and found.load and found.load not in found.words:
        worst = next(row for row in exceedance.limit_rows(view) if row["load"] == found.load)
        label = f"exceed {text.value(worst['level'], worst['unit'])} on {worst['load']}, the limit exceeded most"
        low, high = ends(worst)
        interval = "no interval" if np.isnan(low) else f"total interval {text.span(low, high)}"
        cards.append(Card(share_of(worst), label, f"{above(worst)} joints with a valid load; {interval}"))
    return [*cards, *_basis(view)]


def _basis(view: View) -> list[Card]:
    counts = view.counts
    pending = counts.total - counts.done
    note = counts.shortfall + (f", {pending} still pending" if pending else "")
    whole = view.count(*VALID) == counts.total
    cards = [Card(str(counts.done), "joints simulated", note, "" if whole else "open")]
    kinds = {load_of(name).kind.key for name in view.leading}
    usual = {k: error for k, error in view.numerical_error.items() if k in kinds and not np.isnan(error)}
    if usual and view.verification:
        kind = max(usual, key=lambda name: usual[name])
        label = f"numerical error of the largest loads ({kind})"
        cards.append(Card(accuracy.in_percent(usual[kind]), label, accuracy.basis(view.verification)))
    return cards


def _how(view: View, asked: Asked) -> list[str]:
    """Paragraphs on what the picture shows, and what decides."""
    if not view.design.has_interval("share"):
        return [
            "Points: share of the joints with a valid load. Grey: with failed and unsettled joints counted below and "
            "above every limit.",
            text.sentence(view.design.without_interval("share")),
        ]
    said = f"{view.design.counting} ".lstrip()
    paragraphs = [
        f"{said}Points: share of the joints with a valid load. Blue: its interval ({view.design.interval}), 95 % "
        "for each limit by itself.",
        "Grey: the total interval. Failed and unsettled joints are counted below the limit at its lower end and above "
        "it at its upper end; it covers the numerical error, too, where it is known.",
    ]
    if known_parts.of(view) is not None:
        paragraphs.append("Grey covers what the measured parts leave open of the process, too.")
    if len(view.points) > 1:
        paragraphs.append("A limit that names no operating point is about the largest load over all of them.")
    if asked.judges:
        paragraphs.append(
            f"Each limit by itself: kept if its total interval lies below {text.percent(asked.accepted)}, not kept if "
            "it lies above. It has no verdict where joints without a valid load decide, and is open otherwise. The "
            "verdict at the top is on the joints that exceed at least one limit."
        )
    return paragraphs


def _above(rows: Rows) -> list[str]:
    """Each limit as a label: ``cross1.F > 1500 N``."""
    return [f"{row['load']} > {text.value(row['level'], row['unit'])}" for row in rows]


def _forest(ax: Axes, rows: Rows, accepted: float) -> None:
    """Estimate, interval and total interval of each limit, on an axis from the least to the largest of them."""
    spans = [ends(row) if not np.isnan(ends(row)[0]) else (row["bound_lower"], row["bound_upper"]) for row in rows]
    n = max(1, *(row["n"] for row in rows))
    shown = np.array([*(row["estimate"] for row in rows), *np.ravel(spans)], float)
    shown = np.array([*shown[shown >= 0.5 / n], *([accepted] if accepted > 0 else ())])
    high = min(1.4 * shown.max(initial=0.5 / n), 1.0)
    drawing.rows(ax, _above(rows))
    style.share_axis(ax, min(0.7 * shown.min(initial=high), 0.3 * high), "x", high)
    low = ax.get_xlim()[0]
    for i, (row, span) in enumerate(zip(rows, spans, strict=True)):
        ax.plot([max(span[0], 0.1 * low), span[1]], [i, i], color=drawing.GREY, lw=5.0, solid_capstyle="butt")
        if not np.isnan(row["estimate"] + row["lower"]):
            ax.plot([max(row["lower"], 0.1 * low), row["upper"]], [i, i], color=style.COLOURS[0], lw=2.0)
        if row["estimate"] >= low:
            ax.plot(row["estimate"], i, "o", color=style.COLOURS[0], ms=5.5)
        elif row["estimate"] >= 0:
            ax.plot(low, i, "<", color=style.COLOURS[0], ms=6, clip_on=False)
    if accepted > 0:
        ax.axvline(accepted, color=style.INK, lw=1.4, ls=LIMIT_DASH)
        ax.text(accepted, -0.75, f"accepted: {text.percent(accepted)}", ha="center", va="bottom")
    ax.set_xlabel("share of the joints above the limit")
