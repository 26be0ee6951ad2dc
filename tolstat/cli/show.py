"""``tolstat show``: drawings of a joint."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._library import drawings, style, table, views
from tolstat.cli._shared import say
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.files import check_target
from tolstat.display.options import Opt

FORMATS = (".svg", ".png", ".pdf")


def show(
    source: Annotated[str, Opt("SOURCE")],
    *,
    errors: bool = False,
    row: Annotated[int | None, Opt("I", least=0)] = None,
    alpha: Annotated[str | None, Opt("ANGLE")] = None,
    columns: Annotated[int, Opt("N", least=1, most=2)] = 2,
    out: Annotated[Path | None, Opt("PICTURE")] = None,
) -> None:
    """Draw a joint, its errors, or one joint of a campaign.

    Draws cross, forks, bushings, pins in their holes and the axes e, t, z from the joint's own dimensions. Prints the
    dimensions; with --errors the kinds of errors (to errors.svg), with --row the errors of that joint (to rowI.svg).

    Example: tolstat show studies/iso2768_f.toml --out joint.svg

    Parameters
    ----------
    source : str
        Joint file, study or case (TOML), result file (HDF5), or name of a joint: cirelli2021.
    errors : bool
        Draw what a positive error of each kind means instead of the joint.
    row : int, optional
        Draw the errors of this row of a result file, enlarged.
    alpha : str, optional
        Misalignment in place of the source's; "15 deg".
    columns : int
        Drawings of the joint side by side: 1 or 2.
    out : Path, optional
        File to write: .svg, .png or .pdf; default: joint.svg.
    """
    target = out or Path("errors.svg" if errors else "joint.svg" if row is None else f"row{row}.svg")
    faults = []
    if errors and row is not None:
        faults.append(Fault("--errors", "cannot be used together with --row", "give one of them"))
    if target.suffix.lower() not in FORMATS:
        faults.append(Fault(f"--out {target}", "is not a picture", f"end its name in {', '.join(FORMATS)}"))
    with gather(faults):
        check_target(target)
    if faults:
        raise InputError(faults)
    joint, own_alpha, title, own_errors = drawings.read(source, row, alpha)
    if errors:
        figure, rows = drawings.draw_errors(joint), drawings.meanings()
    elif own_errors is not None:
        figure, rows = drawings.draw_row(joint, own_errors, title), views.numbers(joint, own_errors)
    else:
        figure, rows = drawings.draw_joint(joint, own_alpha, title, columns), drawings.lengths(joint, own_alpha)
    (path,) = style.save(figure, target.with_suffix(""), (target.suffix.lower(),))
    typer.echo(table.fitted(table.plain(rows), rows)[0])
    say(f"wrote {path}")
