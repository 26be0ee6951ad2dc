"""``tolstat plan``: predicted cost and precision of a campaign."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from tolstat.cli._app import AsJson, Workers, announce_compilation, as_text, print_study_notes
from tolstat.cli._talk import progress, say, wrapped

if TYPE_CHECKING:
    from tolstat.campaign.plan import Plan


def plan(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    n: Annotated[
        int | None, typer.Option("--n", metavar="N", min=1, help="Number of joints; default: that of the study.")
    ] = None,
    workers: Workers = None,
    pilot: Annotated[
        int, typer.Option("--pilot", metavar="K", min=1, help="Number of joints simulated for the prediction.")
    ] = 128,
    as_json: AsJson = False,
) -> None:
    """Predict time, memory and precision of a campaign.

    Simulates a few joints (pilot) and writes nothing. Prints the time of the whole command tolstat run (start, joints,
    check, report), memory and file size of the campaign, the width of the 95 % interval of exceedances and of each
    limit's exceedance, the number of joints that a 95 % bound of a quantile needs, and what each entry of [tolerances]
    means: half width, radius or diameter, standard deviation of the error, share of the parts outside.

    Example: tolstat plan studies/iso2768_f.toml
    """
    from dataclasses import asdict

    from tolstat import study
    from tolstat.campaign import plan as plans

    loaded = study.load(study_file, n=n)
    print_study_notes(study_file, loaded)
    announce_compilation()
    with progress() as shown:
        made = plans.plan(loaded, workers, pilot, shown.stage)
    typer.echo(as_text(asdict(made) | {"seconds": made.seconds}) if as_json else _lines(made))
    say(f"next: tolstat run {quote(str(study_file))}" + ("" if n is None else f" --n {n}"))


def _lines(made: Plan) -> str:
    lines = [
        f"joints: {made.rows}" + (f", each at {', '.join(made.points)}" if all(made.points) else ""),
        f"random numbers a joint: {made.dimensions}",
        f"pilot: {made.pilot} joints, {made.failed} failed, {made.unsettled} not settled",
        *([made.fidelity] if made.fidelity else []),
        *_rattle_warning(made),
        *_misfit_warning(made),
        f"time a joint: {1e3 * made.seconds_per_joint:.3g} ms",
        f"time: about {_duration(made.seconds)} on {made.workers} cores, of which",
        *(f"  {stage}: {_duration(seconds)}" for stage, seconds in made.stages.items()),
        f"memory: {made.process_bytes / 1e6:.0f} MB a process, {made.workers + 1} processes",
        f"file: {_size(made.file_bytes)}",
        *made.fit,
        *made.sweep,
        *([f"no tolerance, taken as exact: {', '.join(made.exact)}"] if made.exact else []),
    ]
    lines += [
        f"95 % interval of a share of {100 * share:g} %: {100 * width:.2g} points wide"
        for share, width in made.widths.items()
    ]
    lines += [
        f"limit {limit.load}: {limit.above} of {limit.of} above in the pilot; "
        f"interval at most {100 * limit.width:.2g} points wide"
        for limit in made.limits
    ]
    lines += [
        f"joints for a load that {100 * q:g} % stay below, with 95 % confidence: {n}" for q, n in made.wilks.items()
    ]
    return wrapped("\n".join(lines)) + "\n".join(["", *_meanings(made)])


def _meanings(made: Plan) -> list[str]:
    """Tables of what each entry of [tolerances] and [[correlation]] means."""
    from tolstat.display import table
    from tolstat.questions.joints import CORRELATED, ENTRIES

    tables = ((ENTRIES, made.tolerances), (CORRELATED, made.correlations))
    return [line for columns, rows in tables if rows for line in ("", table.as_text(columns, rows))]


def _rattle_warning(made: Plan) -> list[str]:
    """Warning about joints that rattle, if there are any."""
    found = made.reversals
    if not found.joints:
        return []
    reason = f"warning: the torque reverses in {found.joints} of {made.pilot} joints: inertia torque up to"
    return [f"{reason} {found.torque:.3g} N m; these joints rattle and cost {found.cost:.2g} times as much as others"]


def _misfit_warning(made: Plan) -> list[str]:
    """Warning about joints that do not go together, if there are any."""
    found = made.assembly
    if not found.misfits:
        return []
    reason = "have a pin larger than its hole and cannot be simulated"
    share = ""
    if found.interval is not None:
        share = "; 95 % interval of their share {:.2g} to {:.2g} %".format(*(100.0 * end for end in found.interval))
    return [f"warning: {found.misfits} of {found.of} joints {reason}{share}"]


def _duration(seconds: float) -> str:
    if seconds < 1:
        return "less than 1 s"
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.2g} s"


def _size(size: int) -> str:
    for unit, factor in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= factor:
            return f"{size / factor:.3g} {unit}"
    return f"{size / 1e3:.3g} kB"
