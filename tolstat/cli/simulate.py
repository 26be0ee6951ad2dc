"""``tolstat simulate``: simulate one joint."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import AsJson, announce_compilation, as_text, output_file, print_warnings
from tolstat.cli._talk import progress, say, warn

if TYPE_CHECKING:
    from tolstat.campaign.replay import CaseResult


def simulate(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case file (TOML): one joint with its errors.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="CSV", help="Write the load histories of the last revolution as CSV."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Simulate one joint, with and without its errors.

    Prints status and course of the simulation, and the largest value of each load in the last revolution beside that of
    the joint without errors: forces of the bushings, bending moments at the roots of pins and arms, contact forces of
    the pins, and psi.

    Example: tolstat simulate studies/tilted_pin.toml --out loads.csv
    """
    from tolstat import study
    from tolstat.campaign import replay
    from tolstat.common.files import check_target
    from tolstat.joint.mounting import in_words

    if out is not None:
        check_target(out, case)
    loaded = study.load_case(case)
    print_warnings(case, [loaded.joint])
    say(f"{loaded.name}: {in_words([loaded.joint.shaft.axial], [loaded.joint.contact.law])}")
    announce_compilation()
    with progress("simulation"):
        result = replay.simulate_case(loaded)
    summary = result.summary()
    typer.echo(as_text(summary) if as_json else case_text(summary))
    warn_unless_ok(summary, result.remedy())
    if out is not None:
        write_trace(result, out)


def case_text(summary: dict[str, Any]) -> str:
    """Format `CaseResult.summary` as text."""
    from tolstat.display.text import align

    def value(load: float | None) -> str:
        return "-" if load is None else f"{load:.5g}"

    beside = "status_without_errors" in summary
    rows = [["load", "unit", "this joint", *(["without errors", "change"] if beside else [])]]
    for name, load in summary["max"].items():
        unit = "" if load["unit"] == "1" else load["unit"].replace("*", " ")
        rows.append([name, unit, value(load["joint"])])
        if beside:
            rows[-1] += [value(load["without_errors"]), _per_cent(load["change"])]
    facts = "\n".join(f"{name}: {value}" for name, value in summary.items() if name != "max")
    return f"{facts}\n{align(rows)}"


def _per_cent(change: float | None) -> str:
    if change is None:
        return "-"
    return "0.0 %" if abs(change) < 5e-4 else f"{100 * change:+.1f} %"


def warn_unless_ok(summary: dict[str, Any], remedy: str) -> None:
    """Print the meaning of a status other than ok, and the remedy."""
    from tolstat.common.tables import STATUS_TEXT, Status

    state = Status[str(summary["status"]).upper()]
    if state != Status.OK:
        warn(f"warning: {state.label}: {STATUS_TEXT[state]}\n  hint: {remedy}")


def write_trace(result: CaseResult, out: Path) -> None:
    """Write the load histories of the last revolution as CSV."""
    with output_file(out) as temporary:
        result.to_pandas().to_csv(temporary, index=False, lineterminator="\n")
    say(f"wrote {out}")
