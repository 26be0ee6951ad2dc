"""``tolstat lots``: joints of a lot deviate together; shares of lots, and the next delivery."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import Accept, AsJson, AtPoints, Wide, Workers, as_text, parse_share, print_table
from tolstat.cli._talk import progress, say
from tolstat.common.errors import Fault, InputError


def lots(
    source: Annotated[
        Path,
        typer.Argument(metavar="STUDY|FILE", help="Study file (TOML), or result file of joints that share lots."),
    ],
    number: Annotated[
        int | None,
        typer.Option("--lots", metavar="L", min=30, help="Number of lots; default: that of STUDY, or 50."),
    ] = None,
    joints: Annotated[
        int | None,
        typer.Option("--joints", metavar="M", min=2, help="Joints of each lot; default: those of STUDY, or 20."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Result file; default: STUDY_lots.h5 in the current folder."),
    ] = None,
    delivery: Annotated[
        int,
        typer.Option("--delivery", metavar="N", min=1, max=10**5, help="Number of joints of the next delivery."),
    ] = 500,
    from_lots: Annotated[
        int,
        typer.Option("--from-lots", metavar="K", min=1, help="Number of new lots that the next delivery is of."),
    ] = 1,
    accept: Accept = None,
    point: AtPoints = None,
    workers: Workers = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print which share of a lot or of a delivery exceeds limits.

    Parts of one lot deviate together, as the key lot of an entry of [tolerances] says. Simulates 50 lots of 20 joints
    of STUDY into FILE. To resume after an interruption, run the same command again.

    Prints for each limit, and for all limits together, the share of the joints above it, with a 95 % interval over the
    lots, the worst lot, and a prediction interval for the next delivery; with --wide or --json also the median lot and
    how much joints of one lot are alike. With --accept, prints the share of the deliveries with more bad joints.

    Example: tolstat lots studies/lots.toml
    """
    from tolstat.cli import run
    from tolstat.display import text
    from tolstat.questions.lots import query, rendering
    from tolstat.store import ResultFile, error_budget

    if delivery < from_lots:
        raise InputError([Fault("--from-lots", f"{from_lots} lots of {delivery} joints", "give fewer lots")])
    accepted = float("nan") if accept is None else parse_share(accept)
    if source.suffix == ".toml":
        path = out or Path(f"{source.stem}_lots.h5")
        run.simulate(query.study_of(source, number, joints), path, workers=workers)
    elif number or joints or out:
        remedy = "give a study, or remove --lots, --joints and --out"
        raise InputError([Fault(str(source), "holds its lots already", remedy)])
    else:
        path = source
    with progress("lots"), ResultFile.open(path) as store:
        view = store.view().at(point or "")
        found, unknown = query.lots_of(view, delivery, from_lots, accepted), error_budget.unknown(view)
    if as_json:
        tables = {"limits": text.records(found.table), "lots": text.records(found.shares)}
        typer.echo(as_text({"joints_per_lot": found.joints_per_lot} | tables))
        return
    print_table(rendering.COLUMNS, found.table, wide)
    say(rendering.note(found, accepted))
    if unknown:
        say(unknown)
