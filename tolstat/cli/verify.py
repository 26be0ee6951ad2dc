"""``tolstat verify``: numerical error of a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tolstat.cli._library import accuracy, answers, checks, numerical
from tolstat.cli._shared import deliver, progress, say
from tolstat.common import cores, files
from tolstat.common.late import pandas as pd
from tolstat.display.options import AsJson, Opt, Wide, Workers


def verify(
    what: Annotated[Path, Opt("STUDY|FILE")],
    *,
    joints: Annotated[str | None, Opt("N|all")] = None,
    near: Annotated[str | None, Opt("LIMIT")] = None,
    seed: Annotated[int | None, Opt("S", least=0)] = None,
    out: Annotated[Path | None, Opt("CSV", writes=True)] = None,
    workers: Workers = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Estimate the numerical error on some joints.

    Simulates joints again with half the step, with a smaller Newton tolerance, from another initial state, with another
    integration method, and with a tight reference solution (scipy's Radau). Prints the distribution of the errors of
    the largest loads, relative to the largest load of the kind in the joint.

    Of a result file, checks settled joints and stores the checks in the file for the report. With --near, checks the
    joints nearest to a limit, 50 for each load of it, without another method and reference: how far their loads change,
    and to which side, tells how far the share above the limit moves. Intervals of all commands use it from then on.

    Example: tolstat verify iso2768_f.h5 --joints 2 --out errors.csv

    Parameters
    ----------
    what : Path
        Study file (TOML) or result file (HDF5).
    joints : str, optional
        Number of joints to check, or all; default: 24, near a limit 50.
    near : str, optional
        Check the joints nearest to a limit: "cross1.F > 700 N", "cross*.F > 700 N" or "any limit".
    seed : int, optional
        Seed of the choice of joints; default: that of the study.
    out : Path, optional
        Write the errors of each joint, check and load as CSV.
    """
    with progress("checks, then tight references") as shown:
        count = workers or cores.available_cores()
        if near is None:
            verification = checks.check(what, joints or 24, seed, count, progress=shown)
        else:
            verification = checks.check_near(what, near, joints or numerical.LEAST_NEAR, count, shown)
    units = dict.fromkeys(("median", "usual", "worst"), "1")
    rows, by_load = accuracy.error_rows(verification), accuracy.error_rows(verification, by_kind=False)
    parts: list[answers.Part] = [
        answers.Table("kinds", "By kind of load", accuracy.ERRORS, rows, units),
        answers.Table("loads", "By load", (), by_load, units),
        answers.Sentence(accuracy.note(verification)),
    ]
    facts = {"rows": verification.rows, "seed": verification.seed}
    facts |= {"checks": {name: check.description for name, check in verification.checks.items()}}
    deliver(answers.Answer("verify", "Numerical error", parts, facts), wide, as_json)
    if out is not None:
        with files.atomic_write(out) as temporary:
            pd.DataFrame(accuracy.joint_rows(verification)).to_csv(temporary, index=False, lineterminator="\n")
        say(f"wrote {out}")
