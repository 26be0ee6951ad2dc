"""First section of the page: the question, and the verdict on each limit."""

from __future__ import annotations

import re
from functools import partial

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.asked import Asked
from tolstat.display.blocks import Block, Card, Cards, Panel, Panels, Section, Text
from tolstat.display.table import Column, as_block
from tolstat.questions.accuracy import rendering as accuracy
from tolstat.questions.capability import query as capability
from tolstat.questions.capability import rendering as capabilities
from tolstat.questions.exceedance import query as exceedance
from tolstat.questions.exceedance.rendering import LIMIT_DASH, LIMITS, above
from tolstat.questions.show import section as show
from tolstat.report.headline import WORDS, Headline, ends, headline, share_of, verdict
from tolstat.store.view import View


def section(view: View, asked: Asked) -> Section:
    """Question, headline, and each limit with its share of joints above it."""
    question = question_of(view.store.study_text)
    blocks: list[Block] = [Text(f"Question: {question}")] if question else []
    joint = show.legend(view, asked)
    found = headline(view, asked.accepted)
    if found is not None:
        table = exceedance.limits(view)
        verdicts = [verdict(row, asked.accepted) for row in table.to_dict("records")]
        blocks.append(Cards([*_headline(view, found, table), *_basis(view)]))
        blocks += _limits(view, asked, table, verdicts, joint)
    else:
        blocks.append(Cards(_basis(view)))
        if view.sampled:
            blocks.append(Text("The study sets no limits, so there is no verdict. Its loads are below."))
        blocks += [Panels(joint), Text(show.LEGEND, small=True)] if joint else []
    blocks += [Text(f"{note[0].upper()}{note[1:]}.", small=True) for note in asked.notes]
    return Section("verdict", "Verdict", blocks)


def question_of(text: str) -> str:
    """Question of a study: the paragraph ``# Question: ...`` of its opening comment; empty if there is none."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("#").strip())
    found = re.search(r"^Question:\s*(.*?)(?=^\w[\w ]*:|\Z)", "\n".join(lines), flags=re.DOTALL | re.MULTILINE)
    return " ".join(found[1].split()) if found else ""


def _headline(view: View, found: Headline, table: pd.DataFrame) -> list[Card]:
    """The verdict; then, unless it is what the verdict says, the yield; the limit exceeded most."""
    note = " ".join(text.sentence(note) for note in found.notes)
    cards = [
        Card(
            found.value,
            found.words,
            note,
            "open" if found.answer == "none" else found.answer,
        )
    ]
    if found.answer and not view.weighted and view.count(*VALID):
        together = capabilities.together(capability.limits(view))
        cards.append(Card(together.value, together.words, "Yield"))
    first = table[table["load"].isin(view.leading)].sort_values("estimate", ascending=False, kind="stable")
    if first["estimate"].notna().any() and first["load"].iloc[0] not in found.words:
        worst = first.iloc[0].to_dict()
        label = f"exceed {text.value(worst['level'], worst['unit'])} on {worst['load']}, the limit exceeded most"
        low, high = ends(worst)
        interval = "no interval" if np.isnan(low) else f"total interval {text.span(low, high)}"
        cards.append(Card(share_of(worst), label, f"{above(worst)} joints with a valid load; {interval}"))
    return cards


def _basis(view: View) -> list[Card]:
    counts = view.counts
    pending = counts.total - counts.done
    note = counts.shortfall + (f", {pending} still pending" if pending else "")
    whole = view.count(*VALID) == counts.total
    cards = [Card(str(counts.done), "joints simulated", note, "" if whole else "open")]
    kinds = {name.rpartition(".")[2] for name in view.leading}
    usual = {k: error for k, error in view.numerical_error.items() if k in kinds and not np.isnan(error)}
    if usual and view.verification:
        kind = max(usual, key=lambda name: usual[name])
        label = f"numerical error of the largest loads ({kind}), relative"
        cards.append(Card(f"{usual[kind]:.1e}", label, accuracy.basis(view.verification)))
    return cards


def _limits(view: View, asked: Asked, table: pd.DataFrame, verdicts: list[str], joint: list[Panel]) -> list[Block]:
    """Share above each limit, beside the drawings of the joint; the table of limits; notes."""
    words = dict(zip(table["load"], (WORDS.get(v, "") for v in verdicts), strict=True))
    kept = Column("kept", lambda row: words[row["load"]], shown=lambda _: asked.judges)
    block = as_block("Limits", (*LIMITS, kept), table, verdicts if asked.judges else ())
    said = (
        f"{row['load']} above {text.value(row['level'], row['unit'])}: {text.percent(row['estimate'])}, "
        f"95 % interval {text.span(row['lower'], row['upper'])}"
        for row in table.to_dict("records")
    )
    panel = Panel(
        "forest",
        "Share of the joints above each limit",
        "; ".join(said),
        partial(_forest, table=table, accepted=asked.accepted),
        (4.9, drawing.rows_height(len(table))),
        1.4,
    )
    blocks: list[Block] = [Panels([panel, *joint])]
    blocks += [Text(show.LEGEND, small=True)] if joint else []
    blocks.append(block)
    blocks.append(Text(_how(view, asked), small=True))
    return blocks


def _how(view: View, asked: Asked) -> str:
    if not view.has_intervals:
        return (
            "No intervals: Clopper–Pearson holds for independent samples only; sampling.replicates gives intervals. "
            "Failed and unsettled joints are counted below and above every limit."
        )
    said = "Joints are counted by their weights. " if view.weighted else ""
    said += f"Intervals are {view.interval_of}, 95 % for each limit by itself; failed and unsettled joints are counted "
    said += "below the limit at the lower end and above it at the upper end of the total interval, which covers the "
    said += "numerical error, too, where it is known."
    if asked.judges:
        said += f" A limit is kept if the widest interval lies below {text.percent(asked.accepted)}, not kept if it"
        said += " lies above. It has no verdict where joints without a valid load decide, and is open otherwise."
    return said


def _forest(ax: Axes, table: pd.DataFrame, accepted: float) -> None:
    """Estimate, interval and outer interval of each limit on an axis of shares."""
    known = table["estimate"][table["estimate"] > 0]
    n = max(int(table["n"].max()), 1)
    floor = 0.5 * min(1.0 / n, known.min() if len(known) else 1.0)
    units = [f"{row['load']} > {text.value(row['level'], row['unit'])}" for row in table.to_dict("records")]
    drawing.rows(ax, units)
    style.share_axis(ax, min(floor, 0.5 * accepted) if accepted > 0 else floor, "x")
    for i, row in enumerate(table.to_dict("records")):
        low, high = ends(row)
        if np.isnan(low):
            low, high = row["bound_lower"], row["bound_upper"]
        ax.plot([max(low, 0.1 * floor), high], [i, i], color=drawing.GREY, lw=5.0, solid_capstyle="butt")
        if not np.isnan(row["lower"]):
            ax.plot([max(row["lower"], 0.1 * floor), row["upper"]], [i, i], color=style.COLOURS[0], lw=2.0)
        if row["estimate"] > 0:
            ax.plot(row["estimate"], i, "o", color=style.COLOURS[0], ms=5.5)
        elif row["estimate"] == 0:
            ax.plot(ax.get_xlim()[0], i, "<", color=style.COLOURS[0], ms=6, clip_on=False)
    if accepted > 0:
        ax.axvline(accepted, color=style.INK, lw=1.4, ls=LIMIT_DASH)
        ax.text(accepted, -0.75, f"accepted: {text.percent(accepted)}", ha="center", va="bottom")
    ax.set_xlabel("share of the joints above the limit")
