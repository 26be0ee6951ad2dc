"""``tolstat multifidelity``: few joints of a dear simulation, many of a cheap one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import Workers, announce_compilation, as_text, make_folder, say
from tolstat.common.errors import Fault, InputError, gather


def multifidelity(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    low: Annotated[
        str, typer.Option("--low", metavar="FIDELITY", help="Cheap: quasistatic, or with steps a revolution.")
    ] = "quasistatic:36",
    high: Annotated[
        str, typer.Option("--high", metavar="FIDELITY", help="What is asked about: dynamic, dynamic:360 or so.")
    ] = "dynamic",
    budget: Annotated[str, typer.Option("--budget", metavar="TIME", help="Time of one core for all joints.")] = "60 s",
    pilot: Annotated[
        int, typer.Option("--pilot", metavar="N", min=16, help="Joints at both fidelities to share the work by.")
    ] = 128,
    by: Annotated[
        str | None, typer.Option("--by", metavar="LOAD", help="Load to share the work for; default the first limit's.")
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder of STUDY_high.h5 and STUDY_low.h5; default this one.")
    ] = Path(),
    workers: Workers = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Estimate means, quantiles and shares of a dear simulation with the help of a cheap one of the same joints.

    A pilot tells costs and correlation, and by them how many joints each gets; "no gain" where the dear one alone is
    as good. Both result files are ordinary ones. Stopped with Ctrl-C, the same command goes on where it was.
    """
    from tolstat import study
    from tolstat.campaign import run as campaign
    from tolstat.cli.run import seconds_of
    from tolstat.display import text
    from tolstat.questions.multifidelity.query import two_fidelities

    faults: list[Fault] = []
    with gather(faults):
        seconds = seconds_of(budget, "--budget")
    with gather(faults):
        plan = study.load(study_file)
    if faults:
        raise InputError(faults)
    make_folder(out)
    announce_compilation()
    try:
        found = two_fidelities(plan, low, high, out, seconds, pilot, by, workers, say)
    except campaign.Interrupted as stop:
        say(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    if as_json:
        head = found.allocation._asdict() | {"cost_high_s": found.cost_high, "cost_low_s": found.cost_low}
        typer.echo(as_text({**head, "high": found.high, "low": found.low, "statistics": text.records(found.table)}))
    else:
        typer.echo(text.plain(found.table))
    say(f"{found.high} joints of the high fidelity, {found.low} of the low; gain below 1: do without the low one")
    for path in found.files:
        say(f"joints in {path}")
