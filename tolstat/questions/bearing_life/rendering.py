"""Lives of bearings: tables of lives, equivalent loads, shares below the required life; a curve; notes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from tolstat.analysis.binomial import unresolved_matter
from tolstat.analysis.rating_life import A1
from tolstat.common.load_kinds import PINS
from tolstat.display import style, text
from tolstat.display.table import Column, Row, has, has_unresolved
from tolstat.questions.bearing_life.lives import JOINT, Lives
from tolstat.questions.bearing_life.query import ANY, SHARES

FEW = "needs more joints"


def hours(life: float) -> str:
    """Format a life, h, to four digits; NaN gives a dash."""
    return "-" if math.isnan(life) else "no limit" if math.isinf(life) else f"{text.number(life)} h"


def _span(lower: float, upper: float) -> str:
    if math.isnan(lower):
        return "-"
    high = FEW if math.isinf(upper) else hours(upper)
    return f"{FEW if lower == 0.0 else text.number(lower)} .. {high}"


def _place(row: Row) -> str:
    return "all four" if row["place"] == JOINT else str(row["place"])


def _undecided(row: Row) -> bool:
    """Whether joints without a life make a share as uncertain as sampling does, or no joint has one."""
    without = row["n_failed"] + row["n_unsettled"]
    return bool(without == row["n"] or unresolved_matter(row["count"], row["n"], without))


def _life_of(share: float) -> Column:
    head, rank = f"{100.0 * share:g} % reach", 0 if share == SHARES[-1] else 1
    return Column(head, lambda row: hours(row[share]["estimate"]), rank=rank)


def _load_of(share: float) -> Column:
    return Column(f"{100.0 * share:g} % up to", lambda row: text.value(row[share]["load"], "N"))


LIVES = (
    Column("bearing", _place),
    Column("nominal", lambda row: hours(row[SHARES[-1]]["nominal"]), rank=2),
    *(_life_of(share) for share in SHARES),
    Column(
        f"95 % interval of {100.0 * SHARES[-1]:g} %",
        lambda row: _span(row[SHARES[-1]]["lower"], row[SHARES[-1]]["upper"]),
    ),
)
"""Columns of the table `by_place`: lives."""
LOADS = (
    Column("bearing", _place),
    Column("nominal", lambda row: text.value(row[SHARES[-1]]["nominal_load"], "N")),
    *(_load_of(share) for share in SHARES),
)
"""Columns of the table `by_place` without the joint: dynamic equivalent loads."""
BELOW = (
    Column("bearing", _place),
    Column("below", lambda row: f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"),
    Column("share", lambda row: "-" if _undecided(row) else text.percent(row["estimate"])),
    Column(
        "95 % interval",
        lambda row: text.span(row["lower"], row["upper"]),
        shown=has("lower"),
    ),
    Column(
        "total interval",
        lambda row: text.span(row["total_lower"], row["total_upper"]),
        shown=has("total_lower"),
    ),
    Column(
        "without a life above, below",
        lambda row: text.span(row["bound_lower"], row["bound_upper"]),
        shown=has_unresolved,
        rank=1,
    ),
)
"""Columns of the table `query.below`."""
CONTACTS = (
    Column("bearing", lambda row: "at least one" if row["place"] == ANY else str(row["place"])),
    Column("at one end", lambda row: text.percent(row["one_end"])),
    Column("at opposite ends", lambda row: text.percent(row["opposite_ends"])),
    Column("along its length", lambda row: text.percent(row["along"])),
)
"""Columns of the table `query.contacts`."""


def by_place(quantiles: pd.DataFrame) -> pd.DataFrame:
    """One row per place of `query.quantiles`: for each share its row."""
    rows = [
        {"place": place} | {row["share"]: row for row in part.to_dict("records")}
        for place, part in quantiles.groupby("place", sort=False)
    ]
    return pd.DataFrame(rows)


def of_pins(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of the four bearings."""
    return table[table["place"].isin(PINS)]


def verdict(lives: Lives, below: pd.DataFrame, quantiles: pd.DataFrame) -> list[str]:
    """Sentences on the required life, or on why there is none to judge; the first is the answer."""
    if lives.valid and lives.unrated == lives.valid:
        return [f"no rating: {_unrated(lives, 'every joint')}"]
    if not len(below):
        return ["no required life is given: bearing.required_life"]
    row = below.iloc[-1].to_dict()
    without = row["n_failed"] + row["n_unsettled"]
    required = f"the required {hours(lives.required)}"
    bounds = f"{text.span(row['bound_lower'], row['bound_upper'])} with joints without a life counted above, then below"
    if _undecided(row):
        return [f"no verdict: {without} of {row['n']} joints have no life; below {required} are {bounds}"]
    said = [f"{text.percent(row['estimate'])} of the joints{_interval(row)} do not reach {required}"]
    if without:
        said.append(f"{without} of {row['n']} joints have no life: {bounds}")
    return [*said, *_better_bearings(quantiles.iloc[-1].to_dict())]


def _interval(row: Row) -> str:
    low, high = row["total_lower"], row["total_upper"]
    return "" if math.isnan(low) else f" (total interval {text.span(low, high)})"


def _better_bearings(row: Row) -> list[str]:
    """Sentence on the load rating with which the share of a row of `query.quantiles` reaches the required life."""
    if not row["rating"] > 0.0:
        return []
    low, high = row["rating_lower"], row["rating_upper"]
    top = FEW if math.isinf(high) else f"{text.number(high / 1e3)} kN"
    ends = "" if math.isnan(low) else f" (95 % interval {text.number(low / 1e3)} .. {top})"
    return [f"{100.0 * row['share']:g} % of the joints reach it with C = {text.number(row['rating'] / 1e3)} kN{ends}"]


def _unrated(lives: Lives, joints: str) -> str:
    angle = f"{math.degrees(lives.bearing.critical_amplitude):.3g} deg"
    return (
        f"{joints} swings by less than {angle} to either side, so that the tracks of neighbouring needles do not "
        "overlap; the rating life does not hold there, since the lubricant between needles and raceways is not renewed"
    )


def notes(lives: Lives, contacts: pd.DataFrame) -> list[str]:
    """Notes to the tables: what the life means, what it leaves out, restrictions."""
    bearing, lines = lives.bearing, []
    if lives.unrated < lives.valid:
        factors = f"a_1 = {A1[bearing.reliability]:g}"
        factors += "" if bearing.a_iso is None else f", a_ISO = {bearing.a_iso:g}"
        lines.append(
            f"{100.0 * bearing.reliability:g} % of equal joints reach their life {bearing.symbol} (C = "
            f"{text.number(bearing.C / 1e3)} kN, {factors}) at the joint's speed and misalignment; all four: until the "
            "first of the four bearings fails, Weibull slope 9/8"
        )
    if len(lives.duty) > 1:
        shares = ", ".join(f"{text.percent(share)} at {point}" for point, share in lives.duty.items())
        lines.append(f"over a duty cycle: {shares} of the time; P: the constant load with the same life")
    edge = "the rating knows no edge load: it takes the resultant force as spread along the needles"
    if len(contacts):
        any_ = contacts.iloc[-1]
        lines.append(
            f"{edge}. In {text.percent(any_['one_end'])} of the joints at least one bearing is loaded at one end only "
            f"for more than half of a revolution, in {text.percent(any_['opposite_ends'])} at opposite ends, where the "
            "resultant is smaller than the forces at the ends: these bearings last shorter than rated"
        )
    else:
        lines.append(f"{edge}; the study keeps no contact modes, which tell how many bearings have it")
    if 0 < lives.unrated < lives.valid:
        lines.append(f"{lives.unrated} of {lives.valid} joints have no rating: {_unrated(lives, 'each of them')}")
    if lives.load_error > 0.0:
        lines.append(f"numerical error of an equivalent load: {text.percent(lives.load_error)}, in the total interval")
    if not lives.design.has_interval("quantile"):
        lines.append("no intervals: they hold for independent samples only")
    return lines


def curve(lives: Lives) -> Callable[[Axes], None] | None:
    """Return the function that draws the share of the joints with a shorter life; None if no joint has a life."""
    rate = lives.rate(JOINT)
    if not rate.valid.size or not rate.valid[0] > 0.0:
        return None
    table = rate.curve(np.unique(rate.valid))[::-1]

    def draw(ax: Axes) -> None:
        x, floor = 1.0 / table["level"], 0.5 / float(table["n"][0])
        shares = {name: table[name].clip(floor, 1.0) for name in ("outer_lower", "estimate", "outer_upper")}
        if lives.design.has_interval("quantile"):
            band = shares["outer_lower"], shares["outer_upper"]
            ax.fill_between(x, *band, step="pre", color=style.COLOURS[0], alpha=0.2, lw=0, label="95 % band")
        ax.step(x, shares["estimate"], where="pre", color=style.COLOURS[0])
        ax.set_xscale("log")
        style.share_axis(ax, floor)
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: text.number(value)))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set(xlabel=f"life {lives.bearing.symbol} of the joint [h]", ylabel="share of joints with a shorter life")
        nominal = float(lives.nominal_hours[-1])
        if math.isfinite(nominal):
            ax.plot(
                nominal, 1.0, "v", ms=7.5, mec="white", color=style.INK, ls="", clip_on=False, label="nominal joint"
            )
        if math.isfinite(lives.required):
            ax.axvline(lives.required, color=style.INK, lw=1.4, ls="--", label="required life")
        ax.legend(loc="lower right")

    return draw
