"""Reading all of a result file; apart from the tests, so that a process that reads need not import what these do."""

from __future__ import annotations

from pathlib import Path

from tolstat.store import ResultFile


def read_all(path: Path) -> int:
    """Read everything that a result file holds; number of its joints."""
    with ResultFile.open(path) as store:
        store.counts()
        store.errors()
        store.results()
        for name in store.history_specs:
            store.histories(name)
        if store.case_names:
            _ = store.design
        return store.n
