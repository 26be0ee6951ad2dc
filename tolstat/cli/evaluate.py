"""``tolstat evaluate``: loads of joints whose errors another program gives as CSV."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tolstat.cli._library import function, load_units, np, strict, studies, tables, text, units
from tolstat.cli._shared import say, work, write
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import check_target
from tolstat.display.options import Opt, SimulatedPath, Workers

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAX_FAULTS = 20
"""Most faults of a table that a message lists."""


def evaluate(
    study: SimulatedPath,
    *,
    errors: Annotated[Path, Opt("CSV", name="in")],
    out: Annotated[str, Opt("CSV", writes=True)],
    loads: Annotated[list[str] | None, Opt("LOAD", name="load")] = None,
    uniform: bool = False,
    point: Annotated[str, Opt("POINT")] = "",
    workers: Workers = None,
) -> None:
    """Simulate joints whose errors another program gives.

    The first line of the CSV file has the names of the errors that STUDY draws, in any order; the second their units,
    or SI units hold. Other columns are left out. The output has a row for each joint in the same order: its status,
    then its loads, with the names in the first line and the units in the second. A load is empty where a joint has
    none.

    Example: tolstat evaluate studies/iso2768_f.toml --in joints.csv --out y.csv

    Parameters
    ----------
    errors : Path
        Errors of the joints, for example joints.csv of tolstat export.
    out : str
        Loads of the joints; - for standard output.
    loads : list of str, optional
        Load or pattern, such as cross*.F; repeatable; default: those with limits.
    uniform : bool
        The columns are points of the unit cube, from which errors are drawn as in a campaign.
    point : str
        Operating point, such as cruise; needed if STUDY has several.
    """
    if out != "-":
        check_target(Path(out), errors)
    f = function.function(studies.load(study), loads, point=point, workers=workers)
    si = {field.name: "1" if uniform else field.unit for field in tables.ERROR_FIELDS}
    given = read_table(errors, {name: si.get(name, "1") for name in (f.cube_names if uniform else f.names)})
    with work(workers=workers) as shown:
        shown.display.stage("simulation")
        y = f(f.uniform(given) if uniform else given)
    head = [["status", *f.loads], ["", *(load_units.UNIT_OF_LOAD[name] for name in f.loads)]]
    rows = text.csv_rows([[tables.Status(number).label for number in f.status], *y.T.tolist()])
    write(out, lambda stream: csv.writer(stream, lineterminator="\n").writerows([*head, *rows]))
    without = int((~np.isin(f.status, tables.VALID)).sum())
    say(f"{'' if out == '-' else f'wrote {out}: '}{len(y)} joints, {without} of them without a valid load")


def read_table(path: Path, names: Mapping[str, str]) -> NDArray[np.float64]:
    """Read columns of a CSV file: names in the first line, and units in the second if a cell of it is no number.

    Parameters
    ----------
    path : Path
        The file.
    names : mapping of str to str
        Columns to read, and the SI unit of each; others are left out.

    Returns
    -------
    ndarray, (n, len(names))
        SI.

    Raises
    ------
    InputError
        With the faults of the file: columns that it lacks or has twice, units, cells that are no finite numbers.
    """
    lines = csv.reader(StringIO(strict.read_text(path), newline=""))
    rows = [(lines.line_num, [cell.strip() for cell in row]) for row in lines if any(cell.strip() for cell in row)]
    head = rows.pop(0)[1] if rows else []
    faults = []
    for name in names:
        if head.count(name) != 1:
            number = "more than one" if name in head else "no"
            faults.append(Fault(f"{path}:1", f"{number} column {name!r}", "give one for each error"))
    columns = {name: head.index(name) for name in names if name in head}
    for line, cells in rows:
        if len(cells) != len(head):
            length = f"has {len(cells)} cells, the first line {len(head)}"
            faults.append(Fault(f"{path}:{line}", length, "give a cell for each column"))
    rows = [(line, cells) for line, cells in rows if len(cells) == len(head)]
    factors = dict.fromkeys(columns, 1.0)
    if rows and not all(is_number(rows[0][1][column]) for column in columns.values()):
        line, cells = rows.pop(0)
        for name, column in columns.items():
            unit = cells[column]
            try:
                factors[name] = units.to_si(f"1 {unit}" if unit not in ("", "1") else 1.0, names[name])
            except ValueError:
                remedy = f"write {names[name]}, or another such unit"
                faults.append(Fault(f"{path}:{line}: {name}", f"{unit!r} is no unit of it", remedy))
    if not rows and not faults:
        faults.append(Fault(str(path), "has no joints", "give a row of numbers for each"))
    table = np.empty((len(rows), len(names)))
    for i, (line, cells) in enumerate(rows):
        for j, (name, column) in enumerate(columns.items()):
            if is_number(cells[column]):
                table[i, j] = factors[name] * float(cells[column])
            else:
                problem = f"{cells[column]!r} is no finite number"
                faults.append(Fault(f"{path}:{line}: {name}", problem, "give the error of this joint"))
    if len(faults) > MAX_FAULTS:
        rest = Fault(str(path), f"and {len(faults) - MAX_FAULTS} more faults", "mend these first")
        raise InputError([*faults[:MAX_FAULTS], rest])
    if faults:
        raise InputError(faults)
    return table


def is_number(cell: str) -> bool:
    """Whether a cell holds a finite number."""
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False
