"""Sentences on what a verdict stands on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tolstat.analysis import binomial
from tolstat.common.counts import POWER
from tolstat.common.strict import read_section
from tolstat.display import table, text
from tolstat.display.verdict import WORDS
from tolstat.questions.assumptions.variations import ALL, AXIAL, SHAFT, Standing, widths, written
from tolstat.store.recorded import mentions
from tolstat.store.view import View
from tolstat.study.measured import left_open
from tolstat.study.widths import COARSER, HALF

KEYS_OF_PARTS = ("known_from", "law")
"""Keys of an entry of ``[tolerances]`` that is known from measured parts."""
_NAMED = 2
"""Largest number of assumptions, or variations, that a sentence names."""
_MOST = 20_000
"""Largest number of joints of a variation that is proposed."""


def turned(standing: Standing) -> tuple[str, str]:
    """First words and rest of a verdict that what is assumed decides; empty where it does not.

    ``not kept as drawn (15.8 %)``, and ``kept if the shaft slides (7.4 %): more joints do not decide it; find out how
    the shaft is held``.
    """
    rows = standing.turning
    if not rows:
        return "", ""
    ways = [f"{_condition(row['label'])} ({text.percent(row['share'])})" for row in rows]
    shown = " or ".join(ways[:_NAMED]) + (f", and in {len(ways) - _NAMED} more" if len(ways) > _NAMED else "")
    names = [row for row in rows if row["name"] != ALL] or standing.moving
    nouns = {row["name"]: _noun(row) for row in names if row["name"] != ALL}
    remedy = f"more joints do not decide it; find out {_listed(list(nouns.values())[:_NAMED])}"
    first = f"{WORDS[standing.side]} as drawn ({text.percent(standing.drawn[0])})"
    return first, f"{WORDS[rows[0]['side']]} {shown}: {remedy}"


def more(standing: Standing, file: str) -> str:
    """Words on variations that more joints of them would decide, with the command; empty if there are none."""
    rows = standing.undecided
    if not rows:
        return ""
    row = max(rows, key=lambda row: abs(row["share"] - standing.accepted))
    most = binomial.needed(row["share"], standing.accepted, standing.confidence)
    named = ", ".join(f"{row['label']} ({text.percent(row['share'])})" for row in rows[:_NAMED])
    head = f"undecided: {named}{', ...' if len(rows) > _NAMED else ''}"
    if most > _MOST:
        return f"{head}; too near to the accepted share"
    n = max(math.ceil(most / 100.0) * 100, standing.n)
    often = (
        f"decides {row['label']} in {100 * POWER:.0f} % of campaigns if {text.percent(row['share'])} is the true share"
    )
    return f"{head}; this {often}:\ntolstat assumptions {file} --run --joints {n}"


def of_variations(standing: Standing | None, answer: str) -> str:
    """Sentence on the variations behind a verdict; empty where there are none.

    Parameters
    ----------
    standing : Standing, optional
        What the verdict stands on.
    answer : str
        ``yes``: in how many variations the limits are kept, too, to follow the words of the verdict. ``no``: the one
        with the smallest share, which shows how far a better value helps. ``open``: on which side the variations lie,
        with the farthest one of each side. Empty, where no share is accepted: the smallest and the largest share.
    """
    if standing is None or not standing.rows:
        return ""
    rows, shares = standing.rows, [float(row["share"]) for row in standing.rows]
    n = len(rows)
    if answer == "yes":
        others = sorted((row for row in rows if row["side"] != "yes"), key=lambda row: -row["share"])
        if not others:
            return f", also in {'the one variation' if n == 1 else f'all {n} variations'} of what is assumed"
        return f", also in {n - len(others)} of {n} variations of what is assumed; {_most('open', others)}"
    if answer == "no":
        row = min(rows, key=lambda row: float(row["share"]))
        head = f"Least of {n} variations" if n > 1 else "In the one variation"
        smallest = f"{head}: {text.percent(row['share'])}, {row['label']}{' (open)' if row['side'] == 'open' else ''}"
        others = [other for other in rows if other["side"] == "open" and other is not row]
        return f"{smallest}; {_most('open', others)}" if others else smallest
    if not answer:
        return f"In {n} variations of what is assumed: {text.span(1.0 - max(shares), 1.0 - min(shares))}"
    sides = []
    for side in ("yes", "no"):
        decided = [row for row in rows if row["side"] == side]
        if alone := [row for row in decided if row["name"] != ALL] or decided:
            far = max(alone, key=lambda row: abs(row["change"]))
            sides.append(f"{WORDS[side]} in {len(decided)} ({text.percent(far['share'])} {_condition(far['label'])})")
    return f"Of {n} variations of what is assumed: {', '.join(sides) or 'open in all'}"


def of_parts(view: View, standing: Standing | None) -> str:
    """Words on what measured parts leave open; empty where the study takes its tolerances as exact.

    ``10 parts measured: their spread is known to −27 … +65 %; with the larger one 4.1 %``. Of several entries the one
    with the largest share then, without joints of these the one with the fewest parts.
    """
    store = view.store
    if not mentions(read_section(store.path, store.study_text, "tolerances"), KEYS_OF_PARTS):  # others are not read
        return ""
    shares = {row["keys"]: float(row["share"]) for row in standing.rows} if standing else {}
    each = []
    for entry in view.study.known:
        key, (low, high) = next(iter(left_open(entry).items()))
        share = shares.get(written({key: high}), math.nan)
        ends = " … ".join(f"{100.0 * (end - 1.0):+.0f}" for end in (low, high)).replace("-", "−")
        words = f"their spread is known to {ends} %"
        words += "" if math.isnan(share) else f"; with the larger one {text.percent(share)}"
        each.append((np.nan_to_num(share), -entry.parts, f"{entry.parts} parts of {entry.pattern} measured: {words}"))
    return max(each)[-1] if each else ""


def not_varied(standing: Standing | None, file: str) -> str:
    """Words on assumptions that the file has no joints of, with the command that simulates them."""
    if standing is None or not standing.missing:
        return ""
    missing = standing.missing
    what = _listed(missing) if len(missing) <= _NAMED else f"{len(missing)} assumptions"
    return f"{what} not varied: tolstat assumptions {file} --run"


def idle(standing: Standing) -> str:
    """Sentence on variations in which the axial force of the study has no effect; empty if there are none."""
    if not standing.idle:
        return ""
    without = "simulated without operation.axial_force and its tolerance"
    return f"{_listed(standing.idle)}: {without}, which do nothing to an output shaft that is rigid along its axis"


def without_result(standing: Standing) -> str:
    """Words on joints that have no result with other values; empty if all have one."""
    failed = {row["label"]: f"{row['n_failed']} of {row['n']}" for row in standing.rows if row["n_failed"]}
    if not failed:
        return ""
    told = ", ".join(f"{number} with {label}" for label, number in failed.items())
    return f"joints without a result: {told}; shares are those of the others, intervals hold with them above or below"


def still(standing: Standing) -> str:
    """Sentence on what moves nothing; empty if all that is assumed does."""
    parts = []
    if standing.still:
        parts.append(f"Moves nothing that {standing.n} joints show: {', '.join(standing.still)}.")
    parts += [f"Not varied: {assumption.name} ({assumption.because})." for assumption in standing.fixed]
    if standing.without_other:
        names = _listed(standing.without_other)
        parts.append(f"{text.capital(names)}: only as drawn is listed; give other values in [[assumed]].")
    if standing.given:
        parts.append(f"Given by the study: {_listed(standing.given)}.")
    return " ".join(parts)


def shop(view: View) -> str:
    """Sentence on what the shop must hold: capabilities of the process, and shares with other widths of a tolerance.

    Capabilities are requirements that the shop can measure: they turn no verdict.
    """
    capabilities: dict[str, int] = {}
    for keys in (entry.keys for entry in view.study.entries):
        index, default = ("Cp", 1.0) if "zone" in keys and keys.get("distribution") == "normal" else ("Cpk", None)
        if isinstance(value := keys.get(index.lower(), default), (int, float)):
            capabilities[f"{index} {value:g}"] = capabilities.get(f"{index} {value:g}", 0) + 1
    if not capabilities:
        return ""
    required = _listed([f"{index} in {n} tolerance{'s' if n > 1 else ''}" for index, n in capabilities.items()])
    head = f"What the shop must hold: {required}."
    shares = widths(view)
    if not shares:
        return f"{head} What other widths do: tolstat causes {view.path.name} --run."
    ends = []
    for step, which in ((COARSER, max), (HALF, min)):
        if step in shares:
            label, share, words = which(shares[step], key=lambda width: width[1])
            wide = " as wide" if words == HALF or words.startswith("×") else ""
            ends.append(f"{label} {words}{wide}: {text.percent(share)}")
    return f"{head} Alone changed: {'; '.join(ends)}."


def values(standing: Standing) -> dict[str, Any]:
    """JSON values: ``answer`` with what is assumed, numbers of variations and joints, what turns the verdict."""
    answer = "open" if standing.turning or standing.side == "open" else WORDS.get(standing.side)
    known = sorted((row for row in standing.rows if not np.isnan(row["share"])), key=lambda row: float(row["share"]))
    ends = [{"label": row["label"], "share": row["share"]} for row in known]
    return {
        "answer": answer if standing.rows else None,
        "turned_by": [row["label"] for row in standing.turning],
        "variations": len(standing.rows),
        "joints": standing.n,
        "confidence": standing.confidence,
        "least": ends[0] if ends else None,
        "most": next((end for end in ends if end["share"] == ends[-1]["share"]), None),
        "moves_nothing": standing.still,
        "not_varied": list(standing.missing),
    }


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


def _noun(row: table.Row) -> str:
    """What has to be found out: an assumption, or what holds the shaft."""
    if AXIAL in row["keys"]:
        return "how the shaft is held"
    return f"the {row['name']}" if row["name"][:1].islower() else str(row["name"])
