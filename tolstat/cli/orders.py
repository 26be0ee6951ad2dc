"""``tolstat orders``: amplitudes of the shafts' loads at multiples of the input speed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import AsJson, AtPoints, ResultPath, Wide, as_text, make_folder, output_folder, print_table
from tolstat.cli._talk import progress, say


def orders(
    file: ResultPath,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Write pictures and CSV to this folder, created if missing."),
    ] = None,
    point: AtPoints = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print the orders of the loads that the shafts carry.

    Prints the amplitudes of lateral force, bending moment, driving torque and speed error at one to four times the
    input speed: of the nominal joint, and their 5, 50 and 95 % quantiles over the joints with 95 % intervals. With
    --out also pictures of them and the orbits of the lateral forces in axes that do not turn.

    Example: tolstat orders iso2768_f.h5
    """
    from tolstat.display import text
    from tolstat.questions.orders import query, rendering
    from tolstat.store import ResultFile

    with progress("orders"), ResultFile.open(file) as store:
        found = query.orders_of(store.view().at(point or ""), orbits=out is not None)
    if as_json:
        summary = {"joints": found.joints, "left_out": found.left_out, "orders": text.records(found.table)}
        typer.echo(as_text(summary))
    else:
        print_table(rendering.COLUMNS, found.table, wide)
    say(rendering.note(found))
    if out is not None:
        make_folder(out)
        with progress("figures"), output_folder(out):
            files = rendering.write(found, out / file.stem)
        for path in files:
            say(f"wrote {path}")
