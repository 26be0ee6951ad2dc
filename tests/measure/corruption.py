"""Files with a changed bit through the commands that read them: each gives the right data, or names the damage.

``python -m tests.measure.corruption FOLDER 300 100`` makes a campaign of 220 joints at two operating points, with
histories, checks and what-if runs, once finished and once killed half way; changes one random bit of the first in 300
ways and of the second in 100; passes each to ``status --check``, ``report`` and ``export --statistics -``, and prints
how many commands ended how, and every fault: a traceback, a signal, and in the finished file a silent difference.
With ``page`` as last word, the page of the report is what is made of each file.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import tolstat
from tests.support import corruption, synthetic
from tolstat import study
from tolstat.common.counts import Counts

POINTS = """
[[operation]]
name = "cruise"
alpha = "10 deg"
speed = "500 rpm"
torque = "100 N*m"
[[operation]]
name = "start"
alpha = "15 deg"
speed = "100 rpm"
torque = "200 N*m"
"""
OUTPUT = '[output]\nhistories = "harmonics"\nharmonics = 4\n\n[limits]'
_HEAD, _, _REST = synthetic.REAL.partition("[operation]")
TEXT = _HEAD + POINTS + _REST[_REST.index("[tolerances]") :].replace("n = 60", "n = 220").replace("[limits]", OUTPUT)


def finished(folder: Path) -> Path:
    """Make the file of a whole campaign, with checks and joints of other tolerances."""
    path = folder / "finished.h5"
    (folder / "s.toml").write_text(TEXT, encoding="utf-8")
    tolstat.run(study.load(folder / "s.toml"), path)
    for words in (["causes", path, "--by", "cross1.F", "--run"], ["verify", path, "--near", "cross1.F > 700 N"]):
        ended = corruption.call(words, folder)
        assert ended.code == 0, ended.err
    return path


def killed(folder: Path) -> Path:
    """Make the file of a campaign that was killed when half of its joints were done."""
    path = folder / "killed.h5"

    def kill(counts: Counts) -> None:
        if counts.done >= counts.total // 2:
            os.kill(os.getpid(), signal.SIGKILL)

    pid = os.fork()
    if pid == 0:
        tolstat.run(study.load(folder / "s.toml"), path, block=16, progress=kill)
    os.waitpid(pid, 0)
    return path


def main(folder: Path, of_finished: int, of_killed: int, commands: Sequence[Sequence[str]]) -> None:
    """Make both files, change each and print what came of it."""
    folder.mkdir(exist_ok=True)
    for path, count in ((finished(folder), of_finished), (killed(folder), of_killed)):
        corruption.warm(path, folder / "warm", commands)
        found, kinds = corruption.search(path, folder / "x", range(count), commands)
        print(f"{path.name}, {path.stat().st_size} bytes, {count} changes:", kinds, flush=True)
        for one in found:
            if path.name != "killed.h5" or one.fault != corruption.SILENT:
                print(f"  {one.fault}: {one.change}: {one.words}\n{one.ended.err[-1500:]}", flush=True)
        print("  silent differences:", sum(one.fault == corruption.SILENT for one in found), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:4]), [corruption.PAGE] if sys.argv[4:] else corruption.READING)
