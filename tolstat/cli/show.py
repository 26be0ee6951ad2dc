"""``tolstat show``: drawings of a joint."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import make_folder, output_folder
from tolstat.cli._talk import say
from tolstat.common.errors import Fault, InputError

FORMATS = (".svg", ".png", ".pdf")


def show(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SOURCE",
            help="Joint file, study or case (TOML), result file (HDF5), or name of a joint: cirelli2021.",
        ),
    ],
    errors: Annotated[
        bool, typer.Option("--errors", help="Draw what a positive error of each kind means instead of the joint.")
    ] = False,
    row: Annotated[
        int | None,
        typer.Option("--row", metavar="I", min=0, help="Draw the errors of this row of a result file, enlarged."),
    ] = None,
    alpha: Annotated[
        str | None,
        typer.Option("--alpha", metavar="ANGLE", help='Misalignment in place of the source\'s; "15 deg".'),
    ] = None,
    columns: Annotated[
        int, typer.Option("--columns", metavar="N", min=1, max=2, help="Drawings of the joint side by side: 1 or 2.")
    ] = 2,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="PICTURE", help="File to write: .svg, .png or .pdf; default: joint.svg."),
    ] = None,
) -> None:
    """Draw a joint, its errors, or one joint of a campaign.

    Draws cross, forks, bushings, pins in their holes and the axes e, t, z from the joint's own dimensions. Prints the
    dimensions; with --errors the kinds of errors (to errors.svg), with --row the errors of that joint (to rowI.svg).

    Example: tolstat show studies/iso2768_f.toml --out joint.svg
    """
    from tolstat.display import style
    from tolstat.display.table import as_text, plain
    from tolstat.questions.drawings import answer, views

    target = out or Path("errors.svg" if errors else "joint.svg" if row is None else f"row{row}.svg")
    faults = []
    if errors and row is not None:
        faults.append(Fault("--errors", "cannot be used together with --row", "give one of them"))
    if target.suffix.lower() not in FORMATS:
        faults.append(Fault(f"--out {target}", "is not a picture", f"end its name in {', '.join(FORMATS)}"))
    if faults:
        raise InputError(faults)
    joint, own_alpha, title, own_errors = answer.read(source, row, alpha)
    if errors:
        figure, table = answer.draw_errors(joint), answer.meanings()
    elif own_errors is not None:
        figure, table = answer.draw_row(joint, own_errors, title), views.numbers(joint, own_errors)
    else:
        figure, table = answer.draw_joint(joint, own_alpha, title, columns), answer.lengths(joint, own_alpha)
    make_folder(target.parent)
    with output_folder(target.parent):
        (path,) = style.save(figure, target.with_suffix(""), (target.suffix.lower(),))
    typer.echo(as_text(plain(table), table))
    say(f"wrote {path}")
