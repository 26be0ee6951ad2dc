"""How long the needle bearings of the pins last: lives, shares below the required life, how bearings are loaded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from tolstat.analysis.binomial import needed
from tolstat.analysis.rating_life import A1, FRETTING
from tolstat.analysis.sample import CONFIDENCE
from tolstat.common.errors import NotApplicable
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Panel, Panels, Part, Sentence, Table
from tolstat.display.table import Column, Row, Rows, by_share, has, has_unresolved, of_shares
from tolstat.display.verdict import Verdict, on_share
from tolstat.questions import shares
from tolstat.questions.bearing_life import lives as rating
from tolstat.questions.bearing_life import needles
from tolstat.store import recorded
from tolstat.store.view import View

FEW = "needs more joints"
UNITS = dict.fromkeys(("nominal", "estimate", "lower", "upper", "bound_lower", "bound_upper"), "h")
OF_BEARING = {"load": "N", "tilt": "rad", "life": "h", "safety": "1", "pressure": "Pa"}
"""Quantities of the table ``bearings``, with their units."""
UNITS |= dict.fromkeys(("rating", "rating_lower", "rating_upper"), "N")


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
    return bool(row["n_failed"] + row["n_unsettled"] == row["n"] or shares.unresolved_matter(row))


LIVES = (
    Column("nominal", lambda row: _hours(row[rating.SHARES[-1]]["nominal"]), rank=2),
    *of_shares(rating.SHARES, "reach", lambda row: _hours(row["estimate"]), rank=1),
    Column(f"95 % interval of {100.0 * rating.SHARES[-1]:g} %", lambda row: _span(row[rating.SHARES[-1]])),
)
"""Columns of the table ``lives`` after the bearing, arranged by place."""


def _last(name: str, unit: str, size: float = 1.0) -> shares.Cell:
    """Make a cell of the row of the largest share, by place; `size` of `unit` in SI."""
    return lambda row: text.value(row[rating.SHARES[-1]][name] / size, unit)


BEARINGS = (
    Column("P nominal", _last("nominal_load", "N"), rank=1),
    Column("P", _last("load", "N")),
    Column("tilt", _last("tilt", "mrad", 1e-3)),
    Column("life", lambda row: _hours(row[rating.SHARES[-1]]["life"])),
    Column("C0/P0", _last("safety", "1")),
    Column("pressure", _last("pressure", "Pa")),
)
"""Columns of the table ``bearings`` after the bearing, arranged by place: those of the largest share."""
BELOW = (
    Column("below", lambda row: f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"),
    Column("share", lambda row: "-" if _undecided(row) else text.percent(row["estimate"])),
    Column("95 % interval", shares.shares("lower", "upper"), shown=has("lower")),
    Column("total interval", shares.shares("total_lower", "total_upper"), shown=has("total_lower")),
    Column("without a life above, below", shares.shares("bound_lower", "bound_upper"), shown=has_unresolved, rank=1),
)
"""Columns of the table ``below_required`` after the bearing."""
CONTACTS = (
    Column("at one end", shares.share("one_end")),
    Column("at opposite ends", shares.share("opposite_ends")),
    Column("along its length", shares.share("along")),
)
"""Columns of the table ``contacts`` after the bearing."""


def bearing_life(view: View) -> Answer:
    """Compute the life of the pins' bearings.

    Gives the life that 50, 90 and 99 % of the joints reach, for each bearing and for all of them together, the share of
    the joints that do not reach the required life, each with its 95 % interval, load, tilt, static safety and pressure
    of each bearing, and how the bearings are loaded.

    The bearings are those of [bearing] in the joint file, or of [joint.bearing] in the study. Their dimensions are part
    of the campaign: to change them, run the study into another file. To change ratings, required life, reliability or
    a_iso, edit the file and repeat tolstat run: no joint is simulated again.

    Example: tolstat bearing-life needle_bearings.h5

    Parameters
    ----------
    view : View
        Joints drawn from tolerances, of a study whose joint has a section ``[bearing]``; its operating points are a
        duty cycle.

    Returns
    -------
    Answer
        Tables ``lives`` (see `life_rows`), ``below_required`` (see `below_rows`), ``bearings`` (see `bearing_rows`) and
        ``contacts`` (see `contact_rows`), the first two only if a joint has a rating. Lives are in hours. Facts
        ``symbol`` of the life, ``critical_amplitude`` (rad), ``used``, ``unrated``, ``short``, ``fretting``,
        ``load_error`` and ``population`` (h, with ``_lower`` and ``_upper``), see `lives.Lives`.

    Raises
    ------
    NotApplicable, StoreError, InputError
        See `lives.lives_of`.
    """
    lives = rating.lives_of(view)
    names = rating.places_of(view.mechanism) | {rating.ANY: "at least one"}
    bearing = Column("bearing", lambda row: names[row["place"]])
    reached, below, contacts = rating.life_rows(lives), rating.below_rows(lives), rating.contact_rows(view)
    first, *others = _verdict(lives, below, reached)
    parts: list[Part] = [Sentence(text.sentence(first), "lead"), *map(Sentence, others)]
    rate = lives.rate(lives.whole)
    if rate.valid.size and rate.valid[0] > 0.0:
        words = f"Share of the joints whose bearings fail before a time, against that time. {text.sentence(first)}"
        parts.append(Panels([Panel("lives", "Life of the joints", words, partial(_draw, lives=lives), (6.4, 3.5))]))
    if lives.unrated < lives.valid:
        title = f"Life {lives.bearing.symbol} that a share of the joints reaches"
        parts.append(Table("lives", title, (bearing, *LIVES), reached, UNITS, by_share(reached, "place")))
        title = f"Joints that do not reach the required {_hours(lives.required)}"
        parts += [Table("below_required", title, (bearing, *BELOW), below, {"required": "h"})] if below else []
    each = rating.bearing_rows(lives)
    units = {f"{which}{name}": unit for name, unit in OF_BEARING.items() for which in ("", "nominal_")}
    most = f"{100.0 * rating.SHARES[-1]:g} % of the joints"
    title = f"Bearings in {most}: P, tilt, pressure at most; life, C0/P0 at least"
    parts.append(Table("bearings", title, (bearing, *BEARINGS), each, units, by_share(each, "place")))
    parts += needles.pictures(lives)
    if contacts:
        title = "Joints in which a bearing is loaded so for more than half of a revolution"
        units = dict.fromkeys(list(contacts[0])[1:], "1")
        parts.append(Table("contacts", title, (bearing, *CONTACTS), contacts, units))
    names_of_facts = ("critical_amplitude", "used", "unrated", "short", "fretting", "load_error")
    facts: dict[str, Any] = {"symbol": lives.bearing.symbol} | {name: getattr(lives, name) for name in names_of_facts}
    facts |= shares.with_ends("population", lives.population)
    return Answer("bearing_life", "Bearing life", [*parts, *map(Sentence, _notes(lives, contacts))], facts)


def bearing_life_on_page(view: View, asked: Asked) -> Answer:
    """As `bearing_life`, once a joint of a sample has a result; without histories on the page, without needles."""
    if not (view.sampled and view.count(*VALID)):
        raise NotApplicable
    answer = bearing_life(view)
    calm = [part for part in answer.parts if not (isinstance(part, Panels) and part.panels[0].key.endswith("needles"))]
    return answer if asked.replay else replace(answer, parts=calm)


def _verdict(lives: rating.Lives, below: Rows, reached: Rows) -> list[str]:
    """Sentences on the required life, or on why there is none to judge; the first is the answer."""
    if lives.valid and lives.unrated == lives.valid:
        return [f"no rating: {_why_unrated(lives, 'every joint')}"]
    if not below:
        return ["no required life is given: bearing.required_life"]
    row, required = below[-1], f"the required {_hours(lives.required)}"
    if _undecided(row):
        return [f"no verdict: {_without(row)}; below {required} are {_bounds(row)}"]
    interval = text.span(row["total_lower"], row["total_upper"])
    total = "" if interval == "-" else f" (total interval {interval})"
    sentences = [f"{text.percent(row['estimate'])} of the joints{total} do not reach {required}"]
    sentences += [f"{_without(row)}: {_bounds(row)}"] if has_unresolved([row]) else []
    best = reached[-1]  # all bearings, the largest share
    rate, low, high = (best[f"rating{end}"] / 1e3 for end in ("", "_lower", "_upper"))
    ends = f" (95 % interval {text.number(low)} .. {FEW if math.isinf(high) else f'{text.number(high)} kN'})"
    if rate > 0.0:
        better = f"C = {text.number(rate)} kN{'' if math.isnan(low) else ends}"
        sentences.append(f"{100.0 * best['share']:g} % of the joints reach it with {better}")
    return sentences


def _without(row: Row) -> str:
    return f"{row['n_failed'] + row['n_unsettled']} of {row['n']} joints have no life"


def _bounds(row: Row) -> str:
    return f"{text.span(row['bound_lower'], row['bound_upper'])} with joints without a life counted above, then below"


def life_verdicts(view: View, accepted: float = math.nan) -> list[Verdict]:
    """Verdict on the required life of the bearings; none if no life is required.

    Parameters
    ----------
    view : View
        As in `bearing_life`.
    accepted : float
        Accepted share: share of the joints that may have a shorter life; NaN if none is given.

    Raises
    ------
    NotApplicable, StoreError, InputError
        See `lives.lives_of`.
    """
    bearing = rating.bearings_of(view)[0]
    if bearing is None or bearing.required_life is None:
        return []
    lives = rating.lives_of(view)
    row, undecided = rating.below_rows(lives)[-1], ""
    if lives.valid and lives.unrated == lives.valid:
        nothing = "no joint" if lives.of_shaft else "no bearing"
        undecided = f"{nothing} has a rating: {_why_unrated(lives, 'every joint')}"
    elif _undecided(row):
        undecided = f"{_without(row)}; shorter than required are {_bounds(row)}"
    what, ends = f"have a bearing life below {_hours(lives.required)}", (row["total_lower"], row["total_upper"])
    level = lives.view.design.level(CONFIDENCE)

    def deciding(share: float) -> float:
        return needed(share, accepted, level)

    judged = on_share("bearing life", what, row, ends, accepted, deciding, "", undecided)
    return [judged._replace(notes=tuple(_at_points(lives)))]


def _why_unrated(lives: rating.Lives, joints: str) -> str:
    """Why `joints` have no rating; of a drive shaft with the joint whose bearings swing too little."""
    each, who = " at each of its operating points" if len(lives.duty) > 1 else "", joints
    if lives.of_shaft:
        hours = lives.hours[np.isin(lives.view.status, VALID), : len(lives.pins)]
        lacking = dict.fromkeys(lives.pins[k].partition(".")[0] for k in np.unique(np.argwhere(np.isnan(hours))[:, 1]))
        who = f"in {joints} a bearing of {' or '.join(lacking)}"
    return (
        f"{who} swings by less than {_angle(lives, FRETTING)} to either side{each}, half of the angle from "
        "which on the tracks of neighbouring needles overlap; the lubricant between needles and raceways is not "
        "renewed there, and fretting, which no rating covers, is to be expected"
    )


def _angle(lives: rating.Lives, part: float = 1.0) -> str:
    """Part of the critical amplitude; where that of two joints differs, of each by its name."""
    angles = [f"{math.degrees(part * bearing.critical_amplitude):.3g} deg" for bearing in lives.bearings]
    named = [f"{angle} (joint{number})" for number, angle in enumerate(angles, 1)]
    return angles[0] if len(set(angles)) == 1 else " and ".join(named)


def _at_points(lives: rating.Lives) -> Iterator[str]:
    """Sentences on points at which joints swing by less than the critical amplitude, and on a selection of points."""
    alike: dict[tuple[int, int], list[str]] = {}
    for point, number in lives.short.items() if lives.unrated < lives.valid else ():
        alike.setdefault((number, lives.fretting.get(point, 0)), []).append(point)
    for (number, fretting), points in alike.items():
        share = text.percent(sum(lives.duty[point] for point in points))
        time = f", {share} of the time," if len(lives.duty) > 1 else ""
        where = f"at {', '.join(points)}{time} " if points[0] else ""
        swinging = "every joint swings" if number == lives.valid else f"{number} of {lives.valid} joints swing"
        if lives.of_shaft:
            swinging = f"a bearing of {swinging.removesuffix('s')}s"
        words = (
            f"{where}{swinging} by less than {_angle(lives)} to either side: the tracks of neighbouring needles do not "
            "overlap, and the life is that of the smaller volume that they stress"
        )
        if fretting:
            joints = "they swing" if fretting == number else f"{fretting} of them swing"
            words += f". As {joints} by less than half of this, fretting, which no rating covers, may end it earlier"
        yield words
    if len(lives.duty) < len(lives.view.store.points):
        yield f"as though all of the service were at {' and '.join(lives.duty)}"


def _notes(lives: rating.Lives, contacts: Rows) -> Iterator[str]:
    """What the life means, what it leaves out, restrictions."""
    bearing = lives.bearing
    if lives.unrated < lives.valid:
        ratings = " and ".join(dict.fromkeys(text.number(each.dynamic_rating / 1e3) for each in lives.bearings))
        a_iso = {1.0 if each.a_iso is None else each.a_iso: each.a_iso for each in lives.bearings}
        modified = "" if list(a_iso.values()) == [None] else f", a_ISO = {' and '.join(f'{a:g}' for a in a_iso)}"
        factors = f"a_1 = {A1[bearing.reliability]:g}{modified}"
        all_pins = text.in_words(len(lives.pins))
        yield (
            f"{100.0 * bearing.reliability:g} % of equal joints reach their life {bearing.symbol} (C = "
            f"{ratings} kN, {factors}) at the joint's speed and misalignment; "
            f"all {all_pins}: until the first of the {all_pins} bearings fails, Weibull slope 9/8"
        )
    population = lives.population
    if not math.isnan(population.estimate):
        ends = f" (95 % interval {text.number(population.lower)} .. {_hours(population.upper)})"
        yield (
            f"{100.0 * (1.0 - bearing.reliability):.3g} % of all joints together have lost a bearing after "
            f"{_hours(population.estimate)}{'' if math.isnan(population.lower) else ends}: "
            "life itself scatters, and loads do"
        )
    if len(lives.duty) > 1:
        times = ", ".join(f"{text.percent(share)} at {point}" for point, share in lives.duty.items())
        yield f"over a duty cycle: {times} of the time; P: the constant load with the same life"
        if np.isfinite([*lives.used.values()]).all():
            used = sorted(lives.used.items(), key=lambda of: -of[1])
            told = ", ".join(f"{text.percent(share)} at {point}" for point, share in used)
            yield f"share of the life of all bearings that each operating point uses up, mean of the joints: {told}"
    yield (
        "P is by laminae (ISO/TS 16281): the load with the same L10r on the bearing, profile included, in line and "
        "without clearance. Pressure: of the most loaded lamina, without the stress at the ends of a needle"
    )
    laws = {joint.contact.law for joint in recorded.joints_at(lives.view.store, 0)} - {"needles"}
    if laws:
        yield (
            f"the joints were simulated with contact.law = {' and '.join(sorted(laws))}: force and tilt of each pin "
            "are distributed over the needles afterwards"
        )
    if contacts:
        row = contacts[-1]
        yield (
            f"in {text.percent(row['one_end'])} of the joints at least one bearing is loaded at one end only for more "
            f"than half of a revolution, in {text.percent(row['opposite_ends'])} at opposite ends"
        )
    yield from _at_points(lives)
    if 0 < lives.unrated < lives.valid:
        yield f"{lives.unrated} of {lives.valid} joints have no rating: {_why_unrated(lives, 'each of them')}"
    if lives.load_error > 0.0:
        yield f"numerical error of an equivalent load: {text.percent(lives.load_error)}, in the total interval"


def _draw(ax: Axes, lives: rating.Lives) -> None:
    """Draw the share of the joints with a shorter life."""
    rate = lives.rate(lives.whole)
    table = rate.curve(np.unique(rate.valid))[::-1]
    x, floor = 1.0 / table["level"], 0.5 / float(table["n"][0])
    curve = [table[name].clip(floor, 1.0) for name in ("estimate", "outer_lower", "outer_upper")]
    drawing.curves(ax, x, {"": curve}, bands=1, step="pre")
    style.share_axis(ax, floor)
    nominal = float(lives.nominal_hours[-1])
    ends = [life for life in (x.min(), x.max(), nominal, lives.required) if math.isfinite(life)]
    drawing.log_loads(ax.xaxis, 0.8 * min(ends), 1.25 * max(ends), max(ends), "h")
    ax.set(xlabel=f"life {lives.bearing.symbol} of the {lives.whole} [h]", ylabel="share of joints with a shorter life")
    if math.isfinite(nominal):
        style.mark(ax, nominal, 1.0, style.INK)
    if math.isfinite(lives.required):
        ax.axvline(lives.required, color=style.INK, lw=1.4, ls="--", label="required life")
