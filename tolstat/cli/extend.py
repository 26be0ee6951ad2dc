"""``tolstat extend``: add joints to a campaign."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli import run
from tolstat.cli._app import ResultPath, StudyOption, Wide, Workers
from tolstat.cli._shortage import check_memory
from tolstat.cli._talk import progress, say


def extend(
    file: ResultPath,
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="New number of joints, without the nominal joint.")],
    study_file: StudyOption = None,
    workers: Workers = None,
    report: Annotated[bool, typer.Option(help="Print the report at the end and write its files.")] = True,
    wide: Wide = False,
) -> None:
    """Add joints to a campaign and simulate them.

    Draws the next joints of the sampling sequence and simulates them; the joints already in FILE do not change. FILE
    then equals that of a campaign with N joints from the start. Latin hypercubes, sweeps and listed joints cannot be
    extended. Prints the report and writes its files as tolstat run does.

    To resume after an interruption: tolstat run STUDY --n N --out FILE

    Example: tolstat extend iso2768_f.h5 --n 2000
    """
    check_memory()
    from tolstat.campaign import extend as combine

    with progress("drawing the errors"):
        plan = combine.extend(file, n, study_file)
    say(f"{file}: extended to {n} joints")
    run.simulate(plan, file, workers=workers)
    run.conclude(file, report, wide)
