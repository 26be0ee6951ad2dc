"""Rating life of the bearings of each joint of a campaign (docs/model.md, Bearing life)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from tolstat.analysis import accuracy
from tolstat.analysis.estimates import Estimate
from tolstat.analysis.rating_life import population_life
from tolstat.analysis.sample import Sample, total_interval
from tolstat.common.errors import input_error
from tolstat.common.load_kinds import kinds
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import Mechanism, prefixes
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import LIFE_EXPONENT, VALID, Mode
from tolstat.display import text
from tolstat.display.table import Rows
from tolstat.joint import Bearing, joints_of
from tolstat.joint.bearing import FOR_LIFE
from tolstat.questions.bearing_life.rated import HOUR, largest, rated, turning_of
from tolstat.questions.shares import inapplicable, unusable, with_ends
from tolstat.store import recorded
from tolstat.store.view import View

JOINT, SHAFT = "joint", "shaft"
"""The joint, or the drive shaft: it lasts until the first of its bearings fails."""
ANY = "any"
"""At least one of the bearings."""
SHARES = (0.5, 0.9, 0.99)
"""Shares of the joints that reach a life."""
CONFIDENCE = 0.95
MOSTLY = 0.5
"""Share of a revolution above which a bearing counts as loaded in a mode."""
LOADED = {"one_end": Mode.ONE_POINT, "opposite_ends": Mode.TWO_POINT, "along": Mode.UNIFORM}
"""Contact mode of each way to load a bearing."""


@dataclass(frozen=True, eq=False)
class Lives:
    """Rating lives of the n joints of a view.

    Attributes
    ----------
    view : View
        The campaign.
    bearings : tuple of Bearing
        Section ``[bearing]`` of each joint that is simulated.
    duty : dict of str to float
        Share of the service time at each operating point; their sum is 1.
    used : dict of str to float
        Share of the life that each uses up, see `rated.Rated`, on average of the joints with a rating.
    pins : tuple of str
        Pins, which bearings are named by.
    loads : ndarray, shape (n, pins)
        Dynamic equivalent load of each pin's bearing over the duty cycle, N; NaN without a result.
    hours : ndarray, shape (n, places)
        Life of each bearing and of several together, as in `places`, h; NaN without a result or without a rating.
    worst : dict of str to ndarray, shape (n, pins)
        What `rated.largest` tells of each bearing.
    nominal_loads, nominal_hours : ndarray, shape (pins,) and (places,)
        The same of the nominal joint; NaN if there is none.
    nominal_worst : dict of str to ndarray, shape (pins,)
        Likewise.
    short, fretting : dict of str to int
        Valid joints by operating point of which a bearing swings by less than ``bearing.critical_amplitude`` there, and
        by less than `rating_life.FRETTING` times this; only points that have any.
    unrated : int
        Valid joints without a rating: a bearing swings by less than the latter at each of their operating points.
    load_error : float
        Relative numerical error of an equivalent load that 95 % of the checked joints stay below; NaN if unknown.
    """

    view: View
    bearings: tuple[Bearing, ...]
    duty: Mapping[str, float]
    used: Mapping[str, float]
    pins: tuple[str, ...]
    loads: FloatArray
    hours: FloatArray
    worst: Mapping[str, FloatArray]
    nominal_loads: FloatArray
    nominal_hours: FloatArray
    nominal_worst: Mapping[str, FloatArray]
    short: Mapping[str, int]
    fretting: Mapping[str, int]
    unrated: int
    load_error: float

    @property
    def bearing(self) -> Bearing:
        """That of joint 1, which gives required life and reliability of all."""
        return self.bearings[0]

    @property
    def critical_amplitude(self) -> float:
        """Largest of the bearings, rad."""
        return max(bearing.critical_amplitude for bearing in self.bearings)

    def rating_of(self, place: str) -> float:
        """Load rating C of the bearings of one of `places`, N; NaN of several with different ones."""
        joints = [name.rstrip(".") for name in prefixes(self.view.mechanism)]
        ratings = {
            b.dynamic_rating
            for joint, b in zip(joints, self.bearings, strict=True)
            if place.startswith(joint) or place == SHAFT
        }
        return ratings.pop() if len(ratings) == 1 else np.nan

    @property
    def places(self) -> tuple[str, ...]:
        """See `places_of`."""
        return tuple(places_of(self.view.mechanism))

    @property
    def whole(self) -> str:
        """What all bearings are of: `JOINT` or `SHAFT`."""
        return self.places[-1]

    @property
    def of_shaft(self) -> bool:
        """Whether the bearings are of several joints, which swing by different angles."""
        return self.view.mechanism.is_shaft

    @property
    def valid(self) -> int:
        """Number of joints with a valid result."""
        return self.view.count(*VALID)

    @property
    def population(self) -> Estimate[float]:
        """Life that a share `Bearing.reliability` of all joints reaches, h; NaN where a joint has no life."""
        design = self.view.design.only(valid := np.isin(self.view.status, VALID))
        hours = self.hours[valid, -1]
        if not (hours.size and np.isfinite(hours).all()):
            return Estimate(np.nan, np.nan, np.nan)
        return population_life(hours, self.bearing.reliability, design.groups(hours.size), design.level(CONFIDENCE))

    @property
    def required(self) -> float:
        """Required life, h; NaN if none is given."""
        return np.nan if self.bearing.required_life is None else self.bearing.required_life / HOUR

    def rate(self, place: str) -> Sample:
        """Reciprocal of the life of one of `places`, 1/h: as with a load, higher is worse."""
        k = self.places.index(place)
        with np.errstate(divide="ignore"):
            nominal, values = 1.0 / self.nominal_hours[k], 1.0 / self.hours[:, k]
        return Sample.of(values, self.view.status, self.view.design, name=place, unit="1/h", nominal=nominal)

    def of_bearing(self, name: str, pin: str) -> Sample:
        """A quantity of a pin's bearing: ``load``, N, or one of `worst`; of the safety the reciprocal."""
        k, unit = self.pins.index(pin), {"load": "N", "tilt": "rad", "pressure": "Pa", "safety": "1"}[name]
        nominal, values = self.nominal_loads[k], self.loads[:, k]
        if name != "load":
            nominal, values = self.nominal_worst[name][k], self.worst[name][:, k]
        with np.errstate(divide="ignore"):
            nominal, values = (1.0 / nominal, 1.0 / values) if name == "safety" else (nominal, values)
        return Sample.of(values, self.view.status, self.view.design, name=pin, unit=unit, nominal=float(nominal))


def places_of(mechanism: Mechanism) -> dict[str, str]:
    """What has a life, with which bearings that is: each pin, of a drive shaft each joint, and the whole.

    ``{"joint1.pin1": "joint1.pin1", ..., "joint1": "all of joint1", "joint2": "all of joint2", "shaft": "all eight"}``
    """
    pins = kinds(mechanism)["contact"].places
    joints = [name.rstrip(".") for name in prefixes(mechanism)] if mechanism.is_shaft else []
    whole = {SHAFT if mechanism.is_shaft else JOINT: f"all {text.in_words(len(pins))}"}
    return {pin: pin for pin in pins} | {joint: f"all of {joint}" for joint in joints} | whole


def lives_of(view: View) -> Lives:
    """Rating lives of the joints of a campaign.

    Operating points count by the turns that the bearings make there (Palmgren 1924, Miner 1945; ISO 281).

    Parameters
    ----------
    view : View
        Joints drawn from tolerances, of a study whose joint has a section ``[bearing]``; its operating points are a
        duty cycle.

    Raises
    ------
    NotApplicable
        When the joint has no such section, in the file or in the study that the view reads in its place.
    StoreError
        When the section lacks a key, the equivalent loads are not kept, or the joints are no sample.
    InputError
        When the view has several operating points, and the study does not give their shares of the time.
    """
    view.check()
    bearings, duty, stores = _bearings(view), view.shares_of_time, [part.store for part in view.parts]
    pins = kinds(view.mechanism)["contact"].places
    turning = [turning_of(store) for store in stores]
    load, hours, used, small = rated(bearings, duty, turning)
    worst = largest(bearings, turning)
    unrated = np.asarray(small[1].all(axis=0))
    skip, valid, has_nominal = view.store.first_sample, np.isin(view.status, VALID), len(view.nominal) > 0
    short, fretting = (
        {name: int(n) for name, n in zip(view.points, (some[:, skip:] & valid).sum(axis=1), strict=True) if n}
        for some in (np.asarray(joints.any(axis=2)) for joints in small)
    )
    return Lives(
        view=view,
        bearings=bearings,
        duty=dict(zip(view.points, duty.tolist(), strict=True)),
        used=dict(zip(view.points, _mean(used[:, skip:]).tolist(), strict=True)),
        pins=pins,
        loads=load[skip:],
        hours=hours[skip:],
        worst={name: values[skip:] for name, values in worst.items()},
        nominal_loads=load[0] if has_nominal else np.full(len(pins), np.nan),
        nominal_hours=hours[0] if has_nominal else np.full(hours.shape[1], np.nan),
        nominal_worst={name: values[0] if has_nominal else np.nan * load[0] for name, values in worst.items()},
        short=short,
        fretting=fretting,
        unrated=int((unrated[skip:].any(axis=1) & valid).sum()),
        load_error=_load_error(view),
    )


def quantity(view: View, place: str) -> Sample:
    """Reciprocal of the life of one of `places_of`, 1/h; of all bearings together without a place."""
    lives = lives_of(view)
    place = place or lives.whole
    if place not in lives.places:
        raise input_error(f"life {place}", "is not the life of a bearing", did_you_mean(place, list(lives.places)))
    return replace(lives.rate(place), name="1/life" if place == lives.whole else f"1/life of {place}")


def _mean(shares: FloatArray) -> FloatArray:
    """Mean over the joints that have shares, (points,); NaN without any."""
    known = shares[:, ~np.isnan(shares).any(axis=0)]
    return np.asarray(known.mean(axis=1)) if known.size else np.full(len(shares), np.nan)


def bearings_of(view: View) -> list[Bearing | None]:
    """Section ``[bearing]`` of the joints of a file, or of the study that is read in place of the one in it."""
    study = view.study if view.study_path else None
    joints = joints_of(study.joint, study.operation) if study else recorded.joints_at(view.store, 0)
    return [joint.bearing for joint in joints]


def _bearings(view: View) -> tuple[Bearing, ...]:
    """Section ``[bearing]`` of the joints of a file, with all that a life needs; refused of linkages."""
    if view.mechanism.placed:
        remedy = "take forces of the pins and their swing to the maker's calculation: tolstat export FILE --csv"
        raise inapplicable(view, "holds no Cardan joints, whose bearings alone have a rating life here", remedy)
    sections = ("joint", "joint" if recorded.joint2_of(view.store) is None else "shaft.joint2")
    return tuple(_complete(view, *both) for both in zip(bearings_of(view), sections, strict=False))


def _complete(view: View, bearing: Bearing | None, section: str) -> Bearing:
    """Bearing of the joint of a section of the study; refused without what a life needs."""
    again = "then repeat tolstat run: no joint is simulated again"
    anew = "then run it into another file: loads are distributed over the needles as a joint is simulated"
    if bearing is None:
        remedy = f"add the section [bearing] to the joint file or [{section}.bearing] to the study, {anew}"
        raise inapplicable(view, "holds a joint without bearings", remedy)
    if lacking := bearing.lacking(FOR_LIFE):
        incomplete = f"holds needle bearings without {', '.join(lacking)}, which a rating life needs"
        error = inapplicable if bearing.C is None and bearing.required_life is None else unusable
        keys = " and ".join(f"{section}.bearing.{key}" for key in lacking)
        then = again if lacking == ["C"] else anew
        raise error(view, incomplete, f"add {keys} to the study, or to [bearing] of the joint file, {then}")
    if sum(column.field == "equivalent_load" for column in view.columns) < len(kinds(view.mechanism)["contact"].places):
        remedy = 'add "pin*.equivalent_load" to [output] results of the study'
        raise unusable(view, "does not keep the equivalent loads of the bearings", remedy)
    return bearing


def _load_error(view: View) -> float:
    """Relative numerical error of an equivalent load, `analysis.accuracy.USUAL` of the checked joints; NaN if unknown.

    It is estimated as that of largest loads (`analysis.accuracy.estimate`); the largest of the bearings counts.
    """
    if view.verification is None:
        return np.nan
    base = view.verification.base
    valid = np.isin(base["status"], VALID)[:, None]
    changes = {
        name: np.where(valid, base["equivalent_load"] / check.results["equivalent_load"] - 1.0, np.nan)
        for name, check in view.verification.checks.items()
    }
    return accuracy.spread(accuracy.estimate(changes).max(axis=1)).usual


def life_rows(lives: Lives) -> Rows:
    """Life that a share of the joints reaches.

    Returns
    -------
    sequence of mapping
        One row per place and share: ``place``, ``share``; lives in h: ``nominal``, ``estimate``, ``lower``,
        ``upper``, ``bound_lower``, ``bound_upper`` (joints without a life among the shortest, the longest); ``rating``
        (N, load rating C with which the share reaches the required life) with ``_lower`` and ``_upper``; ``n``,
        ``n_failed`` (those without a rating included), ``n_unsettled``, ``confidence``. Ends are 0 or infinite where
        the joints are too few.
    """

    def life(rate: float) -> float:
        return np.inf if rate <= 0.0 else 1.0 / rate  # no joint: -inf

    def rating(rate: float) -> float:
        return float(C * (max(rate, 0.0) * lives.required) ** (1.0 / LIFE_EXPONENT))

    rows = []
    for rate in map(lives.rate, lives.places):
        C = lives.rating_of(rate.name)
        for share in SHARES:
            q = rate.quantile(share, CONFIDENCE)
            row = {"place": rate.name, "share": share, "nominal": life(rate.nominal), "estimate": life(q.estimate)}
            row |= {"lower": life(q.upper), "upper": life(q.lower)}
            row |= {"bound_lower": life(q.bound_upper), "bound_upper": life(q.bound_lower)}
            row |= with_ends("rating", map(rating, (q.estimate, q.lower, q.upper)))
            row |= {"n": q.n, "n_failed": q.n_failed, "n_unsettled": q.n_unsettled, "confidence": CONFIDENCE}
            rows.append(row)
    return rows


def bearing_rows(lives: Lives) -> Rows:
    """Each bearing by itself: what a share of the joints stays at or below; lives and static safeties that it reaches.

    Returns
    -------
    sequence of mapping
        One row per bearing and share: ``place``, ``share``, ``load`` (P, N), ``tilt`` (rad), ``life`` (h), ``safety``
        (C0/P0), ``pressure`` (Pa), and ``nominal_`` each; NaN where it is not known.
    """
    rows = []
    for pin in lives.pins:
        of = {name: lives.of_bearing(name, pin) for name in ("load", "tilt", "safety", "pressure")}
        of["life"] = lives.rate(pin)
        for share in SHARES:
            row: dict[str, Any] = {"place": pin, "share": share}
            for name, sample in of.items():
                found = (sample.quantile(share).estimate, sample.nominal)
                inverse = name in ("safety", "life")
                row |= dict(
                    zip((name, f"nominal_{name}"), (1.0 / x if inverse and x else x for x in found), strict=True)
                )
            rows.append(row)
    return rows


def below_rows(lives: Lives) -> Rows:
    """Share of the joints whose life is below the required one.

    Returns
    -------
    sequence of mapping
        One row per place: ``place``, ``required`` (h), the fields of `analysis.estimates.Exceedance` but
        its level (``count`` are the joints below the required life; bounds have joints without a life above and
        below), ``total_lower`` and ``total_upper`` (cover sampling, joints without a life and, if known, the numerical
        error), ``confidence``. No rows without a required life.
    """
    known = () if np.isnan(lives.load_error) else (max(0.0, 1.0 - lives.load_error), 1.0 + lives.load_error)
    rows = []
    for place in lives.places if np.isfinite(lives.required) else ():
        rate, level = lives.rate(place), 1.0 / lives.required
        row = {"place": place, "required": lives.required} | asdict(rate.above(level, CONFIDENCE))
        del row["level"]
        off = [rate.shifted((factor**LIFE_EXPONENT - 1.0) * rate.values) for factor in known]
        low, high = total_interval([rate, *off], level, CONFIDENCE)
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
    every = kinds(view.mechanism)["contact"].places
    if sum(column.field == "mode_share" for column in view.columns) < len(every) * len(Mode):
        return []
    modes = [part.read_results(("mode_share",))["mode_share"] for part in view.parts]
    spent = np.tensordot(view.shares_of_revolutions, np.stack(modes), 1)
    rows = []
    for pins in (*((pin,) for pin in every), every):
        row: dict[str, Any] = {"place": pins[0] if len(pins) == 1 else ANY}
        for name, mode in LOADED.items():
            longest = spent[:, [every.index(pin) for pin in pins], mode].max(axis=1)
            above = Sample.of(longest, view.status, view.design).above(MOSTLY, CONFIDENCE)
            row |= with_ends(name, (above.estimate, above.lower, above.upper))
        rows.append(row)
    return rows
