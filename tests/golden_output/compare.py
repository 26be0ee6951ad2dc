"""Comparison of a transcript with its golden file, and the message about what differs."""

from __future__ import annotations

import difflib
from pathlib import Path

from tests.golden_output.numbers import same_line
from tests.golden_output.transcript import NUMBERS

SHOWN = 60
"""Most lines of a difference that are shown."""


def difference(path: Path, name: str, actual: str) -> str:
    """Lines that differ between the golden file at `path`, called `name`, and the text now; empty if none does.

    Blocks whose head ends in ``, numbers`` are compared with a tolerance, all others letter by letter.
    """
    if not path.exists():
        return f"{name}: there is no golden file; pytest --update-golden writes it"
    expected = path.read_text(encoding="utf-8")
    if expected == actual:
        return ""
    before, now = expected.splitlines(), _aligned(expected.splitlines(), actual.splitlines())
    if before == now:
        return ""
    lines = list(difflib.unified_diff(before, now, f"golden {name}", "now", lineterm="", n=2))
    more = [f"... {len(lines) - SHOWN} more lines"] if len(lines) > SHOWN else []
    where = f"first difference of {name} under: {_command(before, now)}"
    return "\n".join([where, *lines[:SHOWN], *more, "pytest --update-golden takes the new output"])


def _aligned(before: list[str], now: list[str]) -> list[str]:
    """Lines of `now`, each as in `before` if it differs within the tolerances only; block by block, by their heads."""
    old_blocks, new_blocks = _blocks(before), _blocks(now)
    if [block[0] for block in old_blocks] != [block[0] for block in new_blocks]:
        return now
    lines = []
    for old, new in zip(old_blocks, new_blocks, strict=True):
        tolerant = old[0].endswith(NUMBERS) and len(old) == len(new)
        lines += [a if same_line(a, b) else b for a, b in zip(old, new, strict=True)] if tolerant else new
    return lines


def _blocks(lines: list[str]) -> list[list[str]]:
    """Lines of each block, its head first."""
    found: list[list[str]] = [[""]]
    for line in lines:
        if line.startswith(("== ", "$ ")):
            found.append([])
        found[-1].append(line)
    return found if found[0] != [""] else found[1:]


def _command(before: list[str], now: list[str]) -> str:
    """Command of the first line that differs."""
    found = ""
    for old, new in zip(before, now, strict=False):
        if old.startswith("$ "):
            found = old
        if old != new:
            break
    return found
