"""``tolstat extend``: more joints for a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, Workers, say
from tolstat.cli.run import carry_out

StudyFile = Annotated[
    Path | None,
    typer.Option("--study", metavar="STUDY", help="Study file, where the text that FILE keeps does not do any more."),
]


def extend(
    file: ResultFile,
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="Number of joints that the campaign shall have.")],
    study_file: StudyFile = None,
    workers: Workers = None,
    report: Annotated[bool, typer.Option(help="Write and print the report at the end.")] = True,
) -> None:
    """Continue a campaign to more joints.

    The next joints of its sequence are drawn and simulated; no joint that FILE holds changes. FILE is then the
    same as that of a campaign of N joints. Stopped with Ctrl-C, run STUDY --n N --out FILE goes on.
    """
    from tolstat.campaign import extend as combine
    from tolstat.campaign.blocks import Execution

    plan = combine.extend(file, n, study_file)
    say(f"{file}: extended to {n} joints")
    carry_out(plan, file, report, execution=Execution("processes", workers))
