"""How long the needle bearings of the pins last: lives, shares below the required life, how bearings are loaded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.analysis.binomial import unresolved_matter
from tolstat.analysis.rating_life import A1
from tolstat.analysis.sample import Sample, total_interval
from tolstat.common.errors import NotApplicable
from tolstat.common.load_kinds import PINS
from tolstat.common.tables import LIFE_EXPONENT, VALID, Mode
from tolstat.display import style, text
from tolstat.display.answer import Answer, Part, Sentence, Table
from tolstat.display.asked import Asked
from tolstat.display.blocks import Panel, Panels
from tolstat.display.mpl import ticker
from tolstat.display.table import Column, Row, Rows, has, has_unresolved
from tolstat.questions.bearing_life.lives import JOINT, PLACES, Lives, lives_of
from tolstat.store import points
from tolstat.store.view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints that reach a life."""
CONFIDENCE = 0.95
ANY = "any"
"""At least one of the four bearings."""
MOSTLY = 0.5
"""Share of a revolution above which a bearing counts as loaded in a mode."""
LOADED = {"one_end": Mode.ONE_POINT, "opposite_ends": Mode.TWO_POINT, "along": Mode.UNIFORM}
"""Contact mode of each way to load a bearing."""
FEW = "needs more joints"
PLACE_NAMES = {JOINT: "all four", ANY: "at least one"}
LIFE_UNITS = dict.fromkeys(("nominal", "estimate", "lower", "upper", "bound_lower", "bound_upper"), "h")
LIFE_UNITS |= dict.fromkeys(("rating", "rating_lower", "rating_upper"), "N")


def _hours(life: float) -> str:
    """Format a life, h, to four digits; NaN gives a dash."""
    return "-" if math.isnan(life) else "no limit" if math.isinf(life) else f"{text.number(life)} h"


def _span(row: Row) -> str:
    lower, upper = row["lower"], row["upper"]
    if math.isnan(lower):
        return "-"
    high = FEW if math.isinf(upper) else _hours(upper)
    return f"{FEW if lower == 0.0 else text.number(lower)} .. {high}"


def _undecided(row: Row) -> bool:
    """Whether joints without a life make a share as uncertain as sampling does, or no joint has one."""
    without = row["n_failed"] + row["n_unsettled"]
    return bool(without == row["n"] or unresolved_matter(row["count"], row["n"], without))


def _life_of(share: float) -> Column:
    head, rank = f"{100.0 * share:g} % reach", 0 if share == SHARES[-1] else 1
    return Column(head, lambda row: _hours(row[share]["estimate"]), rank=rank)


def _load_of(share: float) -> Column:
    return Column(f"{100.0 * share:g} % up to", lambda row: text.value(row[share]["load"], "N"))


BEARING = Column("bearing", lambda row: PLACE_NAMES.get(row["place"], str(row["place"])))
LIVES = (
    BEARING,
    Column("nominal", lambda row: _hours(row[SHARES[-1]]["nominal"]), rank=2),
    *map(_life_of, SHARES),
    Column(f"95 % interval of {100.0 * SHARES[-1]:g} %", lambda row: _span(row[SHARES[-1]])),
)
"""Columns of the table ``lives``, arranged by `_by_place`."""
LOADS = (
    BEARING,
    Column("nominal", lambda row: text.value(row[SHARES[-1]]["nominal_load"], "N")),
    *map(_load_of, SHARES),
)
"""Columns of the table ``loads``, arranged by `_by_place`."""
BELOW = (
    BEARING,
    Column("below", lambda row: f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"),
    Column("share", lambda row: "-" if _undecided(row) else text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"]), shown=has("lower")),
    Column("total interval", lambda row: text.span(row["total_lower"], row["total_upper"]), shown=has("total_lower")),
    Column(
        "without a life above, below",
        lambda row: text.span(row["bound_lower"], row["bound_upper"]),
        shown=has_unresolved,
        rank=1,
    ),
)
"""Columns of the table ``below_required``."""
CONTACTS = (
    BEARING,
    Column("at one end", lambda row: text.percent(row["one_end"])),
    Column("at opposite ends", lambda row: text.percent(row["opposite_ends"])),
    Column("along its length", lambda row: text.percent(row["along"])),
)
"""Columns of the table ``contacts``."""


def bearing_life(view: View) -> Answer:
    """Compute the life of the pins' bearings.

    Gives the life that 50, 90 and 99 % of the joints reach, for each bearing and for all four together, the share of
    the joints that do not reach the required life, each with its 95 % interval, the dynamic equivalent loads, and how
    the bearings are loaded.

    The bearings are those of [bearing] in the joint file, or of [joint.bearing] in the study. To change them, edit the
    file and repeat tolstat run: no joint is simulated again. With contact.law = "needles" the keys needles and
    needle_length are part of the campaign: to change them, run the study into another file.

    Example: tolstat bearing-life needle_bearings.h5

    Parameters
    ----------
    view : View
        Joints drawn from tolerances, of a study whose joint has a section ``[bearing]``; its operating points are a
        duty cycle.

    Returns
    -------
    Answer
        Tables ``lives`` (see `life_rows`), ``below_required`` (see `below_rows`), ``loads`` (see `load_rows`) and
        ``contacts`` (see `contact_rows`), the first two only if a joint has a rating. Facts ``symbol`` of the life,
        ``critical_amplitude`` (rad), ``unrated`` and ``load_error``, see `lives.Lives`. Lives are in hours.

    Raises
    ------
    NotApplicable, StoreError, InputError
        See `lives.lives_of`.
    """
    lives = lives_of(view)
    found, below, contacts = life_rows(lives), below_rows(lives), contact_rows(view)
    first, *others = _verdict(lives, below, found)
    parts: list[Part] = [Sentence(text.sentence(first), "lead"), *map(Sentence, others)]
    rate = lives.rate(JOINT)
    if rate.valid.size and rate.valid[0] > 0.0:
        said = f"Share of the joints whose bearings fail before a time, against that time. {text.sentence(first)}"
        parts.append(Panels([Panel("lives", "Life of the joints", said, partial(_draw, lives=lives), (6.4, 3.5))]))
    if lives.unrated < lives.valid:
        title = f"Life {lives.bearing.symbol} that a share of the joints reaches"
        parts.append(Table("lives", title, LIVES, found, LIFE_UNITS, _by_place(found)))
        title = f"Joints that do not reach the required {_hours(lives.required)}"
        parts += [Table("below_required", title, BELOW, below, {"required": "h"})] if below else []
    loads, title = load_rows(lives), "Dynamic equivalent load P of a bearing, which a share of the joints stays below"
    parts.append(Table("loads", title, LOADS, loads, dict.fromkeys(("nominal_load", "load"), "N"), _by_place(loads)))
    if contacts:
        title = "Joints in which a bearing is loaded so for more than half of a revolution"
        parts.append(Table("contacts", title, CONTACTS, contacts, dict.fromkeys(list(contacts[0])[1:], "1")))
    facts = {"symbol": lives.bearing.symbol, "critical_amplitude": lives.bearing.critical_amplitude}
    facts |= {"unrated": lives.unrated, "load_error": lives.load_error}
    return Answer("bearing_life", "Bearing life", [*parts, *map(Sentence, _notes(lives, contacts))], facts)


def bearing_life_on_page(view: View, asked: Asked) -> Answer:
    """As `bearing_life`, once a joint of a sample has a result."""
    if not (view.sampled and view.count(*VALID)):
        raise NotApplicable
    return bearing_life(view)


def life_rows(lives: Lives) -> Rows:
    """Life that a share of the joints reaches.

    Returns
    -------
    sequence of mapping
        One row per place of `PLACES` and share: ``place``, ``share``; lives in h: ``nominal``, ``estimate``, ``lower``,
        ``upper``, ``bound_lower``, ``bound_upper`` (joints without a life among the shortest, the longest); ``rating``
        (N, load rating C with which the share reaches the required life) with ``_lower`` and ``_upper``; ``n``,
        ``n_failed`` (those without a rating included), ``n_unsettled``, ``confidence``. Ends are 0 or infinite where
        the joints are too few.
    """
    rows = []
    for rate in map(lives.rate, PLACES):
        for share in SHARES:
            q = rate.quantile(share, CONFIDENCE)
            row = {"place": rate.name, "share": share, "nominal": _life(rate.nominal), "estimate": _life(q.estimate)}
            row |= {"lower": _life(q.upper), "upper": _life(q.lower)}
            row |= {"bound_lower": _life(q.bound_upper), "bound_upper": _life(q.bound_lower)}
            rates = {"rating": q.estimate, "rating_lower": q.lower, "rating_upper": q.upper}
            row |= {name: _rating(value, lives) for name, value in rates.items()}
            row |= {"n": q.n, "n_failed": q.n_failed, "n_unsettled": q.n_unsettled, "confidence": CONFIDENCE}
            rows.append(row)
    return rows


def load_rows(lives: Lives) -> Rows:
    """Dynamic equivalent load that a share of the joints stays at or below.

    Returns
    -------
    sequence of mapping
        One row per bearing and share: ``place``, ``share``, ``nominal_load`` and ``load``, N.
    """
    return [
        {"place": pin, "share": share, "nominal_load": load.nominal, "load": load.quantile(share).estimate}
        for pin, load in zip(PINS, map(lives.load, PINS), strict=True)
        for share in SHARES
    ]


def below_rows(lives: Lives) -> Rows:
    """Share of the joints whose life is below the required one.

    Returns
    -------
    sequence of mapping
        One row per place of `PLACES`: ``place``, ``required`` (h), the fields of `analysis.estimates.Exceedance` but
        its level (``count`` are the joints below the required life; bounds have joints without a life above and
        below), ``total_lower`` and ``total_upper`` (cover sampling, joints without a life and, if known, the numerical
        error), ``confidence``. No rows without a required life.
    """
    rows = []
    for place in PLACES if np.isfinite(lives.required) else ():
        rate, level = lives.rate(place), 1.0 / lives.required
        row = {"place": place, "required": lives.required} | asdict(rate.above(level, CONFIDENCE))
        del row["level"]
        low, high = total_interval(_with_error(rate, lives.load_error), level, CONFIDENCE)
        rows.append(row | {"total_lower": low, "total_upper": high, "confidence": CONFIDENCE})
    return rows


def contact_rows(view: View) -> Rows:
    """Share of the joints in which a bearing is mostly loaded at one end, at opposite ends, or along its length.

    Of several operating points each counts by its share of the revolutions.

    Returns
    -------
    sequence of mapping
        One row per pin, and one for `ANY` of them: ``place``; ``one_end``, ``opposite_ends`` and ``along``, shares of
        the joints in which this holds for more than `MOSTLY` of a revolution, with ``_lower`` and ``_upper``.
        No rows if the study does not keep the contact modes.
    """
    if sum(column.field == "mode_share" for column in view.columns) < len(PINS) * len(Mode):
        return []
    modes = [part.read_results(("mode_share",))["mode_share"] for part in view.parts]
    spent = np.tensordot(points.shares_of_revolutions(view), np.stack(modes), 1)
    rows = []
    for place in (*PINS, ANY):
        own = spent[:, [PINS.index(place)]] if place in PINS else spent
        row: dict[str, Any] = {"place": place}
        for name, mode in LOADED.items():
            found = Sample.of(own[:, :, mode].max(axis=1), view.status, view.design).above(MOSTLY, CONFIDENCE)
            row |= {name: found.estimate, f"{name}_lower": found.lower, f"{name}_upper": found.upper}
        rows.append(row)
    return rows


def _by_place(rows: Rows) -> Rows:
    """One row per place: for each share its row."""
    found: dict[str, dict[Any, Any]] = {}
    for row in rows:
        found.setdefault(row["place"], {"place": row["place"]})[row["share"]] = row
    return list(found.values())


def _rating(rate: float, lives: Lives) -> float:
    """Load rating, N, of bearings with which a life of so many 1/h becomes the required one."""
    return float(lives.bearing.C * (max(rate, 0.0) * lives.required) ** (1.0 / LIFE_EXPONENT))


def _life(rate: float) -> float:
    """Reciprocal, h; a rate of zero or of no joint (-inf) is an infinite life."""
    return np.inf if rate <= 0.0 else 1.0 / rate


def _with_error(rate: Sample, error: float) -> tuple[Sample, ...]:
    """Rates, and those with equivalent loads reduced and increased by their numerical error if it is known."""
    if np.isnan(error):
        return (rate,)
    factors = (max(0.0, 1.0 - error) ** LIFE_EXPONENT, (1.0 + error) ** LIFE_EXPONENT)
    return rate, *(rate.shifted((factor - 1.0) * rate.values) for factor in factors)


def _verdict(lives: Lives, below: Rows, found: Rows) -> list[str]:
    """Sentences on the required life, or on why there is none to judge; the first is the answer."""
    if lives.valid and lives.unrated == lives.valid:
        return [f"no rating: {_why_unrated(lives, 'every joint')}"]
    if not below:
        return ["no required life is given: bearing.required_life"]
    row = below[-1]
    without, required = row["n_failed"] + row["n_unsettled"], f"the required {_hours(lives.required)}"
    bounds = f"{text.span(row['bound_lower'], row['bound_upper'])} with joints without a life counted above, then below"
    if _undecided(row):
        return [f"no verdict: {without} of {row['n']} joints have no life; below {required} are {bounds}"]
    low, high = row["total_lower"], row["total_upper"]
    interval = "" if math.isnan(low) else f" (total interval {text.span(low, high)})"
    said = [f"{text.percent(row['estimate'])} of the joints{interval} do not reach {required}"]
    said += [f"{without} of {row['n']} joints have no life: {bounds}"] if without else []
    return [*said, *_better_bearings(found[-1])]


def _better_bearings(row: Row) -> list[str]:
    """Sentence on the load rating with which the share of a row of `life_rows` reaches the required life."""
    if not row["rating"] > 0.0:
        return []
    low, high = row["rating_lower"], row["rating_upper"]
    top = FEW if math.isinf(high) else f"{text.number(high / 1e3)} kN"
    ends = "" if math.isnan(low) else f" (95 % interval {text.number(low / 1e3)} .. {top})"
    return [f"{100.0 * row['share']:g} % of the joints reach it with C = {text.number(row['rating'] / 1e3)} kN{ends}"]


def _why_unrated(lives: Lives, joints: str) -> str:
    angle = f"{math.degrees(lives.bearing.critical_amplitude):.3g} deg"
    return (
        f"{joints} swings by less than {angle} to either side, so that the tracks of neighbouring needles do not "
        "overlap; the rating life does not hold there, since the lubricant between needles and raceways is not renewed"
    )


def _notes(lives: Lives, contacts: Rows) -> Iterator[str]:
    """What the life means, what it leaves out, restrictions."""
    bearing = lives.bearing
    if lives.unrated < lives.valid:
        factors = f"a_1 = {A1[bearing.reliability]:g}"
        factors += "" if bearing.a_iso is None else f", a_ISO = {bearing.a_iso:g}"
        yield (
            f"{100.0 * bearing.reliability:g} % of equal joints reach their life {bearing.symbol} (C = "
            f"{text.number(bearing.C / 1e3)} kN, {factors}) at the joint's speed and misalignment; all four: until the "
            "first of the four bearings fails, Weibull slope 9/8"
        )
    if len(lives.duty) > 1:
        shares = ", ".join(f"{text.percent(share)} at {point}" for point, share in lives.duty.items())
        yield f"over a duty cycle: {shares} of the time; P: the constant load with the same life"
    edge = "the rating knows no edge load: it takes the resultant force as spread along the needles"
    if contacts:
        row = contacts[-1]
        yield (
            f"{edge}. In {text.percent(row['one_end'])} of the joints at least one bearing is loaded at one end only "
            f"for more than half of a revolution, in {text.percent(row['opposite_ends'])} at opposite ends, where the "
            "resultant is smaller than the forces at the ends: these bearings last shorter than rated"
        )
    else:
        yield f"{edge}; the study keeps no contact modes, which tell how many bearings have it"
    if 0 < lives.unrated < lives.valid:
        yield f"{lives.unrated} of {lives.valid} joints have no rating: {_why_unrated(lives, 'each of them')}"
    if lives.load_error > 0.0:
        yield f"numerical error of an equivalent load: {text.percent(lives.load_error)}, in the total interval"
    if not lives.design.has_interval("quantile"):
        yield "no intervals: they hold for independent samples only"


def _draw(ax: Axes, lives: Lives) -> None:
    """Draw the share of the joints with a shorter life."""
    rate = lives.rate(JOINT)
    table = rate.curve(np.unique(rate.valid))[::-1]
    x, floor = 1.0 / table["level"], 0.5 / float(table["n"][0])
    shares = {name: table[name].clip(floor, 1.0) for name in ("outer_lower", "estimate", "outer_upper")}
    if lives.design.has_interval("quantile"):
        band = shares["outer_lower"], shares["outer_upper"]
        ax.fill_between(x, *band, step="pre", color=style.COLOURS[0], alpha=0.2, lw=0, label="95 % band")
    ax.step(x, shares["estimate"], where="pre", color=style.COLOURS[0])
    ax.set_xscale("log")
    style.share_axis(ax, floor)
    ax.xaxis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: text.number(value)))
    ax.xaxis.set_minor_formatter(ticker.NullFormatter())
    ax.set(xlabel=f"life {lives.bearing.symbol} of the joint [h]", ylabel="share of joints with a shorter life")
    nominal = float(lives.nominal_hours[-1])
    if math.isfinite(nominal):
        marker: Any = {"ms": 7.5, "mec": "white", "color": style.INK, "ls": "", "clip_on": False}
        ax.plot(nominal, 1.0, "v", label="nominal joint", **marker)
    if math.isfinite(lives.required):
        ax.axvline(lives.required, color=style.INK, lw=1.4, ls="--", label="required life")
    ax.legend(loc="lower right")
