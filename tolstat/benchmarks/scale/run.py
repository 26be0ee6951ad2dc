"""Run, report, causes and export of campaigns of several sizes, one after the other."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from tolstat import study
from tolstat.benchmarks.scale import usage
from tolstat.common.errors import Fault, InputError, gather


class Setup(NamedTuple):
    """What is measured.

    Attributes
    ----------
    path : Path
        Study file.
    joints : list of int
        Numbers of joints, ascending.
    workers : int
        Worker processes of ``tolstat run``.
    load : str
        Load whose causes are asked for.
    point : list of str
        Options that select an operating point; empty if the study has one.
    """

    path: Path
    joints: list[int]
    workers: int
    load: str
    point: list[str]


class Row(NamedTuple):
    """A command at one number of joints; all numbers are NaN if it failed.

    Attributes
    ----------
    joints : int
        Number of joints.
    command : str
        Word of the command.
    wall, cpu : float
        Time on the clock, and processor time of its processes, s.
    memory : float
        Largest resident memory of any one of its processes, bytes.
    size : float
        Size of the file that it writes, bytes; NaN if it writes none.
    failed : str or None
        How it failed.
    """

    joints: int
    command: str
    wall: float = math.nan
    cpu: float = math.nan
    memory: float = math.nan
    size: float = math.nan
    failed: str | None = None


def load(path: Path, joints: str, workers: int) -> Setup:
    """Read the study and the numbers of joints, such as ``"1000,10000"``.

    Raises
    ------
    InputError
        With every fault of both.
    """
    faults: list[Fault] = []
    words = joints.split(",")
    numbers = [int(word) for word in words if word.strip().isdecimal()]
    if len(numbers) < len(words) or 0 in numbers or any(a >= b for a, b in pairwise(numbers)):
        faults.append(
            Fault("--joints", f"{joints!r} are not ascending numbers of joints", "write --joints 1000,10000,100000")
        )
        numbers = []
    if not hasattr(os, "wait4"):
        faults.append(Fault("tolstat bench scale", "this system does not tell what a process used", "use Linux"))
    base = None
    with gather(faults):
        base = study.load(path)
        if base.sampling.n != base.samples:
            found = f"with {base.sampling.method!r} the number of joints cannot be chosen"
            raise InputError([Fault(f"{path}: sampling.method", found, 'name a study that draws them, as "random"')])
        for n in numbers:
            with gather(faults):
                study.load(path, n=n)
    if faults or base is None:
        raise InputError(list(dict.fromkeys(faults)))
    point = ["--point", base.points[0].name] if len(base.points) > 1 else []
    return Setup(path, numbers, workers, next(iter(base.asked), "cross1.F"), point)


def commands(setup: Setup, n: int, folder: Path) -> dict[str, tuple[list[str], Path | None]]:
    """Arguments of each command for `n` joints, and the file that it writes to `folder`."""
    file, page, csv = (folder / f"joints.{ending}" for ending in ("h5", "html", "csv"))
    campaign = ["--n", str(n), "--workers", str(setup.workers), "--no-report", "--out", str(file)]
    return {
        "run": (["run", str(setup.path), *campaign], file),
        "report": (["report", str(file), "--out", str(page)], page),
        "causes": (["causes", str(file), "--by", setup.load], None),
        "export": (["export", str(file), "--csv", str(csv), *setup.point], csv),
    }


def measure(setup: Setup, folder: Path | None, say: Callable[[str], None]) -> list[Row]:
    """Measure each command at each number of joints, after a run of the fewest that compiles the kernels.

    Parameters
    ----------
    setup : Setup
        What is measured.
    folder : Path or None
        Folder for the files, which are removed after each number of joints; None for that of temporary files.
    say : callable
        Receives a sentence as each command ends.

    Returns
    -------
    list of Row
        By number of joints, then in the order of the commands.
    """
    rows: list[Row] = []
    fewest = min(setup.joints)
    with tempfile.TemporaryDirectory(prefix="tolstat-scale-", dir=folder, ignore_cleanup_errors=True) as own:
        _measure(fewest, "run", *commands(setup, fewest, Path(own))["run"])
    say(f"{fewest} joints, run: done once, not counted, so that kernels are compiled")
    for n in setup.joints:
        with tempfile.TemporaryDirectory(prefix="tolstat-scale-", dir=folder, ignore_cleanup_errors=True) as own:
            for word, (arguments, file) in commands(setup, n, Path(own)).items():
                first = next((row for row in rows if row.joints == n), None)
                if first is not None and first.failed:  # its file may be incomplete
                    row, why = Row(n, word, failed="not run"), f"{first.command} failed"
                else:
                    row, why = _measure(n, word, arguments, file)
                rows.append(row)
                how = f"{row.wall:.1f} s, {row.memory / 1e6:.0f} MB" if row.failed is None else f"{row.failed}: {why}"
                say(f"{n} joints, {word}: {how}")
    return rows


def _measure(n: int, word: str, arguments: Sequence[str], file: Path | None) -> tuple[Row, str]:
    """Row of a command, and why it failed, in its own words."""
    script = [sys.executable, "-I", "-S", usage.__file__, sys.executable, "-m", "tolstat"]
    with subprocess.Popen([*script, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            out, told = process.communicate()
        except BaseException:
            process.terminate()
            process.wait()
            raise
    why = " ".join(told.rpartition("error: ")[2].split())
    used = json.loads(out) if process.returncode == 0 else {"code": process.returncode}
    code = used.pop("code")
    if code:
        return Row(n, word, failed=f"exit code {code}" if code > 0 else f"signal {-code}"), why
    return Row(n, word, **used, size=file.stat().st_size if file else math.nan), why


def growth(rows: Sequence[Row]) -> list[float]:
    """Exponent p of the processor time t ~ n^p, from each row and the same command at the number of joints n before.

    Returns
    -------
    list of float
        One for each row; NaN at the first number of joints, and where a command failed.
    """
    before: dict[str, Row] = {}
    found = []
    for row in rows:
        last = before.get(row.command)
        before[row.command] = row
        found.append(math.log(row.cpu / last.cpu) / math.log(row.joints / last.joints) if last else math.nan)
    return found
