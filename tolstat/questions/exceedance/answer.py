"""Which load is exceeded by which share of the joints: limits, quantiles, curves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

from tolstat.analysis.design import SAMPLE
from tolstat.common.errors import NotApplicable
from tolstat.common.tables import VALID, Status
from tolstat.display import text
from tolstat.display.answer import Answer, Asked, Panels, Part, Sentence, Table
from tolstat.display.options import Accepted
from tolstat.display.table import Column, Row, alike, by_share, has, has_unresolved
from tolstat.display.verdict import WORDS
from tolstat.questions import shares
from tolstat.questions.exceedance import rows as of
from tolstat.questions.exceedance.curves import forest_panel, leading_panel, reader
from tolstat.store.recorded import joints_at
from tolstat.store.view import View

SAMPLED, TOTAL = (shares.shares(f"{kind}lower", f"{kind}upper") for kind in ("", "total_"))
"""Cells of the interval of sampling, which is shown where it differs from the total one, and of that."""


def _outer(row: Row) -> str:
    kind = "bound" if math.isnan(row["outer_lower"]) else "outer"
    return text.span(row[f"{kind}_lower"], row[f"{kind}_upper"])


LIMITS = (
    Column("load", shares.word("load")),
    Column("kept by itself", shares.word("verdict"), shown=has("verdict")),
    Column("limit", shares.value("level")),
    Column("nominal", shares.value("nominal"), rank=1),
    Column("above", shares.above),
    Column("share", shares.share("estimate")),
    Column("95 % interval", SAMPLED, shown=lambda rows: any(SAMPLED(row) != TOTAL(row) for row in rows), rank=3),
    Column("with unresolved joints", _outer, shown=has_unresolved, rank=2),
    Column("total interval", TOTAL, shown=has("numerical_error")),
)
"""Columns of the table ``limits``. Joints above are counted among the valid ones, as the share is; the last columns
count failed and unsettled joints below, then above the limit, and shift every load by the numerical error."""
BUDGET = (
    Column("limit", text.limit),
    Column("share", shares.share("estimate")),
    Column("sampling, ±", lambda row: text.percent(0.5 * (row["upper"] - row["lower"]))),
    Column("numerical error, up to", lambda row: text.percent(_numerical(row))),
    Column("failed and unsettled, width", lambda row: text.percent(row["bound_upper"] - row["bound_lower"])),
)
"""Contributions to the uncertainty of each share above a limit."""
TITLE = "Which load is exceeded by which share"
NOTABLE = 0.1
"""Part of the interval of sampling from which on another contribution to the uncertainty is shown."""


def exceedance(view: View, accepted: Accepted = math.nan) -> Answer:
    """Estimate the share of joints above each load.

    Parameters
    ----------
    view : View
        A campaign; it may be unfinished.
    accepted : float
        Accepted share: share of the joints that may be above each limit, for a verdict on each.

    Returns
    -------
    Answer
        Tables ``limits``, see `rows.limit_rows`, ``at_points``, see `rows.point_rows`, and ``quantiles``, see
        `rows.quantile_rows`; pictures of the leading loads.

    Raises
    ------
    NotApplicable
        When the joints are those of a sweep, or listed.
    """
    if view.method in ("sweep", "cases"):
        raise shares.inapplicable(view, "its joints are no sample of a production", SAMPLE)
    parts = [*limit_tables(view, accepted), *quantile_tables(view), *_pictures(view), Sentence(note(view))]
    return Answer("exceedance", TITLE, parts)


def exceedance_on_page(view: View, asked: Asked) -> Answer:
    """Curves of the leading loads, and the reader."""
    if not (view.method != "sweep" and view.shown_loads and view.count(*VALID)):
        raise NotApplicable
    words = text.sentence(note(view))
    if len(view.nominal):
        words += f" Triangle: the joint without errors.{_beyond(view)}"
    if len(view.points) > 1:
        words += " Loads are the largest over all operating points, unless they name some."
    if missing := of.not_kept(view):
        words += f" {text.sentence(missing)}"
    return Answer("exceedance", TITLE, [*_pictures(view), Sentence(words), reader(view)])


def _pictures(view: View) -> list[Part]:
    """Curves of the leading loads; none without a valid joint."""
    pictures = [leading_panel(view, name) for name in view.leading] if view.count(*VALID) else []
    return [Panels(pictures)] if pictures else []


def limits(view: View, accepted: Accepted = math.nan) -> Answer:
    """Estimate the share of the joints above each limit.

    Parameters
    ----------
    view : View
        A campaign of a study with limits.
    accepted : float
        Accepted share: share of the joints that may be above each limit, for a verdict on each.

    Returns
    -------
    Answer
        Tables ``limits``, see `rows.limit_rows`, and ``at_points``, see `rows.point_rows`.

    Raises
    ------
    NotApplicable
        When the study has no limits, or its joints are no sample of a production.
    """
    if not (view.sampled and view.limits):
        remedy = "give the result file of a study with [limits] whose joints are drawn from tolerances"
        raise shares.inapplicable(view, "has no limits, or its joints are no sample", remedy)
    table, *at_points = limit_tables(view, accepted)
    panel = forest_panel(table.for_people, accepted)
    how = list(map(Sentence, _how(view, accepted)))
    parts: list[Part] = [Panels([panel], beside=how), table, *at_points]
    rows = [row for row in of.limit_rows(view) if not math.isnan(row["numerical_lower"])]
    others = [max(_numerical(row), row["bound_upper"] - row["bound_lower"]) for row in rows]
    if any(other > NOTABLE * 0.5 * (row["upper"] - row["lower"]) for other, row in zip(others, rows, strict=True)):
        title = "What makes the shares above limits uncertain, in per cent of the joints"
        parts.append(Table("uncertainty", title, BUDGET, rows, seen=alike(rows, BUDGET)))
    return Answer("limits", "Each limit", parts)


def limits_on_page(view: View, asked: Asked) -> Answer:
    """Share above each limit, judged by the accepted share of the page."""
    return limits(view, asked.accepted)


def quantiles(view: View) -> Answer:
    """Estimate quantiles and tolerance limits of each load.

    Parameters
    ----------
    view : View
        A campaign.

    Returns
    -------
    Answer
        Table ``quantiles``, see `rows.quantile_rows`.

    Raises
    ------
    NotApplicable
        When the joints are those of a sweep, or none is valid.
    """
    if not (view.method != "sweep" and view.shown_loads and view.count(*VALID)):
        raise shares.inapplicable(view, "has no sample of valid loads", "simulate more joints")
    title = f"Quantiles with 95 % intervals {view.design.of_quantiles}, and one-sided tolerance limits (Wilks)"
    title = title if view.design.is_sample else "Quantiles"
    return Answer("quantiles", "Quantiles", [_quantiles(view, title, True)])


def limit_tables(view: View, accepted: float = math.nan) -> list[Table]:
    """Tables of the share above each limit, and at each operating point; none without limits."""
    if not view.limits:
        return []
    rows, is_judged = of.limit_rows(view), not math.isnan(accepted)
    if is_judged:
        rows = [{**row, "verdict": WORDS[of.verdict(row, accepted)]} for row in rows]
    seen = alike(rows, LIMITS)
    verdicts = [of.verdict(row, accepted) for row in seen] if is_judged else ()
    tables = [Table("limits", "Joints above each limit", LIMITS, rows, seen=seen, verdicts=verdicts)]
    if points := of.point_rows(view):
        title = "Share of the joints above each limit at each operating point"
        columns = [LIMITS[0], LIMITS[2], *(Column(point, shares.share(point)) for point in view.points)]
        tables.append(Table("at_points", title, columns, points, seen=alike(points, columns)))
    return tables


def quantile_tables(view: View) -> list[Table]:
    """Table of quantiles with the interval of the largest share; none where no load is shown."""
    return [_quantiles(view, "Quantiles of the largest loads", False)] if view.shown_loads else []


def _quantiles(view: View, title: str, whole: bool) -> Table:
    """Table of quantiles; people see one row per load, `whole` with all intervals and with tolerance limits."""
    rows = of.quantile_rows(view)

    def quantile(share: float, row: Row) -> str:
        estimate, lower, upper, unit = (row[share][key] for key in ("estimate", "lower", "upper", "unit"))
        size = text.multiple(estimate, unit)[0]
        ends = f" ({text.number(lower / size)} .. {text.number(upper / size)})"
        return text.value(estimate, unit) + (ends if whole and not math.isnan(lower) else "")

    def last(row: Row) -> str:
        if not whole:
            return text.span_of(*(row[of.SHARES[-1]][key] for key in ("lower", "upper", "unit")))
        # Wilks (1941): the upper end of the two-sided 90 % interval
        upper = view.load(row["load"]).quantile(of.COVERED, 0.9).upper
        return "needs more joints" if math.isinf(upper) else text.value(upper, row["unit"])

    columns = [LIMITS[0], Column("nominal", shares.value("nominal"), rank=1)]
    for share in of.SHARES:
        rank = 3 if share in of.SHARES[1:-1] else 0
        columns.append(Column(f"{100 * share:g} %{whole * ' stay below'}", partial(quantile, share), rank=rank))
    head = "tolerance limit 99 % / 95 %" if whole else f"95 % interval of {100 * of.SHARES[-1]:g} %"
    return Table(
        "quantiles", title, [*columns, Column(head, last)], rows, seen=by_share(rows, "load", "nominal", "unit")
    )


def note(view: View) -> str:
    """Sentence on what the intervals cover."""
    clauses = [
        view.design.covers,
        "light bands: with the others counted below and above every x" * (view.count(*VALID, Status.PENDING) < view.n),
    ]
    return "; ".join(clause for clause in clauses if clause)


def _beyond(view: View) -> str:
    """Why the force without errors is smaller than T/(2 R); empty where it is not, or at several operating points."""
    mechanism = view.mechanism
    holes = {lump.name for lump in mechanism.lumps if lump.member == mechanism.shafts[-1].member}
    pins = {pair.pin for pair in mechanism.pairs if pair.hole in holes}
    names = [f"{bushing.name}.F" for bushing in mechanism.bushings if bushing.lump in pins]
    forces = [view.load(name).nominal for name in names if name in view.bushing_loads]
    if not forces or len(view.points) > 1:
        return ""
    torque, radius = abs(view.store.operation.torque), joints_at(view.store, 0)[-1].cross.R
    if not max(forces) < torque / (2.0 * radius):
        return ""
    at_middle = text.value(torque / (2.0 * radius), "N")
    return f" Its force on the cross is below T/(2 R) = {at_middle}: without errors pins bear at their outer ends."


def _how(view: View, accepted: float) -> Iterator[str]:
    """Paragraphs on what the picture shows, and what decides."""
    if not view.design.is_sample:
        yield "Points: share of the joints with a valid load. Grey: with failed and unsettled joints below and above."
        yield "The joints are no sample of a production: a share has no interval."
        return
    yield (
        f"Points: share of the joints with a valid load. Blue: its interval ({view.design.interval}), 95 % "
        "for each limit by itself. Grey: the total interval. Failed and unsettled joints are counted below the limit "
        "at its lower end and above it at its upper end; it covers the numerical error, too, where it is known."
    )
    if len(view.points) > 1:
        yield "A limit that names no operating point is about the largest load over all of them."
    if not math.isnan(accepted):
        yield (
            f"Each limit by itself: kept if its total interval lies below {text.percent(accepted)}, not kept if "
            "it lies above. It has no verdict where joints without a valid load decide, and is open otherwise. The "
            "verdict at the top is on the joints that exceed at least one limit."
        )


def _numerical(row: Row) -> float:
    """Largest change of a share by the numerical error."""
    return max(float(abs(row[f"numerical_{end}"] - row["estimate"])) for end in ("lower", "upper"))
