"""The joints with the largest values of a load: their errors, and their loads over the revolution."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from shlex import quote

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.common.channels import CHANNELS, histories_of
from tolstat.common.columns import RESULT_COLUMNS
from tolstat.common.errors import Fault, InputError, NotApplicable, TolstatError
from tolstat.common.loads import LOADS, FloatArray, unit_text
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import SIMULATED, VALID, Status
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Load, Top
from tolstat.questions.causes import angles
from tolstat.questions.shares import rows_of, value, word
from tolstat.store import revolutions
from tolstat.store.view import View

ON_PAGE = 8
"""Number of worst joints of each load on the page."""
DRAWN = 3
"""Number of the worst joints drawn for each load."""
ANGLES = 180
"""Number of input angles drawn, if the histories have as many samples."""
ERRORS = ("largest error in σ", "second", "third", "fourth", "fifth")
"""Heads of the columns of the largest errors of a joint."""
ERRORS_ON_PAGE = 4
"""Number of errors of each joint on the page."""
KEYS = ("load", "unit", "row", "value", "point", "status")
"""Keys of a row that are no errors."""
ROW = Column("row", word("row"))
WHERE = (
    Column("at", word("point"), words=True, shown=lambda rows: any(row["point"] for row in rows)),
    Column("status", word("status"), words=True),
)
"""Operating point and status of a joint."""


def worst(view: View, by: Load = None, top: Top = 10) -> Answer:
    """List the joints with the largest load and their errors.

    Gives row, load and status of each joint, and its largest errors in sigma: the standard normal score that has the
    same probability as the error in its own distribution. --by takes columns of the results too, such as revolutions.

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
    load = by or view.most_exceeded
    rows = joint_rows(view, load, top)
    unit = rows[0]["unit"] if rows else "1"
    columns = [
        ROW,
        Column(f"{load} [{unit}]" if unit != "1" else load, lambda row: f"{row['value']:.6g}"),
        *WHERE,
        *(Column(head, partial(_error, rank=i), True, rank=i) for i, head in enumerate(ERRORS)),
    ]
    parts: list[Part] = [Table("joints", f"Joints with the largest {load}", columns, rows)]
    if rows:
        at = f" --point {quote(rows[0]['point'])}" if rows[0]["point"] else ""
        command = f"tolstat replay {quote(str(view.path))} --row {rows[0]['row']}{at} --out trace.csv"
        parts.append(Sentence(f"next: {command}"))
    return Answer("worst", "The worst joints", parts, {"by": load, "unit": unit})


def worst_on_page(view: View, asked: Asked) -> Answer:
    """The worst joints of the leading loads, and their loads over the revolution."""
    if view.method == "sweep" or not view.count(*VALID) or not view.leading:
        raise NotApplicable
    rows = [row for load in view.leading for row in joint_rows(view, load, ON_PAGE)]
    followed = [load for load in view.leading if load in CHANNELS and asked.replay and len(view.points) == 1]
    spreads: dict[str, tuple[FloatArray, FloatArray]] = {}
    with suppress(TolstatError):  # which `angles` notes
        spreads = angles.spreads(view, followed, asked.replay) if followed else {}
    panels = [_panel(view, [row for row in rows if row["load"] == load], spreads.get(load)) for load in followed]
    columns = [
        Column("load", word("load")),
        ROW,
        Column("largest", value("value")),
        *WHERE,
        Column("largest errors, in standard deviations", _errors, words=True),
    ]
    at = " --point POINT" if len(view.points) > 1 else ""
    command = f"tolstat replay {quote(view.path.name)} --row ROW{at} --out trace.csv"
    parts: list[Part] = [Panels(panels)] if panels else []
    parts.append(Table("joints", "Joints with the largest leading loads", columns, rows))
    parts.append(Sentence(f"to simulate one of them again: {command}, with its number for ROW"))
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
        each = np.stack([LOADS[name].of(part.results)[samples] for part in narrowed.parts])
        points = [narrowed.points[k] for k in np.argmax(each, axis=0)]
    columns = {"row": view.rows(samples).tolist(), "value": values.tolist(), "point": points}
    columns["status"] = [Status(status).label for status in view.status[samples]]
    return [{"load": by, "unit": unit} | row for row in rows_of(columns | _scores(view, samples))]


def begin_replay(view: View, asked: Asked) -> None:
    """Begin to simulate again the joints whose loads over the revolution the page shows; see `revolutions.ahead`."""
    if not asked.replay or len(view.points) > 1 or view.method == "sweep":
        return
    with suppress(TolstatError):  # the questions say what is wrong
        followed = [load for load in view.leading if load in CHANNELS]
        slots = [view.slots(np.sort(drawn(view, load))) for load in followed]
        if slots and not revolutions.held(view.store, histories_of(followed)):
            with suppress(TolstatError):
                nominal, samples = angles.evaluated(view, asked.replay)
                slots += [nominal, view.slots(samples)]
            revolutions.ahead(view.store, np.unique(np.concatenate(slots)), asked.processes)


def drawn(view: View, load: str) -> NDArray[np.intp]:
    """Samples of the worst joints whose loads over the revolution are drawn, the largest load first."""
    return _largest(view, load, DRAWN)[0]


def largest_errors(row: Row) -> list[tuple[str, float]]:
    """Errors of a row of `joint_rows` in descending order of the modulus; equal ones as they come."""
    return sorted(((k, z) for k, z in row.items() if k not in KEYS), key=lambda item: -round(abs(item[1]), 9))


def _largest(view: View, by: str, n: int) -> tuple[NDArray[np.intp], FloatArray, str]:
    """Samples of the `n` joints with the largest values, the largest first; these values, and their unit."""
    view, name = view.narrowed(by)
    columns = {column.name: column for column in view.columns}
    if name in view.kept_loads:
        values, unit = LOADS[name].of(view.results), LOADS[name].unit
    elif name in columns:
        column = columns[name]
        values, unit = column.of(view.read_results([column.field])).astype(np.float64), str(column.unit)
    else:
        known = [*view.kept_loads, *columns]
        if name in LOADS or name in [column.name for column in RESULT_COLUMNS]:
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


def _error(row: Row, rank: int) -> str:
    errors = largest_errors(row)
    return f"{errors[rank][0]} {errors[rank][1]:+.2f}" if rank < len(errors) else "-"


def _errors(row: Row) -> str:
    return ",  ".join(f"{name} {z:+.1f} σ" for name, z in largest_errors(row)[:ERRORS_ON_PAGE])


def _panel(view: View, rows: Rows, spread: tuple[FloatArray, FloatArray] | None) -> Panel:
    load, rows = rows[0]["load"], rows[:DRAWN]
    ascending, order = np.unique(drawn(view, load), return_inverse=True)
    histories = revolutions.read(view.store, view.slots(ascending), [load], ANGLES)
    lines = {f"row {row['row']}": line for row, line in zip(rows, histories.loads[load][order], strict=True)}
    highest = ", ".join(f"row {row['row']} up to {text.value(row['value'], row['unit'])}" for row in rows)
    limit = view.limits.get(load)

    def draw(ax: Axes) -> None:
        degrees = angles.theta_axis(ax, histories.angles)
        for i, (label, line) in enumerate(lines.items()):
            ax.plot(degrees, angles.closed(line), color=style.COLOURS[i], ls=style.DASHES[i], lw=1.3, label=label)
        if spread is not None:
            low, _, high = angles.closed(spread[1])
            around = angles.theta_axis(ax, spread[0])
            ax.fill_between(around, low, high, color=style.FAINT, alpha=0.25, lw=0, label="5 to 95 %")
        if limit is not None:
            ax.axhline(limit, color=style.INK, lw=1.2, ls=(0.0, (8.0, 3.0)), label="limit")
        top = 1.05 * np.nanmax([*(line.max() for line in lines.values()), limit or 0.0])
        ax.set(ylabel=f"|{load}| [{unit_text(rows[0]['unit'])}]", ylim=(0.0, top))

    title, words = f"{load} of the worst joints over the revolution", f"Histories of the worst joints: {highest}"
    return Panel(f"worst-{load}", title, words, draw, (drawing.WIDTH, 3.3))
