"""Heat of the bearings: power that friction takes, and the efficiency of the joint."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tolstat.common.load_kinds import kinds
from tolstat.common.loads import FloatArray
from tolstat.common.tables import VALID
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Row, Rows, Sentence, Table, has
from tolstat.questions.shares import Cell, inapplicable, word
from tolstat.store.view import View


def _cell(key: str) -> Cell:
    """Make a `Column.cell` of a power, or of an efficiency in per cent; NaN gives a dash."""

    def cell(row: Row) -> str:
        is_share = row["unit"] == "1" and not np.isnan(row[key])
        return f"{100.0 * row[key]:.3f} %" if is_share else text.value(row[key], row["unit"])

    return cell


COLUMNS = (
    Column("operating point", word("point"), shown=lambda rows: any(row["point"] for row in rows)),
    Column("of", word("of")),
    Column("nominal joint", _cell("nominal"), shown=has("nominal")),
    Column("median", _cell("median")),
    Column("95 % are better than", _cell("bound")),
)
MEANING = (
    "Loss: power that friction turns into heat, mean over a revolution. Efficiency: 1 - loss/(mean driving power), not "
    "below zero; the mean driving power is the loss and the mean torque times the mean speed of the output shaft, or "
    "that product alone where the output shaft drives. No torque: none"
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
        ``nominal`` (NaN without a nominal joint), ``median``, and ``bound``, which 95 % of the joints are better than;
        an efficiency is NaN where no torque is transmitted.

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
    every = _share_left(loss.values[valid], power[valid])
    nominal = _share_left(np.array(loss.nominal), np.array(means.torque * means.speed))
    ends = {"median": float(np.median(every)), "bound": float(np.quantile(every, 0.05))}
    return {"of": "efficiency", "load": "", "unit": "1", "nominal": float(nominal)} | ends


def _share_left(loss: FloatArray, power: FloatArray) -> FloatArray:
    """Efficiency with which joints transmit a mean power of the output shaft, W; below zero, that shaft drives."""
    driving = np.where(power > 0.0, power + loss, -power)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(power == 0.0, np.nan, np.maximum(1.0 - loss / driving, 0.0))
