"""Causes of a load by error: which errors make it scatter over the joints, and which make its tail."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tolstat import sampling
from tolstat.analysis import ranks, sensitivity
from tolstat.analysis.sample import CONFIDENCE, Sample
from tolstat.common.channels import histories_of
from tolstat.common.cores import mapped
from tolstat.common.errors import Fault, InputError, NotApplicable, TolstatError
from tolstat.common.loads import ANY_LIMIT, FloatArray, unit_text
from tolstat.common.shell import quote
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table, has
from tolstat.display.options import Costs, Load, Top
from tolstat.questions import is_computed, quantity, shares
from tolstat.questions.causes import lines, revolution
from tolstat.questions.causes.shares import ENDS, check_scatter
from tolstat.questions.causes.simulation import simulate as simulate
from tolstat.store.revolutions import held
from tolstat.store.view import View

SIGNIFICANT = 0.05
"""p-value below which a table marks an error of the tail."""
MOST_WIDE = 90.0
"""Width of an interval of a share, %, above which it says nothing."""
SHOWN = 10
"""Number of errors shown for each load on the page."""
MAX_JOINTS = 20_000
"""Maximum number of joints (the first ones) for shares, and on either side of the tail: more add little, and
a million joints with fifty errors do not fit into a gigabyte."""
KINDS = ("first", "direction", "size")
TAIL = KINDS[-2:]

Parts = Mapping[str, NamedTuple]
"""Estimates of all errors with their ends, by name of `KINDS`."""


BARS = (
    "Bars: share of a load's variance that vanishes when the error is removed (first-order index). "
    "The rest up to 100 % comes from errors that act together."
)
LOGARITHMS = "Where a few joints with large loads dominate the variance, it is that of the logarithm."


class Indices(NamedTuple):
    """What each error contributes to a load.

    Attributes
    ----------
    facts : mapping
        ``load``, ``unit``, ``logarithm``; ``joints`` (valid), ``used`` (of them for shares),
        ``without_load``; ``level`` at which the tail begins, SI: the study's limit or, without one, the 90 % quantile;
        ``above``: number of joints above it; ``std`` of the load or its logarithm; ``additive`` with ``_lower`` and
        ``_upper``: sum of the first-order indices; whether errors are ``correlated``.
    rows : sequence of mapping
        One row per error that scatters (two per vector of a zone), the largest first-order index first: ``error``; with
        ``_lower`` and ``_upper``: ``first``, ``direction`` and ``size``; the last two also with ``_p``, and NaN if too
        few joints are on either side of the level.
    """

    facts: Mapping[str, Any]
    rows: Rows

    @property
    def quantity(self) -> str:
        """Name of the decomposed quantity: the load, or its logarithm."""
        return f"log {self.facts['load']}" if self.facts["logarithm"] else str(self.facts["load"])

    @property
    def with_intervals(self) -> bool:
        """Whether the samples are independent."""
        return not all(math.isnan(row["first_lower"]) for row in self.rows)


def causes(view: View, by: Load = None, top: Top = 12, logarithm: bool = False, costs: Costs = None) -> Answer:
    """Compute which tolerances and errors cause a load.

    Gives for each line of the drawing, an entry of [tolerances], the share of the joints above the limit if it were
    half as wide, exact, finer or coarser by one class (else by the factors 0.63 and 1.6); of a fit, with the next
    fundamental deviations and grades. With --run, simulates these joints, which have the seeds of FILE and keep their
    loads in it: until the order of the lines is settled, the time is up, or each change has --most joints. All else
    stays as drawn. To go on, run the same command again.

    Gives for each error: the share of the load's variance that it explains alone (first-order Sobol' index), and the
    probability that a joint above the limit (without a limit: above the 90 % quantile) has a larger, or a more extreme,
    error than a joint below. Where the file holds load histories, tells which error
    scatters the load most at its peak over the input angle.

    Example: tolstat causes iso2768_f.h5 --by cross1.F

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    by : str, optional
        Load, such as cross1.F or psi, "any limit", or over the duty cycle "life", "life pin1" or "damage cross1.F_t";
        default: all limits, or the only one.
    top : int
        Number of errors in the printed table.
    logarithm : bool
        Explain the variance of the load's logarithm instead of the load's.
    costs : Path, optional
        Cost of each tolerance, TOML or CSV (see tolstat docs allocate): what each change of a line costs.

    Returns
    -------
    Answer
        Table ``errors`` and facts, see `Indices`. Where the file has joints with other widths, first the tables
        of `lines.lines`, and a fact ``lines`` with its facts.

    Raises
    ------
    InputError
        When there is no such load, the study does not keep it, or `logarithm` is set and a value is not positive; with
        every fault of the costs, and when the file holds no joints with a line changed that they are for.
    StoreError
        When the file has too few valid joints, or joints that are not drawn from tolerances.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.causes(store.view(), "cross1.F")
    >>> found.frame("errors")["error"][:2].sort_values().tolist()
    ['pin1.offset_t', 'pin2.offset_z']
    """
    load = by or view.decisive
    of_errors = indices(view, load, logarithm)
    facts, parts = of_errors.facts, list[Part]()
    command = "" if is_computed(load) else f"tolstat causes {quote(str(view.path))} --run"
    if costs is not None and not view.altered:
        missing = f"is about changes of lines, and {view.path} holds no joints with one"
        raise InputError([Fault("--costs", missing, f"simulate them: {command}" if command else "leave it out")])
    if view.altered and not is_computed(load):
        with suppress(NotApplicable):  # joints of other lines, or at other operating points
            changed = lines.lines(view, load, costs=costs)
            parts, facts = list(changed.parts), {**facts, "lines": changed.facts}
    elif command and not view.altered:
        parts.append(Sentence(f"which line of the drawing to change: {command}"))
    parts += [Panels([_tornado(of_errors)]), _table("errors", of_errors, top)]
    parts += map(Sentence, _notes(of_errors, "" if view.altered else command, top))
    followed, m = [] if is_computed(load) else revolution.followed(view, [load]), view.mechanism
    stored = [name for name in followed if held(view.store, histories_of([name], m))]
    parts += revolution.over_angle(view, stored)
    return Answer("causes", "Causes by error", parts, facts)


def causes_on_page(view: View, asked: Asked) -> Answer:
    """Causes of the leading loads; of a load with a long tail, those of its logarithm."""
    if view.method == "sweep" or not view.count(*VALID):
        raise NotApplicable
    each: list[Indices] = []
    with asked.noting("causes are left out"):
        view.check()
        loads = view.loads(view.leading)
        jobs = [partial(indices, view, load.name, load.long_tailed, MAX_JOINTS) for load in loads]
        tried = mapped([partial(_tried, job) for job in jobs], min(asked.processes, 2))
        for load, job, of_errors in zip(loads, jobs, tried, strict=True):
            with asked.noting(f"no causes of {load.name}"):
                each.append(of_errors or job())  # which raises what it raised before
    if not each:
        raise NotApplicable
    introduction = [BARS, LOGARITHMS * any(of_errors.facts["logarithm"] for of_errors in each)]
    introduction.append("" if each[0].with_intervals else "No intervals: the samples are not independent.")
    parts: list[Part] = [Sentence(" ".join(filter(None, introduction)), "lead"), Panels(list(map(_tornado, each)))]
    with asked.noting("nothing over the input angle"):
        names = [str(of_errors.facts["load"]) for of_errors in each if asked.replay]
        parts += revolution.over_angle(view, revolution.followed(view, names), asked.replay)
    command = "" if view.altered else f"tolstat causes {quote(view.path.name)} --run"
    for of_errors in each:
        parts.append(_table(f"errors_{of_errors.facts['load']}", of_errors, SHOWN))
        parts += map(Sentence, _notes(of_errors, command, SHOWN))
    return Answer("causes", "Causes by error", parts)


def _tried(job: Callable[[], Indices]) -> Indices | None:
    """Result of a job; None where it cannot be had."""
    with suppress(TolstatError):
        return job()
    return None


def _table(name: str, of_errors: Indices, shown: int) -> Table:
    """Table of all errors; people see the `shown` with the largest shares, and those with an effect on the tail.

    Shares of the variance in per cent, with intervals; probability that a joint of the tail has the larger error
    (``direction``) and the error farther from the middle (``size``), where ``*`` marks p < `SIGNIFICANT`.
    """
    columns = [
        Column("error", shares.word("error")),
        shares.estimated("alone, %", "first", ends=(0.0, 1.0)),
        Column("tail: larger", partial(_tail, name="direction"), shown=has("direction"), rank=2),
        Column("tail: farther out", partial(_tail, name="size"), shown=has("size"), rank=1),
    ]
    title = f"Scatter of {of_errors.quantity} over all joints, not of exceeding a limit, by error"
    return Table(name, title, columns, of_errors.rows, seen=_seen(of_errors.rows, shown))


def _seen(rows: Rows, shown: int) -> list[Row]:
    """Rows that people see, see `_table`."""
    return [row for i, row in enumerate(rows) if i < shown or min(row["direction_p"], row["size_p"]) < SIGNIFICANT]


def _tail(row: Row, name: str) -> str:
    star = "*" if row[f"{name}_p"] < SIGNIFICANT else " "
    return "-" if math.isnan(row[name]) else f"{row[name]:.2f}{star}"


def _notes(of_errors: Indices, command: str, shown: int) -> list[str]:
    """Joints, explained variance, restrictions; `command` gives shares in all, empty if it has been run.

    `shown` is that of `_table`.
    """
    facts, rows = of_errors
    unit, std = unit_text(facts["unit"]), f"{facts['std']:.4g}"
    additive, low, high = (100 * facts[f"additive{end}"] for end in ENDS)
    ends = "" if math.isnan(low) else f" ({low:.0f} .. {high:.0f} %{', too few joints' * (high - low > MOST_WIDE)})"
    alone = f"errors alone explain {additive:.0f} %{ends} of the variance"
    if number := len(rows) - len(seen := _seen(rows, shown)):
        rest = additive - 100 * sum(row["first"] for row in seen)
        share = "0" if abs(rest) < 0.5 else f"{rest:+.0f}"
        alone += f", of which the {number} not shown {share} % (without effect they scatter about 0 %)"
    std = f"{std}, of the logarithm" if facts["logarithm"] else f"{std} {unit}".rstrip()
    level = "at least one limit" if facts["load"] == ANY_LIMIT else f"{facts['level']:.5g} {unit}".rstrip()
    tail = f"; tail: {text.several(facts['above'], 'joint')} above {level}"
    notes = [
        f"{facts['load']}: {text.several(facts['joints'], 'joint')}, {facts['without_load']} without a valid load left "
        f"out; standard deviation {std}",
        f"{alone}{tail}",
    ]
    if (used := facts["used"]) < facts["joints"]:
        notes.append(f"shares are from the first {used} joints, the tail from at most as many on either side")
    if facts["correlated"]:
        notes.append("errors are correlated: shares overlap")
    elif command:
        notes.append(f"shares in all, with interactions: {command}")
    return notes if of_errors.with_intervals else [*notes, shares.NO_INTERVALS]


def _tornado(of_errors: Indices) -> Panel:
    facts, rows = of_errors.facts, of_errors.rows[:SHOWN]

    def draw(ax: Axes) -> None:
        y = np.arange(len(rows))
        first, low, high = (100.0 * np.array([row[f"first{end}"] for row in rows]) for end in ENDS)
        bar: Any = {"height": 0.5, "color": style.COLOURS[0], "zorder": 2, "label": "alone (first order), 95 %"}
        ax.barh(y, first.clip(min=0.0), **bar)
        if np.isfinite(low).any():
            ax.hlines(y, low, high, color=style.INK, lw=1.2, zorder=3)
        ax.set_xlim(0.0, None)
        ax.set_xlabel(f"share of the variance of {of_errors.quantity} [%]")

    largest = ", ".join(f"{row['error']} {100 * row['first']:.1f} %" for row in rows[:5])
    description = f"Largest first-order indices: {largest}; all errors alone {100 * facts['additive']:.0f} %"
    title, height = f"{of_errors.quantity}: share of the variance by error", drawing.rows_height(len(rows)) + 0.25
    key, names = f"tornado-{facts['load']}", [str(row["error"]) for row in rows]
    return Panel(key, title, description, draw, (drawing.WIDTH, height), rows=names)


def indices(view: View, by: str, logarithm: bool = False, joints: int | None = None) -> Indices:
    """Estimate what each error contributes to a load.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``).
    logarithm : bool
        Decompose the variance of the load's logarithm: for a load whose variance a few joints dominate.
    joints : int, optional
        Number of samples to use, from the first; by default all.

    Returns
    -------
    Indices

    Raises
    ------
    InputError
        When there is no such load, the study does not keep it, or `logarithm` is set and a value is not positive.
    StoreError
        When the file has too few valid joints, or joints that are not drawn from tolerances.
    """
    view.check_drawn()
    view.check()
    load = quantity(view, by)
    if joints is not None:
        load = load.only(np.arange(min(joints, view.n)))
    names, parts, variance = _of_samples(view, load, logarithm)
    first: Any = parts["first"]
    valid, level = load.valid, shares.tail_level(load)
    facts = {"load": load.name, "unit": load.unit, "logarithm": logarithm, "joints": valid.size}
    facts |= {"used": min(valid.size, MAX_JOINTS), "without_load": sum(load.unresolved)}
    facts |= {"level": level, "above": int((valid > level).sum()), "std": math.sqrt(variance)}
    facts |= shares.with_ends("additive", first.additive)
    facts["correlated"] = bool(view.study.copula.names)
    columns: dict[str, Any] = {"error": names}
    for kind in KINDS:
        estimates = parts[kind]._asdict() if kind in parts else {}
        keys = {"": "estimate", "_lower": "lower", "_upper": "upper"} | ({"_p": "p"} if kind in TAIL else {})
        for end, key in keys.items():
            columns[f"{kind}{end}"] = np.broadcast_to(estimates.get(key, np.nan), len(names)).tolist()
    return Indices(facts, sorted(shares.rows_of(columns), key=lambda row: -row["first"]))


def _of_samples(view: View, load: Sample, logarithm: bool) -> tuple[list[str], Parts, float]:
    """Names, estimates and variance from joints that are all drawn from the same tolerances."""
    study, independent, confidence = view.study, view.design.independent, view.design.level(CONFIDENCE)
    samples = np.flatnonzero(load.is_valid)
    values = load.values[samples]
    check_scatter(view, load)
    columns = sampling.columns(study)
    components = sampling.components(study, view.errors(samples[:MAX_JOINTS], columns))
    names = [name for name, values_of_error in components.items() if np.ptp(values_of_error) > 0]
    x = np.column_stack([components[name] for name in names])
    response = (_logarithm(load.name, values) if logarithm else values)[:MAX_JOINTS]
    parts: dict[str, NamedTuple] = {}
    first = sensitivity.first_order(x, response, confidence, independent)
    above = values > shares.tail_level(load)
    if ranks.FEWEST <= above.sum() <= above.size - ranks.FEWEST:
        chosen = np.sort(np.concatenate([np.flatnonzero(side)[:MAX_JOINTS] for side in (above, ~above)]))
        scores = sampling.normal_scores(study, view.errors(samples[chosen], columns))
        z = np.column_stack([scores[name] for name in names])
        parts |= ranks.tail(z, above[chosen], confidence, independent)._asdict()
    return names, parts | {"first": first}, float(first.variance)


def _logarithm(name: str, values: FloatArray) -> FloatArray:
    if np.nanmin(values, initial=np.inf) <= 0:
        remedy = "decompose the variance of the load itself, not of its logarithm"
        raise InputError([Fault(name, "is not positive in all joints", remedy)])
    return np.asarray(np.log(values))
