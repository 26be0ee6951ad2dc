"""Verdicts on shares of the joints: one sentence each, the same in text, on the page and in JSON."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from tolstat.common.counts import POWER
from tolstat.display import table, text

WORDS = {
    "yes": "kept",
    "no": "not kept",
    "open": "open",
    "none": "no verdict",
}
"""Answers in words."""
FEW = 20
"""Number of joints below which their share is no guess of the true one, to say how many joints decide."""


class Verdict(NamedTuple):
    """A verdict on the limits of a campaign, or on a life that its study requires.

    Attributes
    ----------
    answer : str
        ``yes``, ``no``, ``open``, ``none`` (no verdict); empty if no accepted share is given and a share
        can be.
    value, words : str
        The answer or, without one, a share or its interval; the rest of the sentence, without full stop.
    notes : tuple of str
        Causes, remedies, and what else restricts the verdict.
    load : str
        The load whose limit it is about: of several, that most joints exceed. Empty if there is no verdict on limits.
    stands_on : mapping, optional
        What a verdict on limits stands on, see `sentences.values`; None if that question does not apply.
    about : str
        What a verdict on a life is on, in words: ``bearing life``.
    share, lower, upper : float
        Share of the joints that do not last, with its interval; NaN if unknown.
    """

    answer: str
    value: str
    words: str
    notes: tuple[str, ...] = ()
    load: str = ""
    stands_on: Mapping[str, Any] | None = None
    about: str = ""
    share: float = math.nan
    lower: float = math.nan
    upper: float = math.nan

    @property
    def sentence(self) -> str:
        """The whole sentence, without full stop."""
        return f"{self.value}{',' if self.is_turned else ':' if self.answer else ''} {self.words}"

    @property
    def is_turned(self) -> bool:
        """Whether what is assumed decides the verdict."""
        return bool(self.stands_on and self.stands_on["turned_by"])

    @property
    def shade(self) -> str:
        """``yes``, ``no`` or ``open`` of the page: also open where what is assumed decides, or there is none."""
        return "open" if self.is_turned or self.answer == "none" else self.answer

    def values(self) -> dict[str, Any]:
        """JSON values: the answer of the joints as drawn in words, null without one, the sentence, other attributes."""
        values: dict[str, Any] = {"about": self.about, "answer": WORDS.get(self.answer), "stands_on": self.stands_on}
        values |= {"sentence": self.sentence, "share": self.share, "lower": self.lower, "upper": self.upper}
        others = ("stands_on",) if self.about else ("about", "share", "lower", "upper")
        shown = {key: value for key, value in values.items() if key not in others}
        return {**text.plain(shown), "notes": list(self.notes)}


def side_of(interval: Sequence[float], accepted: float) -> str:
    """``yes`` if an interval lies below the accepted share, ``no`` above it, ``open``; empty if one is unknown."""
    low, high = interval
    if math.isnan(accepted) or math.isnan(low):
        return ""
    return "yes" if high <= accepted else "no" if low > accepted else "open"


def deciding(bounds: tuple[float, float], accepted: float, n: int, needed: Callable[[float], float]) -> str:
    """Words on the number of joints that decide on which side of the accepted share a share is.

    `needed` gives that number for a true share; assumed is the end of the `bounds` of the share of `n` joints that is
    nearer to the accepted share. None helps where that lies between them.
    """
    low, high = bounds
    if low <= accepted <= high:
        return "no number of joints would decide it"
    if n < FEW:
        return f"{n} joint{' is' if n == 1 else 's are'} too few to say how many would decide it"
    joints = needed(share := high if high < accepted else low)
    number = f"{text.number(joints)} joints" if joints < 1e7 else "more than 1e7 joints"
    lost = ", joints without a valid load included," if low < high else ""
    return f"{number} decide it in {100 * POWER:.0f} % of campaigns if {text.percent(share)}{lost} is the true share"


def on_share(
    about: str,
    what: str,
    row: table.Row,
    ends: tuple[float, float],
    accepted: float,
    needed: Callable[[float], float],
    reason: str = "",
    undecided: str = "",
) -> Verdict:
    """Verdict on whether at most an accepted share of the joints does not last.

    Parameters
    ----------
    about, what : str
        What it is on, and what joints do that do not last: ``have a bearing life below 8000 h``.
    row : mapping
        Their share ``estimate``, the numbers ``n``, ``n_failed`` and ``n_unsettled`` of joints and, unless they follow
        from these, its bounds ``bound_lower`` and ``bound_upper``.
    ends : tuple of float
        Ends of the interval of the share; NaN if it has none.
    accepted : float
        Accepted share; NaN if none is given.
    needed : callable
        Gives the number of joints that decide if a share is the true one, see `deciding`.
    reason : str
        Why the share has no interval; empty if it has one.
    undecided : str
        Which joints without a result make the share so uncertain that its interval stands alone; empty if none do.
    """
    share = math.nan if undecided else row["estimate"]
    interval, most, side = text.span(*ends), text.percent(accepted), side_of(ends, accepted)
    numbers = [text.percent(share)] * (not math.isnan(share)) + [interval] * (not math.isnan(ends[0]))
    rest = f"of the joints {what}{''.join(f' ({other})' for other in numbers[1:])}"
    told = f"{(numbers or ['-'])[0]} {rest}"
    answer, words = "", rest
    if side == "yes":
        answer, words = side, f"at most {most} of the joints {what} ({', '.join(numbers)})"
    elif side == "no":
        answer, words = side, f"{told}; {most} is accepted"
    elif (undecided or reason) and not (math.isnan(accepted) and share == share):
        answer, words = "none", undecided or reason
    elif not math.isnan(accepted):
        lost = (row["n_failed"] + row["n_unsettled"]) / row["n"]
        low = row.get("bound_lower", share * (1.0 - lost))
        high = row.get("bound_upper", share * (1.0 - lost) + lost)
        answer, words = "open", f"{told}; {most} is accepted; {deciding((low, high), accepted, row['n'], needed)}"
    value = text.capital(WORDS[answer]) if answer else (numbers or ["-"])[0]
    return Verdict(answer, value, words, about=about, share=share, lower=ends[0], upper=ends[1])
