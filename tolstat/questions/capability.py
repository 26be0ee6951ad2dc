"""How a production stands against the limits of its study, and its rare loads."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Annotated, Any

import numpy as np

from tolstat.analysis import capability as indices
from tolstat.analysis.clustered import LEAST, Clustered
from tolstat.analysis.prediction import DELIVERY
from tolstat.common.errors import Fault, InputError, NotApplicable
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.answer import Answer, Asked, Column, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Delivery, Opt
from tolstat.questions import shares
from tolstat.store import error_budget
from tolstat.store.view import View

ON_PAGE = (1e3, 1e4, 1e5)
"""Numbers of joints of which one exceeds the rare loads on the page."""
FIGURES = ("estimate", "lower", "upper", "bound_lower", "bound_upper")
"""Keys of `return_rows` that are NaN beyond the joints."""
RARE = "Load that one in N joints exceeds"

LIMITS = (
    Column("load", shares.word("load")),
    Column("limit", shares.limit),
    Column("above", shares.above),
    Column("yield", shares.share("good")),
    Column("total interval", shares.shares("good_lower", "good_upper")),
    Column("ppm", lambda row: text.number(row["ppm"]), rank=1),
    Column("interval of ppm", lambda row: text.span_of(row["ppm_lower"], row["ppm_upper"], "1"), rank=2),
    Column("above in delivery", text.delivery, rank=3),
    Column("Ppk", lambda row: text.formed(row["ppk"], ".2f")),
    Column("interval of Ppk", lambda row: _ends_of_ppk(row)),
)
"""Columns of the table ``limits``; the total interval is that of the yield."""
LOTS = (
    Column("load", shares.word("load")),
    Column("limit", shares.limit),
    Column("median lot", shares.share("median")),
    Column("one lot in ten", lambda row: f"{'≥ ' if row['high'] else ''}{text.percent(row['high'])}"),
    Column("worst lot", shares.share("worst")),
    Column("above in delivery", text.delivery),
)
"""Columns of the table ``lots``, shares of the joints of a lot."""
RETURNS = (
    Column("load", shares.word("load")),
    Column("one joint in", lambda row: f"{row['one_in']:,.0f}".replace(",", " ")),
    Column("exceeds", shares.value("estimate")),
    Column("95 % interval", shares.values("lower", "upper")),
)
"""Columns of the table ``one_in``."""


def capability(
    view: View,
    one_in: Annotated[list[float] | None, Opt("N", least=1)] = None,
    delivery: Delivery = DELIVERY,
) -> Answer:
    """Compute yield and Ppk against each limit of the study.

    Gives for each limit, and for all limits together, the share of joints below it (yield) and the performance index
    Ppk of ISO 22514-2, each with its 95 % interval; with --wide or --json also a prediction interval for the number of
    joints above the limit in the next delivery. Where joints share lots, gives the shares of the lots, too.

    With --one-in N, gives also the load that one in N joints exceeds, from the joints in their order: N is at most
    their number. Beyond, tolstat rare simulates the joints that matter.

    Example: tolstat capability iso2768_f.h5 --one-in 1000

    Parameters
    ----------
    view : View
        A campaign of a study with limits.
    one_in : list of float, optional
        Also the load that one in N joints exceeds; repeatable.
    delivery : int
        Number of joints of the next delivery, for the prediction interval of those above a limit.

    Returns
    -------
    Answer
        Table ``limits``, see `limit_rows`; where joints share lots, ``lots``, see `of_lots`; with `one_in` table
        ``one_in``, see `return_rows`.

    Raises
    ------
    NotApplicable
        When the study has no limits, or its joints are no sample of a production.
    StoreError
        When the joints are no random sample.
    InputError
        When N is not above one.
    """
    if not view.limits or view.method in ("sweep", "cases"):
        remedy = 'give the result file of a study with [limits] and sampling.method = "random"'
        raise shares.inapplicable(view, "has no limits, or its joints are no random sample", remedy)
    view.check()
    rows = limit_rows(view, delivery)
    parts: list[Part] = [Table("limits", "Against each limit, and all of them together", LIMITS, rows)]
    parts += of_lots(view, delivery)
    notes = [Sentence(note) for note in (*_notes(rows), error_budget.unknown(view)) if note]
    if not one_in:
        return Answer("capability", "Yield and Ppk", [*parts, *notes])
    if min(one_in) <= 1.0:
        raise InputError([Fault("--one-in", f"{min(one_in):g} is not above one", "give the number of joints N")])
    rare = [row for load in view.limits for row in return_rows(view, load, one_in)]
    parts += [Table("one_in", RARE, RETURNS, rare), *notes, *_beyond(view, rare)]
    return Answer("capability", "Yield, Ppk and rare loads", parts)


def capability_on_page(view: View, asked: Asked) -> Answer:
    """Yield and Ppk against the limits, if there are any, and rare loads of the leading loads."""
    if not (view.sampled and view.count(*VALID)) or view.design.refuses():
        raise NotApplicable
    parts = list(capability(view).parts) if view.limits else []
    rare = [row for name in view.leading for row in return_rows(view, name, ON_PAGE)]
    if rows := [row for row in rare if not math.isnan(row["estimate"])]:
        parts += [Table("one_in", RARE, RETURNS, rows), *_beyond(view, rare)]
    if not parts:
        raise NotApplicable
    return Answer("capability", "Yield, Ppk and rare loads" if view.limits else "Rare loads", parts)


def limit_rows(view: View, delivery: int = DELIVERY) -> Rows:
    """Yield and Ppk against each limit, and against all limits together.

    Parameters
    ----------
    view : View
        A campaign of a study with limits.
    delivery : int
        Number of joints of the next delivery.

    Returns
    -------
    sequence of mapping
        One row per limit: ``load``, ``unit``, ``limit``, ``n``, ``n_failed``, ``n_unsettled``, ``count`` (above,
        or ``scrap``); ``good`` and ``ppm`` with ``_lower`` and ``_upper``, total intervals: they cover sampling,
        unresolved joints and, if known, the numerical error; ``ppk`` with its ends, ``needed``, see
        `analysis.capability.Performance`;
        ``next_lower`` and ``next_upper``, prediction interval for the joints above the limit in the delivery. The last
        row, `ANY_LIMIT`, is for the largest ratio of load to limit of each joint. ``ppk`` is NaN where unresolved
        joints matter (`analysis.binomial.unresolved_matter`).
    """
    rows = []
    for load in view.loads([*view.limits, ANY_LIMIT]):
        row = dict(shares.good(view, load.name, delivery))
        index = indices.of_sample(load, row["limit"])
        ppk = indices.NONE if shares.unresolved_matter(row) else index.ppk
        rows.append(row | shares.with_ends("ppk", ppk) | {"needed": index.needed})
    return rows


def of_lots(view: View, delivery: int = DELIVERY) -> list[Part]:
    """Which share of a lot is above each limit, and how many joints of the next delivery; for joints that share lots.

    Parameters
    ----------
    view : View
        A campaign; one without lots or limits has no parts.
    delivery : int
        Number of joints of the next delivery, all of one new lot.

    Returns
    -------
    list of Part
        Table ``lots``, one row per limit, the last for all together: ``load``, ``unit``, ``limit``; ``lots``, number of
        them; ``median``, ``high`` (90 %) and ``worst`` of the shares of their joints that are above the limit;
        ``next_lower``, ``next_upper``, prediction interval for the joints above it in the ``delivery``. A sentence.
    """
    if not isinstance(view.design, Clustered) or not view.limits:
        return []
    rows = []
    for load in view.loads([*view.limits, ANY_LIMIT]):
        good = shares.good(view, load.name, delivery)
        above, joints = view.design.counts(load.value, [good["limit"]])
        of_lot = above[joints > 0, 0] / joints[joints > 0]
        if len(of_lot) < LEAST:
            return [Sentence(f"no shares of lots: joints of {len(of_lot)} lots simulated, {LEAST} are needed")]
        row = {key: good[key] for key in ("load", "unit", "limit", "next_lower", "next_upper", "delivery")}
        row |= {"lots": len(of_lot), "median": float(np.median(of_lot)), "worst": float(of_lot.max())}
        rows.append(row | {"high": float(np.quantile(of_lot, 0.9, method="inverted_cdf"))})
    size = view.store.sampling["joints_per_lot"]
    words = f"{len(of_lot)} lots of {size} joints; delivery: {delivery} joints of one new lot, 95 % prediction interval"
    return [Table("lots", "Which share of a lot is above each limit", LOTS, rows), Sentence(words)]


def return_rows(view: View, name: str, one_in: Sequence[float]) -> Rows:
    """Return loads, "1 in N joints": quantiles, as far as the joints reach.

    Parameters
    ----------
    view : View
        The campaign.
    name : str
        Load.
    one_in : sequence of float
        Numbers of joints N, above one.

    Returns
    -------
    sequence of mapping
        One row for each N: ``load``, ``unit``, ``one_in``, ``estimate``, ``lower``, ``upper``, ``bound_lower`` and
        ``bound_upper`` (unresolved joints counted below, above), see `estimates.Quantile`. SI units. NaN where N is
        larger than the number of valid joints.
    """
    load, rows = view.load(name), []
    for number in one_in:
        found = load.quantile(1.0 - 1.0 / number)._asdict()
        reached = number <= load.valid.size
        row: dict[str, Any] = {"load": name, "unit": load.unit, "one_in": number}
        rows.append(row | {key: found[key] if reached else math.nan for key in FIGURES})
    return rows


def _beyond(view: View, rows: Rows) -> Iterator[Sentence]:
    """Sentence on loads that are rarer than the joints show, with the command that estimates how rare a load is."""
    if any(math.isnan(row["estimate"]) for row in rows):
        name, study = rows[0]["load"], f"{view.store.study_name}.toml"
        level = view.load(name).limit
        limit = f"{name} > {'LEVEL' if level is None else text.value(level, view.load(name).unit)}"
        number = text.several(view.load(name).valid.size, "joint")
        yield Sentence(f"one in more than {number} is beyond these joints")
        yield Sentence(f'rarer ones: tolstat rare {study} --limit "{limit}"')


def _ends_of_ppk(row: Row) -> str:
    """Cell of the interval of Ppk; of too few joints its upper end."""
    if math.isnan(row["ppk"]) and not math.isnan(row["ppk_upper"]):
        return f"below {row['ppk_upper']:.2f}"
    return text.ends(row["ppk_lower"], row["ppk_upper"], ".2f")


def _notes(rows: Rows) -> Iterator[str]:
    """Definitions, unresolved joints, restrictions of the table of limits."""
    yield "Ppk is Ppu: limits are upper limits. It is not Cpk: no process is shown to be under control (ISO 22514-2)"
    first = rows[0]
    if scrap := first["scrap"]:
        yield f"{scrap} of {first['n']} joints cannot be assembled: scrap in yield, ppm and delivery, in no Ppk"
    if unresolved := first["n_failed"] + first["n_unsettled"]:
        of = f"{unresolved} of {first['n']} joints without a valid load"
        yield f"{of}: in the intervals of yield and ppm both ways, in no Ppk"
        if any(shares.unresolved_matter(row) for row in rows):
            yield "no Ppk where joints without a valid load make a share as uncertain as sampling does"
    if first["n"] - unresolved - scrap < indices.LEAST:
        words = f"Ppk needs {indices.LEAST} valid joints, its lower end {first['needed']}"
        yield f"{words}; fewer tell at most its upper end"
    elif any(row["ppk_lower"] == 0 for row in rows):
        yield f"lower ends of Ppk need {first['needed']} valid joints"
