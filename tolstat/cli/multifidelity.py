"""``tolstat multifidelity``: statistics from two fidelities of the same joints."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import AsJson, AtOne, Wide, Workers, announce_compilation, as_text, make_folder, print_table
from tolstat.cli._talk import fail, progress, say
from tolstat.common.errors import Fault, InputError, gather


def multifidelity(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    low: Annotated[
        str,
        typer.Option(
            "--low",
            metavar="FIDELITY",
            help="Cheap fidelity (ideal, quasistatic, dynamic), with or without steps per revolution.",
        ),
    ] = "quasistatic:36",
    high: Annotated[
        str,
        typer.Option(
            "--high", metavar="FIDELITY", help="Expensive fidelity that the statistics refer to, such as dynamic:360."
        ),
    ] = "dynamic",
    budget: Annotated[
        str,
        typer.Option("--budget", metavar="TIME", help="Processor time of all joints together, with unit s, min or h."),
    ] = "60 s",
    pilot: Annotated[
        int, typer.Option("--pilot", metavar="N", min=16, help="Number of joints in the pilot, at both fidelities.")
    ] = 128,
    by: Annotated[
        str | None,
        typer.Option(
            "--by",
            metavar="LOAD",
            help="Load for which the numbers of joints are optimal; default: first load with a limit.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder of STUDY_high.h5 and STUDY_low.h5, created if missing.")
    ] = Path(),
    point: AtOne = None,
    workers: Workers = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Combine few expensive and many cheap simulations.

    Estimates means, quantiles and shares above the limits at the high fidelity, from few joints at the high and many at
    the low fidelity (control variates). A pilot measures the costs and the correlation of both fidelities, which give
    the numbers of joints; it ends with "no gain" if the high fidelity alone is as good.

    Prints each estimate with its 95 % interval, from both fidelities and from the high fidelity alone. Writes two
    ordinary result files. To resume after an interruption, run the same command again.

    Example: tolstat multifidelity studies/iso2768_f.toml --low dynamic:90 --budget "10 s"
    """
    from tolstat import study
    from tolstat.campaign import run as campaign
    from tolstat.cli.run import parse_time
    from tolstat.display import text
    from tolstat.questions.multifidelity import rendering
    from tolstat.questions.multifidelity.query import two_fidelities

    faults: list[Fault] = []
    with gather(faults):
        seconds = parse_time(budget, "--budget")
    with gather(faults):
        plan = study.load(study_file).at(point or "")
    if faults:
        raise InputError(faults)
    make_folder(out)
    announce_compilation()
    try:
        with progress("joints at two fidelities") as shown:
            found = two_fidelities(plan, low, high, out, seconds, pilot, by, workers, shown.note, shown.stage, shown)
    except campaign.Interrupted as stop:
        fail(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    if as_json:
        head = found.allocation._asdict() | {"cost_high_s": found.cost_high, "cost_low_s": found.cost_low}
        typer.echo(as_text({**head, "high": found.high, "low": found.low, "statistics": text.records(found.table)}))
    else:
        print_table(rendering.TABLE, found.table, wide)
    say(f"{found.high} joints at high fidelity, {found.low} at low; where gain < 1, the high fidelity alone is better")
    for path in found.files:
        say(f"results in {path}")
