"""Tables of coverage: a line for each statistic, and one for each case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from studies.precision.measuring import markdown as as_markdown
from tests.measure.coverage.run import LEAST, MOST, Coverage
from tests.measure.coverage.statistics import CONTROL, STATISTICS
from tests.measure.coverage.trial import Row
from tolstat.display.text import align

ENOUGH = 0.05
"""Share of the seeds that must have an interval for a case to count in the summary."""


class Line(NamedTuple):
    """A statistic in the summary.

    Attributes
    ----------
    name : str
        Key of `statistics.STATISTICS`.
    rows : list of Row
        Its cases with enough intervals.
    every : list of Row
        All of its cases.
    """

    name: str
    rows: list[Row]
    every: list[Row]

    def numbers(self) -> list[str]:
        """Cells that are measured."""
        return [self.covered(), self.sides(), self.given(), self.width()]

    def covered(self) -> str:
        """Smallest coverage of the cases with its interval, and the median, per cent."""
        found = [tuple(100.0 * share for share in row.covered) for row in self.rows]
        if not found:
            return "-"
        least, lower, upper = min(found)
        return f"{least:.1f} ({lower:.1f} to {upper:.1f}), {np.median([own[0] for own in found]):.1f}"

    def given(self) -> str:
        """Smallest and largest share of the seeds with an interval, per cent, of all cases."""
        return _range([100.0 * row.given / row.seeds for row in self.every], ".0f")

    def width(self) -> str:
        """Smallest and largest width over that of fresh joints."""
        found = [row.width for row in self.rows if math.isfinite(row.width)]
        return _range(found, ".2g") if found else ""

    def sides(self) -> str:
        """Largest share of the intervals above the truth, and below it, per cent."""
        if not self.rows:
            return "-"
        return ", ".join(
            f"{100.0 * max(getattr(row, side) / row.given for row in self.rows):.1f}" for side in ("above", "below")
        )


def lines(found: Coverage) -> list[Line]:
    """Summary, in the order of the statistics."""
    made = []
    for name in STATISTICS:
        rows = [row for row in found.rows if row.asked.statistic == name]
        if rows:
            made.append(Line(name, [row for row in rows if row.given >= max(1.0, ENOUGH * row.seeds)], rows))
    return made


def text(found: Coverage, every: bool = False) -> str:
    """Tables for a terminal: the summary, and with `every` all cases."""
    head = ["statistic", "cases", "covered, %", "above, below, %", "given, %", "width"]
    rows = [[line.name, str(len(line.every)), *line.numbers()] for line in lines(found)]
    parts = [align([head, *rows]), _legend(found)]
    if every:
        parts.append(align([_CASE, *(_case(found, row) for row in found.rows)], words=[True, True]))
    return "\n\n".join([*parts, *_verdict(found)])


def markdown(found: Coverage) -> str:
    """Table for a document, and what misses."""
    head = ["estimator", "claim", "covered, %", "above, below, %", "given, %", "width", "refuses", "shown by"]
    rows = []
    for line in lines(found):
        about = STATISTICS[line.name]
        head_of = [f"{line.name} ({len(line.every)})", about.claim]
        rows.append([*head_of, *line.numbers(), about.refuses, about.where])
    return "\n\n".join([as_markdown([head, *rows]), _legend(found), *_verdict(found, "- ")])


_CASE = ["statistic", "case", "joints", "given, %", "covered, %", "its interval", "above, %", "below, %", "width", ""]


def _case(found: Coverage, row: Row) -> list[str]:
    covered, lower, upper = (100.0 * share for share in row.covered)
    about = [row.asked.statistic, row.asked.case, str(row.asked.n), f"{100.0 * row.given / row.seeds:.1f}"]
    if not row.given:
        return [*about, *["-"] * 4, "", ""]
    sides = [f"{100.0 * count / row.given:.1f}" for count in (row.above, row.below)]
    width = f"{row.width:.2g}" if math.isfinite(row.width) else ""
    mark = "misses" if found.misses(row) else ""
    return [*about, f"{covered:.1f}", f"{lower:.1f} to {upper:.1f}", *sides, width, mark]


def _legend(found: Coverage) -> str:
    seeds = max(row.seeds for row in found.rows)
    fewer = {row.asked.statistic: row.seeds for row in found.rows if row.seeds < seeds}
    apart = "".join(f"; {name}: 0 to {number - 1}" for name, number in fewer.items())
    return (
        f"Seeds 0 to {seeds - 1}{apart}. Covered: least of the cases, with its 95 % interval, and their median; cases "
        f"count in which at least {100 * ENOUGH:.0f} % of the seeds give an interval. Above, below: largest share of "
        "the intervals that lie above the truth, and below it. Given: share of the seeds with an interval. Width: "
        "median, over that of as many independent joints."
    )


def _verdict(found: Coverage, bullet: str = "") -> list[str]:
    """Sentences: which rows miss, whether the wrong estimator is found."""
    missing = [row for row in found.rows if found.misses(row) and row.asked.statistic != CONTROL]
    told = [f"{bullet}{_sentence(row)}" for row in missing]
    controls = [row for row in found.rows if row.asked.statistic == CONTROL]
    parts = []
    if missing:
        parts.append(f"Intervals that miss on one side in surely more than {100 * MOST:g} % of the seeds:")
        parts.append("\n".join(told))
    else:
        parts.append(f"No interval misses on one side in surely more than {100 * MOST:g} % of the seeds.")
    counted = [row for line in lines(found) for row in line.rows if line.name != CONTROL]
    if low := [row for row in counted if row.covered[0] < LEAST]:
        parts.append(f"Intervals that contain the truth in less than {100 * LEAST:g} %:")
        parts.append("\n".join(f"{bullet}{_of_all(row)}" for row in low))
    else:
        parts.append(f"No interval contains the truth in less than {100 * LEAST:g} % of the seeds.")
    if controls:
        found_out = "not found in every case" if found.controls_pass else "found in every case"
        parts.append(f"The estimator that is wrong on purpose was {found_out}.")
    return parts


def _of_all(row: Row) -> str:
    covered, low, high = (100.0 * share for share in row.covered)
    why = f" ({row.asked.known})" if row.asked.known else ""
    numbers = f"{covered:.1f} % ({low:.1f} to {high:.1f})"
    return f"{row.asked.statistic}, {row.asked.case}, {row.asked.n} joints: {numbers}{why}"


def _sentence(row: Row) -> str:
    side = "above" if row.above > row.below else "below"
    share = 100.0 * max(row.above, row.below) / row.given
    why = f" ({row.asked.known})" if row.asked.known else ""
    return f"{row.asked.statistic}, {row.asked.case}, {row.asked.n} joints: {share:.1f} % {side} the truth{why}"


def _range(values: Sequence[float], form: str) -> str:
    low, high = f"{min(values):{form}}", f"{max(values):{form}}"
    return low if low == high else f"{low} to {high}"
