"""The verdicts of a campaign in a sentence each, as page, text and JSON give them: no more than the file tells."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from tolstat.analysis import binomial
from tolstat.analysis.sample import CONFIDENCE
from tolstat.common.errors import TolstatError
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import FAILED, STATUS_TEXT, UNSETTLED, VALID, Status
from tolstat.display import table, text
from tolstat.display.verdict import WORDS, Verdict, deciding
from tolstat.questions import joints, shares
from tolstat.questions.assumptions import sentences, variations
from tolstat.questions.assumptions.variations import Standing
from tolstat.questions.bearing_life import answer as bearing_life
from tolstat.questions.causes import lines
from tolstat.questions.exceedance import rows as exceedance
from tolstat.questions.fatigue import answer as fatigue
from tolstat.store.recorded import MISFIT
from tolstat.store.view import View


def headline(view: View, accepted: float = np.nan) -> Verdict | None:
    """Verdict on the limits of a campaign.

    Parameters
    ----------
    view : View
        The campaign; it may be unfinished.
    accepted : float
        Accepted share: share of the joints that may exceed at least one limit; NaN if none is given.

    Returns
    -------
    Verdict or None
        None without limits, and for joints that are no sample of a production.
    """
    if not (view.sampled and view.limits):
        return None
    counts = view.counts
    if not counts.done:
        return Verdict("none", WORDS["none"], "no joint has been simulated", _pending(view))
    records = exceedance.limit_rows(view)
    standing = variations.applicable(view, accepted)
    judged = _yield(view, records, standing) if np.isnan(accepted) else _judged(view, records, accepted, standing)
    if standing is not None and judged.answer != "none":
        more = sentences.more(standing, view.path.name)
        judged = judged._replace(stands_on=sentences.values(standing), notes=(*judged.notes, *filter(None, [more])))
    if judged.answer != "none" and (parts := sentences.of_parts(view, standing)):
        judged = judged._replace(words=f"{judged.words}. {parts}")
    unresolved = _causes(view) if shares.unresolved_matter(_decisive(view, records)) else ()
    return judged._replace(notes=(*unresolved, *judged.notes, *_pending(view)))


def _deciding(row: table.Row, accepted: float, level: float = CONFIDENCE) -> str:
    """Words on the number of simulated joints that decide, those without a load too."""
    low, high = row["bound_lower"], row["bound_upper"]
    if not np.isnan(row["numerical_lower"]):
        part = (row["n_failed"] + row["n_unsettled"]) / row["n"]
        low = min(low, row["numerical_lower"] * (1.0 - part))
        high = max(high, row["numerical_upper"] * (1.0 - part) + part)
    return deciding((low, high), accepted, row["n"], lambda share: binomial.needed(share, accepted, level))


def _judged(view: View, records: Sequence[table.Row], accepted: float, standing: Standing | None) -> Verdict:
    row, worst = _decisive(view, records), exceedance.most_exceeded(view, records)
    several, answers = len(records) > 1, [exceedance.verdict(record, accepted) for record in records]
    answer = exceedance.verdict(row, accepted)
    numbers = ", ".join(f"{answers.count(key)} {word}" for key, word in WORDS.items() if key in answers)
    notes: tuple[str, ...] = (f"of {len(records)} limits, each by itself: {numbers}",) if several else ()
    if answer == "none":
        return Verdict(answer, WORDS[answer], _reason(view, [row]), notes)
    value, words = _sentence(view, row, accepted, answer, standing)
    if first := _without_errors(view):
        is_first = answer != "yes" and value == WORDS[answer]  # a verdict that holds begins with what holds
        words = f"{first}. {text.capital(words)}" if is_first else f"{words}. {text.capital(first)}"
    if several and worst["count"]:
        alike = sum(record["estimate"] == worst["estimate"] for record in records) - 1
        others = f", {alike} other limit{'s' if alike > 1 else ''} as often" if alike else ""
        words += f". Most often {_limit(view, worst)}: {exceedance.share_of(worst)}{others}"
    if value == WORDS["no"]:
        better = lines.advice(view, row["load"], accepted)
        words += f". {better}" if better else ""
    return Verdict(answer, value, words, notes, worst["load"])


def _sentence(view: View, row: table.Row, accepted: float, answer: str, standing: Standing | None) -> tuple[str, str]:
    """First words and rest of the sentence of a verdict, with what it stands on."""
    most, share, limit = text.percent(accepted), exceedance.share_of(row), _limit(view, row)
    exceed = "" if row["load"] == ANY_LIMIT else f" exceed {limit}"
    interval = "total interval" if shares.unresolved_matter(row) else text.span(*exceedance.ends(row))
    value, words = WORDS[answer], f"{share}{exceed} ({interval}); {most} is accepted"
    behind = sentences.of_variations(standing, answer)
    if standing is not None and any(turned := sentences.turned(standing)):
        value, words = turned
    elif answer == "yes":
        words = f"at most {most} exceed {limit} ({share}, {interval}){behind}"
    else:
        if answer == "open" and view.design.independent:
            words += f"; {_deciding(row, accepted, view.design.level(CONFIDENCE))}"
        words += f". {behind}" if behind else ""
    missing = sentences.not_varied(standing, view.path.name)
    return value, words + (f"; {missing}" if missing else "")


def _without_errors(view: View) -> str:
    """Words on limits that the joint without errors exceeds; empty if it keeps all."""
    above = [load for name in view.limits if (load := view.load(name)).limit is not None and load.nominal > load.limit]
    if not above:
        return ""
    first, *others = above
    more = f", and {len(others)} other limit{'s' if len(others) > 1 else ''}" if others else ""
    limit = text.value(first.limit or 0.0, first.unit)
    return f"the joint without errors exceeds {limit} on {first.name} ({text.value(first.nominal, first.unit)}){more}"


def tells_yield(view: View) -> bool:
    """Whether the share of the joints that keep all limits can be told: of joints that count equally, with a load."""
    return view.design.refuses() is None and bool(view.count(*VALID))


def _decisive(view: View, records: Sequence[table.Row]) -> table.Row:
    """Row on which the verdict is: that of the joints above at least one limit, or of the only limit."""
    return exceedance.all_limits(view) if len(records) > 1 else records[0]


def _limit(view: View, row: table.Row) -> str:
    """Limit in words: ``1500 N on cross1.F (most often at start)`` where it holds at several operating points."""
    if row["load"] == ANY_LIMIT:
        return "at least one limit"
    limit = f"{text.value(row['level'], row['unit'])} on {row['load']}"
    several = row["count"] and len(view.narrowed(row["load"])[0].points) > 1
    return f"{limit} (most often at {view.point_of(row['load'])})" if several else limit


def _yield(view: View, records: Sequence[table.Row], standing: Standing | None) -> Verdict:
    """Without an accepted share: share of the joints that keep all limits."""
    in_words = shares.together(shares.good(view), len(view.limits))
    if not in_words.decides:
        return Verdict("none", WORDS["none"], _reason(view, [_decisive(view, records)]), ())
    behind = [sentences.of_variations(standing, ""), text.capital(_without_errors(view))]
    missing = sentences.not_varied(standing, view.path.name)
    words = ". ".join([in_words.words + (f"; {missing}" if missing else ""), *filter(None, behind)])
    return Verdict("", in_words.value, words, (), exceedance.most_exceeded(view, records)["load"])


def _reason(view: View, records: Sequence[table.Row]) -> str:
    """Why there is no verdict on some limits."""
    lost = max(row["n_failed"] + row["n_unsettled"] for row in records)
    n = max(row["n"] for row in records)
    if any(map(shares.unresolved_matter, records)):
        what = "valid result" if view.count(*UNSETTLED) else "result"
        why = f": {MISFIT}" if view.misfits.sum() == lost else ""
        return f"{text.percent(lost / n)} of the joints have no {what} ({lost} of {n}{why})"
    return f"{n} {'joint is' if n == 1 else 'joints are'} too few"


def _causes(view: View) -> Iterator[str]:
    """Most frequent status of the joints without a valid load, its meaning, and the remedy for the first of them."""
    state = max((*FAILED, *UNSETTLED), key=view.count)
    if number := view.count(state):
        scrap = state == Status.OUTSIDE_MODEL and view.misfits.sum() == number
        words = f"{number} of {view.n}: {MISFIT}" if scrap else f"{number} {state.label}: {STATUS_TEXT[state]}"
        first = next((joint for joint in joints.without_load(view) if joint["status"] == state.label), None)
        yield f"{words}. Row {first['row']}: {first['remedy']}" if first else words


def _pending(view: View) -> tuple[str, ...]:
    pending = view.counts.total - view.counts.done
    return (
        (f"{pending} of {text.several(view.counts.total, 'joint')} {'is' if pending == 1 else 'are'} still pending",)
        if pending
        else ()
    )


SAMPLES = 1000
"""Maximum number of joints that are simulated again for the stresses of their parts."""


def life_verdicts(view: View, accepted: float = math.nan, samples: int | None = None) -> list[Verdict]:
    """Verdicts on the lives that the study of a campaign requires; none of joints that are no sample of a production.

    Parameters
    ----------
    view : View
        The campaign; it may be unfinished.
    accepted : float
        Accepted share: share of the joints that may have a shorter life; NaN if none is given.
    samples : int, optional
        Number of joints that may be simulated again; by default `SAMPLES`, and none while joints are pending.
    """
    if not (view.sampled and view.count(*VALID)):
        return []
    if samples is None:
        samples = SAMPLES if view.counts.done == view.counts.total else 0
    judged: list[Verdict] = []
    of_parts = partial(fatigue.life_verdicts, samples=samples)
    for about, verdicts in (("bearing life", bearing_life.life_verdicts), ("failures of parts", of_parts)):
        try:
            judged += verdicts(view, accepted)
        except TolstatError as error:
            reason = str(error).splitlines()[0].replace(str(view.path), view.path.name)
            judged.append(Verdict("none", "No verdict", f"{about}: {reason}", about=about))
    return judged
