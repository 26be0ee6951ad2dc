"""Verdict on the share of the joints that do not last: one sentence, the same in text, on the page and in JSON."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from tolstat.display import text
from tolstat.display.table import Row

WORDS = {"yes": "Kept", "no": "Not kept", "open": "Open", "none": "No verdict"}
"""Answers in words."""


class Verdict(NamedTuple):
    """A verdict.

    Attributes
    ----------
    about : str
        What it is on, in words: ``bearing life``.
    answer : str
        ``yes``, ``no``, ``open``, ``none`` (no verdict); empty if no accepted share is given and a share can be.
    words : str
        The rest of the sentence, without full stop.
    share, lower, upper : float
        Share of the joints that do not last, with its interval; NaN if unknown.
    notes : tuple of str
        What restricts the verdict.
    """

    about: str
    answer: str
    words: str
    share: float = math.nan
    lower: float = math.nan
    upper: float = math.nan
    notes: tuple[str, ...] = ()

    @property
    def value(self) -> str:
        """The first words: the answer or, without one, the share or its interval."""
        share = text.span(self.lower, self.upper) if math.isnan(self.share) else text.percent(self.share)
        return WORDS.get(self.answer, share)

    @property
    def shade(self) -> str:
        """``yes``, ``no`` or ``open`` of the page."""
        return "open" if self.answer == "none" else self.answer

    @property
    def sentence(self) -> str:
        """The whole sentence, without full stop."""
        return f"{self.value}{':' if self.answer else ''} {self.words}"

    def values(self) -> dict[str, Any]:
        """JSON values: the answer in words, null without one, the sentence, and the other attributes."""
        known = {"share": self.share, "lower": self.lower, "upper": self.upper}
        numbers = {name: None if math.isnan(value) else float(value) for name, value in known.items()}
        answer = WORDS[self.answer].lower() if self.answer else None
        return (
            {"about": self.about, "answer": answer, "sentence": self.sentence} | numbers | {"notes": list(self.notes)}
        )


def on_share(
    about: str,
    what: str,
    row: Row,
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
        Gives the number of joints whose interval excludes the accepted share if theirs stayed at the share given.
    reason : str
        Why the share has no interval; empty if it has one.
    undecided : str
        Which joints without a result make the share so uncertain that its interval stands alone; empty if none do.
    """
    share = math.nan if undecided else row["estimate"]
    interval, most, judges = text.span(*ends), text.percent(accepted), not math.isnan(accepted)
    numbers = [text.percent(share)] * (not math.isnan(share)) + [interval] * (not math.isnan(ends[0]))
    rest = f"of the joints {what}{''.join(f' ({other})' for other in numbers[1:])}"
    told = f"{(numbers or ['-'])[0]} {rest}"
    if judges and ends[1] <= accepted:
        answer, words = "yes", f"at most {most} of the joints {what} ({', '.join(numbers)})"
    elif judges and ends[0] > accepted:
        answer, words = "no", f"{told}; {most} is accepted"
    elif (undecided or reason) and (judges or math.isnan(share)):
        answer, words = "none", undecided or reason
    elif judges:
        lost = (row["n_failed"] + row["n_unsettled"]) / row["n"]
        low = row.get("bound_lower", share * (1.0 - lost))
        high = row.get("bound_upper", share * (1.0 - lost) + lost)
        joints = math.inf if low <= accepted <= high else needed(high if high < accepted else low)
        number = "more joints do not" if math.isinf(joints) else f"{text.number(joints)} joints would"
        answer, words = "open", f"{told}; {most} is accepted; {number} decide it"
    else:
        answer, words = "", rest
    return Verdict(about, answer, words, share, *ends)
