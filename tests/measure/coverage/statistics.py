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
EXCHANGED = "fewer than 50 pairs; few pairs that make up the variance"
CONTROL = "normal approximation, wrong on purpose"
"""Statistic that no command shows: an interval that misses. A measurement that passes it shows nothing."""

STATISTICS = {
    "share": Statistic("`report`, `fatigue`, `bearing-life`", LEAST),
    "share, joints without a load": Statistic("`report`: total interval", LEAST),
    "quantile": Statistic("`report`, `capability --one-in`, `fatigue`", LEAST),
    "equivalent load": Statistic("`fatigue`", LEAST),
    "band": Statistic("`report`: band of the whole curve", LEAST),
    "band at random levels": Statistic("`report`: band at each level", LEAST),
    "share of failed parts": Statistic("`fatigue`", LEAST),
    "yield and ppm": Statistic("`capability`", LEAST),
    "next delivery": Statistic("`report`, `capability`", LEAST),
    "next delivery, from a share": Statistic("`fatigue`, `rare`", LEAST, "as the share"),
    "Ppk": Statistic("`capability`", LEAST, "few joints: the lower end is at most 0"),
    "process, measured parts": Statistic("`assumptions`, the verdict, at 90 %", ABOUT, "fewer than 5 parts"),
    "share at a stop": Statistic("`run --until`", LEAST),
    "quantile at a stop": Statistic("`report` after `--until`", LEAST),
    "share, lots": Statistic("`report`, `capability`", ABOUT, "fewer than 30 lots"),
    "quantile, lots": Statistic("`report`", ABOUT, "fewer than 30 lots"),
    "next delivery, lots": Statistic("`report`, `capability`", ABOUT, "fewer than 30 lots"),
    "load that never repeats": Statistic("`report`: total interval", ABOUT, "fewer than 16 revolutions"),
    "rare share, subsets": Statistic("`rare`", ABOUT, "limits that are not reached: an upper end only"),
    "allocation holds": Statistic("`allocate`: the verdict", "97.5 %", "shares that do not show it"),
    "share, allocation": Statistic("`allocate`: the check", LEAST, "an unfinished search"),
    "difference of shares": Statistic("`compare`", ABOUT),
    "change of a share, what if": Statistic("`causes --run`", ABOUT),
    "change of a share, at a stop": Statistic("`change`", ABOUT),
    "difference of quantiles": Statistic("`compare`", ABOUT, "few joints: infinite ends"),
    "line half as wide": Statistic("`causes --run`", ABOUT),
    "line exact": Statistic("`causes --run`", ABOUT),
    "index alone": Statistic("`causes`", ABOUT, "fewer than 50 joints"),
    "index alone, at a stop": Statistic("`causes` after `--until`", ABOUT, "fewer than 50 joints"),
    "index alone, exchanged": Statistic("`causes --run`", ABOUT, EXCHANGED),
    "index in all, exchanged": Statistic("`causes --run`", ABOUT, EXCHANGED),
    "index of the event": Statistic("`causes --run`", ABOUT, "no joint, or every joint, above the limit"),
    "errors above a limit": Statistic("`causes`: tail", ABOUT, "fewer than 10 joints on a side of the limit"),
    CONTROL: Statistic("no command", ABOUT, "never"),
}
