"""Measured joints: text tables with a column for each error that was measured and a row for each joint."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from tolstat.common.columns import result_columns
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import Mechanism, features
from tolstat.common.text_table import TextTable
from tolstat.study.axes import columns_of, zone_units
from tolstat.study.selection import error_units, excludes, given_units, halves, suggestion


class Crosses(NamedTuple):
    """Errors of measured joints.

    Attributes
    ----------
    columns : dict of str to ndarray, (n,)
        Those that the table has, SI.
    lines : list of int
        Line of each joint in the file.
    notes : list of str
        Columns that are left out, and how many errors were not measured.
    """

    columns: dict[str, FloatArray]
    lines: list[int]
    notes: list[str]


def read(
    path: Path,
    mechanism: Mechanism,
    units: Mapping[str, str],
    varied: Collection[str],
    needed: Collection[str] = (),
    most: int | None = None,
) -> Crosses:
    """Read a table of measured joints.

    Parameters
    ----------
    path : Path
        Text table; its header has names of errors. Columns without a unit are in SI units.
    mechanism : Mechanism
        What the joints are.
    units : mapping of str to str
        SI unit of each column that is read if there is one of this name.
    varied : collection of str
        Errors that are named as not measured where they have no column.
    needed : collection of str
        Columns that must be there.
    most : int, optional
        Maximum number of joints.

    Raises
    ------
    InputError
        With every fault of the file: no column of an error, columns that look like errors and are none, cells.
    """
    table = TextTable(path)
    columns = table.numbers(units, list(needed), 1, units)
    others = [name for name in table.columns if name not in columns]
    results = [name for name in others if name in {column.name for column in result_columns(mechanism)}]
    zones, known = zone_units(mechanism), {*results, *error_units(mechanism)}
    features = {halves(name)[0] for name in zones}
    if wrong := [name for name in others if halves(name)[0] in features and halves(name)[1] and name not in known]:
        first = wrong[0]
        instead = f"give {', '.join(columns_of(first))}" if first in zones else suggestion(first, list(units))
        found = f"has {', '.join(map(repr, wrong))}, which {'is no error' if len(wrong) == 1 else 'are no errors'}"
        table.fault(table.head, "", found, f"{instead}; or remove the column{'s' * (len(wrong) > 1)}")
    if not needed and not wrong and not columns:
        example, there = next(iter(varied), next(iter(units))), ", ".join(table.columns) or "none"
        table.fault(table.head, "", "has no column of an error", f"write names such as {example}; there are {there}")
    if most is not None and len(table.rows) > most:
        table.fault(table.rows[most][0], "", f"has more than {most} row below the header", "give one row a file")
    table.check()
    left_out = [name for name in others if name not in results] + [f"{len(results)} of results"] * bool(results)
    notes = [f"columns left out: {', '.join(left_out)}"] if left_out else []
    instead_of = {name for column in columns for name in excludes(mechanism).get(column, ())}
    if lacking := len(set(varied) - columns.keys() - instead_of):
        notes.append(f"{lacking} error{'s' * (lacking > 1)} not measured: taken as nominal")
    return Crosses(columns, [line for line, _ in table.rows], [f"{path}: {note}" for note in notes])


def of_one(path: Path, mechanism: Mechanism) -> tuple[dict[str, float], list[str]]:
    """Errors of the only joint of a table, SI, and what there is to be said; see `read`."""
    units = given_units(mechanism)
    of_parts = [name for name in units if halves(name)[0] in features(mechanism) and not name.endswith(".clearance")]
    columns, _, notes = read(path, mechanism, units, of_parts, most=1)
    return {name: float(values[0]) for name, values in columns.items()}, notes
