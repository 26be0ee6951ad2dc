"""``tolstat plan``: predicted cost and precision of a campaign."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from shlex import quote
from typing import Annotated

import typer

from tolstat import study
from tolstat.campaign import plan as plans
from tolstat.campaign.plan import Plan
from tolstat.cli._output import print_json
from tolstat.cli._talk import progress, say, wrapped
from tolstat.cli._work import print_study_notes
from tolstat.display import table
from tolstat.display.options import AsJson, Joints, Opt, StudyPath, Workers
from tolstat.questions.joints import CORRELATED, ENTRIES
from tolstat.solver import compilation

TIMES = (("d", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 0.5))
SIZES = (("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 0.0))


def plan(
    study_file: StudyPath,
    *,
    n: Joints = None,
    workers: Workers = None,
    pilot: Annotated[int, Opt("K", least=1)] = plans.PILOT,
    as_json: AsJson = False,
) -> None:
    """Predict time, memory and precision of a campaign.

    Simulates a few joints (pilot) and writes nothing. Prints the time of the whole command tolstat run (start, joints,
    check, report), memory and file size of the campaign, the width of the 95 % interval of exceedances and of each
    limit's exceedance, the number of joints that a 95 % bound of a quantile needs, and what each entry of [tolerances]
    means: half width, radius or diameter, standard deviation of the error, share of the parts outside.

    Example: tolstat plan studies/iso2768_f.toml

    Parameters
    ----------
    pilot : int
        Number of joints simulated for the prediction.
    """
    loaded = study.load(study_file, n=n)
    print_study_notes(study_file, loaded)
    compilation.announce()
    with progress() as shown:
        made = plans.plan(loaded, workers, pilot, shown.stage)
    if as_json:
        print_json(asdict(made) | {"seconds": made.seconds})
    else:
        typer.echo(wrapped("\n".join(_lines(made))))
        for columns, rows in ((ENTRIES, made.tolerances), (CORRELATED, made.correlations)):
            if rows:
                typer.echo(f"\n{table.as_text(columns, rows)}")
    say(f"next: tolstat run {quote(str(study_file))}" + ("" if n is None else f" --n {n}"))


def _lines(made: Plan) -> Iterator[str]:
    yield f"joints: {made.rows}" + (f", each at {', '.join(made.points)}" if all(made.points) else "")
    yield f"random numbers a joint: {made.dimensions}"
    yield f"pilot: {made.pilot} joints, {made.failed} failed, {made.unsettled} not settled"
    if made.fidelity:
        yield made.fidelity
    if rattle := made.reversals.joints:
        yield (
            f"warning: the torque reverses in {rattle} of {made.pilot} joints: inertia torque up to "
            f"{made.reversals.torque:.3g} N m; these joints rattle and cost {made.reversals.cost:.2g} times as much as "
            "others"
        )
    if misfits := made.assembly.misfits:
        ends = [f"{100 * end:.2g}" for end in made.assembly.interval or ()]
        interval = f"; 95 % interval of their share {' to '.join(ends)} %" if ends else ""
        joints = f"{misfits} of {made.assembly.of} joints"
        yield f"warning: {joints} have a pin larger than its hole and cannot be simulated{interval}"
    yield f"time a joint: {1e3 * made.seconds_per_joint:.3g} ms"
    yield f"time: about {_duration(made.seconds)} on {made.workers} cores, of which"
    for stage, seconds in made.stages.items():
        yield f"  {stage}: {_duration(seconds)}"
    yield f"memory: {made.process_bytes / 1e6:.0f} MB a process, {made.workers + 1} processes"
    yield f"file: {_size(made.file_bytes)}"
    yield from (*made.fit, *made.sweep)
    if made.exact:
        yield f"no tolerance, taken as exact: {', '.join(made.exact)}"
    for share, width in made.widths.items():
        yield f"95 % interval of a share of {100 * share:g} %: {100 * width:.2g} points wide"
    for limit in made.limits:
        interval = f"interval at most {100 * limit.width:.2g} points wide"
        yield f"limit {limit.load}: {limit.above} of {limit.of} above in the pilot; {interval}"
    for q, n in made.wilks.items():
        yield f"joints for a load that {100 * q:g} % stay below, with 95 % confidence: {n}"


def _duration(seconds: float) -> str:
    units = (("d", 86400.0), ("h", 3600.0), ("min", 60.0))
    long = next((f"{seconds / size:.3g} {unit}" for unit, size in units if seconds >= 2 * size), f"{seconds:.2g} s")
    return "less than 1 s" if seconds < 1 else long


def _size(size: int) -> str:
    units = (("TB", 1e12), ("GB", 1e9), ("MB", 1e6))
    return next((f"{size / factor:.3g} {unit}" for unit, factor in units if size >= factor), f"{size / 1e3:.3g} kB")
