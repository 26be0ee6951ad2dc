"""``tolstat compare``: two campaigns side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import as_text, filling, make_folder, say


def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="Result file (HDF5) of a campaign.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="Result file of the campaign to compare with it.")],
    by: Annotated[
        list[str] | None,
        typer.Option("--by", metavar="LOAD", help="cross1.F, psi; repeat for more. Default: loads with limits."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the files, made if need be; default that of B."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables, and write no files.")] = False,
) -> None:
    """Tell what two campaigns differ in: their studies, the shares above limits, quantiles and means.

    Prints the shares above limits, and with --by (or without limits) quantiles and means. Joints drawn from the same
    seed are compared one by one, so that small differences show. Writes curves and the differences as pictures and
    CSV, and the joints that changed the side of a limit.
    """
    from tolstat.display import text
    from tolstat.questions.compare import rendering
    from tolstat.questions.compare.query import compared
    from tolstat.store import ResultStore

    with ResultStore.open(a) as one, ResultStore.open(b) as other:
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
    with filling(folder):
        files = rendering.write(found, folder / f"{a.stem}_{b.stem}", (a.stem, b.stem))
    for path in files:
        say(f"wrote {path}")
