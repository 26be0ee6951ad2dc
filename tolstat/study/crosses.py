"""Measured joints: text tables with a column for each error that was measured and a row for each joint."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

from tolstat.common.columns import result_columns
from tolstat.common.error_fields import error_units, given_units
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import Mechanism, features
from tolstat.common.text_table import TextTable, number
from tolstat.study.axes import columns_of, zone_units
from tolstat.study.selection import excludes, halves, select, suggestion

_PART = re.compile(r"(?:.*\.)?(?:pin|hole)\d+")
"""Names of pins and holes, of which there may be others."""
_WORD = re.compile(r"[^\W\d_]+[\s_-]*\d*")
"""A word of a name, with its number."""
_CLOSE = 0.85
"""Similarity from which on a header is a misspelt error."""
_NAMES = {"name", "part", "joint", "cross", "serial", "id"}
"""Headers of a column that names joints; so does the first column, if it is no error."""


class Crosses(NamedTuple):
    """Errors of measured joints.

    Attributes
    ----------
    columns : dict of str to ndarray, (n,)
        Those that the table has, SI.
    labels : list of str
        Name of each joint, from the column that names them, else its line in the file; no two are the same.
    named : str
        Header of the column that names joints; empty without one.
    notes : list of str
        Columns that are left out, and how many errors were not measured.
    """

    columns: dict[str, FloatArray]
    labels: list[str]
    named: str
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
    known = {*results, *error_units(mechanism)}
    meant = {name: _meant(name, list(units), mechanism) for name in others if name not in known}
    if wrong := {name: remedy for name, remedy in meant.items() if remedy}:
        names, remedies = ", ".join(map(repr, wrong)), "; ".join(dict.fromkeys(wrong.values()))
        table.fault(table.head, "", f"has columns that are no errors: {names}", f"remove or rename them: {remedies}")
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
    named = _named(list(table.columns), others)
    left_out = [name for name in others if name not in (*results, named)]
    left_out += [f"{len(results)} of results"] * bool(results)
    notes = [f"columns left out: {', '.join(left_out)}"] if left_out else []
    told = {*columns, *(other for name in columns for other in excludes(mechanism).get(name, ()))}
    lacking = [name for name in _of_parts(mechanism) if name not in told]
    if given is not None and lacking:
        fixed = len(given.keys() & set(lacking))
        but = f", but for {fixed} of [errors]" if fixed else ""
        notes.append(f"{len(lacking)} error{'s' * (len(lacking) > 1)} not measured: taken as nominal{but}")
    return Crosses(columns, _labels(table, named), named, [f"{path}: {note}" for note in notes])


def _meant(header: str, names: Sequence[str], mechanism: Mechanism) -> str:
    """Remedy for a header that looks like an error and is none: what is meant; empty for any other header."""
    zones, plain = zone_units(mechanism), {_squeezed(name): name for name in names}
    if set(header) & set("*?[") and (selected := select(header, names)):
        return f"give a column for each of {', '.join(selected)}"
    if header in zones:
        return f"give {', '.join(columns_of(header))}"
    if inside := [name for name in names if _words(name) <= _words(header)]:
        return f"write {max(inside, key=len)!r} for {header!r}, and a unit in brackets"
    part = halves(header.casefold())[0]
    if "." in header and (part in {halves(name)[0] for name in zones} or _PART.fullmatch(part)):
        return suggestion(header, names)
    close = get_close_matches(_squeezed(header), plain, n=1, cutoff=_CLOSE)
    return f"did you mean {plain[close[0]]!r}?" if close else ""


def _squeezed(name: str) -> str:
    """Letters and digits of a name."""
    return "".join(sign for sign in name.casefold() if sign.isalnum())


def _words(name: str) -> set[str]:
    """Words of a name with their numbers, whatever stands between them: ``pin1``, ``tilt``, ``z``."""
    return {_squeezed(word) for word in _WORD.findall(name)}


def _named(headers: Sequence[str], others: Collection[str]) -> str:
    """Header of the column that names joints; empty without one."""
    by_name = [name for name in others if name.casefold() in _NAMES]
    return next(iter([*by_name, *(name for name in headers[:1] if name in others)]), "")


def _labels(table: TextTable, named: str) -> list[str]:
    """Name of each joint, see `Crosses`."""
    lines = [f"line {line}" for line, _ in table.rows]
    if not named:
        return lines
    cells = [row[table.columns[named]] for _, row in table.rows]
    names = [f"{named} {cell}" if not math.isnan(number(cell)) else cell for cell in cells]
    return [
        name if name and names.count(name) == 1 else f"{name} ({line})" if name else line
        for name, line in zip(names, lines, strict=True)
    ]


def _of_parts(mechanism: Mechanism) -> list[str]:
    """Errors of pins and holes that can be measured; a clearance follows from diameters."""
    parts = features(mechanism)
    return [name for name in given_units(mechanism) if halves(name)[0] in parts and not name.endswith(".clearance")]


def of_one(path: Path, mechanism: Mechanism, given: Mapping[str, float]) -> tuple[dict[str, float], list[str]]:
    """Errors of the only joint of a table, SI, and what there is to be said; see `read`."""
    table = read(path, mechanism, given_units(mechanism), given, single=True)
    return {name: float(values[0]) for name, values in table.columns.items()}, table.notes
