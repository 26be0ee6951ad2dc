"""Heat of the bearings: power that friction takes, and the efficiency of the joint."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tolstat.common.load_kinds import kinds
from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Row, Rows, Sentence, Table, has
from tolstat.questions.shares import Cell, inapplicable, word
from tolstat.store.view import View


def _cell(key: str) -> Cell:
    """Make a `Column.cell` of a power, or of an efficiency in per cent."""
    return lambda row: f"{100.0 * row[key]:.3f} %" if row["unit"] == "1" else text.value(row[key], row["unit"])


def _has_points(rows: Rows) -> bool:
    return any(row["point"] for row in rows)


COLUMNS = (
    Column("operating point", word("point"), shown=_has_points),
    Column("of", word("of")),
    Column("nominal joint", _cell("nominal"), shown=has("nominal")),
    Column("median", _cell("median")),
    Column("95 % are better than", _cell("bound")),
)
MEANING = (
    "Loss: power that friction turns into heat, mean over a revolution. Efficiency: 1 - loss/(mean driving power); the "
    "mean driving power is the loss and the mean torque times the mean speed of the output shaft"
)
LEFT_OUT = (
    "Left out of the efficiency: that torque and speed swing together; damping of bushings and contacts, the oil film, "
    "seals, friction on thrust faces and in a spline"
)


def heat(view: View) -> Answer:
    """Estimate the power that friction takes, and the efficiency.

    Parameters
    ----------
    view : View
        A campaign whose joints have friction.

    Returns
    -------
    Answer
        Table ``heat``, at each operating point one row for the loss of all bearings, one for that of each pin's bearing
        and one for the efficiency: ``point``, ``of``, ``load`` (empty for the efficiency), ``unit`` (W or 1),
        ``nominal`` (NaN without a nominal joint), ``median``, and ``bound``, which 95 % of the joints are better than.

    Raises
    ------
    NotApplicable
        When the joints have no friction, the study keeps no loss, or no joint has a valid result.
    """
    if "loss" not in view.kept_loads or not view.count(*VALID):
        remedy = "give the joint friction.mu, and let [output] results of the study keep the losses"
        raise inapplicable(view, "holds no losses of valid joints", remedy)
    rows: Rows = [
        {"point": part.points[0], **row} for part in view.parts for row in (*_losses(part), _efficiency(part))
    ]
    table = Table("heat", "Loss and efficiency", COLUMNS, rows)
    return Answer("heat", "Heat of the bearings", [table, Sentence(MEANING), Sentence(LEFT_OUT)])


def _losses(view: View) -> Iterator[Row]:
    """Rows of the losses at one operating point, that of all bearings first."""
    names = [name for _, name in kinds(view.mechanism)["loss"].loads() if name in view.kept_loads]
    for name in sorted(names, key=lambda name: name != "loss"):
        load = view.load(name)
        of = "loss of all bearings" if name == "loss" else f"loss of the bearing of {name.removesuffix('.loss')}"
        row = {"of": of, "load": name, "unit": load.unit, "nominal": load.nominal}
        yield row | {"median": load.quantile(0.5).estimate, "bound": load.quantile(0.95).estimate}


def _efficiency(view: View) -> Row:
    """Row of the efficiency at one operating point."""
    loss, means = view.load("loss"), view.store.points[view.points[0]].operation
    blocks = view.error_blocks(["operation.torque", "operation.speed"])
    power = np.concatenate(
        [(means.torque + each["operation.torque"]) * (means.speed + each["operation.speed"]) for each in blocks]
    )
    valid = np.isin(view.status, [int(state) for state in VALID])
    every = 1.0 / (1.0 + loss.values[valid] / np.abs(power[valid]))
    nominal = 1.0 / (1.0 + loss.nominal / abs(means.torque * means.speed)) if means.torque else 0.0
    ends = {"median": float(np.median(every)), "bound": float(np.quantile(every, 0.05))}
    return {"of": "efficiency", "load": "", "unit": "1", "nominal": nominal} | ends
