"""Statistics of a campaign under other tolerances, by likelihood-ratio reweighting of its own joints."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from shlex import quote
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import prediction
from tolstat.analysis import reweight as weighting
from tolstat.analysis.prediction import DELIVERY
from tolstat.analysis.reweight import Ratios, Share
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.analysis.weighted import Weighted
from tolstat.common.errors import Fault, raise_all
from tolstat.common.loads import ANY_LIMIT, FloatArray
from tolstat.common.tables import Status
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Document, Row, Rows, Sentence, Table, has
from tolstat.display.options import Delivery, Opt
from tolstat.questions import shares
from tolstat.store import error_budget
from tolstat.store.view import View
from tolstat.study import Study
from tolstat.study.axes import columns_of
from tolstat.study.scaling import changed, rewritten_with
from tolstat.study.tolerances import density_ratio
from tolstat.study.tolerances.distributions import Distribution

SHARES = (0.5, 0.9, 0.99)
"""Quantiles of a study without limits."""
MAX_OUTSIDE = 1e-4
"""Maximum probability of the new distribution outside the range of the old one; no estimate covers that part."""
GIVEN = ("estimate", "lower", "upper", "bound_lower", "bound_upper")
WITHHELD = (*GIVEN, "total_lower", "total_upper", "next_lower", "next_upper")
"""Keys that are NaN where the joints do not support them."""
DRAWS = 1 << 15
"""Number of sets of errors drawn for the mean square of the ratio of correlated errors, which has no closed form."""
_ENDS = np.array([1e-12, 1 - 1e-12])


def _any_unresolved(rows: Rows) -> bool:
    return any(row["bound_upper"] > row["bound_lower"] for row in rows)


COUNTS = Column("counts as joints", lambda row: f"{row['ess']:.0f}" if row["usable"] else "-", rank=1)
LIMITS = (
    Column("load > limit", text.limit),
    Column("before", shares.share("before")),
    Column("after", shares.share("estimate")),
    Column("95 % interval", shares.shares("lower", "upper")),
    COUNTS,
    Column("with numerical error", shares.shares("total_lower", "total_upper"), shown=has("total_lower"), rank=1),
    Column("with unresolved joints", shares.shares("bound_lower", "bound_upper"), shown=_any_unresolved, rank=2),
    Column("ppm", lambda row: text.ppm(row["estimate"]), rank=2),
    Column("above in delivery", text.delivery, rank=3),
)
"""Columns of the table ``loads`` of a study with limits: shares above them."""
QUANTILES = (
    Column("quantile", lambda row: f"{row['load']}, {100 * row['share']:g} % stay below"),
    Column("before", shares.value("before")),
    Column("after", shares.value("estimate")),
    Column("95 % interval", shares.values("lower", "upper")),
    COUNTS,
)
"""Columns of the table ``loads`` of a study without limits."""


def reweight(
    view: View, settings: Annotated[list[str], Opt("KEY=VALUE", name="set")], delivery: Delivery = DELIVERY
) -> Answer:
    """Estimate exceedances for changed tolerances.

    Simulates nothing: each joint in FILE gets a weight, the density of its errors under the changed tolerances over
    that under the tolerances of the campaign (likelihood ratio).

    Gives the share of joints above each limit, and above any limit, with its 95 % interval, and a verdict. Where the
    joints do not support a share, none is given; the verdict is then "needs new runs" and names the commands. With
    --out DIR, writes also the study with the changed tolerances and the same seed, STEM_reweight.toml.

    Example: tolstat reweight iso2768_f.h5 --set "pin*.offset_t.plus_minus=0.1 mm"

    Parameters
    ----------
    view : View
        A campaign of joints drawn from tolerances.
    settings : list of str
        Tolerance to change: "pin*.offset_t.plus_minus=0.05 mm"; repeatable.
    delivery : int
        Number of joints of the next delivery, for the prediction interval of those above a limit.

    Returns
    -------
    Answer
        Table ``loads``, one row per limit, and `ANY_LIMIT` for all of them together: ``load``, ``unit``, ``level``,
        ``before`` (share of the joints as drawn), ``estimate``, ``lower``, ``upper``, ``bound_lower`` and
        ``bound_upper`` (joints without a valid load counted below and above), ``total_lower`` and ``total_upper`` (also
        with the numerical error; NaN where that is not known, see `store.error_budget.near`), ``next_lower`` and
        ``next_upper`` (prediction interval for the joints above the limit in the next delivery), ``ess``, ``above`` and
        ``below`` (effective joints on each side of the limit), ``k``, ``usable``. For a study without limits,
        quantiles: ``share`` instead of ``level``, loads as estimates, no bounds and no sides. Estimates, intervals and
        bounds are NaN where ``usable`` is false. Facts: ``usable`` (every row), ``effective`` and ``needed`` joints,
        ``verdict``, ``changed`` (errors whose distribution changes).

    Raises
    ------
    InputError
        With the faults of the settings, and every error whose new distribution exceeds the range of the old one.
    StoreError
        When the joints of the file are not drawn from tolerances, none of them is possible under the new ones, or none
        has a valid load.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     answer = tolstat.reweight(store.view(), ["pin1.offset_t.plus_minus=0.09 mm"])
    >>> row = answer.tables["loads"].rows[0]
    >>> answer.facts["usable"], row["load"], bool(row["estimate"] < row["before"])
    (True, 'cross1.F', True)
    """
    view.check_drawn()
    view.check("share")
    old = view.study.tolerances
    new = {name: law for name, law in changed(view.study, settings).items() if law.describe() != old[name].describe()}
    remedy = "run a study with these tolerances"
    beyond = {name: _beyond(old[name], law) for name, law in new.items()}
    raise_all(Fault(f"tolerances.{name}", words, remedy) for name, words in beyond.items() if words)
    done = np.flatnonzero(view.status != Status.PENDING)
    ratios = _ratios(view, new, done)
    if not ratios.values.any():
        raise shares.unusable(view, "the new tolerances make none of the joints", remedy)
    rows = _rows(view, done, ratios, delivery)
    verdict, usable = _verdict(ratios, rows), all(row["usable"] for row in rows)
    facts = {"usable": usable, "effective": ratios.effective, "needed": ratios.needed, "verdict": verdict}
    title, columns = ("Shares above the limits", LIMITS) if view.limits else ("Quantiles", QUANTILES)
    again = ""
    if not usable:
        changes = " ".join(f"--set {json.dumps(setting, ensure_ascii=False)}" for setting in settings)
        command = f"tolstat reweight {quote(str(view.path))} {changes} --out changed"
        study = quote(f"changed/{view.path.stem}_reweight.toml")
        again = f"fresh joints, same seeds: {command} && tolstat run {study}"
    words = (f"{len(new)} errors changed; {verdict}", error_budget.unknown(view), again)
    notes = [Sentence(note) for note in words if note]
    other = Document(".toml", lambda _: rewritten_with(view.study, settings))
    table = Table("loads", f"{title}, reweighted", columns, rows)
    return Answer("reweight", "Other tolerances", [table, *notes, other], facts | {"changed": list(new)})


def _rows(view: View, done: NDArray[np.intp], ratios: Ratios, delivery: int) -> list[Row]:
    """Rows of the table ``loads``; `ratios` are those of the joints `done`."""
    loads = view.loads(list(view.limits) or list(view.shown_loads))
    if lacking := [load.name for load in loads if not load.is_valid.any()]:
        reason = f"holds no joint with a valid load: {', '.join(lacking)}"
        raise shares.unusable(view, reason, f"see why: tolstat status {view.path}")
    if view.limits:
        rows = [_share_above(view, load, done, ratios, delivery) for load in (*loads, view.load(ANY_LIMIT))]
    else:
        rows = [_quantile(load.only(done), ratios, share) for load in loads for share in SHARES]
    return [row if row["usable"] else row | dict.fromkeys(WITHHELD & row.keys(), np.nan) for row in rows]


def _verdict(ratios: Ratios, rows: Rows) -> str:
    """Sentence on whether the table is reliable."""
    figures = f"{ratios.values.size} joints count as {ratios.effective:.0f}"
    if ratios.effective < ratios.needed:
        return f"needs new runs, no estimates: {figures}, {ratios.needed:.0f} needed"
    if not ratios.usable:
        square, allowed = math.exp(ratios.log_unbounded), weighting.LARGEST_SPREAD
        wide = f"mean square {square:.3g} of the density ratio of wider or shifted tolerances, {allowed:g} allowed"
        return f"needs new runs, no estimates: {wide}"
    missing = sum(not row["usable"] for row in rows)
    least = f"fewer than {weighting.LEAST_BESIDE:g} effective joints on one side, or the tail of their weights"
    return figures + (f"; {missing} of {len(rows)} rows need new runs: {least}" if missing else "")


def _ratios(view: View, new: Mapping[str, Distribution], done: NDArray[np.intp]) -> Ratios:
    """Density ratios of the joints `done`, with their exact mean square."""
    study = view.study
    columns = [column for name in dict.fromkeys((*new, *study.copula.names)) for column in columns_of(name)]
    blocks = view.error_blocks(columns)  # the errors of a million joints would be half a gigabyte
    logs = np.concatenate([_log_ratios(study, new, errors) for errors in blocks])
    values = np.exp((logs + np.log(view.design.counts_as(view.n)))[done])
    correlated = {name: law for name, law in new.items() if name in study.copula.names}
    square, open_square, largest = density_ratio.exact(
        (law, study.tolerances[name]) for name, law in new.items() if name not in correlated
    )
    if correlated:
        # mean ratio over errors drawn from the new tolerances: its mean square over the old ones
        scores = np.random.default_rng(2024).standard_normal((DRAWS, len(sampling.streams(study))))
        errors = sampling.from_scores(replace(study, tolerances=study.tolerances | dict(new)), scores)
        added = float(np.log(np.mean(np.exp(_log_ratios(study, correlated, errors)))))
        square, open_square, largest = square + added, open_square + added, np.inf
    # the tolerances have at least the share 1 / heaviest of the mixture drawn from
    heaviest = np.log(view.design.heaviest) if isinstance(view.design, Weighted) else 0.0
    return Ratios(values, float(square + heaviest), float(open_square), float(np.exp(largest + heaviest)))


def _beyond(old: Distribution, new: Distribution) -> str:
    """Words on a new distribution that has values where the old one has none; empty if it has not."""
    if old.discrete != new.discrete:
        return "is of measured parts before or after the change, not both: the joints lack the new values"
    if old.discrete:
        outside = float(np.mean(np.isneginf(old.logpdf(new.ppf((np.arange(10_000) + 0.5) / 10_000)))))
    else:
        low, high = old.ppf(_ENDS)
        u = np.concatenate([np.geomspace(1e-12, 0.5, 2000), 1 - np.geomspace(1e-12, 0.5, 2000)[::-1]])
        x = new.ppf(u)
        outside = float(np.max(u[x < low], initial=0.0) + np.max(1 - u[x > high], initial=0.0))
    return f"{outside:.2g} of the new errors lie where the study draws none" if outside > MAX_OUTSIDE else ""


def _log_ratios(study: Study, new: Mapping[str, Distribution], errors: NDArray[np.void]) -> FloatArray:
    values = partial(sampling.values, study, errors)
    return density_ratio.log_ratios(new, study.tolerances, study.copula, values, len(errors))


def _share_above(view: View, load: Sample, done: NDArray[np.intp], ratios: Ratios, delivery: int) -> dict[str, Any]:
    """Row of the table for a limit; `ratios` are those of the joints `done`."""
    assert load.limit is not None
    level, known = load.limit, error_budget.near(view, load)
    samples = [end.only(done) for end in (load, *(known or ()))]
    share, total, predicted = _reweighted(samples, ratios, level, delivery)
    before = samples[0].above(level, CONFIDENCE).estimate
    row = {"load": load.name, "unit": load.unit, "level": level, "before": before}
    row |= {key: getattr(share, key) for key in GIVEN}
    row["total_lower"], row["total_upper"] = total if known else (np.nan, np.nan)
    return row | predicted | share.support._asdict()


def _quantile(load: Sample, ratios: Ratios, share: float) -> dict[str, Any]:
    """Row of the table for a quantile; `ratios` are those of the joints of `load`."""
    before = load.quantile(share, CONFIDENCE).estimate
    row = {"load": load.name, "unit": load.unit, "share": share, "before": before}
    return row | weighting.quantile(load, ratios, share, CONFIDENCE)._asdict()


def _reweighted(
    samples: Sequence[Sample], ratios: Ratios, level: float, delivery: int
) -> tuple[Share, tuple[float, float], dict[str, float]]:
    """Share of the joints above a level under other tolerances.

    Parameters
    ----------
    samples : sequence of Sample
        Load of some joints and, where it is known, with both ends of its numerical error.
    ratios : Ratios
        Density ratios of these joints.
    level, delivery
        The level, and the number of joints of the next delivery.

    Returns
    -------
    Share
        Of the load as simulated.
    tuple of float
        Ends of the interval, with the numerical error where it is known.
    dict
        Columns of the prediction interval.
    """

    def ends(confidence: float) -> tuple[float, float]:
        each = [weighting.share_above(sample, ratios, level, confidence) for sample in samples]
        return min(share.lower for share in each), max(share.upper for share in each)

    predicted = prediction.of_share(*ends(prediction.half(CONFIDENCE)), delivery, CONFIDENCE)
    share = weighting.share_above(samples[0], ratios, level, CONFIDENCE)
    return share, ends(CONFIDENCE), prediction.columns(predicted, delivery)
