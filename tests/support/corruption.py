"""Result files with a changed bit through commands that read them, each in a forked child of one warm process."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import psutil
from typer.testing import CliRunner

from tests.support.damage import flip
from tolstat import cli

READING = (
    ("status", "FILE", "--check"),
    ("report", "FILE"),
    ("export", "FILE", "--statistics", "-"),
)
"""Commands that a changed file is passed to; ``FILE`` stands for it."""
PAGE = ("report", "FILE", "--out", "page.html")
"""A command that reads nearly all of a file, and takes longer."""
LIMIT_S = 60
"""Processor seconds of a command."""
LIMIT_BYTES = 2 << 30
"""Memory that a command may take beyond that of the process that it is forked from."""
SILENT = "silent difference"


class Ended(NamedTuple):
    """How a command ended: exit code, or minus a signal; what it printed; what it said."""

    code: int
    out: str
    err: str


def call(words: Sequence[object], folder: Path) -> Ended:
    """Run a command in `folder`, in a forked child with limits of time and memory."""
    out, err = folder / "stdout", folder / "stderr"
    pid = os.fork()
    if pid == 0:
        _be_command([str(word) for word in words], out, err, folder)
    begun = time.monotonic()
    while not (ended := os.waitpid(pid, os.WNOHANG))[0]:
        if time.monotonic() - begun > 10 * LIMIT_S:
            os.kill(pid, signal.SIGKILL)
        time.sleep(0.002)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)  # what it started and left behind
    said, told = (path.read_text(encoding="utf-8", errors="replace") for path in (out, err))
    return Ended(os.waitstatus_to_exitcode(ended[1]), said, told)


def _be_command(words: list[str], out: Path, err: Path, folder: Path) -> None:
    code = 99
    os.setsid()
    try:
        process = psutil.Process()
        limit, used = process.memory_info().vms + LIMIT_BYTES, int(time.process_time())
        process.rlimit(psutil.RLIMIT_AS, (limit, limit))
        process.rlimit(psutil.RLIMIT_CORE, (0, 0))
        process.rlimit(psutil.RLIMIT_CPU, (used + LIMIT_S, used + LIMIT_S))
        for number, path in ((1, out), (2, err)):
            os.dup2(os.open(path, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), number)
        sys.stdout, sys.stderr = (os.fdopen(k, "w", encoding="utf-8", closefd=False) for k in (1, 2))
        os.chdir(folder)
        cli.app(words, prog_name="tolstat")
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 98
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def read(words: Sequence[str], path: Path) -> Ended:
    """Pass a file to a command in the file's folder; a page that the command writes is part of its output."""
    page = path.parent / "page.html"
    page.unlink(missing_ok=True)
    ended = call([path.name if word == "FILE" else word for word in words], path.parent)
    whole = ended.out + (page.read_text(encoding="utf-8") if page.exists() else "")
    return ended._replace(out=re.sub(r'.*"wall_s".*\n', "", whole))  # the one number that is another in each run


def fault(ended: Ended, usual: Ended) -> str:
    """What is wrong with the end of a command over a changed file; empty if nothing is."""
    if ended.code < 0:
        return f"signal {-ended.code}"
    if "Traceback" in ended.err or ended.code not in (0, 2):
        return f"exit code {ended.code}"
    if ended.code == 2:
        return "" if "error: " in ended.err and "hint: " in ended.err else "no message"
    return "" if ended.out == usual.out or "damaged" in ended.err else SILENT


class Found(NamedTuple):
    """A fault: number of the change, the command, what was wrong, and how the command ended."""

    change: str
    words: str
    fault: str
    ended: Ended


def search(
    path: Path, folder: Path, numbers: range, commands: Sequence[Sequence[str]] = READING
) -> tuple[list[Found], dict[str, int]]:
    """Change one bit of a file, for each number one in another part of the file, and pass it to commands.

    Returns
    -------
    list of Found
        All faults.
    dict
        Number of ends by kind: ``same`` output, ``refused``, ``told`` (other output, damage named), ``fault``.
    """
    folder.mkdir(exist_ok=True)
    copied, content = folder / path.name, path.read_bytes()
    copied.write_bytes(content)
    usual = [read(words, copied) for words in commands]
    assert not [ended for ended in usual if ended.code], usual
    found, kinds = [], {"same": 0, "refused": 0, "told": 0, "fault": 0}
    for part, number in enumerate(numbers):
        rng = np.random.default_rng(number)
        at, bit = int((part + rng.random()) / len(numbers) * len(content)), int(rng.integers(8))
        for words, before in zip(commands, usual, strict=True):
            copied.write_bytes(content)
            flip(copied, at, bit)
            ended = read(words, copied)
            wrong = fault(ended, before)
            if wrong:
                found.append(Found(f"{number}: bit {bit} of byte {at}", " ".join(words), wrong, ended))
            same = ended.out == before.out
            kinds["fault" if wrong else "refused" if ended.code else "same" if same else "told"] += 1
    return found, kinds


def warm(path: Path, folder: Path, commands: Sequence[Sequence[str]] = READING) -> None:
    """Run commands once in this process, so that its children inherit loaded modules and kernels."""
    folder.mkdir(exist_ok=True)
    shutil.copy(path, folder)
    with contextlib.chdir(folder):
        for words in commands:
            CliRunner().invoke(cli.app, [path.name if word == "FILE" else word for word in words])
