"""``python -m tests.measure.coverage``: how often intervals contain the truth; half an hour on two cores.

Samples are drawn from laws with known answers, and every interval that a command shows is computed from them. The
result is the share of intervals that contain the truth, with its own interval; of those that do not, how many are above
the truth, and below it; how often an estimator refuses; the width over that of fresh joints. An estimator that is wrong
on purpose must be found. Exit code 1: an interval misses on one side in more than 3.5 %, where that is not known.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from studies.precision.measuring import insert, split_page
from tests.measure.commands import say
from tests.measure.coverage import page, run
from tolstat.common.cores import available_cores, limit_threads

MARK = "coverage"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=run.FULL, metavar="N", help="samples of each case; default 1000")
    parser.add_argument("--quick", action="store_true", help="200 seeds: ten minutes on two cores")
    parser.add_argument("--only", default="", metavar="WORD", help="statistics whose name has this word")
    parser.add_argument("--workers", type=int, default=available_cores(), metavar="W", help="processes; default: cores")
    parser.add_argument("--cases", action="store_true", help="also print every case")
    parser.add_argument(
        "--into", type=Path, metavar="FILE", help=f"page with a place '{MARK}', filled after every 50 seeds"
    )
    given = parser.parse_args(arguments)
    limit_threads()  # of the workers

    def keep(part: run.Coverage) -> None:
        if given.into is not None:
            insert(given.into, MARK, page.markdown(part))

    if given.into is not None:
        split_page(given.into, MARK)
    found = run.measure(run.QUICK if given.quick else given.seeds, given.only, given.workers, say, keep=keep)
    print(page.text(found, given.cases))
    for row in found.failed:
        say(f"{row.asked.statistic}, {row.asked.case}: misses more often than it claims")
    for row in found.controls_pass:
        say(f"{row.asked.statistic}, {row.asked.case}: not found")
    return int(bool(found.failed or found.controls_pass))


if __name__ == "__main__":
    sys.exit(main())
