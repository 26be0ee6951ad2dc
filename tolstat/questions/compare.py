"""Comparison of two campaigns: differences between their studies and between their loads."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import difference
from tolstat.analysis.design import SAMPLE
from tolstat.analysis.sample import Sample
from tolstat.common.counts import Counts
from tolstat.common.errors import Fault, StoreError, raise_all
from tolstat.common.loads import ANY_LIMIT, split, unit_text
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import Status
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Loads
from tolstat.questions.shares import NO_INTERVALS, inapplicable, share, word
from tolstat.store.view import View
from tolstat.study.selection import select

QUANTILES = (0.5, 0.9, 0.99)
"""Quantiles that are compared."""
LEVELS = 200
"""Approximate number of levels of a curve."""
SIGNIFICANT = 0.05
"""p-value below which a test shows a difference, beside intervals of 95 %."""
MAX_LOADS = 4
"""Maximum number of loads with pictures."""
SIZE = (drawing.WIDTH, 3.4)
"""Width and height of a picture, inches."""


class Sides(NamedTuple):
    """The joints of two campaigns A and B that are compared.

    Attributes
    ----------
    views : tuple of View
        The campaigns.
    samples : tuple of ndarray of int
        Samples of each, ascending; if paired, as many.
    paired : bool
        Whether joint i of both was drawn with the same random numbers.
    """

    views: tuple[View, View]
    samples: tuple[NDArray[np.intp], NDArray[np.intp]]
    paired: bool

    @property
    def has_intervals(self) -> bool:
        """Whether differences of shares have intervals."""
        designs = [view.design for view in self.views]
        return all(design.independent or not self.paired for design in designs)

    @property
    def rows(self) -> NDArray[np.intp]:
        """Row of each joint of A in its campaign, (n,)."""
        return self.views[0].rows(self.samples[0])

    def load(self, name: str) -> tuple[Sample, Sample]:
        """Load of the joints of A and of B."""
        both = zip((view.load(name) for view in self.views), self.samples, strict=True)
        # a million joints are not copied
        a, b = (load if len(joints) == load.values.size else load.only(joints) for load, joints in both)
        return a, b


def _unit(row: Row) -> str:
    return f" {unit_text(row['unit'])}".rstrip()


def _interval(row: Row, factor: float, unit: str) -> str:
    low, high = factor * row["lower"], factor * row["upper"]
    return "-" if math.isnan(low) else f"{low:+.3g} .. {high:+.3g}{unit}"


SHARES = (
    Column("load > limit", text.limit),
    Column("A", share("a")),
    Column("B", share("b")),
    Column("B - A", lambda row: f"{100 * row['estimate']:+.3g} %"),
    Column("ppm", lambda row: f"{1e6 * row['estimate']:+.4g}", rank=2),
    Column("95 % interval", lambda row: _interval(row, 100.0, " %")),
    Column("only A", word("only_a"), rank=1),
    Column("only B", word("only_b"), rank=1),
    Column("McNemar's p", lambda row: text.formed(row["p"], ".2g")),
)
"""Columns of the table ``shares``; joints above on one side only are counted for pairs."""
LOADS = (
    Column("load", word("load")),
    Column("statistic", word("statistic")),
    Column("A", lambda row: f"{row['a']:.4g}{_unit(row)}"),
    Column("B", lambda row: f"{row['b']:.4g}{_unit(row)}"),
    Column("B - A", lambda row: f"{row['estimate']:+.3g}{_unit(row)}"),
    Column("95 % interval", lambda row: _interval(row, 1.0, _unit(row))),
)


def compare(a: View, b: View, by: Loads = None) -> Answer:
    """Compare the exceedances and loads of two campaigns.

    Gives the differences between the studies and, as B - A with its 95 % interval, the difference of the share above
    each limit; with --by, or without limits, also of quantiles. Joints drawn from the same seed are compared
    in pairs, which makes the intervals narrow.

    With --out, writes the curves and their difference as PNG and SVG, and as CSV the differences and the joints that
    are above a limit in one campaign only.

    Example: tolstat compare iso2768_f.h5 narrow.h5 --by cross1.F

    Parameters
    ----------
    a, b : View
        Campaigns. Joints are paired if both studies draw them by the same method from the same seed: an error then
        has the same random number in both, whatever its tolerance. Joints without a partner are then left out.
    by : list of str, optional
        Load or pattern, such as cross1.F or cross*.T, whose quantiles are compared; repeatable; default: loads with
        limits.

    Returns
    -------
    Answer
        Differences are B minus A. Fact ``paired``: whether joints are compared in pairs. Table ``shares``, one row per
        limit of either study, and `ANY_LIMIT` if both have some (each side against its own): ``load``, ``unit``,
        ``level``, fields of `difference.ShareDifference`. Table ``loads``, one row per load and ``statistic``
        (``50 %`` ...): ``load``, ``unit``, fields of `difference.Difference`. Table ``switched``, one row per
        pair and limit if only one joint of the pair is above the limit: ``row`` (of A), ``load``, ``unit``, ``level``,
        ``a``, ``b``. Table ``changes``, one row per ``key`` that differs between the studies, with its values ``a`` and
        ``b``.

    Raises
    ------
    InputError
        When a name is not a load, or a load is not kept by both files.
    NotApplicable
        When a file holds joints that are not drawn from tolerances.
    StoreError
        When a file has no joint with a valid load.

    Examples
    --------
    >>> with tolstat.open(path) as a, tolstat.open(other) as b:
    ...     answer = tolstat.compare(a.view(), b.view(), ["cross1.F"])
    >>> answer.facts["paired"], answer.frame("changes")["key"].tolist()[0]
    (True, 'sampling.n')
    >>> answer.frame("shares")[["only_a", "only_b"]].iloc[0].tolist()
    [0, 0]
    """
    for view in (a, b):
        if view.method != "random":
            raise inapplicable(view, "holds joints that are not drawn from tolerances", SAMPLE)
    common, limits = _common(a, b), list(dict.fromkeys([*a.limits.items(), *b.limits.items()]))
    names, both = _names(a, b, by or (), [name for name, _ in limits]), sides(a, b)
    apart = [name for name, _ in limits if split(name)[0] not in common]
    limits = [(name, level) for name, level in limits if name not in apart]
    try:
        rows = [_share(both, *limit) for limit in [*limits, *([(ANY_LIMIT, 1.0)] if a.limits and b.limits else [])]]
        loads = [row for name in names for row in _statistics(both, name)]
    except ValueError as error:
        raise StoreError(str(Fault(f"{a.path}, {b.path}", str(error), "resume both campaigns"))) from error
    switched = [row for limit in limits for row in _switched(both, *limit)] if both.paired else []
    seen = rows if both.paired else [{**row, "only_a": "-", "only_b": "-"} for row in rows]
    differing = changes(a, b)
    keys = [{"key": key, "a": of_a, "b": of_b} for keys, of_a, of_b in differing for key in keys]
    parts: list[Part] = [
        Panels([panel for name in names[:MAX_LOADS] for panel in _panels(both, name, rows, loads)]),
        Table("shares", "Shares above the limits", SHARES if rows else (), rows, seen=seen),
        Table("loads", "Quantiles", LOADS if by or not rows else (), loads),
        Table("switched", "Pairs with one joint above a limit", (), switched),
        Table("changes", "Differences between the studies", (), keys),
        *map(Sentence, _notes(both, differing, rows, switched, apart)),
    ]
    return Answer("compare", "Two campaigns side by side", parts, {"paired": both.paired})


def changes(a: View, b: View) -> list[tuple[list[str], Any, Any]]:
    """Keys that differ between the studies of two files, limits and code included, with their values in A and in B.

    Keys with equal values are together; a value is None where a study has no such key.
    """
    identities = []
    for view in (a, b):
        limits = {f"limits.{name}": level for name, level in view.limits.items()}
        code = {key: view.store.versions.get(key) for key in ("tolstat", "sources")}
        identities.append(view.store.identity | limits | code)
    by_values: dict[str, tuple[list[str], Any, Any]] = {}
    for key in sorted(set().union(*identities)):
        of_a, of_b = (identity.get(key) for identity in identities)
        if of_a != of_b:
            by_values.setdefault(json.dumps((of_a, of_b)), ([], of_a, of_b))[0].append(key)
    return list(by_values.values())


def sides(a: View, b: View) -> Sides:
    """Simulated joints of both campaigns; those with the same random numbers if there are any."""
    done_a, done_b = (view.status != Status.PENDING for view in (a, b))
    first = max(a.campaign_samples.start, b.campaign_samples.start)
    common = range(first, min(a.campaign_samples.stop, b.campaign_samples.stop))
    if not common or a.store.sampling["seed"] != b.store.sampling["seed"]:
        return Sides((a, b), (np.flatnonzero(done_a), np.flatnonzero(done_b)), paired=False)
    samples_a, samples_b = (np.arange(len(common)) + view.campaign_samples.index(first) for view in (a, b))
    done = done_a[samples_a] & done_b[samples_b]
    return Sides((a, b), (samples_a[done], samples_b[done]), paired=True)


def _names(a: View, b: View, by: Sequence[str], limited: Sequence[str]) -> list[str]:
    """Loads whose quantiles are compared, which both files keep: those asked for, else those with limits."""
    common, asked = _common(a, b), dict.fromkeys(by, "--by") or {name: f"limits.{name}" for name in limited}
    found = {pattern: _selected(pattern, common) for pattern in asked}
    raise_all(
        Fault(option, f"{name!r} is not a load that both files keep", did_you_mean(split(name)[0], common))
        for name, option in asked.items()
        if not found[name]
    )
    names = list(dict.fromkeys(name for selected in found.values() for name in selected))
    return names or [name for name in a.shown_loads if name in common]


def _selected(pattern: str, common: Sequence[str]) -> list[str]:
    """Loads that a name or pattern selects; each at the points that stand behind it."""
    name, points = split(pattern)
    return [f"{load} at {points}" if points else load for load in select(name, common)]


def _common(a: View, b: View) -> list[str]:
    """Loads that both files keep."""
    return [name for name in a.kept_loads if name in b.kept_loads]


def _share(both: Sides, name: str, level: float) -> Row:
    a, b = both.load(name)
    fields = difference.shares(a, b, [level], both.paired)._asdict()
    values = {key: value if key == "n" else value[0].item() for key, value in fields.items()}
    return {"load": name, "unit": a.unit, "level": level, **values}


def _statistics(both: Sides, name: str) -> Rows:
    a, b = both.load(name)
    statistics = {f"{100 * share:g} %": difference.quantiles(a, b, share, both.paired) for share in QUANTILES}
    return [{"load": name, "unit": a.unit, "statistic": key, **value._asdict()} for key, value in statistics.items()]


def _switched(both: Sides, name: str, level: float) -> Iterator[Row]:
    loads = both.load(name)
    a, b = (load.values for load in loads)
    differs = np.isfinite(a) & np.isfinite(b) & ((a > level) != (b > level))
    for row, of_a, of_b in zip(both.rows[differs].tolist(), a[differs].tolist(), b[differs].tolist(), strict=True):
        yield {"row": row, "load": name, "unit": loads[0].unit, "level": level, "a": of_a, "b": of_b}


def _notes(
    both: Sides, differing: Sequence[tuple[list[str], Any, Any]], shares: Rows, switched: Rows, apart: Sequence[str]
) -> Iterator[str]:
    """Differences between the studies, numbers of joints, what test and interval are, and what they leave out."""
    for side, view in zip("AB", both.views, strict=True):
        yield f"{side}: {view.path}"
    for keys, of_a, of_b in differing:
        more = f" and {len(keys) - 1} more" if len(keys) > 1 else ""
        yield f"  {keys[0]}{more}: {_in_words(of_a)} -> {_in_words(of_b)}"
    if not differing:
        yield "  the studies are the same"
    if apart:
        yield f"limits left out: {', '.join(apart)}, which only one file keeps"
    a, b = map(len, both.samples)
    if both.paired:
        yield f"{text.several(a, 'pair')} of joints with the same random numbers"
        pairs, cases = len({row["row"] for row in switched}), f"{len(switched)} such cases, limit by limit"
        yield f"{pairs} pairs have a limit that only one of their joints exceeds; {cases}"
        yield from _tests(shares)
    else:
        yield f"{a} and {text.several(b, 'joint')} with different random numbers"
    each = [Counts.of(view.status[joints]) for view, joints in zip(both.views, both.samples, strict=True)]
    if unresolved := sum(counts.failed + counts.unsettled for counts in each):
        bounds = "the bounds in JSON and CSV count them below, then above"
        yield f"{text.several(unresolved, 'joint')} without a valid load: left out; {bounds}"
    if not both.has_intervals:
        yield NO_INTERVALS


def _tests(shares: Rows) -> Iterator[str]:
    """What p and interval of pairs are, and the rows where one shows a difference and the other does not."""
    known = [row for row in shares if not math.isnan(row["p"])]
    if not known:
        return
    yield "McNemar's p: exact test of no difference; 95 % interval: approximate, by Clopper and Pearson's of both sides"
    apart = [row for row in known if (row["p"] < SIGNIFICANT) != (row["lower"] > 0.0 or row["upper"] < 0.0)]
    if apart:
        more = f" and {len(apart) - 1} more" if len(apart) > 1 else ""
        yield f"they disagree at {text.limit(apart[0])}{more}: whether there is a difference, the exact test says"


def _in_words(value: object) -> str:
    """Value of a key of a study for people: products of units without a sign, ``N m/rad``."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return "nothing" if value is None else re.sub(r"(?<=[A-Za-z])\*(?=[A-Za-z])", " ", str(value))


def _panels(both: Sides, name: str, rows: Rows, loads: Rows) -> Iterator[Panel]:
    """Pictures of a load: exceedance of both campaigns, and their difference, with pointwise 95 % intervals."""
    limits = [row["level"] for row in rows if row["load"] == name]
    draw = partial(_draw, both=both, name=name, limits=limits)
    median = next(row for row in loads if row["load"] == name and row["statistic"] == "50 %")
    words = f"Medians of A and B: {' and '.join(text.value(median[side], median['unit']) for side in 'ab')}"
    yield Panel(name, f"{name}: joints above a load", words, partial(draw, change=False), SIZE)
    title, key = f"{name}: B less A{', pairs' if both.paired else ''}", f"{name}-difference"
    words = "Difference of the shares of the joints above a load"
    yield Panel(key, title, words, partial(draw, change=True), SIZE)


def _draw(ax: Axes, both: Sides, name: str, limits: Sequence[float], change: bool) -> None:
    """Draw the exceedance of both campaigns, or the share of B less that of A."""
    a, b = both.load(name)
    # levels of the curves: quantiles of both campaigns pooled, denser in the tail
    pooled = np.concatenate([a.valid, b.valid])
    tail = 1.0 - np.geomspace(1.0, 1.0 / pooled.size, LEVELS // 2)
    levels = np.unique(np.quantile(pooled, np.union1d(np.linspace(0.0, 1.0, LEVELS // 2), tail), method="inverted_cdf"))
    floor = 0.5 / max(a.values.size, b.values.size)
    if change:
        ax.axhline(0.0, color=style.FAINT, lw=1.0)
        shares = difference.shares(a, b, levels, both.paired)
        curves = {"": [100.0 * end for end in (shares.estimate, shares.lower, shares.upper)]}
    else:
        curves = {}
        for side, view, load in zip("AB", both.views, (a, b), strict=True):
            table = load.curve(levels)
            ends = [table[end].clip(0.1 * floor) for end in ("estimate", "lower", "upper")]
            curves[f"{side}: {view.path.stem}"] = ends
    look: Any = {"step": "post", "colours": (style.INK,) if change else style.COLOURS}
    drawing.curves(ax, levels, curves, limits, bands=len(curves) if both.has_intervals else 0, **look)
    ax.set_xlabel(f"x [{unit_text(a.unit)}]" if a.unit != "1" else "x")
    ax.set_ylabel("B less A, % of the joints" if change else "share of the joints above x")
    if not change:
        style.share_axis(ax, floor)
