"""``tolstat simulate``, ``replay``, ``evaluate``, ``show``: joints of a case, a campaign, another program; drawings."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from tolstat.cli import _library as library
from tolstat.cli._shared import (
    about,
    answered,
    deliver,
    echo,
    loaded,
    opened,
    print_json,
    print_warnings,
    print_warnings_of_others,
    progress,
    say,
    told,
    warn,
    work,
    write,
    write_frame,
)
from tolstat.common.errors import Fault, gather, raise_all
from tolstat.common.files import check_target
from tolstat.display.options import AsJson, Opt, Point, ResultPath, SimulatedPath, Trace, Workers

FORMATS = (".svg", ".png", ".pdf")


def simulate(
    case: Annotated[Path, Opt("CASE")],
    *,
    table: Annotated[Path | None, Opt("CSV")] = None,
    out: Trace = None,
    as_json: AsJson = False,
) -> None:
    """Simulate one joint, with and without its errors.

    Prints status and course of the simulation, and the largest value of each load in the last revolution beside that of
    the joint without errors: forces of the bushings, bending moments at the roots of pins and arms, contact forces of
    the pins, and psi. The largest value may lie between two samples of --out: parts that strike ring for shorter. If
    CASE has limits, or the joint what rating lives need, prints which limits are exceeded, and the lives of the
    bearings.

    Example: tolstat simulate studies/tilted_pin.toml --out loads.csv

    Parameters
    ----------
    case : Path
        Case file (TOML): one joint with its errors.
    table : Path, optional
        Text table of a measured joint: a column for each error that was measured, one row. Each takes the place of
        that of CASE.
    """
    loaded = library.studies.load_case(case)
    about(loaded.wording)
    if table is not None:
        measured, notes = library.crosses.of_one(table, loaded.mechanism, loaded.errors)
        loaded = replace(loaded, errors=loaded.errors | measured)
        for note in notes:
            say(note)
    print_warnings(case, [loaded.joint])
    print_warnings_of_others(case, loaded)
    say(f"{loaded.name}: {loaded.joint_in_words}")
    with progress("simulation"):
        result = library.replays.simulate_case(loaded)
    joints = answered(library.parts.of_case(loaded, result))
    _deliver(result, joints.values() if as_json and joints.parts else {}, out, as_json)
    if joints.parts and not as_json:
        echo()
        deliver(joints, wide=False)


def replay(
    file: ResultPath,
    *,
    row: Annotated[int, Opt("I", least=0)],
    out: Trace = None,
    point: Point = None,
    as_json: AsJson = False,
) -> None:
    """Simulate one joint again and compare with the file.

    Uses the joint, errors and settings stored in FILE. Prints the largest value of each load, and whether all stored
    values are identical to the last bit, as they must be on the same machine with the same versions. If they
    differ, prints the versions that differ and ends with exit code 1.

    Example: tolstat replay iso2768_f.h5 --row 17 --out trace.csv

    Parameters
    ----------
    row : int
        Row of the joint in the campaign, from 0.
    point : str, optional
        Operating point, such as cruise; needed if FILE has several.
    """
    with progress("simulation"), opened(file) as store:
        again = library.replays.replay(store, row, point or "")
    facts = {"row": row, "equal": not again.differences, "differing": [d.name for d in again.differences]}
    _deliver(again.result, facts, out, as_json)
    say(_verdict(again))
    if again.differences:
        raise typer.Exit(1)


def _deliver(result: library.replays.CaseResult, facts: dict[str, Any], out: Path | None, as_json: bool) -> None:
    """Print `facts` and the summary of a joint, a warning if its status is not ok, and write its histories."""
    summary = facts | result.summary()
    if as_json:
        print_json(summary)
    else:
        lines = [f"{name}: {value}" for name, value in summary.items() if name != "max"]
        echo(told("\n".join([*lines, library.text.align(_largest(summary["max"]))])))
    state = library.tables.Status[str(summary["status"]).upper()]
    if state != library.tables.Status.OK:
        warn(f"warning: {state.label}: {library.tables.STATUS_TEXT[state]}\n  hint: {result.remedy()}")
    if out is not None:
        write_frame(result.to_pandas(), out)


def _largest(largest: dict[str, dict[str, Any]]) -> list[list[str]]:
    """Cells of the largest loads of a joint, beside those of the joint without errors, if it was simulated."""
    rows = [["load", "unit", "this joint", "without errors", "change"]]
    for name, load in largest.items():
        values = ("-" if value is None else f"{value:.5g}" for value in (load["joint"], load.get("without_errors")))
        change = load.get("change")
        change = "-" if change is None else "0.0 %" if abs(change) < 5e-4 else f"{100 * change:+.1f} %"
        rows.append([name, library.load_units.unit_text(load["unit"]), *values, change])
    known = any(load.get("without_errors") is not None for load in largest.values())
    return rows if known else [row[:3] for row in rows]


def _verdict(again: library.replays.Replay) -> str:
    if not again.differences:
        return f"row {again.row}: identical to the stored results, bit for bit"
    now = again.result.summary()["status"]
    if again.stored.label != now:
        line = f"row {again.row}: status {again.stored.label} in the campaign, {now} now"
    else:
        d = max(again.differences, key=lambda d: d.relative)
        differ = f"{len(again.differences)} values differ, largest relative difference {d.relative:.2g}"
        line = f"row {again.row}: {differ}: {d.name} {d.stored!r} stored, {d.now!r} now"
    reason = "all versions are those that made the file: the machine is of another type, or the file is damaged"
    return "\n  ".join([line, *(again.code or [reason])])


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

    The header of the CSV file has the names of errors, in any order; units stand there or below, or SI units hold.
    Errors are deviations, those of operation.* from the operating point, as tolstat export writes them. Errors
    without a column are those of [errors] of STUDY, or nominal, as is said. Zones of STUDY do not matter: joints have
    offsets and tilts. If STUDY has several joints, a column variant says which. Other columns are left out and named.
    A column such as name or part, or the first one if it is no error, names the joints. The output has a row for each
    joint in the same order: its name, if the joints have any, its status, its loads, and if the joint has what they
    need the rating lives of its bearings, with the names in the first line and the units in the second. A load is empty
    where a joint has none. If STUDY has limits, or lives, prints which joints are beyond a limit, and of up to three
    joints loads with limits, those of the shafts, and lives.

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
    given = loaded(study)
    with work(workers=workers) as shown:
        found = library.evaluating.evaluate(
            given, errors, loads, uniform=uniform, point=point, workers=workers, tell=say, stage=shown.display.stage
        )
    head, rows = [[*found.frame], [*found.frame.attrs["units"].values()]], found.frame.to_dict("list").values()
    write(out, lambda to: csv.writer(to, lineterminator="\n").writerows([*head, *library.text.csv_rows([*rows])]))
    status = found.frame["status"]
    invalid = status[~status.isin([state.label for state in library.tables.VALID])]
    wrote = "" if out == "-" else f"wrote {out}: "
    say(f"{wrote}{len(status)} joints, {len(invalid) or 'none'} of them without a valid load")
    for state in (state for state in library.tables.Status if state.label in invalid.unique()):
        hint = library.remedy.WITHOUT_RESULTS.get(state)
        say(f"{int((invalid == state.label).sum())} {state.label}: {library.tables.STATUS_TEXT[state]}")
        if hint:
            say(f"  hint: {hint}")
    if out != "-":
        deliver(found.answer, wide=False)


def show(
    source: Annotated[str, Opt("SOURCE")],
    *,
    errors: bool = False,
    row: Annotated[int | None, Opt("I", least=0)] = None,
    alpha: Annotated[str | None, Opt("ANGLE")] = None,
    columns: Annotated[int, Opt("N", least=1, most=2)] = 2,
    out: Annotated[Path | None, Opt("PICTURE")] = None,
) -> None:
    """Draw a joint, its errors, or one joint of a campaign.

    Draws cross, forks, bushings, pins in their holes and the axes e, t, z from the joint's own dimensions, and a drive
    shaft as a whole. Prints the dimensions and the operating points; with --errors the kinds of errors (to
    errors.svg), with --row the errors of that joint (to rowI.svg).

    Example: tolstat show studies/iso2768_f.toml --out joint.svg

    Parameters
    ----------
    source : str
        Joint file, study or case (TOML), result file (HDF5), or name of a joint: cirelli2021.
    errors : bool
        Draw what a positive error of each kind means instead of the joint.
    row : int, optional
        Draw the errors of this row of a result file, enlarged.
    alpha : str, optional
        Misalignment in place of the source's; "15 deg".
    columns : int
        Drawings of the joint side by side: 1 or 2.
    out : Path, optional
        File to write: .svg, .png or .pdf; default: joint.svg.
    """
    target = out or Path("errors.svg" if errors else "joint.svg" if row is None else f"row{row}.svg")
    faults = []
    if errors and row is not None:
        faults.append(Fault("--errors", "cannot be used together with --row", "give one of them"))
    if target.suffix.lower() not in FORMATS:
        faults.append(Fault(f"--out {target}", "is not a picture", f"end its name in {', '.join(FORMATS)}"))
    with gather(faults):
        check_target(target)
    raise_all(faults)
    drawn = library.drawings.read(source, row, alpha)
    if errors:
        figure, rows = library.drawings.draw_errors(drawn.joint), library.drawings.meanings()
    elif drawn.errors is not None:
        operation = drawn.points[0].operation
        figure = library.drawings.draw_row(drawn.joint, operation, drawn.errors, drawn.title)
        rows = library.drawings.errors_in_numbers(drawn.joint, operation, drawn.errors)
    else:
        figure = library.drawings.draw_joint(drawn.joint, drawn.points[0].operation, drawn.title, columns)
        rows = library.dimensions.dimensions(drawn.joint, drawn.points)
    (path,) = library.style.save(figure, target.with_suffix(""), (target.suffix,))
    echo(library.table.fitted(library.table.plain(rows), rows)[0])
    say(f"wrote {path}")
