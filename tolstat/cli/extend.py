"""``tolstat extend``: add joints to a campaign."""

from __future__ import annotations

from typing import Annotated

from tolstat.campaign import extend as campaign
from tolstat.cli import run
from tolstat.cli._talk import progress, say
from tolstat.display.options import Opt, OtherStudy, Report, ResultPath, Wide, Workers


def extend(
    file: ResultPath,
    *,
    n: Annotated[int, Opt("N", least=1)],
    study_file: OtherStudy = None,
    workers: Workers = None,
    report: Report = True,
    wide: Wide = False,
) -> None:
    """Add joints to a campaign and simulate them.

    Draws the next joints of the sampling sequence and simulates them; the joints already in FILE do not change. FILE
    then equals that of a campaign with N joints from the start. Latin hypercubes, sweeps and listed joints cannot be
    extended. Prints the report and writes its files as tolstat run does.

    To resume after an interruption: tolstat run STUDY --n N --out FILE

    Example: tolstat extend iso2768_f.h5 --n 2000

    Parameters
    ----------
    n : int
        New number of joints, without the nominal joint.
    """
    with progress("drawing the errors"):
        plan = campaign.extend(file, n, study_file)
    say(f"{file}: extended to {n} joints")
    run.simulate(plan, file, workers=workers)
    run.conclude(file, report, wide)
