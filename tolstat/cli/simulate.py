"""``tolstat simulate`` and ``tolstat replay``: one joint, of a case file or of a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._library import compilation, load_units, replays, sections, stores, studies, tables, text
from tolstat.cli._shared import print_json, print_warnings, progress, say, warn
from tolstat.common.files import atomic_write
from tolstat.display.options import AsJson, Opt, Point, ResultPath, Trace

if TYPE_CHECKING:
    from tolstat.campaign.replay import CaseResult, Replay


def simulate(case: Annotated[Path, Opt("CASE")], *, out: Trace = None, as_json: AsJson = False) -> None:
    """Simulate one joint, with and without its errors.

    Prints status and course of the simulation, and the largest value of each load in the last revolution beside that of
    the joint without errors: forces of the bushings, bending moments at the roots of pins and arms, contact forces of
    the pins, and psi.

    Example: tolstat simulate studies/tilted_pin.toml --out loads.csv

    Parameters
    ----------
    case : Path
        Case file (TOML): one joint with its errors.
    """
    loaded = studies.load_case(case)
    print_warnings(case, [loaded.joint])
    say(f"{loaded.name}: {sections.mounting_and_law([loaded.joint.shaft.axial], [loaded.joint.contact.law])}")
    compilation.announce()
    with progress("simulation"):
        result = replays.simulate_case(loaded)
    _deliver(result, {}, out, as_json)


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
    compilation.announce()
    with progress("simulation"), stores.ResultFile.open(file) as store:
        again = replays.replay(store.at(point) if point else store, row)
    facts = {"row": row, "equal": not again.differences, "differing": [d.name for d in again.differences]}
    _deliver(again.result, facts, out, as_json)
    say(_verdict(again))
    if again.differences:
        raise typer.Exit(1)


def _deliver(result: CaseResult, facts: dict[str, Any], out: Path | None, as_json: bool) -> None:
    """Print `facts` and the summary of a joint, a warning if its status is not ok, and write its histories."""
    summary = facts | result.summary()
    if as_json:
        print_json(summary)
    else:
        lines = [f"{name}: {value}" for name, value in summary.items() if name != "max"]
        typer.echo("\n".join([*lines, text.align(_largest(summary["max"]))]))
    state = tables.Status[str(summary["status"]).upper()]
    if state != tables.Status.OK:
        warn(f"warning: {state.label}: {tables.STATUS_TEXT[state]}\n  hint: {result.remedy()}")
    if out is not None:
        with atomic_write(out) as temporary:
            result.to_pandas().to_csv(temporary, index=False, lineterminator="\n")
        say(f"wrote {out}")


def _largest(largest: dict[str, dict[str, Any]]) -> list[list[str]]:
    """Cells of the largest loads of a joint, beside those of the joint without errors, if it was simulated."""
    rows = [["load", "unit", "this joint", "without errors", "change"]]
    for name, load in largest.items():
        values = ("-" if value is None else f"{value:.5g}" for value in (load["joint"], load.get("without_errors")))
        change = load.get("change")
        change = "-" if change is None else "0.0 %" if abs(change) < 5e-4 else f"{100 * change:+.1f} %"
        rows.append([name, load_units.unit_text(load["unit"]), *values, change])
    known = any(load.get("without_errors") is not None for load in largest.values())
    return rows if known else [row[:3] for row in rows]


def _verdict(again: Replay) -> str:
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
