"""``tolstat bench``: what a joint costs and where the time goes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import announce_compilation, as_text
from tolstat.cli._talk import say


def cost(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    n: Annotated[int, typer.Option("--joints", metavar="N", min=1, help="Number of joints to simulate.")] = 256,
    quick: Annotated[
        bool, typer.Option("--quick", help="Few joints and repetitions, no other integrators: half a minute.")
    ] = False,
    cold: Annotated[
        bool, typer.Option("--cold", help="Also time the compilation into an empty cache: two minutes more.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Measure what a joint costs and where the time goes.

    Takes two minutes. Prints joints a second in lanes, one at a time and quasi-static; the time of each part; the share
    of the core's peak rate; ratios to a dense LAPACK solution, and to scipy's Radau and SUNDIALS' CVODE at an error of
    1e-3; the efficiency of worker processes; start-up times. Everything is timed in turn, in one run: on a machine with
    other load only the ratios count.

    Example: tolstat bench studies/iso2768_f.toml --quick
    """
    from tolstat.benchmarks.cost import run, text

    announce_compilation()
    found = run.measure(study_file, n, quick, cold, say)
    typer.echo(as_text(found.plain()) if as_json else text.text(found))
