"""``tolstat bench scale``: time and memory of the commands over the number of joints."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import Workers, announce_compilation, as_text, make_folder
from tolstat.cli._talk import fail, say
from tolstat.common.errors import Fault, InputError, gather

MARK = "scale"
ENDINGS = (".svg", ".png", ".pdf")


def scale(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    joints: Annotated[
        str, typer.Option("--joints", metavar="N,N,...", help="Numbers of joints, ascending.")
    ] = "1000,10000,100000",
    workers: Workers = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            "--folder",
            metavar="DIR",
            help="Folder for the files, which are removed; default: that of temporary files.",
        ),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Figure to write: SVG, PNG or PDF.")
    ] = None,
    into: Annotated[
        Path | None,
        typer.Option(
            "--into", metavar="FILE", help=f"Markdown file; the table replaces what its comments '{MARK}' enclose."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Measure time and memory over the number of joints.

    Runs tolstat run, report (the page), causes and export --csv one after the other, each as a user does, after a run
    that compiles the kernels. Prints time, processor time of all processes, memory of the largest of them, and size of
    the file written. Growth is the exponent of the processor time over the number of joints. Takes three minutes on
    two cores, and 4 kB of disk a joint. Use a machine without other load. Exit code 1: a command failed.

    Example: tolstat bench scale studies/iso2768_f.toml --joints 1000,10000
    """
    from tolstat.benchmarks.scale import run
    from tolstat.common.cores import available_cores
    from tolstat.common.files import check_target
    from tolstat.display import marks

    faults: list[Fault] = []
    setup = None
    with gather(faults):
        setup = run.load(study_file, joints, available_cores() if workers is None else workers)
    if plot is not None and plot.suffix not in ENDINGS:
        faults.append(Fault(f"--plot {plot}", "is no name of a figure", f"end it in {', '.join(ENDINGS)}"))
    for target in (plot, into, folder / "joints.h5" if folder is not None else None):
        with gather(faults):
            if target is not None:
                check_target(target, study_file)
    with gather(faults):
        if into is not None:
            marks.split(into, MARK)
    if faults or setup is None:
        raise InputError(faults)
    if folder is not None:
        make_folder(folder)
    announce_compilation()
    from tolstat.benchmarks.scale import page
    from tolstat.display import style

    about = page.circumstances(setup)
    rows = run.measure(setup, folder, say)
    typer.echo(as_text({"about": about, "rows": page.plain(rows)}) if as_json else page.terminal(rows))
    say(about)
    if into is not None:
        marks.insert(into, MARK, page.markdown(rows, about))
        say(f"wrote {into}")
    if plot is not None:
        for file in style.save(page.figure(rows, about), plot.with_suffix(""), (plot.suffix,)):
            say(f"wrote {file}")
    failed = [row for row in rows if row.failed]
    for row in failed:
        fail(f"{row.joints} joints, {row.command}: {row.failed}")
    if failed:
        raise typer.Exit(1)
