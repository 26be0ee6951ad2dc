"""Shares of the lots above the limits, and what the next delivery may hold."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import clustered, prediction
from tolstat.analysis.clustered import Clustered, Delivery
from tolstat.analysis.estimates import Column as Values
from tolstat.analysis.sample import CONFIDENCE, Sample, total_interval
from tolstat.campaign.work import Work
from tolstat.common.errors import Fault, InputError, NotApplicable, StoreError
from tolstat.common.late import special
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Accepted, Opt
from tolstat.display.table import has, has_unresolved
from tolstat.questions import shares
from tolstat.store import error_budget
from tolstat.store.view import View
from tolstat.study import Study, load
from tolstat.study.rewriting import with_keys

Integers = NDArray[np.intp]
LOTS, JOINTS = 50, 20
"""Number of lots, and of joints of each, that are simulated unless told otherwise."""
EXPECTED = ("if joints did not depend on their lot", "expected of a new lot")
"""Labels of the curves that are not simulated."""
DELIVERY = 500
"""Joints of the next delivery, unless another number is given."""
COLUMNS = (
    Column("load", shares.word("load")),
    Column("limit", shares.limit),
    Column("above", shares.share("estimate")),
    Column("total interval", shares.shares("lower", "upper")),
    Column("lots without", shares.share("without"), rank=2),
    Column("median lot", shares.share("median"), rank=4),
    Column("one lot in ten", lambda row: f"> {text.percent(row['high'])}", rank=3),
    Column("worst lot", shares.share("worst"), rank=1),
    Column("correlation", lambda row: text.formed(row["correlation"], ".2f"), rank=5),
    Column("above in delivery", text.delivery),
    Column("bad deliveries", shares.share("bad"), shown=has("bad")),
)
"""Columns of the table ``limits``; bad deliveries with an accepted share."""
Joints = Annotated[int, Opt("N", 1, 10**5)]
NewLots = Annotated[int, Opt("K", least=1)]


def simulate(
    study: Study,
    work: Work,
    number: Annotated[int | None, Opt("L", least=clustered.LEAST, name="lots")] = None,
    joints: Annotated[int | None, Opt("M", least=2)] = None,
    delivery: Joints = DELIVERY,
    from_lots: NewLots = 1,
) -> list[Path]:
    """Simulate lots of a study into ``STUDY_lots.h5``.

    Parameters
    ----------
    study : Study
        A study with ``lot`` in an entry of ``[tolerances]``.
    work : Work
        Worker processes and folder.
    number : int, optional
        Number of lots; default: that of STUDY, or 50.
    joints : int, optional
        Joints of each lot; default: those of STUDY, or 20.
    delivery, from_lots : int
        As in `lots`, so that what that refuses is not simulated.
    """
    _check_delivery(delivery, from_lots)
    return [work.run(study_of(study, number, joints), f"{study.path.stem}_lots.h5")]


def study_of(study: Study, number: int | None = None, joints: int | None = None) -> Study:
    """Let the joints of a study share lots: `number` of them with `joints` each, see `simulate`.

    Raises
    ------
    InputError
        With every fault of the study.
    """
    size_of_study = study.sampling.joints_per_lot
    lots_of_study = study.samples // size_of_study if size_of_study > 1 else LOTS
    size = joints or (size_of_study if size_of_study > 1 else JOINTS)
    keys = {"method": "random", "n": size * (number or lots_of_study), "joints_per_lot": size, "replicates": None}
    changed = with_keys(study.text, {("sampling",): keys}, str(study.path))
    return load(study.path, text=changed)


def lots(
    view: View,
    delivery: Joints = DELIVERY,
    from_lots: NewLots = 1,
    accepted: Accepted = math.nan,
) -> Answer:
    """Compute which share of a lot or of a delivery exceeds limits.

    Parts of one lot deviate together, as the key lot of an entry of [tolerances] says. Simulates 50 lots of 20 joints
    of STUDY into STUDY_lots.h5. To resume after an interruption, run the same command again.

    Gives for each limit, and for all limits together, the share of the joints above it, with a 95 % interval over the
    lots, the worst lot, and a prediction interval for the next delivery; with --wide or --json also the median lot and
    how much joints of one lot are alike. With --accept, prints the share of the deliveries with more bad joints.

    Example: tolstat lots studies/lots.toml

    Parameters
    ----------
    view : View
        A campaign with limits whose joints share lots.
    delivery : int
        Number of joints of the next delivery.
    from_lots : int
        Number of new lots that the next delivery is of.
    accepted : float
        Accepted share of a delivery, all limits together: "0.1 %", "1000 ppm" or 0.001.

    Returns
    -------
    Answer
        Fact ``joints_per_lot``; a slice, or joints that are pending, may leave fewer. Table ``limits``, one row per
        limit, the last for all limits together: ``load``, ``unit``, ``limit``, ``lots``, ``n`` (joints), ``n_failed``,
        ``n_unsettled``, ``count`` (above); ``estimate``, share of the joints above, with its total interval ``lower``,
        ``upper`` over lots; ``correlation`` of two joints of a lot; ``without``, share of the lots with no joint above;
        ``median``, ``high`` (90 %) and ``worst`` of the lots' shares; ``delivery``, ``from_lots``, ``next_lower``,
        ``next_upper``: joints above the limit in the next delivery; ``bad``: probability that more than the accepted
        share of the next delivery is above, NaN without one. Table ``lots``, one row per lot: ``lot``, its number;
        ``n``, joints; and by load the number of joints above the limit.

    Raises
    ------
    InputError
        When a delivery has fewer joints than lots.
    NotApplicable
        When the study has no limits, or each joint is its own lot.
    StoreError
        When fewer than `clustered.LEAST` lots have joints done.
    """
    _check_delivery(delivery, from_lots)
    if not isinstance(view.design, Clustered) or not view.limits:
        in_lots = isinstance(view.design, Clustered)
        reason = "is of a study without [limits]" if in_lots else "holds joints that are each its own lot"
        remedy = "give the file of a study with [limits], or simulate its lots: tolstat lots STUDY"
        raise shares.inapplicable(view, reason, remedy)
    design, joints = view.design, view.design.counts(view.load(ANY_LIMIT).upper, [1.0])[1].astype(np.intp)
    n = joints[joints > 0]
    if n.size < clustered.LEAST:
        reason = f"has joints of {n.size} lots simulated, and fewer than {clustered.LEAST} have no interval"
        raise shares.unusable(view, reason, "simulate the others: run the same command again, or tolstat run STUDY")

    def above(x: Values, limit: float | None) -> Integers:
        return np.asarray(design.counts(x, [limit or 0.0])[0][joints > 0, 0], dtype=np.intp)

    @cache
    def predicted(*counts: int) -> Delivery:
        return clustered.delivery(counts, n, delivery, from_lots)

    rows, counts = [], {}
    for sample in view.loads([*view.limits, ANY_LIMIT]):
        ends, counts[sample.name] = error_budget.with_error(view, sample), above(sample.value, sample.limit)
        least, most = (predicted(*above(x, sample.limit)) for x in (ends[1 % len(ends)].lower, ends[-1].upper))
        row = _shares(sample, ends, counts[sample.name], n)
        row |= prediction.columns((least.ends()[0], most.ends()[1]), delivery) | {"from_lots": from_lots}
        rows.append(row | {"bad": math.nan if math.isnan(accepted) else most.more_than(accepted)})
    numbers, size = design.numbers[joints > 0], int(view.store.sampling["joints_per_lot"])
    notes = [*_notes(rows, size, accepted), error_budget.unknown(view)]
    parts: list[Part] = [
        Panels([_panel(rows[-1], counts[ANY_LIMIT], n, size)]),
        Table("limits", "Lots against each limit, and all of them together", COLUMNS, rows),
        Table("lots", "Joints above the limits, by lot", (), shares.rows_of({"lot": numbers, "n": n} | counts)),
        *(Sentence(note) for note in notes if note),
    ]
    return Answer("lots", "Lots, and the next delivery", parts, {"joints_per_lot": size})


def lots_on_page(view: View, asked: Asked) -> Answer:
    """Shares of the lots and the next delivery, or why there are none; for campaigns whose joints share lots."""
    if not isinstance(view.design, Clustered) or not view.limits or not view.count(*VALID):
        raise NotApplicable
    try:
        answer = lots(view, accepted=asked.accepted)
    except StoreError as error:
        reason = str(error).splitlines()[0].partition(": ")[2]
        return Answer("lots", "Lots", [Sentence(f"No lots: {reason}.", "lead")])
    unknown = Sentence(error_budget.unknown(view))  # which the page says of all limits
    return replace(answer, parts=[part for part in answer.parts if part != unknown])


def _check_delivery(delivery: int, from_lots: int) -> None:
    if delivery < from_lots:
        raise InputError([Fault("--from-lots", f"{from_lots} lots of {delivery} joints", "give fewer lots")])


def _shares(sample: Sample, ends: tuple[Sample, ...], count: Integers, n: Integers) -> dict[str, Any]:
    """Shares of the joints and of the lots above the limit of a load, `count` of `n` joints in each lot."""
    assert sample.limit is not None
    share, above = count / n, sample.above(sample.limit)
    low, high = total_interval(ends, sample.limit, CONFIDENCE)
    row = {"load": sample.name, "unit": sample.unit, "limit": sample.limit, "lots": len(n), **shares.counts(above)}
    row |= {"estimate": above.estimate, "lower": low, "upper": high}
    row |= {"correlation": float(clustered.interval(count, n).correlation), "without": float(np.mean(count == 0))}
    row |= {"median": float(np.median(share)), "high": float(np.quantile(share, 0.9, method="inverted_cdf"))}
    return row | {"worst": float(share.max())}


def _notes(rows: Rows, size: int, accepted: float) -> Iterator[str]:
    lots, delivery, of = (int(rows[-1][key]) for key in ("lots", "delivery", "from_lots"))
    yield f"{lots} lots, {size} joints a lot; intervals: Student's t over lots, on the logit"
    origin = "one new lot" if of == 1 else f"{of} new lots"
    yield f"delivery: {delivery} joints of {origin}, 95 % prediction interval"
    if not math.isnan(accepted):
        yield f"bad deliveries: more than {text.percent(accepted)} of the joints above"
    if has_unresolved(rows):
        yield "joints without a valid load: below a limit at lower ends, above it at upper ends"


def _panel(row: Row, above: Integers, n: Integers, size: int) -> Panel:
    """Picture of the shares of the lots that exceed at least one limit; `row` is that of all limits together."""

    def draw(ax: Axes) -> None:
        """Draw the share of the lots with at most a share of bad joints: simulated, expected, and without lots."""
        share = np.sort(above / n)
        top = max(2, int(np.ceil(size * min(1.0, share[-1] * 1.15 + 1.0 / size))))
        at, x = np.arange(top + 1), np.arange(top + 2) / size
        expected = np.cumsum(clustered.delivery(above, n, size).probability)[at]
        alone = special.bdtr(at, size, above.sum() / n.sum())
        looks = (style.FAINT, style.DASHES[2]), (style.COLOURS[1], style.DASHES[1])
        for label, cdf, (colour, dash) in zip(EXPECTED, (alone, expected), looks, strict=True):
            ax.step(x, 100.0 * np.append(cdf, cdf[-1]), where="post", color=colour, ls=dash, label=label)
        steps = 100.0 * np.arange(1, share.size + 1) / share.size
        look: Any = {"color": style.COLOURS[0], "label": "lots simulated"}
        ax.step(np.append(share, x[-1]), np.append(steps, 100.0), where="post", **look)
        ax.set(xlim=(0.0, x[-1]), ylim=(0.0, 104.0), ylabel="lots with at most this share [%]")
        ax.xaxis.set_major_formatter(lambda value, _: f"{100.0 * value:g} %")
        ax.set_xlabel("share of the joints of a lot that exceed at least one limit")

    title = f"{row['lots']} lots: which share of their joints is bad"
    half, worst = text.percent(row["median"]), text.percent(row["worst"])
    description = f"Half of the lots have at most {half}, the worst has {worst}"
    return Panel("lots", title, description, draw, (drawing.WIDTH, 3.2))
