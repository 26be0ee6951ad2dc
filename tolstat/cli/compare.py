"""``tolstat compare``: differences between two campaigns."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import as_text, make_folder, output_folder, say


def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="Result file (HDF5) of the first campaign.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="Result file (HDF5) of the second campaign.")],
    by: Annotated[
        list[str] | None,
        typer.Option(
            "--by", metavar="LOAD", help="Load to compare, such as cross1.F; repeatable; default: loads with limits."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the files, created if missing; default: folder of B."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables; write no files.")] = False,
) -> None:
    """Compare the exceedances and loads of two campaigns.

    Prints the differences between the studies and, as B - A with its 95 % interval, the difference of the share above
    each limit; with --by, or without limits, also of quantiles and means. Joints drawn from the same seed are compared
    in pairs, which makes the intervals narrow.

    Writes the curves and their difference as PNG and SVG, and as CSV the differences and the joints that are above a
    limit in one campaign only.

    Example: tolstat compare before.h5 after.h5 --by cross1.F
    """
    from tolstat.display import text
    from tolstat.questions.compare import rendering
    from tolstat.questions.compare.query import compared
    from tolstat.store import Reader

    with Reader.open(a) as one, Reader.open(b) as other:
        found = compared(one.view(), other.view(), by or ())
    if as_json:
        tables = {key: text.records(getattr(found, key)) for key in ("shares", "loads", "switched")}
        differing = [change._asdict() for change in found.changes]
        typer.echo(as_text({"paired": found.sides.paired, "changes": differing, **tables}))
        return
    if out is not None:
        make_folder(out)
    typer.echo(rendering.text(found, loads=bool(by)))
    say(rendering.note(found, str(a), str(b)))
    folder = b.parent if out is None else out
    with output_folder(folder):
        files = rendering.write(found, folder / f"{a.stem}_{b.stem}", (a.stem, b.stem))
    for path in files:
        say(f"wrote {path}")
