"""Corrupted result files through the commands: each must end with correct data, or with exit code 2 and one message.

``python -m tests.measure.corruption FILE 1000 [FIRST [COMMAND ...]]`` corrupts a copy of FILE, a result file of 220
joints, in 1000 ways, the first of them number FIRST (0), passes each to every command below, or to those named, and
prints every traceback, signal, hang and silent difference. What a command writes is compared, too. FILE may have
several operating points, and load histories or cycles: these pass through two commands more. Beside FILE of an
unfinished campaign lie its histories, and its study, of the same name: ``run`` goes on with it, while ``extend`` and
``merge`` would refuse it.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import h5py
from tolstat.store.histories import parts_folder

from tests.support import corruption

READING = (
    ("status", "FILE", "--json"),
    ("export", "FILE", "--csv", "-", "--quiet", "POINT"),
    ("export", "FILE", "--statistics", "-", "--quiet"),
    ("report", "FILE", "--out", "page.html", "--quiet"),
    ("causes", "FILE", "--by", "cross1.F", "--json"),
    ("verify", "FILE", "--near", "cross1.F > 1500 N", "--joints", "50", "--json", "--workers", "1"),
    ("replay", "FILE", "--row", "1", "--json", "POINT"),
)
WRITING = (
    ("extend", "FILE", "--n", "230", "--workers", "1", "--no-report"),
    ("merge", "FILE", "--out", "whole.h5"),
)
OF_HISTORIES = (
    ("export", "FILE", "--pylife", "-", "--quiet", "POINT"),
    ("fatigue", "FILE", "--by", "cross1.F_t", "--json"),
)
"""Commands that read load histories or cycles."""
GO_ON = ("run", "STUDY", "--out", "FILE", "--workers", "1", "--no-report", "--no-verify")


def _commands(path: Path) -> list[tuple[str, ...]]:
    """Commands for a file; a command that is about one operating point gets the first."""
    with h5py.File(path) as file:
        points = list(file.get("points", ()))
        unfinished = parts_folder(path).exists()
        histories = unfinished or "histories" in (file[f"points/{points[0]}"] if points else file)
    point = ("--point", points[0]) if points else ()
    go_on = tuple(str(path.with_suffix(".toml").resolve()) if word == "STUDY" else word for word in GO_ON)
    changing = (go_on,) if unfinished else WRITING
    commands = READING + OF_HISTORIES * histories + changing
    return [tuple(word for given in words for word in (point if given == "POINT" else (given,))) for words in commands]


def main(path: Path, count: int, first: int = 0, *names: str) -> None:
    """Corrupt a file `count` times; print the faults and how many commands ended how."""
    commands = [words for words in _commands(path) if not names or words[0] in names]
    with tempfile.TemporaryDirectory() as folder:
        corruption.warm(path, Path(folder), commands)
        for words in commands:
            found, kinds = corruption.search(path, Path(folder) / "x", range(first, first + count), [words])
            print(" ".join(words), kinds, f"faults {len(found)}", flush=True)
            for one in found:
                print(f"  {one.fault}: {one.corruption}\n{one.ended.err[-1500:]}", flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), *map(int, sys.argv[3:4]), *sys.argv[4:])
