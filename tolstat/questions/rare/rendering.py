"""Result of a subset simulation, as a table of its levels and a sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate
from operator import mul
from typing import TYPE_CHECKING

import pandas as pd

from tolstat.analysis.subset import Estimate, Level
from tolstat.common.loads import Limit
from tolstat.display import text
from tolstat.display.table import Column

if TYPE_CHECKING:
    from tolstat.questions.rare.query import RareEvent

LEVELS = (
    Column("level", lambda row: str(row["level"])),
    Column("threshold", lambda row: "-" if math.isinf(row["threshold"]) else text.value(row["threshold"], row["unit"])),
    Column("P(above it)", lambda row: text.formed(row["probability"])),
    Column("share that goes on", lambda row: text.percent(row["share"])),
    Column("its deviation", lambda row: text.percent(row["deviation"])),
    Column("joints", lambda row: str(row["joints"])),
    Column("accepted moves", lambda row: text.percent(row["acceptance"]), rank=1),
    Column("step", lambda row: text.formed(row["step"]), rank=2),
)
"""Columns of the table `table`; the deviation is the coefficient of variation of the share."""


def table(levels: list[Level], limit: Limit) -> pd.DataFrame:
    """Levels of a subset simulation.

    Parameters
    ----------
    levels : list of Level
        Loads in SI units.
    limit : Limit
        The limit whose exceedance is estimated.

    Returns
    -------
    DataFrame
        One row per level: ``level``, ``load``, ``unit``, ``threshold`` (-inf at level 0), ``probability`` of a load
        above it, then the other fields of `analysis.subset.Level`.
    """
    frame = pd.DataFrame([level._asdict() for level in levels])
    frame.insert(0, "level", range(len(levels)))
    frame.insert(1, "load", limit.name)
    frame.insert(2, "unit", limit.unit)
    frame.insert(4, "probability", list(accumulate([1.0, *frame["share"][:-1]], mul)))
    return frame


def sentence(estimate: Estimate, limit: Limit) -> str:
    """The probability with its interval, or its upper bound if the levels did not reach the limit."""
    head = f"P({limit})"
    if math.isnan(estimate.probability):
        return f"{head} < {estimate.upper:.2g}: the limit was not reached"
    ppm = f"{text.ppm(estimate.probability)} ppm"
    return f"{head} = {estimate.probability:.3g} ({ppm}), 95 % interval {estimate.lower:.3g} .. {estimate.upper:.3g}"


def together(estimates: Sequence[Estimate]) -> tuple[Estimate, bool]:
    """Mean of the probabilities of several seeds, and whether they agree.

    Returns
    -------
    Estimate
        Its interval is that of independent estimates; where they do not agree, it reaches from the least lower end to
        the largest upper end.
    bool
        Whether all reached the limit, and differ no more than their deviations explain (chi-squared, p >= 0.01).
    """
    from scipy.special import chdtrc

    reached = [one for one in estimates if not math.isnan(one.probability)]
    ends = min(one.lower for one in estimates), max(one.upper for one in estimates)
    if not reached:
        return Estimate(math.nan, *ends, math.nan), True
    mean = sum(one.probability for one in reached) / len(estimates)
    variances = [(one.probability * one.deviation) ** 2 for one in reached]
    deviation = math.sqrt(sum(variances)) / len(estimates) / mean if mean else math.nan
    spread = sum((one.probability - mean) ** 2 / v for one, v in zip(reached, variances, strict=True) if v)
    agree = len(reached) == len(estimates) and (len(reached) == 1 or bool(chdtrc(len(reached) - 1, spread) >= 0.01))
    if not agree or len(estimates) == 1:
        return Estimate(mean, *ends, deviation), agree
    # the logarithm of an unbiased product is low by half its variance; the ends of one seed tell Student's quantile
    one = reached[0]
    quantile = 0.5 * math.log(one.upper / one.lower) / one.deviation if one.lower and one.deviation else 1.96
    lower, upper = (min(1.0, mean * math.exp(0.5 * deviation**2 + s * quantile * deviation)) for s in (-1, 1))
    return Estimate(mean, lower, upper, deviation), agree


def of_seeds(found: Sequence[RareEvent], delivery: int) -> str:
    """Sentences on the probability of several seeds, its numerical error, and the next delivery."""
    limit, (estimate, agree) = found[0].sampling.limit, together([one.estimate for one in found])
    lines = [sentence(estimate, limit)]
    if len(found) > 1:
        each = ", ".join(text.formed(one.estimate.probability) for one in found)
        said = "agree" if agree else "DISAGREE: some missed a way to the limit; the interval is that of all of them"
        lines.append(f"{len(found)} seeds {said}: {each}")
    ancestors = ", ".join(str(one.ancestors) for one in found)
    lines.append(f"joints above the limit descend from {ancestors} of {found[0].sampling.per_level} joints of level 0")
    known = [one.numerical for one in found if one.numerical]
    if known:
        low, high = min(low for low, _ in known), max(high for _, high in known)
        lower, upper = estimate.lower * low, min(1.0, estimate.upper * high)
        lines.append(f"with the numerical error near the limit: {lower:.3g} .. {upper:.3g}")
    following = [one.delivery(delivery) for one in found]
    low, high = min(low for low, _ in following), max(high for _, high in following)
    lines.append(
        f"of the next {delivery} joints, {low:.0f} .. {high:.0f} are above the limit (95 % prediction interval)"
    )
    return "\n".join(lines)
