"""What each interval claims, where it is refused, and which command shows it."""

from __future__ import annotations

from typing import NamedTuple


class Statistic(NamedTuple):
    """An interval that a user can read.

    Attributes
    ----------
    where : str
        Commands that show it.
    claim : str
        What it claims for a confidence of 95 %.
    refuses : str
        Where there is no number.
    """

    where: str
    claim: str
    refuses: str = "dependent joints"


LEAST, ABOUT = "at least 95 %", "95 %"
TAIL, MEANS = "89 to 95 %, by the law", "95 %, of skew loads 88 %"
EXCHANGED = "fewer than 50 pairs; few pairs that make up the variance"
NONE = "none: tolerances are taken as exact"
"""Claim of an interval that is measured beside another, to show what is lost without that one."""
CONTROL = "normal approximation, wrong on purpose"
"""Statistic that no command shows: an interval that misses. A measurement that passes it shows nothing."""

STATISTICS = {
    "share": Statistic("`report`, `fatigue`, `bearing-life`, `time-above`", LEAST),
    "share, joints without a load": Statistic("`report`: total interval", LEAST),
    "quantile": Statistic("`report`, `fatigue`, `time-above`", LEAST),
    "equivalent load": Statistic("`fatigue`", LEAST),
    "band": Statistic("`report`: band of the whole curve", LEAST),
    "mean time above": Statistic("`time-above`", ABOUT),
    "share of failed parts": Statistic("`fatigue`", LEAST),
    "yield and ppm": Statistic("`capability`", LEAST),
    "next delivery": Statistic("`report`, `capability`", LEAST),
    "next delivery, from a share": Statistic("`reweight`, `fatigue`, `rare`", LEAST, "as the share"),
    "Cpk, normal": Statistic("`capability`", LEAST, "fewer than 1000 joints; a long tail"),
    "Cpk from quantiles": Statistic("`capability`", LEAST, "few joints: the lower end is at most 0"),
    "share at a stop": Statistic("`run --until`", LEAST, "Sobol' points, Latin hypercubes"),
    "share, replicates": Statistic("`report`, `capability`", ABOUT, "one replicate"),
    "quantile, replicates": Statistic("`report`", ABOUT, "one replicate"),
    "share, lots": Statistic("`lots`, `report`, `capability`", ABOUT, "fewer than 30 lots"),
    "quantile, lots": Statistic("`report`", ABOUT, "fewer than 30 lots"),
    "next delivery, lots": Statistic("`lots`", ABOUT, "fewer than 30 lots"),
    "return load": Statistic(
        "`capability --one-in`", TAIL, "less than 50 joints in the tail; a tail that is not Pareto's, or short"
    ),
    "share above, from the tail": Statistic("Python: `Tail.probability`", TAIL, "as a return load"),
    "load that never repeats": Statistic("`report`: total interval", ABOUT, "fewer than 16 revolutions"),
    "rare share, subsets": Statistic("`rare`", ABOUT, "limits that are not reached: an upper end only"),
    "share, importance sampling": Statistic(
        "`report`, `capability`",
        "95 %, if the proposals reach every way to the limit",
        "few effective joints above, without a bound; k of 0.7 and more",
    ),
    "share, whatever proposals miss": Statistic("`report`: the verdict", "upper end: at least 97.5 %", "never"),
    "share, parts and joints": Statistic(
        "`report`, with `known_from`", ABOUT, "joints that do not support 2.5 % of the likely processes"
    ),
    "share, parts left out": Statistic("`report`, without `known_from`", NONE, "as importance sampling"),
    "share, other tolerances": Statistic("`reweight`", ABOUT, "large density ratios; few effective joints on a side"),
    "quantile, other tolerances": Statistic("`reweight`", ABOUT, "as shares, at both ends"),
    "allocation holds": Statistic("`allocate`: the verdict", "97.5 %", "shares that do not show it"),
    "difference of shares": Statistic("`compare`", ABOUT),
    "change of a share, what if": Statistic("`causes --run`", ABOUT),
    "difference of quantiles": Statistic("`compare`", ABOUT, "few joints: infinite ends"),
    "difference of means": Statistic("`compare`", MEANS),
    "index alone": Statistic("`causes`", ABOUT, "fewer than 50 joints"),
    "index in all": Statistic("`causes`: bounds", LEAST, "fewer than 50 joints"),
    "index over the revolution": Statistic("`angles`", ABOUT, "fewer than 50 joints"),
    "index alone, exchanged": Statistic("`causes --run`, `causes STUDY`", ABOUT, EXCHANGED),
    "index in all, exchanged": Statistic("`causes --run`, `causes STUDY`", ABOUT, EXCHANGED),
    "index of the event": Statistic("`causes --run`", ABOUT, "no joint, or every joint, above the limit"),
    "rank regression": Statistic("`causes`", ABOUT, "fewer than 40 joints more than errors"),
    "errors above a limit": Statistic("`causes`: tail", ABOUT, "fewer than 10 joints on a side of the limit"),
    CONTROL: Statistic("no command", ABOUT, "never"),
}
