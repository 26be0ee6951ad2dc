"""Sentences on what a verdict stands on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tolstat.analysis import binomial
from tolstat.display import table, text
from tolstat.questions.assumptions.variations import ALL, AXIAL, SHAFT, Standing, widths
from tolstat.store.view import View
from tolstat.study.widths import COARSER, HALF

KEPT = {"yes": "kept", "no": "not kept"}
"""Sides of the accepted share in words."""
_NAMED = 2
"""Largest number of assumptions, or variations, that a sentence names."""
_MOST = 20_000
"""Largest number of joints of a variation that is proposed."""


def turned(found: Standing) -> tuple[str, str]:
    """First words and rest of a verdict that what is assumed decides; empty where it does not.

    ``not kept as drawn (15.8 %)``, and ``kept if the shaft slides (7.4 %): more joints do not decide it; find out how
    the shaft is held``.
    """
    rows = found.turning
    if not rows:
        return "", ""
    ways = [f"{_condition(row['label'])} ({text.percent(row['share'])})" for row in rows]
    shown = " or ".join(ways[:_NAMED]) + (f", and in {len(ways) - _NAMED} more" if len(ways) > _NAMED else "")
    side, other = KEPT[found.side], KEPT[rows[0]["side"]]
    names = [row for row in rows if row["name"] != ALL] or found.moving
    about = {row["name"]: AXIAL in row["keys"] for row in names if row["name"] != ALL}
    first = dict(list(about.items())[:_NAMED])
    remedy = f"more joints do not decide it; find out {_listed([_noun(*own) for own in first.items()])}"
    return f"{side} as drawn ({text.percent(found.drawn[0])})", f"{other} {shown}: {remedy}"


def more(found: Standing, file: str) -> str:
    """Words on variations that more joints of them would decide, with the command; empty if there are none."""
    rows = found.undecided
    if not rows:
        return ""
    row = max(rows, key=lambda row: abs(row["share"] - found.accepted))
    most = binomial.needed(row["share"], found.accepted, found.confidence)
    named = ", ".join(f"{row['label']} ({text.percent(row['share'])})" for row in rows[:_NAMED])
    head = f"undecided: {named}{', ...' if len(rows) > _NAMED else ''}"
    if most > _MOST:
        return f"{head}; too near to the accepted share"
    n = max(math.ceil(most / 100.0) * 100, found.n)
    return f"{head}; if its share stays, this decides {row['label']}:\ntolstat assumptions {file} --run --joints {n}"


def also(found: Standing) -> str:
    """End of the sentence of a verdict *kept*: in how many variations the limits are kept, too."""
    n = len(found.rows)
    if not n:
        return ""
    kept = sum(row["side"] == "yes" for row in found.rows)
    if kept == n:
        return f", also in {'the one variation' if n == 1 else f'all {n} variations'} of what is assumed"
    others = sorted((row for row in found.rows if row["side"] != "yes"), key=lambda row: -row["share"])
    return f", also in {kept} of {n} variations of what is assumed; {_most('open', others)}"


def least(found: Standing) -> str:
    """Sentence behind a verdict *not kept*: the variation with the smallest share."""
    if not found.rows:
        return ""
    row = min(found.rows, key=lambda row: float(row["share"]))
    n = len(found.rows)
    head = f"Least of {n} variations" if n > 1 else "In the one variation"
    own = f"{head}: {text.percent(row['share'])}, {row['label']}"
    own += " (open)" if row["side"] == "open" else ""
    others = [other for other in found.rows if other["side"] == "open" and other is not row]
    return f"{own}; {_most('open', others)}" if others else own


def decided(found: Standing) -> str:
    """Sentence behind an open verdict: on which side the variations lie, with the farthest one of each side."""
    if not found.rows:
        return ""
    on = {word: [row for row in found.rows if row["side"] == side] for side, word in KEPT.items()}
    told = []
    for word, rows in on.items():
        alone = [row for row in rows if row["name"] != ALL] or rows
        if alone:
            far = max(alone, key=lambda row: abs(row["change"]))
            told.append(f"{word} in {len(rows)} ({text.percent(far['share'])} {_condition(far['label'])})")
    return f"Of {len(found.rows)} variations of what is assumed: {', '.join(told) or 'open in all'}"


def reach(found: Standing) -> str:
    """Sentence where no share is accepted: the smallest and the largest share of the variations."""
    if not found.rows:
        return ""
    shares = [float(row["share"]) for row in found.rows]
    ends = text.span(1.0 - max(shares), 1.0 - min(shares))
    return f"In {len(shares)} variations of what is assumed: {ends}"


def not_varied(found: Standing, file: str) -> str:
    """Words on assumptions that the file has no joints of, with the command that simulates them."""
    if not found.missing:
        return ""
    return f"{_listed(found.missing[:_NAMED])} not varied: tolstat assumptions {file} --run"


def still(found: Standing) -> str:
    """Sentence on what moves nothing; empty if all that is assumed does."""
    parts = []
    if found.still:
        parts.append(f"Moves nothing that {found.n} joints show: {', '.join(found.still)}.")
    parts += [f"Not varied: {own.name} ({own.because})." for own in found.fixed]
    if found.given:
        parts.append(f"Given by the study: {_listed(found.given)}.")
    return " ".join(parts)


def shop(view: View) -> str:
    """Sentence on what the shop must hold: capabilities of the process, and shares with other widths of a tolerance.

    Capabilities are requirements that the shop can measure: they turn no verdict.
    """
    entries = view.study.entries
    capabilities: dict[str, int] = {}
    for keys in (entry.keys for entry in entries):
        index, default = ("Cp", 1.0) if "zone" in keys and keys.get("distribution") == "normal" else ("Cpk", None)
        if isinstance(value := keys.get(index.lower(), default), (int, float)):
            capabilities[f"{index} {value:g}"] = capabilities.get(f"{index} {value:g}", 0) + 1
    if not capabilities:
        return ""
    held = _listed([f"{index} in {n} tolerance{'s' if n > 1 else ''}" for index, n in capabilities.items()])
    head = f"What the shop must hold: {held}."
    shares = widths(view)
    if not shares:
        return f"{head} What other widths do: tolstat causes {view.path.name} --run."
    ends = []
    for step, which in ((COARSER, max), (HALF, min)):
        if step in shares:
            label, share, said = which(shares[step], key=lambda own: own[1])
            wide = " as wide" if said == HALF or said.startswith("×") else ""
            ends.append(f"{label} {said}{wide}: {text.percent(share)}")
    return f"{head} Alone changed: {'; '.join(ends)}."


def values(found: Standing) -> dict[str, Any]:
    """JSON values: ``answer`` with what is assumed, numbers of variations and joints, what turns the verdict."""
    rows = found.rows
    answer = "open" if found.turning or found.side == "open" else KEPT.get(found.side)
    least, most = (
        {"label": row["label"], "share": row["share"]} if (row := _end(found, which)) else None for which in (min, max)
    )
    return {
        "answer": answer if rows else None,
        "turned_by": [row["label"] for row in found.turning],
        "variations": len(rows),
        "joints": found.n,
        "confidence": found.confidence,
        "least": least,
        "most": most,
        "moves_nothing": found.still,
        "not_varied": list(found.missing),
    }


def _end(found: Standing, which: Any) -> table.Row | None:
    known = [row for row in found.rows if not np.isnan(row["share"])]
    return which(known, key=lambda row: row["share"]) if known else None


def _most(word: str, rows: list[table.Row]) -> str:
    """``open in 2: H 3 (9.1 %), law sliced (8 %)``."""
    shown = ", ".join(f"{row['label']} ({text.percent(row['share'])})" for row in rows[:_NAMED])
    return f"{word} in {len(rows)}: {shown}{', ...' if len(rows) > _NAMED else ''}"


def _condition(label: str) -> str:
    """Under which condition the share is that of a variation: ``if the shaft slides``, ``with law sliced``."""
    return dict(SHAFT.values()).get(label) or f"with {label.replace('all at', 'all assumptions at')}"


def _listed(items: Sequence[str]) -> str:
    """``a, b and c``."""
    *most, last = items
    return f"{', '.join(most)} and {last}" if most else last


def _noun(name: str, is_mounting: bool) -> str:
    """What has to be found out: an assumption, or what holds the shaft."""
    if is_mounting:
        return "how the shaft is held"
    return f"the {name}" if name[:1].islower() else name
