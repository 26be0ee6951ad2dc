"""The joints with the largest values of a load: their rows, to simulate them again, and their errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis.binomial import half_width
from tolstat.analysis.ranks import ranks
from tolstat.analysis.sensitivity import FEWEST
from tolstat.common.columns import result_columns
from tolstat.common.errors import Fault, InputError, NotApplicable
from tolstat.common.loads import FloatArray, load_of, loads_of
from tolstat.common.shell import quote
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import SIMULATED, VALID, Status
from tolstat.display.answer import Answer, Asked, Column, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Load, Top
from tolstat.questions import is_computed, quantity
from tolstat.questions.shares import rows_of, value, word
from tolstat.store.view import View

ON_PAGE = 8
"""Number of worst joints of each load on the page."""
ERRORS = 2
"""Number of errors of each joint that people see."""
KEYS = ("load", "unit", "row", "value", "point", "status", "raised_by")
"""Keys of a row that are no errors."""
MOST = 20_000
"""Maximum number of joints (the first ones) that tell what moves the load."""
LEAST_EFFECT = 0.2
"""Smallest effect of an error that raises a load, in standard deviations of the load's ranks."""
NOTES = {
    True: "errors: first those that raise the load most there, by their correlation with it; then the largest ones",
    False: "errors: the largest ones; the joints do not tell which errors move the load",
}
"""Order of the errors of a joint, by whether correlations are known."""


def worst(view: View, by: Load = None, top: Top = 10) -> Answer:
    """List the joints with the largest load and their errors.

    Gives load and row of each joint, and errors in sigma: the standard normal score that has the same probability as
    the error in its own distribution. First come errors that raise the load most, as far as the joints tell, then the
    largest ones. Last, the command that simulates the first joint again. --by takes columns of the results too, such as
    revolutions.

    Example: tolstat worst iso2768_f.h5 --by cross1.F --top 20

    Parameters
    ----------
    view : View
        A campaign.
    by : str, optional
        Load, such as cross1.F or psi, a column of the results, or over the duty cycle "life", "life pin1" or
        "damage cross1.F_t"; by default the load whose limit most joints exceed.
    top : int
        Number of joints to list.

    Returns
    -------
    Answer
        Table ``joints``, see `joint_rows`.

    Raises
    ------
    InputError
        When there is no such load, the study does not keep it, or the study cannot be read any more.
    StoreError
        When the study is not that of the file.
    """
    return _answer(view, [by or view.most_exceeded], top)


def worst_on_page(view: View, asked: Asked) -> Answer:
    """The worst joints of the leading loads."""
    if view.method == "sweep" or not view.count(*VALID) or not view.leading:
        raise NotApplicable
    return _answer(view, view.leading, ON_PAGE)


def _answer(view: View, loads: Sequence[str], n: int) -> Answer:
    rows = [row for load in loads for row in joint_rows(view, load, n)]
    columns = (
        Column("load", word("load")),
        Column("largest", value("value")),
        Column("row", word("row")),
        Column("at", word("point"), words=True, shown=lambda rows: any(row["point"] for row in rows)),
        Column("status", word("status"), True, lambda rows: any(row["status"] != Status.OK.label for row in rows)),
        Column("errors, in σ", _errors, words=True),
    )
    parts: list[Part] = [Table("joints", f"Joints with the largest {', '.join(loads)}", columns, rows)]
    if rows:
        point = rows[0]["point"] or view.points[0]
        at = f" --point {quote(point)}" if point else ""
        command = f"tolstat replay {quote(str(view.path))} --row {rows[0]['row']}{at}"
        if ordered(rows[0]):
            parts.append(Sentence(NOTES[any(row["raised_by"] for row in rows)]))
        parts.append(Sentence(f"the first one again: {command}"))
    return Answer("worst", "The worst joints", parts)


def joint_rows(view: View, by: str, n: int = 10) -> Rows:
    """Joints with the largest load.

    Parameters
    ----------
    view : View
        A campaign.
    by : str
        A load that can have a limit (``cross1.F``, ``pin2.contact``, ``psi``), or a column of the results; of some
        operating points ``cross1.F at cruise``.
    n : int
        Maximum number of joints.

    Returns
    -------
    sequence of mapping
        At most `n` joints that have results; the nominal joint is not among them, and equal loads come in the order
        of their rows. ``load``, ``unit``, ``row`` of the campaign, ``value`` (SI; of a joint that is not settled that
        of the recorded revolution), ``point`` (with the largest value; empty where there is one only), ``status``,
        ``raised_by``, names of the errors that raise the load there by what the joints tell (see `_raising`), the
        largest effect first, and by name each error that scatters, in sigma (`sampling.normal_scores`).

    Raises
    ------
    InputError
        When there is no such load, the study does not keep it, or the study cannot be read any more.
    StoreError
        When the study is not that of the file.
    """
    samples, values, unit = _largest(view, by, n)
    narrowed, name = _narrowed(view, by)
    points = ["" if is_computed(by) else narrowed.points[0]] * len(samples)
    if len(narrowed.parts) > 1 and not is_computed(by):  # a load, whose largest value is at one of them
        each = np.stack([load_of(name, view.mechanism).of(part.results)[samples] for part in narrowed.parts])
        points = [narrowed.points[k] for k in np.argmax(each, axis=0)]
    columns = {"row": view.rows(samples).tolist(), "value": values.tolist(), "point": points}
    columns["status"] = [Status(status).label for status in view.status[samples]]
    scores = _scores(view, samples)
    columns["raised_by"] = [", ".join(names) for names in _raising(narrowed, name, samples, scores)]
    told = quantity(view, by).name if is_computed(by) else by
    return [{"load": told, "unit": unit} | row for row in rows_of(columns | scores)]


def ordered(row: Row) -> list[tuple[str, float]]:
    """Errors of a row of `joint_rows`: those that raise the load, then others in descending order of the modulus."""
    first = row["raised_by"].split(", ")

    def order(item: tuple[str, float]) -> tuple[int, float]:
        return first.index(item[0]) if item[0] in first else len(first), -round(abs(item[1]), 9)

    return sorted(((k, z) for k, z in row.items() if k not in KEYS), key=order)


def _raising(
    view: View, name: str, samples: NDArray[np.intp], scores: Mapping[str, Sequence[float]]
) -> list[list[str]]:
    """Errors that raise the load of some joints, of each joint, the largest effect first.

    Over the joints of a campaign, the ranks of the load are correlated with each score z and with its distance |z| from
    the middle. Correlations that chance explains (at 5 % for all of them together) are left out; the effect in a joint
    is the sum of correlation times standardised z and standardised |z|, at least `LEAST_EFFECT`.
    """
    all_samples, values, _ = _with_values(view, name)
    used = np.sort(all_samples)[:MOST]
    if view.method != "random" or used.size < FEWEST or not scores:
        return [[] for _ in samples]
    names, every = list(scores), _scores(view, used)
    z, here = (np.column_stack([columns[key] for key in names]) for columns in (every, scores))
    load = ranks(values[used][:, None])[:, 0]
    effects = np.zeros(here.shape)
    for of_all, of_joint in ((z, here), (np.abs(z), np.abs(here))):
        middle, spread = of_all.mean(axis=0), of_all.std(axis=0)
        spread[spread == 0.0] = np.inf
        standard, response = (of_all - middle) / spread, (load - load.mean()) / max(load.std(), 1e-300)
        correlation = standard.T @ response / used.size
        correlation[np.abs(correlation) < half_width(1.0 - 0.05 / (2 * len(names))) / np.sqrt(used.size)] = 0.0
        effects += correlation * (of_joint - middle) / spread
    return [[names[k] for k in np.argsort(-row, kind="stable") if row[k] > LEAST_EFFECT] for row in effects]


def _largest(view: View, by: str, n: int) -> tuple[NDArray[np.intp], FloatArray, str]:
    """Samples of the `n` joints with the largest values, the largest first; these values, and their unit."""
    samples, values, unit = _with_values(*_narrowed(view, by))
    samples = samples[np.argsort(-values[samples], kind="stable")][:n]
    return samples, values[samples], unit


def _narrowed(view: View, by: str) -> tuple[View, str]:
    """View of the points that a load names, and its plain name; what a question computes is of the duty cycle."""
    return (view, by) if is_computed(by) else view.narrowed(by)


def _with_values(view: View, name: str) -> tuple[NDArray[np.intp], FloatArray, str]:
    """Samples of the joints that have a value, the values of all joints, and their unit."""
    columns = {column.name: column for column in view.columns}
    if is_computed(name):
        computed = quantity(view, name)
        values, unit = computed.values, computed.unit
    elif name in view.kept_loads:
        load = load_of(name, view.mechanism)
        values, unit = load.of(view.results), load.unit
    elif name in columns:
        column = columns[name]
        values, unit = column.of(view.read_results([column.field])).astype(np.float64), str(column.unit)
    else:
        known = [*view.kept_loads, *columns]
        if name in loads_of(view.mechanism) or name in [column.name for column in result_columns(view.mechanism)]:
            lacking = f"is not kept in {view.path}, see [output] results of its study"
            raise InputError([Fault(name, lacking, f"give one of: {', '.join(known)}")])
        raise InputError([Fault(name, "is neither a load nor a column of the results", did_you_mean(name, known))])
    return np.flatnonzero(np.isin(view.status, SIMULATED) & np.isfinite(values)), values, unit


def _scores(view: View, samples: NDArray[np.intp]) -> dict[str, list[float]]:
    """Each error that scatters, of some joints, in sigma."""
    ascending, order = np.unique(samples, return_inverse=True)
    errors = view.errors(ascending, sampling.columns(view.study))[order]
    return {name: z.tolist() for name, z in sampling.normal_scores(view.study, errors).items()}


def _errors(row: Row) -> str:
    return ",  ".join(f"{name} {z:+.1f}" for name, z in ordered(row)[:ERRORS])
