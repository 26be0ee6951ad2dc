"""Measured joints: text tables with a column for each error that was measured and a row for each joint."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from tolstat.common.columns import result_columns
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import Mechanism, features
from tolstat.common.text_table import TextTable
from tolstat.study.axes import columns_of, zone_units
from tolstat.study.selection import error_units, excludes, given_units, halves, suggestion

_PART = re.compile(r"(?:.*\.)?(?:pin|hole)\d+")
"""Names of pins and holes, of which there may be others."""


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
    given: Mapping[str, float] | None,
    needed: Collection[str] = (),
    single: bool = False,
) -> Crosses:
    """Read a table of measured joints.

    Parameters
    ----------
    path : Path
        Text table; its header has names of errors. Columns without a unit are in SI units unless it is of a `single`
        joint, which needs units.
    mechanism : Mechanism
        What the joints are.
    units : mapping of str to str
        SI unit of each column that is read if there is one of this name.
    given : mapping of str to float, optional
        Errors that joints have without a column; others are nominal. None where the columns are no errors.
    needed : collection of str
        Columns that must be there.
    single : bool
        Whether it has one row.

    Raises
    ------
    InputError
        With every fault of the file: columns that look like errors and are none, or contradict each other; no column of
        an error; cells.
    """
    table = TextTable(path)
    columns = table.numbers(units, list(needed), 1, None if single else units)
    others = [name for name in table.columns if name not in columns]
    results = [name for name in others if name in {column.name for column in result_columns(mechanism)}]
    zones = zone_units(mechanism)
    known, parts = {*results, *error_units(mechanism)}, {halves(name)[0] for name in zones}
    part_of = {name: halves(name.casefold())[0] for name in others if "." in name and name not in known}
    if wrong := [name for name, part in part_of.items() if part in parts or _PART.fullmatch(part)]:
        instead = f"give {', '.join(columns_of(wrong[0]))}" if wrong[0] in zones else suggestion(wrong[0], list(units))
        names = ", ".join(map(repr, wrong))
        table.fault(table.head, "", f"has columns that are no errors: {names}", f"remove or rename them: {instead}")
    elif not columns and not needed:
        remedy = f"write names such as {next(iter(units))}; there are {', '.join(others) or 'none'}"
        table.fault(table.head, "", "has no column of an error", remedy)
    not_zero = {name for name, values in columns.items() if values.any()}
    for name, diameters in excludes(mechanism).items():
        if name.endswith(".clearance") and name in not_zero and (beside := sorted(not_zero & set(diameters))):
            table.fault(table.head, name, f"is given beside {' and '.join(beside)}", "remove one or the other")
    if single and len(table.rows) > 1:
        table.fault(table.rows[1][0], "", "is a second joint", "give one row a file, or all to: tolstat evaluate STUDY")
    table.check()
    left_out = [name for name in others if name not in results] + [f"{len(results)} of results"] * bool(results)
    notes = [f"columns left out: {', '.join(left_out)}"] if left_out else []
    told = {*columns, *(other for name in columns for other in excludes(mechanism).get(name, ()))}
    lacking = [name for name in _of_parts(mechanism) if name not in told]
    if given is not None and lacking:
        fixed = len(given.keys() & set(lacking))
        but = f", but for {fixed} of [errors]" if fixed else ""
        notes.append(f"{len(lacking)} error{'s' * (len(lacking) > 1)} not measured: taken as nominal{but}")
    return Crosses(columns, [line for line, _ in table.rows], [f"{path}: {note}" for note in notes])


def _of_parts(mechanism: Mechanism) -> list[str]:
    """Errors of pins and holes that can be measured; a clearance follows from diameters."""
    parts = features(mechanism)
    return [name for name in given_units(mechanism) if halves(name)[0] in parts and not name.endswith(".clearance")]


def of_one(path: Path, mechanism: Mechanism, given: Mapping[str, float]) -> tuple[dict[str, float], list[str]]:
    """Errors of the only joint of a table, SI, and what there is to be said; see `read`."""
    columns, _, notes = read(path, mechanism, given_units(mechanism), given, single=True)
    return {name: float(values[0]) for name, values in columns.items()}, notes
