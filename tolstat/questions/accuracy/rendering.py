"""Numerical error of the loads as text: the table of errors, and sentences on how they were determined."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from tolstat.analysis.accuracy import FIDELITY, REFERENCE
from tolstat.common.load_kinds import KIND
from tolstat.common.loads import load_of
from tolstat.common.tables import Status
from tolstat.display import text
from tolstat.display.table import Column
from tolstat.questions.accuracy.query import TOTAL, distribution_rows
from tolstat.store.verification import Verification


def _small(x: float) -> str:
    return "-" if np.isnan(x) else f"{x:.1e}"


ERRORS = (
    Column("load", lambda row: str(row["load"])),
    Column("error", lambda row: str(row["error"]), words=True),
    Column("joints", lambda row: str(row["joints"])),
    Column("median", lambda row: _small(row["median"])),
    Column("95 % below", lambda row: _small(row["usual"])),
    Column("worst", lambda row: _small(row["worst"])),
)
"""Columns of the table `query.distribution`."""


LEAST = 1e-5
"""Smallest error that is given as a number in per cent."""


def in_percent(error: float) -> str:
    """Format an error in per cent; below `LEAST` the number says no more than that it is small."""
    return f"< {text.percent(LEAST)}" if error < LEAST else text.percent(error)


def basis(verification: Verification) -> str:
    """Words on how the numerical error was determined."""
    m = len(verification.rows)
    if REFERENCE in verification.checks:
        settled = int((verification.checks[REFERENCE].results["status"] == Status.OK).sum())
        return f"measured on {settled} of {m} joints against a tight reference"
    noun = "joint" if m == 1 else "joints"
    return f"estimated on {m} {noun} from half the step, tighter Newton and longer settling"


def note(verification: Verification, limits: Iterable[str] = ()) -> str:
    """Sentence on the numerical error of the largest loads: of kinds that every report shows, and those of `limits`."""
    kinds = {load_of(name).kind.key for name in limits}
    total = [row for row in distribution_rows(verification) if row["error"] == TOTAL]
    shown = [row for row in total if row["load"] in kinds or KIND[row["load"]].shown] or total
    words = [
        f"{_called(row['load'])} {_small(row['median'])}, at worst {_small(row['worst'])}"
        for row in shown
        if not np.isnan(row["worst"])
    ]
    noun = "error of numerics and fidelity" if FIDELITY in verification.checks else "numerical error"
    said = f"{noun}, {basis(verification)}: {'; '.join(words) or 'unknown'}"
    unknown = joints_without_error(verification)
    return f"{said}; {unknown}" if unknown else said


def _called(key: str) -> str:
    """Kind of loads in a sentence: its symbol, or what a load is called where several kinds share the symbol."""
    kind = KIND[key]
    return kind.symbol if kind.symbol == key else kind.noun


def joints_without_error(verification: Verification) -> str:
    """Words on joints that failed or did not settle in the campaign or in a check; empty if there are none."""
    base = verification.base["status"] == Status.OK
    words = [f"{int((~base).sum())} not settled"] if not base.all() else []
    for name, check in verification.checks.items():
        bad = int((base & (check.results["status"] != Status.OK)).sum())
        words += [f"{bad} not settled in {name}"] if bad else []
    return ", ".join(words)
