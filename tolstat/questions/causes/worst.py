"""The joints with the largest values of a load: their rows, to simulate them again, and their errors."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.common.columns import result_columns
from tolstat.common.errors import Fault, InputError, NotApplicable
from tolstat.common.loads import FloatArray, load_of, loads_of
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import SIMULATED, VALID, Status
from tolstat.display.answer import Answer, Asked, Column, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Load, Top
from tolstat.questions.shares import rows_of, value, word
from tolstat.store.view import View

ON_PAGE = 8
"""Number of worst joints of each load on the page."""
ERRORS = 2
"""Number of errors of each joint that people see."""
KEYS = ("load", "unit", "row", "value", "point", "status")
"""Keys of a row that are no errors."""


def worst(view: View, by: Load = None, top: Top = 10) -> Answer:
    """List the joints with the largest load and their errors.

    Gives load and row of each joint, and its largest errors in sigma: the standard normal score that has the same
    probability as the error in its own distribution; last, the command that simulates the first joint again. --by takes
    columns of the results too, such as revolutions.

    Example: tolstat worst iso2768_f.h5 --by cross1.F --top 20

    Parameters
    ----------
    view : View
        A campaign.
    by : str, optional
        Load, such as cross1.F or psi, or a column of the results; by default the one whose limit most joints exceed.
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
        Column("largest errors, in σ", _errors, words=True),
    )
    parts: list[Part] = [Table("joints", f"Joints with the largest {', '.join(loads)}", columns, rows)]
    if rows:
        at = f" --point {quote(rows[0]['point'])}" if rows[0]["point"] else ""
        command = f"tolstat replay {quote(str(view.path))} --row {rows[0]['row']}{at}"
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
        of the recorded revolution), ``point`` (with the largest value; empty where there is one only), ``status``, and
        by name each error that scatters, in sigma (`sampling.normal_scores`).

    Raises
    ------
    InputError
        When there is no such load, the study does not keep it, or the study cannot be read any more.
    StoreError
        When the study is not that of the file.
    """
    samples, values, unit = _largest(view, by, n)
    narrowed, name = view.narrowed(by)
    points = [narrowed.points[0]] * len(samples)
    if len(narrowed.parts) > 1:  # a load, whose largest value is at one of them
        each = np.stack([load_of(name, view.mechanism).of(part.results)[samples] for part in narrowed.parts])
        points = [narrowed.points[k] for k in np.argmax(each, axis=0)]
    columns = {"row": view.rows(samples).tolist(), "value": values.tolist(), "point": points}
    columns["status"] = [Status(status).label for status in view.status[samples]]
    return [{"load": by, "unit": unit} | row for row in rows_of(columns | _scores(view, samples))]


def largest_errors(row: Row) -> list[tuple[str, float]]:
    """Errors of a row of `joint_rows` in descending order of the modulus; equal ones as they come."""
    return sorted(((k, z) for k, z in row.items() if k not in KEYS), key=lambda item: -round(abs(item[1]), 9))


def _largest(view: View, by: str, n: int) -> tuple[NDArray[np.intp], FloatArray, str]:
    """Samples of the `n` joints with the largest values, the largest first; these values, and their unit."""
    view, name = view.narrowed(by)
    columns = {column.name: column for column in view.columns}
    if name in view.kept_loads:
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
    samples = np.flatnonzero(np.isin(view.status, SIMULATED) & np.isfinite(values))
    samples = samples[np.argsort(-values[samples], kind="stable")][:n]
    return samples, values[samples], unit


def _scores(view: View, samples: NDArray[np.intp]) -> dict[str, list[float]]:
    """Each error that scatters, of some joints, in sigma."""
    ascending, order = np.unique(samples, return_inverse=True)
    errors = view.errors(ascending, sampling.columns(view.study))[order]
    return {name: z.tolist() for name, z in sampling.normal_scores(view.study, errors).items()}


def _errors(row: Row) -> str:
    return ",  ".join(f"{name} {z:+.1f}" for name, z in largest_errors(row)[:ERRORS])
