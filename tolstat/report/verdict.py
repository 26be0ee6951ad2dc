"""The verdicts on the page: the decision with which it begins, and what it stands on."""

from __future__ import annotations

import re

import numpy as np

from tolstat.common.draw_records import METHODS
from tolstat.common.loads import load_of
from tolstat.common.tables import VALID
from tolstat.display import table, text
from tolstat.display.answer import Asked
from tolstat.display.blocks import Card, Decision, Section, Table, Text
from tolstat.display.verdict import WORDS, Verdict
from tolstat.questions import accuracy, shares
from tolstat.questions.assumptions import answer, sentences, variations
from tolstat.questions.drawings.answer import place_of
from tolstat.questions.exceedance import rows as exceedance
from tolstat.questions.exceedance.answer import above
from tolstat.questions.exceedance.rows import ends, share_of
from tolstat.report.headline import headline, life_verdicts, tells_yield
from tolstat.store.view import View


def section(view: View, asked: Asked) -> Section:
    """Decide on the limits: question, verdicts, what they stand on, drawing with the worst bushing marked, numbers."""
    found = headline(view, asked.accepted)
    load = found.load if found else next(iter(view.leading), "")
    lives = [_card(own) for own in life_verdicts(view, asked.accepted, asked.replay)]
    standing = variations.applicable(view, asked.accepted)
    below = [sentences.still(standing), sentences.shop(view)] if standing and standing.rows else []
    head = Decision(
        question_of(view.store.study_text),
        lives if found is None and lives else [_card(found) if found else _without_verdict(view), *lives],
        _cards(view, found),
        place_of(view, load, asked),
        answer.bars(standing) if standing and standing.rows else None,
        [own for own in below if own],
    )
    notes = (Text(f"{note[0].upper()}{note[1:]}.", small=True) for note in asked.notes)
    return Section("verdict", "Verdict", [head, *_points(view), *notes])


def _points(view: View) -> list[Table]:
    """Operating points, and of the joints that keep all limits there; none of a file with one point."""
    if len(view.parts) == 1:
        return []
    rows = []
    for part in view.parts:
        point = part.store.points[part.points[0]]
        row = {"point": point.name, "operation": point._replace(share=np.nan).in_words, "share": point.share}
        if part.sampled and part.limits and tells_yield(part):
            found = shares.together(shares.good(part), len(part.limits))
            row |= {"kept": found.value if found.decides else WORDS["none"]}
        rows.append(row)
    return [table.as_block("Operating points", POINTS, rows)]


POINTS = (
    table.Column("point", lambda row: str(row["point"])),
    table.Column("misalignment, speed, torque", lambda row: str(row["operation"])),
    table.Column("of the time", lambda row: text.percent(row["share"]), shown=table.has("share")),
    table.Column("keep all limits there", lambda row: str(row.get("kept", WORDS["none"])), shown=table.has("kept")),
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


def _card(found: Verdict) -> Card:
    return Card(found.value, found.words, " ".join(map(text.sentence, found.notes)), found.shade)


def _without_verdict(view: View) -> Card:
    why = "The study sets no limits" if view.sampled else f"Joints of a {METHODS[view.method]} are no sample"
    return Card("", f"{why}, so there is no verdict.", "")


def _cards(view: View, found: Verdict | None) -> list[Card]:
    """Unless the verdict says it, the yield and the limit exceeded most; next delivery, number of joints, errors."""
    cards = []
    if found is not None and tells_yield(view):
        row = shares.good(view)
        if found.answer:
            together = shares.together(row, len(view.limits))
            cards.append(Card(together.value, together.words, "Yield"))
        if predicted := shares.delivered(row, len(view.limits)):
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
