"""Probability of a rare load, by subset simulation."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import prediction
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.analysis.subset import Estimate
from tolstat.campaign import subset
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.stop_rule import limit_of
from tolstat.campaign.work import Work
from tolstat.common.errors import Fault, InputError
from tolstat.common.late import special
from tolstat.common.loads import FloatArray, Limit, load_of
from tolstat.common.shell import quote
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Delivery, Opt
from tolstat.questions import shares
from tolstat.store import ResultFile, error_budget
from tolstat.store.view import View
from tolstat.study import Study, subset_of

EXAMPLE = 'write --limit "cross1.F > 900 N"'
LEVELS = (
    Column("level", lambda row: str(row["level"])),
    Column("threshold", lambda row: "-" if math.isinf(row["threshold"]) else text.value(row["threshold"], row["unit"])),
    Column("P(above it)", lambda row: text.formed(row["probability"])),
    Column("share that goes on", lambda row: text.percent(row["share"])),
    Column("its deviation", lambda row: text.percent(row["deviation"])),
    Column("joints", lambda row: str(row["joints"])),
    Column("accepted moves", lambda row: text.percent(row["acceptance"]), rank=1),
    Column("step", lambda row: text.formed(row["step"]), rank=2),
)
"""Columns of the table ``levels``; the deviation is the coefficient of variation of the share."""


def simulate(
    source: Study | Path,
    work: Work,
    limit: Annotated[str | None, Opt("LIMIT")] = None,
    n: Annotated[int, Opt("N", least=20)] = 1000,
    p0: Annotated[float, Opt("P")] = 0.1,
    seed: Annotated[int | None, Opt("S", least=0)] = None,
    unresolved: Literal["above", "below"] = "below",
    repeats: Annotated[int, Opt("K", least=1)] = 4,
) -> list[Path]:
    """Run or resume subset simulations with several seeds: that of the study, and the following ones.

    Parameters
    ----------
    source : Study or Path
        Study whose tolerances are used, its number of joints is ignored; or the result file of a simulation to resume,
        which holds all settings.
    work : Work
        Worker processes, folder of the result files, progress and messages; see `campaign.subset.run`.
    limit : str
        "cross1.F > 900 N", "cross*.F > 900 N" or "any limit"; required with STUDY.
    n : int
        Number of joints per level.
    p0 : float
        Share of joints carried to the next level, up to 0.5.
    seed : int, optional
        Seed of all draws; default: that of the study.
    unresolved : {"above", "below"}
        Whether failed and unsettled joints count as above or below the level.
    repeats : int
        Number of seeds, each with a result file of its own.

    Returns
    -------
    list of Path
        Result files ``STUDY_rare.h5``, ``STUDY_rare_2.h5`` and so on; existing ones of the same study, limit and
        settings are resumed.

    Raises
    ------
    InputError
        With every fault of limit and settings.
    StoreError
        When a file is of another study, limit or settings, or lacks joints and was begun by other code.
    Interrupted, WorkerDied
        As `campaign.run`; the same call resumes.
    """
    plans: dict[Path, Study] = {}
    if isinstance(source, Path):
        with ResultFile.open(source) as store:
            plans[source] = _plan_of(store.view(work.study_file))
    elif limit is None:
        raise InputError([Fault("--limit", "is missing", 'add --limit "cross1.F > 900 N"')])
    else:
        study = source.at(work.point).at("")
        wanted = limit_of(limit, study.limits, study.mechanism, "--limit", EXAMPLE)
        levels = dict(zip(wanted.loads, wanted.levels, strict=True))
        fields = {"load": wanted.name, "levels": levels, "per_level": n, "p0": p0, "unresolved": unresolved}
        plan = subset_of(study, fields | ({} if seed is None else {"seed": seed}))
        for k in range(repeats):
            path = work.folder / f"{source.path.stem}_rare{f'_{k + 1}' if k else ''}.h5"
            seeded = plan.sampling.model_copy(update={"seed": plan.sampling.seed + k})
            plans[path] = replace(plan, sampling=seeded)
    work.display.stage("levels of the subset simulation")
    with kept_workers():
        for path, plan in plans.items():
            work.tell(f"seed {plan.sampling.seed}: {path}")
            subset.run(plan, path, work)
    return list(plans)


def rare(*views: View, delivery: Delivery = prediction.DELIVERY) -> Answer:
    """Estimate a rare exceedance by subset simulation.

    Estimates P(load > level) down to 1e-9. Each level of the simulation starts from the joints of the previous level
    with the largest loads. What the interval does not cover: tolstat docs rare

    Repeats the simulation with 4 seeds. Gives threshold and share of each level (of the first seed), the probability
    with its 95 % interval from all seeds, whether they agree, and from how many joints of level 0 the joints above the
    limit descend: few of these, or seeds that disagree, tell of ways to the limit that were missed. The joints of each
    seed are in a result file, STUDY_rare.h5, STUDY_rare_2.h5 and so on, in the folder of --out or the current one. To
    resume after an interruption, run the same command again.

    Example: tolstat rare studies/iso2768_f.toml --limit "cross1.F > 5 kN"

    Parameters
    ----------
    *views : View
        Result files of `simulate`, one of each seed.
    delivery : int
        Number of joints of the next delivery, for the prediction interval of those above the limit.

    Returns
    -------
    Answer
        Table ``levels``, one row per level and seed: ``seed``, ``level``, ``load``, ``unit``, ``threshold`` (-inf at
        level 0), ``probability`` of a load above it, and the other fields of `analysis.subset.Level`. Table ``seeds``,
        see `seed_row`. Facts: ``load``, ``above`` and ``unit`` of the limit, ``probability``, ``lower``, ``upper`` and
        ``deviation`` of all seeds, whether they ``agree``, see `together`; ``next_lower`` and ``next_upper``.

    Raises
    ------
    InputError
        When the files are of several limits.
    StoreError
        When a file is none of a subset simulation, or it is not finished.
    """
    limits = {subset.Subsets(_plan_of(view)).settings.limit(view.mechanism) for view in views}
    if len(limits) != 1:
        remedy = "give files of one simulation, which differ in the seed alone"
        raise InputError([Fault(", ".join(str(view.path) for view in views), "are of several limits", remedy)])
    limit = limits.pop()
    seeds, by_seed = zip(*(seed_row(view, delivery) for view in views), strict=True)
    estimate, agree = together([Estimate(*(row[key] for key in Estimate._fields)) for row in seeds])
    facts = {"load": limit.name, "above": limit.level, "unit": limit.unit, **estimate._asdict()}
    facts |= {"agree": agree, "delivery": delivery}
    facts |= {end: pick(row[end] for row in seeds) for end, pick in (("next_lower", min), ("next_upper", max))}
    parts: list[Part] = [
        Table("levels", f"Levels to {limit}", LEVELS, [row for rows in by_seed for row in rows], seen=by_seed[0]),
        Table("seeds", f"P({limit}) by seed", (), seeds),
        *(Sentence(line, "lead") for line in _sentences(limit, estimate, facts, seeds)),
        *map(Sentence, _notes(seeds, views, limit, estimate)),
    ]
    return Answer("rare", f"Probability of {limit}", parts, facts)


def _plan_of(view: View) -> Study:
    """The study of the subset simulation that a result file holds."""
    if view.method != "subset":
        remedy = 'give the study: tolstat rare STUDY --limit "cross1.F > 900 N" --out DIR'
        raise shares.unusable(view, "is not a result file of tolstat rare", remedy)
    return view.study


def seed_row(view: View, delivery: int) -> tuple[dict[str, Any], Rows]:
    """Result of one seed.

    Returns
    -------
    dict
        ``file``, ``seed``; ``reached`` (whether the levels reached the limit), ``probability``, ``lower``, ``upper``,
        ``deviation`` as in `analysis.subset.Estimate`; ``as_sure_as`` (number of joints drawn at random that would give
        the same deviation; NaN if unknown), ``upper_if_above`` (upper end if joints without a valid load are all above
        the limit, estimated by their share in level 0); ``joints`` simulated (the nominal one not counted),
        ``unresolved`` of these and ``unresolved_first`` of level 0 (without a valid load), ``ancestors`` (joints of
        level 0 that those above the limit descend from); ``numerical_lower`` and ``numerical_upper`` (factors on the
        ends of the interval by the numerical error near the limit; NaN if it is not known); ``next_lower`` and
        ``next_upper``, prediction interval for the joints above the limit among `delivery` further ones, with the
        numerical error.
    sequence of mapping
        Rows of the table ``levels``.
    """
    store, subsets, unresolved = view.parts[0].store, subset.Subsets(_plan_of(view)), []
    walk, settings, before, complete = subsets.walk, subsets.settings, subsets.first, store.complete
    while not walk.done:
        if store.n < subsets.stage.stop or not complete:
            remedy = f"resume it: tolstat rare {quote(str(view.path))} --run"
            raise shares.unusable(view, "is not finished", remedy)
        unresolved.append(subsets.take(store))
    estimate, wide = walk.estimate(), walk.estimate(prediction.half(CONFIDENCE))
    p, deviation = estimate.probability, estimate.deviation
    limit = settings.limit(view.mechanism)
    factors = numerical(view, limit, walk.last)
    low, high = factors or (1.0, 1.0)
    ends = prediction.of_share(wide.lower * low, min(1.0, wide.upper * high), delivery, CONFIDENCE)
    row = {"file": view.path.name, "seed": settings.seed, "reached": walk.reached} | estimate._asdict()
    row["as_sure_as"] = (1.0 - p) / (p * deviation**2) if deviation > 0 else math.nan
    row["upper_if_above"] = min(1.0, estimate.upper + unresolved[0] / settings.per_level)
    row |= {"joints": subsets.first - before, "unresolved": sum(unresolved), "unresolved_first": unresolved[0]}
    row |= {"ancestors": walk.ancestors, "per_level": settings.per_level, "counted": settings.unresolved}
    row["numerical_lower"], row["numerical_upper"] = factors or (math.nan, math.nan)
    row["next_lower"], row["next_upper"] = ends
    levels, probability = [], 1.0
    for number, level in enumerate(walk.levels):
        head = {"seed": settings.seed, "load": limit.name, "unit": limit.unit, "level": number}
        levels.append(head | {"threshold": level.threshold, "probability": probability} | level._asdict())
        probability *= level.share
    return row, levels


def numerical(view: View, limit: Limit, last: NDArray[np.intp]) -> tuple[float, float] | None:
    """Factors on both ends of the interval of a probability by the numerical error of the loads.

    Parameters
    ----------
    view : View
        Result file of a subset simulation.
    limit : Limit
        The limit.
    last : ndarray of int, shape (n,)
        Samples that are the states of its last level.

    Returns
    -------
    tuple of float or None
        Share of the last level above the limit with the loads corrected by what verified joints near it lack, over the
        share as simulated: least and largest, 1 included. None with fewer than `accuracy.LEAST_NEAR` such joints.
    """
    ends: list[list[FloatArray]] = [[], [], []]
    for name, level in zip(limit.loads, limit.levels, strict=True):
        load = replace(Sample.of(load_of(name, view.mechanism).of(view.results), view.status, name=name), limit=level)
        known = error_budget.near(view, load)
        if known is None:
            return None
        for end, sample in zip(ends, (load, *known), strict=True):
            end.append(np.nan_to_num(sample.values[last], nan=-np.inf) / level)
    plain, *moved = (float((np.maximum.reduce(end) > 1.0).mean()) for end in ends)
    factors = [share / plain for share in moved] if plain else [1.0]
    return min(1.0, *factors), max(1.0, *factors)


def together(estimates: Sequence[Estimate]) -> tuple[Estimate, bool]:
    """Mean of the probabilities of several seeds, and whether they agree.

    Returns
    -------
    Estimate
        Its interval is that of independent estimates; where they do not agree, it reaches from the least lower end to
        the largest upper end.
    bool
        Whether all reached the limit, and differ no more than their deviations explain (chi-squared, p >= 0.01).
    """
    n, reached = len(estimates), [seed for seed in estimates if not math.isnan(seed.probability)]
    ends = min(seed.lower for seed in estimates), max(seed.upper for seed in estimates)
    if not reached:
        return Estimate(math.nan, *ends, math.nan), True
    mean = sum(seed.probability for seed in reached) / n
    variances = [(seed.probability * seed.deviation) ** 2 for seed in reached]
    deviation = math.sqrt(sum(variances)) / n / mean if mean else math.nan
    spread = sum((seed.probability - mean) ** 2 / v for seed, v in zip(reached, variances, strict=True) if v)
    agree = len(reached) == n and (n == 1 or bool(special.chdtrc(n - 1, spread) >= 0.01))
    if not agree or n == 1:
        return Estimate(mean, *ends, deviation), agree
    # the logarithm of an unbiased product is low by half its variance; the ends of one seed tell Student's quantile
    first = reached[0]
    quantile = 0.5 * math.log(first.upper / first.lower) / first.deviation if first.lower and first.deviation else 1.96
    lower, upper = (min(1.0, mean * math.exp(0.5 * deviation**2 + s * quantile * deviation)) for s in (-1, 1))
    return Estimate(mean, lower, upper, deviation), agree


def _sentences(limit: Limit, estimate: Estimate, facts: Row, seeds: Rows) -> Iterator[str]:
    """Sentences on the probability of all seeds, its numerical error, and the next delivery."""
    if math.isnan(estimate.probability):
        yield f"P({limit}) < {estimate.upper:.2g}: the limit was not reached"
    else:
        ppm = f"{text.ppm(estimate.probability)} ppm"
        interval = f"95 % interval {estimate.lower:.3g} .. {estimate.upper:.3g}"
        yield f"P({limit}) = {estimate.probability:.3g} ({ppm}), {interval}"
    if len(seeds) > 1:
        each = ", ".join(text.formed(row["probability"]) for row in seeds)
        missed = "DISAGREE: some missed a way to the limit; the interval is that of all of them"
        yield f"{len(seeds)} seeds {'agree' if facts['agree'] else missed}: {each}"
    ancestors = ", ".join(str(row["ancestors"]) for row in seeds)
    yield f"joints above the limit descend from {ancestors} of {seeds[0]['per_level']} joints of level 0"
    known = [row for row in seeds if not math.isnan(row["numerical_lower"])]
    if known:
        lower = estimate.lower * min(row["numerical_lower"] for row in known)
        upper = min(1.0, estimate.upper * max(row["numerical_upper"] for row in known))
        yield f"with the numerical error near the limit: {lower:.3g} .. {upper:.3g}"
    low, high, number = facts["next_lower"], facts["next_upper"], facts["delivery"]
    yield f"of the next {number} joints, {low:.0f} .. {high:.0f} are above the limit (95 % prediction interval)"
    yield "this probability is that of the assumed distributions: no simulation tells whether parts have such tails"


def _notes(seeds: Rows, views: Sequence[View], limit: Limit, estimate: Estimate) -> Iterator[str]:
    """What the seeds leave open, and what they took: each note once."""
    unknown = [view.path for row, view in zip(seeds, views, strict=True) if math.isnan(row["numerical_lower"])]
    if unknown:
        others = f", and with each of the other {len(unknown) - 1} files" if len(unknown) > 1 else ""
        yield error_budget.command(unknown[0], str(limit)) + others
    for row, view in zip(seeds, views, strict=True):
        yield f"{view.path}: {text.several(row['joints'], 'joint')}, {row['unresolved']} of them failed or not settled"
    p, deviation = estimate.probability, estimate.deviation
    if deviation > 0.0 and all(row["reached"] for row in seeds):
        yield f"the estimate is as precise as that from {(1.0 - p) / (p * deviation**2):.2g} random joints"
    open_ = [row["upper_if_above"] for row in seeds if row["unresolved_first"] and row["counted"] == "below"]
    if open_:
        yield (
            "joints without a valid load count as below the level; if all of them were above, P would be at most "
            f"{max(open_):.2g} (--unresolved above counts them as above)"
        )
