"""``python studies/precision/run.py``: measure speed against error, beside other integrators; four minutes.

The others are those of scipy, and SUNDIALS' CVODE and Exudyn where they are installed (``pip install ".[bench]"``).
Prints the fastest of tolstat and of the others at each error; writes ``precision.md`` (page), ``.csv`` (every setting),
``.png`` and ``.svg`` (figure). Use a machine without other load.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
MARK = "precision"


def say(words: str) -> None:
    """Print on standard error."""
    print(words, file=sys.stderr, flush=True)


def main() -> None:
    """Measure, and write the files."""
    from tolstat.common.cores import limit_threads

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("comparison", nargs="?", type=Path, default=HERE / "precision.toml", help="TOML file")
    parser.add_argument("--out", type=Path, default=Path(), metavar="DIR", help="folder for the files")
    parser.add_argument("--into", type=Path, metavar="FILE", help=f"page with a place '{MARK}' for the short table")
    parser.add_argument("--quick", action="store_true", help="two joints and few settings: one minute")
    given = parser.parse_args()
    limit_threads()  # of libraries that are imported from here on, in this process and in workers
    from studies.precision import page, runs, setup
    from studies.precision.measuring import insert, split_page

    if given.into is not None:
        split_page(given.into, MARK)
    given.out.mkdir(parents=True, exist_ok=True)
    asked, base = setup.load(given.comparison, given.quick)
    found = runs.run([*setup.jobs(asked, base, say)], say)
    print(page.write(found, asked, given.out / given.comparison.stem))
    if given.into is not None:
        insert(given.into, MARK, page.short(found))


if __name__ == "__main__":
    sys.path.insert(0, str(HERE.parent.parent))
    main()
