"""``tolstat show``: drawings of a joint."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tolstat.cli._app import make_folder, output_folder, say
from tolstat.common.errors import Fault, InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tolstat.questions.show.source import Shown

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
        typer.Option("--alpha", metavar="ANGLE", help='Misalignment for a joint file, which has none; "15 deg".'),
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
    from tolstat.questions.show import source as sources

    target = out or Path("errors.svg" if errors else "joint.svg" if row is None else f"row{row}.svg")
    _check(errors, row, target)
    shown = sources.read(source, row, None if alpha is None else _angle(alpha))
    figure, table = _drawn(shown, errors, columns)
    make_folder(target.parent)
    with output_folder(target.parent):
        (path,) = style.save(figure, target.with_suffix(""), (target.suffix.lower(),))
    typer.echo(table)
    say(f"wrote {path}")


def _check(errors: bool, row: int | None, target: Path) -> None:
    faults = []
    if errors and row is not None:
        faults.append(Fault("--errors", "cannot be used together with --row", "give one of them"))
    if target.suffix.lower() not in FORMATS:
        faults.append(Fault(f"--out {target}", "is not a picture", f"end its name in {', '.join(FORMATS)}"))
    if faults:
        raise InputError(faults)


def _angle(text: str) -> float:
    from pydantic_core import PydanticCustomError

    from tolstat.common.units import to_si

    try:
        angle, found = to_si(text, "rad"), "a Cardan joint cannot turn at 90 deg or more"
    except PydanticCustomError as error:
        angle, found = math.inf, error.message()
    if not abs(angle) < 0.5 * math.pi:
        raise InputError([Fault("--alpha", found, 'write --alpha "15 deg"')])
    return angle


def _drawn(shown: Shown, errors: bool, columns: int) -> tuple[Figure, str]:
    """Return the figure, and the table of its numbers as text."""
    from tolstat.display.table import as_text, cells
    from tolstat.display.text import align
    from tolstat.questions.show import query, rendering

    if errors:
        rows = cells(rendering.MEANING, rendering.meanings())
        return rendering.draw_errors(shown.joint), align(rows, text_last=True)
    if shown.errors is not None:
        figure = rendering.draw_row(shown.joint, shown.errors, shown.title)
        return figure, as_text(rendering.NUMBERS, rendering.numbers(query.pairs(shown.joint, shown.errors)))
    figure = rendering.draw_joint(shown.joint, shown.alpha, shown.title, columns)
    rows = cells(rendering.LENGTHS, rendering.lengths(shown.joint, shown.alpha))
    return figure, align(rows, text_last=True)
