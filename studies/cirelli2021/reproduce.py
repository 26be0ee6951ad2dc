"""``python studies/cirelli2021/reproduce.py``: run the paper's cases and write the page beside its printed values.

In the current folder: ``cirelli2021.h5`` (209 MB), ``cirelli2021_paper.html`` with its pictures inside, and Tables
4 to 7 as ``cirelli2021_tables.csv``. A file that is there is completed; one that is whole is shown again.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
STUDY = HERE / "cirelli2021.toml"


def build(result: Path, stem: Path) -> str:
    """Write page and tables of a result file; returns the summary.

    Raises
    ------
    ValueError
        When the file does not hold the paper's cases.
    """
    from studies.cirelli2021 import page, page_source
    from tolstat.display import text
    from tolstat.store import ResultFile

    with ResultFile.open(result) as store:
        if not page_source.matching(store):
            raise ValueError(f"{result} does not hold the paper's cases: give a file of {STUDY.name}")
        study = page_source.read(store)
    page.write(study, stem.with_name(f"{stem.name}_paper.html"))
    entries = page.entries(study)
    text.csv({str(name): entries[name].tolist() for name in entries}, stem, "tables")
    return page.summary(study)


def main() -> None:
    """Simulate what is missing, then build."""
    import tolstat

    result = Path(f"{STUDY.stem}.h5")
    tolstat.run(tolstat.load(STUDY), result)
    print(build(result, result.with_suffix("")))


if __name__ == "__main__":
    sys.path.insert(0, str(HERE.parent.parent))
    main()
