"""``tolstat compare``: differences between two campaigns."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import AsJson, ByMany, Wide, as_text, make_folder, output_folder, print_table
from tolstat.cli._talk import progress, say


def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="Result file (HDF5) of the first campaign.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="Result file (HDF5) of the second campaign.")],
    by: ByMany = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the files, created if missing; default: folder of B."),
    ] = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Compare the exceedances and loads of two campaigns.

    Prints the differences between the studies and, as B - A with its 95 % interval, the difference of the share above
    each limit; with --by, or without limits, also of quantiles and means. Joints drawn from the same seed are compared
    in pairs, which makes the intervals narrow.

    Writes the curves and their difference as PNG and SVG, and as CSV the differences and the joints that are above a
    limit in one campaign only. With --json, writes no files.

    Example: tolstat compare iso2768_f.h5 narrow.h5 --by cross1.F
    """
    from tolstat.display import text
    from tolstat.questions.compare import rendering
    from tolstat.questions.compare.query import compared
    from tolstat.store import ResultFile

    with progress("comparison"), ResultFile.open(a) as one, ResultFile.open(b) as other:
        found = compared(one.view(), other.view(), by or ())
    if as_json:
        tables = {key: text.records(getattr(found, key)) for key in ("shares", "loads", "switched")}
        differing = [change._asdict() for change in found.changes]
        typer.echo(as_text({"paired": found.sides.paired, "changes": differing, **tables}))
        return
    if out is not None:
        make_folder(out)
    for number, (columns, table) in enumerate(rendering.tables(found, loads=bool(by))):
        if number:
            typer.echo()
        print_table(columns, table, wide)
    say(rendering.note(found, str(a), str(b)))
    folder = b.parent if out is None else out
    with progress("figures"), output_folder(folder):
        files = rendering.write(found, folder / f"{a.stem}_{b.stem}", (a.stem, b.stem))
    for path in files:
        say(f"wrote {path}")
