"""Shares of the lots above the limits, and what the next delivery may hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat.analysis import clustered, prediction
from tolstat.analysis.clustered import Clustered, Delivery, Law
from tolstat.analysis.column import Column
from tolstat.analysis.design import Design
from tolstat.analysis.sample import Sample, total_interval
from tolstat.common.errors import Fault, StoreError
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.shown import shown
from tolstat.store import error_budget
from tolstat.store.view import View
from tolstat.study import Study, load
from tolstat.study.rewriting import with_keys

LOTS, JOINTS = 50, 20
"""Number of lots, and of joints of each, that the command simulates unless told otherwise."""
DELIVERY = 500
"""Joints of the next delivery, unless another number is given."""


@shown
class Lots(NamedTuple):
    """Shares of the lots of a campaign.

    Attributes
    ----------
    joints_per_lot : int
        Joints of a lot; a slice, or joints that are pending, may leave fewer.
    table : DataFrame
        One row per limit, the last for all limits together: ``load``, ``unit``, ``limit``, ``lots``, ``n`` (joints),
        ``n_failed``, ``n_unsettled``, ``count`` (above); ``estimate``, share of the joints above, with its total
        interval ``lower``, ``upper`` over lots; ``correlation`` of two joints of a lot; ``without``, share of the lots
        with no joint above; ``median``, ``high`` (90 %) and ``worst`` of the lots' shares; ``delivery``, ``from_lots``,
        ``next_lower``, ``next_upper``: joints above the limit in the next delivery; ``bad``: probability that more than
        the accepted share of the next delivery is above, NaN without one.
    shares : DataFrame
        One row per lot: ``lot``, its number; ``n``, joints; and by load the number of joints above the limit.
    law : Law
        What is known of the lots' shares above all limits together.
    """

    joints_per_lot: int
    table: pd.DataFrame
    shares: pd.DataFrame
    law: Law


def study_of(path: Path, number: int | None = None, joints: int | None = None) -> Study:
    """Read a study, and let its joints share lots.

    Parameters
    ----------
    path : Path
        TOML file, with ``lot`` in an entry of ``[tolerances]``.
    number, joints : int, optional
        Lots, and joints of each; without them those of the study, or `LOTS` and `JOINTS`.

    Raises
    ------
    InputError
        With every fault of the study.
    """
    plan = load(path)
    own = plan.sampling.joints_per_lot
    size = joints or (own if own > 1 else JOINTS)
    held = plan.samples // own if own > 1 else LOTS
    keys = {"method": "random", "n": size * (number or held), "joints_per_lot": size, "replicates": None}
    return load(path, text=with_keys(plan.text, {("sampling",): keys | {"groups": None}}, str(path)))


def lots_of(
    view: View, delivery: int = DELIVERY, from_lots: int = 1, accepted: float = np.nan, confidence: float = 0.95
) -> Lots:
    """Shares of the lots above each limit, and the prediction for the next delivery.

    Parameters
    ----------
    view : View
        A campaign with limits whose joints share lots.
    delivery, from_lots : int
        Joints of the next delivery, and number of new lots that they come from.
    accepted : float
        Accepted share of a delivery.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    Lots

    Raises
    ------
    StoreError
        When the study has no limits, each joint is its own lot, or fewer than `clustered.LEAST` lots have joints done.

    Examples
    --------
    >>> with tolstat.open("lots.h5") as store:  # doctest: +SKIP
    ...     found = tolstat.lots_of(store.view(), delivery=500)
    """
    check(view)
    rows, every, known = [], {}, dict[bytes, Delivery]()
    for own in [*view.loads(list(view.limits)), view.load(ANY_LIMIT)]:
        every[own.name] = counted(own, own.value)
        rows.append(_row(view, own, known, (delivery, from_lots, accepted, confidence)))
    above, n = every[ANY_LIMIT]
    lots = _lots_of(view.design)
    shares = {"lot": lots.numbers[lots.counts(own.upper, [1.0])[1] > 0], "n": n}
    shares |= {name: own[0] for name, own in every.items()}
    size = int(view.store.sampling["joints_per_lot"])
    return Lots(size, pd.DataFrame(rows), pd.DataFrame(shares), clustered.law_of(above, n))


def check(view: View) -> None:
    """Raise a StoreError for a file whose lots tell nothing; the hint names what can be used."""
    found, remedy = "", "give the file of a study with [limits], or simulate its lots: tolstat lots STUDY"
    if not isinstance(view.design, Clustered):
        found = "holds joints that are each its own lot"
    elif not view.limits:
        found = "is of a study without [limits]"
    else:
        load = view.load(ANY_LIMIT)
        done = len(counted(load, load.value)[1])
        if done < clustered.LEAST:
            found = f"has joints of {done} lots simulated, and fewer than {clustered.LEAST} have no interval"
            remedy = "simulate the others: run the same command again, or tolstat run STUDY"
    if found:
        raise StoreError(str(Fault(str(view.path), found, remedy)))


def counted(load: Sample, x: Column) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Joints above the limit, and joints, of each lot with a joint done.

    Parameters
    ----------
    load : Sample
        A load with a limit, of joints that share lots.
    x : Column
        What is compared with the limit: its values, or their lower or upper ends.
    """
    lots = _lots_of(load.design)
    levels = [load.limit or 0.0]
    n = lots.counts(load.upper, levels)[1]
    return lots.counts(x, levels)[0][n > 0, 0].astype(np.intp), n[n > 0].astype(np.intp)


def _lots_of(design: Design) -> Clustered:
    assert isinstance(design, Clustered)
    return design


def _row(
    view: View, load: Sample, known: dict[bytes, Delivery], asked: tuple[int, int, float, float]
) -> dict[str, object]:
    assert load.limit is not None
    delivery, from_lots, accepted, confidence = asked

    def predicted(counts: tuple[NDArray[np.intp], NDArray[np.intp]]) -> Delivery:
        key = b"".join(own.tobytes() for own in counts)  # equal counts have one prediction
        if key not in known:
            known[key] = clustered.law_of(*counts).delivery(delivery, from_lots)
        return known[key]

    loads = error_budget.with_error(view, load)
    above = load.above(load.limit, confidence)
    low, high = total_interval(loads, load.limit, confidence)
    count, n = counted(load, load.value)
    share = count / n
    least = predicted(counted(loads[0], loads[1 % len(loads)].lower))
    most = predicted(counted(loads[0], loads[-1].upper))
    row: dict[str, object] = {"load": load.name, "unit": load.unit, "limit": load.limit, "lots": len(n)}
    row |= {key: getattr(above, key) for key in ("n", "n_failed", "n_unsettled", "count", "estimate")}
    row |= {"lower": low, "upper": high, "correlation": float(clustered.interval(count, n).correlation)}
    row |= {"without": float(np.mean(count == 0)), "median": float(np.median(share))}
    row |= {"high": float(np.quantile(share, 0.9, method="inverted_cdf")), "worst": float(share.max())}
    row |= prediction.columns((least.ends(confidence)[0], most.ends(confidence)[1]), delivery)
    return row | {"from_lots": from_lots, "bad": np.nan if np.isnan(accepted) else most.more_than(accepted)}


def summary(view: View, confidence: float) -> dict[str, Any]:
    """JSON value: ``lots``, the rows of the table of `lots_of`; nothing where each joint is its own lot."""
    from tolstat.display import text

    if not isinstance(view.design, Clustered):
        return {}
    try:
        return {"lots": text.records(lots_of(view, confidence=confidence).table)}
    except StoreError:
        return {"lots": []}
