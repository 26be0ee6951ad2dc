"""Fatigue of a campaign: failures of the parts, damage-equivalent loads and damage sums over a service life."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Annotated

import numpy as np

from tolstat.analysis import binomial, prediction, strength
from tolstat.analysis.sample import CONFIDENCE
from tolstat.common.channels import signals_of, unit_of
from tolstat.common.counts import POWER
from tolstat.common.errors import NotApplicable
from tolstat.common.loads import unit_text
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Status
from tolstat.display import drawing, style, text, verdict
from tolstat.display.answer import Answer, Asked, Axes, Panel, Panels, Part, Sentence, Table
from tolstat.display.options import Delivery, Loads, Opt
from tolstat.display.style import ticker
from tolstat.display.table import Column, Row, Rows, by_share, of_shares
from tolstat.questions.fatigue import counting, loads, parts
from tolstat.questions.fatigue.loads import SHARES, channels, load_cycles
from tolstat.questions.shares import NO_INTERVALS
from tolstat.store.revolutions import held
from tolstat.store.view import View
from tolstat.study.fatigue import Fatigue, StressPoint

JOINTS = 5000
"""Maximum number of samples, the first ones, whose cycles the page evaluates: more add little and take memory."""
MAX_APART = 1e-6
"""Relative difference of joints simulated again from their stored loads above which a note says so."""
MAX_LACKING = 1e-3
"""Relative increase of the sum of S^m by cycles that the file does not hold, above which a note says so."""
MIN_RANGE = 1e-3
"""Smallest range drawn, relative to the largest."""
POINTS = 25
"""Number of lives of the curve of failures."""
DECADES = 2.0
"""Decades drawn around the service life."""


def _life(*lives: float) -> str:
    """Format a life, or the ends of its interval; NaN gives a dash."""
    ends = ("never" if math.isinf(life) else f"{life:.2e}".replace("e+", "e") for life in lives)
    return "-" if math.isnan(lives[0]) else " .. ".join(ends)


def _line_of_load(row: Row, mechanism: Mechanism) -> str:
    if row["channel"] == counting.ANY:
        return "-"
    return f"{text.value(row['S0'], unit_of(row['channel'], mechanism))} at {row['N0']:g} cycles, m = {row['m']:g}"


_LAST = SHARES[-1]
PARTS = (
    Column("point", lambda row: str(row["point"])),
    Column("failures", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["outer_lower"], row["outer_upper"])),
    Column("ppm", lambda row: text.ppm(row["estimate"]), rank=6),
    Column("failures in delivery", text.delivery, rank=7),
    Column("B10 life", lambda row: _life(row["life"])),
    Column("its 95 % interval", lambda row: _life(row["life_lower"], row["life_upper"]), rank=5),
    Column("nominal damage", lambda row: text.formed(row["nominal"]), rank=3),
    Column("median damage", lambda row: text.formed(row["median"]), rank=2),
    Column("99 % damage", lambda row: text.formed(row["upper_99"]), rank=1),
    Column("nominal joint fails", lambda row: text.percent(row["nominal_failures"]), rank=4),
)
"""Columns of the table ``points``."""
LOADS = (
    Column("channel and exponent", lambda row: f"{row['channel']}, m = {row['m']:g}"),
    Column("nominal", lambda row: text.value(row[_LAST]["nominal"], row[_LAST]["unit"]), rank=2),
    *of_shares(SHARES, "below", lambda row: text.value(row["estimate"], row["unit"]), rank=1),
    Column(
        f"95 % interval of {100 * _LAST:g} %",
        lambda row: text.span_of(row[_LAST]["lower"], row[_LAST]["upper"], row[_LAST]["unit"]),
    ),
)
"""Columns of the table ``loads``, arranged by channel and exponent."""


def _damages(mechanism: Mechanism) -> tuple[Column, ...]:
    """Columns of the table ``damages``. Joints above 1 are counted among the settled ones, as the share is."""
    return (
        Column("channel", lambda row: str(row["channel"])),
        Column("S–N line", partial(_line_of_load, mechanism=mechanism), words=True, rank=3),
        Column("nominal damage", lambda row: text.formed(row["nominal"]), rank=2),
        Column("median", lambda row: text.formed(row["median"]), rank=1),
        Column("joints above 1", lambda row: f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"),
        Column("share", lambda row: text.percent(row["estimate"])),
        Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
        Column("ppm", lambda row: text.ppm(row["estimate"]), rank=4),
        Column("above in delivery", text.delivery, rank=5),
    )


def fatigue(
    view: View,
    by: Loads = None,
    joints: Annotated[int | None, Opt("N", least=1)] = None,
    delivery: Delivery = prediction.DELIVERY,
) -> Answer:
    """Compute failures of parts, equivalent loads and damage.

    For each [fatigue.point] of the study: the damage sum, the life that 90 % of the parts reach, and the share of the
    parts that fail in the service life, with 95 % intervals. Without load histories in the file, the joints are
    simulated again. From cycles of load components, or of a force or moment along a direction: quantiles of the
    damage-equivalent load over the joints, and for each S-N line of a load the share of joints whose damage sum exceeds
    1. Without --by, prints the most loaded component of the force and of the moment of each bushing. All settings are
    those of [fatigue] in the study of FILE. Its operating points form a duty cycle, by the share of the time that
    [[operation]] gives each.

    Example: tolstat fatigue iso2768_f.h5 --by "cross*.F_t"

    Parameters
    ----------
    view : View
        A campaign, whose operating points are the duty cycle if it has several.
    by : list of str, optional
        Component or direction, such as cross1.F_t, "cross*.F_t", "cross1.F at 30 deg" or "cross1.F at worst";
        repeatable; default: components of bushings.
    joints : int, optional
        Evaluate the first N joints only; default: all.
    delivery : int
        Number of joints of the next delivery, for the prediction intervals of failures.

    Returns
    -------
    Answer
        Of a study with points table ``points``, see `parts.part_failures`; else, or with cycles in the files, S–N lines
        of loads or `by`, tables ``loads``, see `loads.equivalent_loads`, and of loads with an S–N line ``damages``, see
        `loads.damages`.
        Fact ``duty``: shares of the revolutions by operating point, if there are several.

    Raises
    ------
    InputError
        When the shares of the operating points are not known, or nothing is selected.
    StoreError
        When the joints are no sample of a production.
    """
    view.check()
    settings = counting.section(view)
    has_cycles = all(part.store.history_specs for part in view.parts)
    shown_parts: list[Part] = []
    duty: Sequence[tuple[str, float]] = ()
    if settings.points:
        stressed = parts.load_stresses(view, joints)
        duty, shown_parts = stressed.duty, _of_parts(stressed, delivery)
    if by or has_cycles or settings.lines or not settings.points:
        loading = load_cycles(view, channels(by, view.mechanism) if by else None, joints)
        rows = loads.equivalent_loads(loading)
        shown = [] if by else loads.most_loaded(rows, view.mechanism)
        seen = [row for row in rows if not shown or row["channel"] in shown]
        duty, shown_parts = loading.duty, [*shown_parts, *_of_loads(loading, rows, seen, delivery)]
    return Answer("fatigue", "Fatigue", shown_parts, {"duty": dict(duty)} if len(duty) > 1 else {})


def fatigue_on_page(view: View, asked: Asked) -> Answer:
    """Fatigue of the first joints, with the leading loads; without histories, of those that are simulated again."""
    shown_parts: list[Part] = []
    if view.method != "sweep" and view.count(Status.OK):
        with asked.noting("load cycles are left out"):
            view.check()
            settings = counting.section(view)
            joints = JOINTS if held(view.store) else min(asked.replay, JOINTS)
            if settings.points and joints:
                shown_parts += _of_parts(parts.load_stresses(view, joints), prediction.DELIVERY)
            joints = _joints_with_lines(view, settings, asked.replay)
            if (settings.lines or view.store.history_specs) and joints:
                loading = load_cycles(view, samples=joints)
                rows = loads.equivalent_loads(loading)
                leading = loads.leading(rows, view.mechanism)
                seen = sorted((row for row in rows if row["channel"] in leading), key=lambda r: (r["channel"], r["m"]))
                shown_parts += _of_loads(loading, rows, seen, prediction.DELIVERY)
    if not shown_parts:
        raise NotApplicable
    return Answer("fatigue", "Fatigue", shown_parts)


def life_verdicts(view: View, accepted: float = math.nan, samples: int = JOINTS) -> list[verdict.Verdict]:
    """Verdict on failures of the parts in the service life, and on damage sums of loads; none if no life is required.

    Parameters
    ----------
    view : View
        A campaign, whose operating points are the duty cycle.
    accepted : float
        Accepted share: share of the joints that may fail; NaN if none is given.
    samples : int
        Number of joints evaluated, the first ones, where they have to be simulated again: of a file without histories.

    Raises
    ------
    InputError
        When the shares of the operating points are not known.
    StoreError
        When a file holds joints that are no sample of a production.
    """
    settings = counting.section(view)
    if not (settings.points or settings.lines) or not counting.settings_of(view).required:
        return []
    view.check()
    verdicts = []
    if settings.points and (joints := JOINTS if held(view.store) else min(samples, JOINTS)):
        stressed = parts.load_stresses(view, joints)
        row = parts.failures_over_life(stressed, [stressed.settings.revolutions])[0]._asdict()
        verdicts.append(_verdict("failures of parts", "have a failed part", row, stressed, accepted))
    if settings.lines and (joints := _joints_with_lines(view, settings, samples)):
        loading = load_cycles(view, tuple(settings.lines), joints)
        sums = loads.damages(loading)[-1]
        verdicts.append(_verdict("damage by loads", "have a damage sum above 1", sums, loading, accepted))
    return verdicts


def _joints_with_lines(view: View, settings: Fatigue, again: int) -> int:
    """Number of joints evaluated by loads; at most `again` where they have to be simulated again for an S–N line."""
    signals = [signal for name in settings.lines for signal in signals_of(name, view.mechanism)]
    return JOINTS if counting.held(view.store, signals) else min(again, JOINTS)


def _verdict(about: str, what: str, row: Row, joints: counting.Joints, accepted: float) -> verdict.Verdict:
    """Verdict from the share in a row: `analysis.strength.Failures`, or `analysis.estimates.Exceedance`."""
    share, without = row["estimate"], row["n_failed"] + row["n_unsettled"]

    def joints_needed(end: float) -> float:
        if "count" in row:
            return binomial.needed(end, accepted)
        # an interval of a mean narrows with the root of the number of joints, and faster where the share is small; nine
        # in ten means are nearer than 1.28 standard errors, of which half an interval has 1.96
        distance = row["upper"] - share if share < accepted else share - row["lower"]
        distance *= 1.0 + float(binomial.half_width(2.0 * POWER - 1.0) / binomial.half_width(CONFIDENCE))
        return float(np.ceil(row["n"] * (distance / (accepted - end)) ** 2))

    lost = math.isnan(share) or (without and without / row["n"] >= 0.5 * (row["upper"] - row["lower"]))
    undecided = f"{without} of {row['n']} joints have no load that repeats" if lost else ""
    what, ends = f"{what} within {joints.settings.service_life}", (row["outer_lower"], row["outer_upper"])
    reason = "" if joints.design.independent else "the joints depend on each other: a mean has no interval"
    judged = verdict.on_share(about, what, row, ends, accepted, joints_needed, reason, undecided)
    first = f"{about}: of the first {row['n']} of {joints.total} joints"
    return judged._replace(notes=(first,) if joints.total > joints.status.size else ())


def _of_parts(stressed: counting.Counted, delivery: int) -> list[Part]:
    rows = parts.part_failures(stressed, delivery)
    panel = Panel(
        "failures-over-life",
        "Share of the joints with a failed part, with pointwise 95 % intervals",
        "Share of the joints in which a part has failed, against revolutions of the input shaft",
        partial(_draw_failures, stressed=stressed, life=rows[-1]["life"]),
        (6.5, 3.6),
    )
    lives = dict.fromkeys(("life", "life_lower", "life_upper"), "revolutions")
    table = Table("points", "Parts", PARTS, rows, {"S_D": "Pa"} | lives)
    return [Panels([panel]), table, *map(Sentence, _notes_on_parts(stressed, rows))]


def _of_loads(loading: counting.Counted, rows: Rows, seen: Rows, delivery: int) -> list[Part]:
    panels = [
        Panel(
            f"spectrum-{channel}",
            f"{channel}: load spectrum",
            f"Ranges of {channel} that so many cycles a revolution reach, for half, 90 and 99 % of the joints",
            partial(_draw_spectrum, loading=loading, channel=channel),
            (drawing.WIDTH, 3.5),
        )
        for channel in loads.leading(rows, loading.mechanism)
    ]
    shown_parts: list[Part] = [Panels(panels)] if panels else []
    shown_parts.append(Table("loads", "Damage-equivalent loads", LOADS, rows, seen=by_share(seen, "channel", "m")))
    if damages := loads.damages(loading, delivery):
        title = "Damage sum of the service life, and share of the joints where it exceeds 1"
        shown_parts.append(Table("damages", title, _damages(loading.mechanism), damages, {"S0": "N or N*m"}))
    return [*shown_parts, *map(Sentence, _notes_on_loads(loading, rows))]


def _notes_on_parts(stressed: counting.Counted, rows: Rows) -> Iterator[str]:
    """Number of joints, meaning of the columns, restrictions."""
    settings, n = stressed.settings, stressed.status.size
    starts = f" with {settings.starts:g} starts" if settings.starts else ""
    first = f" (the first {n} of {stressed.total})" if stressed.total > n else ""
    yield f"{stressed.settled}{first}; service life {settings.service_life}{starts}"
    yield from stressed.duty_in_words
    life = "B10 life: revolutions after which 10 % have failed; damage: at the median strength"
    yield f"{life}; intervals count joints without a valid load as failing and as surviving"
    yield from _lines(settings.points)
    if rows[-1]["point"] == counting.ANY:
        yield f"{counting.ANY}: the joint fails with its first part; strengths of two points are independent"
    if not stressed.design.independent:
        yield NO_INTERVALS
    if stressed.apart > MAX_APART:
        yield _apart(stressed)


def _notes_on_loads(loading: counting.Counted, rows: Rows) -> Iterator[str]:
    """Number of joints, definition of the loads, restrictions."""
    settings = loading.settings
    cycles = f"loads are ranges: {settings.reference_cycles:g} cycles of them do the damage of "
    yield f"{loading.settled}; {cycles}{settings.service_life}"
    yield from loading.duty_in_words
    if loading.apart > MAX_APART:
        yield _apart(loading)
    lacking = max((row["lacking"] for row in rows), default=0.0)
    if lacking > MAX_LACKING:
        yield f"cycles that the file does not hold may add {lacking:.2g} of a sum of S^m"


def _apart(counted: counting.Counted) -> str:
    return f"joints simulated again differ from the file by up to {counted.apart:.1g} of a largest load"


def _lines(points: Sequence[StressPoint]) -> Iterator[str]:
    """One sentence for each S–N line, with the names of its points."""
    names: dict[strength.SNLine, list[str]] = {}
    for point in points:
        names.setdefault(point.line, []).append(point.name)
    for line, points_of_line in names.items():
        where = f" of {'; '.join(points_of_line)}" if len(names) > 1 else ""
        scatter = f", T_S = {line.T_S:.3g}" if line.T_S > 1 else ""
        mean = f", M = {line.M:g} (R = {line.R:g})" if line.M > 0 else ""
        knee = f"range of {line.S_D / 1e6:.4g} MPa at {line.N_D:g} cycles, k = {line.k:g}, {line.k_2:g} below"
        yield f"S–N line{where}: {knee}{scatter}{mean}, damage sum {line.D_c:g}"


def _draw_failures(ax: Axes, stressed: counting.Counted, life: float) -> None:
    """Draw the share of the joints with a failed part against revolutions, with its band and the service life."""
    service = stressed.settings.revolutions
    first, last = sorted([service, life if math.isfinite(life) and life > 0 else service])
    numbers = np.geomspace(first / 10**DECADES, last * 10**DECADES, POINTS)
    curve, has_band = parts.failures_over_life(stressed, numbers.tolist()), stressed.design.independent
    share, lower, upper = np.array([(at.estimate, at.outer_lower, at.outer_upper) for at in curve]).T
    drawing.curves(ax, numbers, {"": (share, lower, upper)}, bands=int(has_band))
    ax.axvline(service, color=style.INK, lw=1, ls="--")
    at = ("data", "axes fraction")
    ax.annotate("service life", (service, 1.0), (4, -2), xycoords=at, textcoords="offset points", va="top")
    ax.set(xscale="log", xlim=(numbers[0], numbers[-1]))
    ax.set_ylim(0.0, min(1.0, 1.1 * float(np.nanmax(upper if has_band else share, initial=0.0))) or 1.0)
    ax.xaxis.set_major_formatter(ticker.FuncFormatter(lambda x, _: f"{x:.0e}".replace("e+0", "e").replace("e+", "e")))
    ax.yaxis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    ax.set(xlabel="revolutions of the input shaft", ylabel="joints with a failed part")


def _draw_spectrum(ax: Axes, loading: counting.Counted, channel: str) -> None:
    """Draw the spectra of one channel as step curves, with their bands."""
    rows = loads.spectrum(loading, channel)
    ceiling = max(row["estimate"] for row in rows)
    floor = MIN_RANGE * ceiling if ceiling > 0 else 1.0
    numbers = np.array([row["cycles"] for row in rows if row["share"] == SHARES[0]]) / loading.settings.revolutions
    x = np.concatenate([[0.7 * numbers[0]], numbers])
    curves = {}
    for share in SHARES:
        curve = [row for row in rows if row["share"] == share]
        lower, estimate, upper, nominal = (  # the first value twice, so that the curve begins at the left edge
            np.array([row[key] for row in (curve[0], *curve)]) for key in ("lower", "estimate", "upper", "nominal")
        )
        top = np.where(np.isfinite(upper), upper, estimate)  # too few joints: the upper end is infinite
        low, high = (np.maximum(y, 0.1 * floor) for y in (lower, top))
        curves[f"{100 * share:g} % of the joints stay below"] = estimate, low, high
    ax.step(x, nominal, where="pre", color=style.INK, lw=1, label="nominal joint")
    drawing.curves(ax, x, curves, bands=len(curves), step="pre")
    shown = max([row["cycles"] for row in rows if row["estimate"] > floor], default=0.0) / loading.settings.revolutions
    ax.set(xscale="log", yscale="log", ylim=(floor, 2.0 * max(ceiling, floor)))
    ax.set_xlim(x[0], 1.05 * max(shown if shown > x[0] else x[-1], 2.0 * x[0]))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(ticker.NullFormatter())
    ax.set_xticks([t for t in (0.01, 0.03, 0.1, 0.3, 1, 2, 3, 4, 6, 8, 12, 16) if x[0] <= t <= ax.get_xlim()[1]])
    unit = unit_text(unit_of(channel, loading.mechanism))
    ax.set(xlabel="cycles a revolution with at least this range", ylabel=f"range of {channel} [{unit}]")
