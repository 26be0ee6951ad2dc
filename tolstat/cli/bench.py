"""``tolstat bench``: what a joint costs and where the time goes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import announce_compilation, as_text, say


def bench(
    study_file: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).")],
    n: Annotated[int, typer.Option("--joints", metavar="N", min=1, help="Joints to simulate in each way.")] = 256,
    quick: Annotated[
        bool, typer.Option("--quick", help="Few joints and rounds, no other integrators: half a minute.")
    ] = False,
    cold: Annotated[
        bool, typer.Option("--cold", help="Measure compilation into an empty cache too: two minutes more.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Measure the solver on joints of a study, in two minutes.

    Joints a second in lanes, alone and quasi-static; where the time of a Newton iteration goes; operations a second
    against what the core does at most; a dense LAPACK solve instead of the structured one; worker processes; start of a
    process; scipy's Radau and SUNDIALS' CVODE at an error of 1e-3. All in one run and in turn: on a machine that does
    other things too only the ratios count.
    """
    from importlib.util import find_spec

    from tolstat.benchmarks import run
    from tolstat.benchmarks import text as page

    announce_compilation()
    found = run.bench(study_file, n, quick, cold, say)
    if not quick and find_spec("sksundae") is None:
        say('CVODE is left out: it needs scikit-sundae (pip install "tolstat[bench]")')
    typer.echo(as_text(found.plain()) if as_json else page.text(found))
