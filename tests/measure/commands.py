"""``python -m tests.measure.commands STUDY``: time and memory of commands over the number of joints; three minutes.

Runs tolstat run, report (the page), causes and export --csv one after the other, each as a user does, after a run that
compiles the kernels. Prints time, processor time of all processes, memory of the largest of them, and size of the file
written. Growth is the exponent of the processor time over the number of joints. Takes 4 kB of disk a joint. Use a
machine without other load.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from studies.precision.measuring import insert, machine, markdown, split_page
from tests.measure import usage
from tolstat import study
from tolstat.common.cores import available_cores
from tolstat.display import style, table, text
from tolstat.display.table import Column

MARK = "scale"
MARKERS = ("o", "s", "D", "^")
COLUMNS = [
    Column("joints", lambda row: str(row["joints"])),
    Column("command", lambda row: row["command"], words=True),
    Column("clock, s", lambda row: text.formed(row["wall"])),
    Column("processor, s", lambda row: text.formed(row["cpu"])),
    Column("memory, MB", lambda row: text.formed(row["memory"] / 1e6, ".0f")),
    Column("file, MB", lambda row: text.formed(row["size"] / 1e6)),
    Column("growth", lambda row: text.formed(row["growth"], ".2f")),
]
LEGEND = (
    "Processor: of all processes of a command. Memory: of the largest of them, not of all together. File: what the "
    "command writes. Growth: exponent of the processor time over the number of joints, from this number and the one "
    "before; 1 is in proportion."
)


class Row(NamedTuple):
    """A command at one number of joints.

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
    """

    joints: int
    command: str
    wall: float
    cpu: float
    memory: float
    size: float


def numbers(words: str) -> list[int]:
    """Numbers of joints, such as ``"1000,10000"``; ValueError if they do not ascend from 1 at least."""
    found = [int(word) for word in words.split(",")]
    if found[0] < 1 or any(a >= b for a, b in pairwise(found)):
        raise ValueError(words)
    return found


def commands(path: Path, n: int, workers: int, folder: Path) -> dict[str, tuple[list[str], Path | None]]:
    """Arguments of each command for `n` joints of a study, and the file that it writes to `folder`."""
    base = study.load(path)
    point = ["--point", base.points[0].name] if len(base.points) > 1 else []
    file, page, csv = (folder / f"joints.{ending}" for ending in ("h5", "html", "csv"))
    campaign = ["--n", str(n), "--workers", str(workers), "--no-report", "--out", str(file)]
    return {
        "run": (["run", str(path), *campaign], file),
        "report": (["report", str(file), "--out", str(page)], page),
        "causes": (["causes", str(file), "--by", next(iter(base.asked), "cross1.F")], None),
        "export": (["export", str(file), "--csv", str(csv), *point], csv),
    }


def measure(path: Path, joints: Sequence[int], workers: int, folder: Path | None) -> list[Row]:
    """Measure each command at each number of joints, after a run of the fewest that compiles the kernels.

    Parameters
    ----------
    path : Path
        Study file.
    joints : sequence of int
        Numbers of joints, ascending.
    workers : int
        Worker processes of ``tolstat run``.
    folder : Path or None
        Folder for the files, which are removed after each number of joints; None for that of temporary files.

    Returns
    -------
    list of Row
        By number of joints, then in the order of the commands.

    Raises
    ------
    CalledProcessError
        When a command fails; it has told why.
    """
    rows: list[Row] = []
    for count, n in enumerate([joints[0], *joints]):
        with tempfile.TemporaryDirectory(prefix="tolstat-scale-", dir=folder, ignore_cleanup_errors=True) as own:
            for word, (arguments, file) in commands(path, n, workers, Path(own)).items():
                row = _measure(n, word, arguments, file)
                say(f"{n} joints, {word}: {row.wall:.1f} s, {row.memory / 1e6:.0f} MB")
                if count == 0:  # the kernels are compiled: this run does not count
                    break
                rows.append(row)
    return rows


def _measure(n: int, word: str, arguments: Sequence[str], file: Path | None) -> Row:
    script = [sys.executable, "-I", "-S", usage.__file__, sys.executable, "-m", "tolstat", *arguments]
    used = json.loads(subprocess.run(script, stdout=subprocess.PIPE, text=True, check=True).stdout)
    if code := used.pop("code"):
        raise subprocess.CalledProcessError(code, ["tolstat", *arguments])
    return Row(n, word, **used, size=file.stat().st_size if file else math.nan)


def growth(rows: Sequence[Row]) -> list[float]:
    """Exponent p of the processor time t ~ n^p, from each row and the same command at the number of joints n before.

    Returns
    -------
    list of float
        One for each row; NaN at the first number of joints.
    """
    before: dict[str, Row] = {}
    found = []
    for row in rows:
        last = before.get(row.command)
        before[row.command] = row
        found.append(math.log(row.cpu / last.cpu) / math.log(row.joints / last.joints) if last else math.nan)
    return found


def records(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Rows by column, with ``growth``."""
    return [{**row._asdict(), "growth": own} for row, own in zip(rows, growth(rows), strict=True)]


def figure(rows: Sequence[Row], about: str) -> Figure:
    """Draw time and memory against the number of joints, both logarithmic; `about`: the circumstances."""
    with style.settings():
        page = Figure(figsize=(11.0, 5.6))
        time, memory = page.subplots(1, 2)
        page.subplots_adjust(left=0.085, right=0.965, top=0.745, bottom=0.19, wspace=0.19)
        page.text(0.02, 0.965, "Commands over the number of joints", fontsize=15, fontweight="bold", va="top")
        page.text(0.02, 0.905, about, fontsize=9.5, color="#444444", va="top", linespacing=1.45)
        _panel(time, rows, "wall", 1.0, "Time of a command", "time on the clock [s]")
        _panel(memory, rows, "memory", 1e-6, "Memory of its largest process", "resident memory [MB]")
        last = max((row for row in rows if row.command == rows[0].command), key=lambda row: row.joints)
        ends, heights = time.get_xlim(), time.get_ylim()
        through = [last.wall * x / last.joints for x in ends]
        time.plot(ends, through, color=style.FAINT, lw=0.9, zorder=1, label="in proportion to the number of joints")
        time.set(xlim=ends, ylim=heights)
        page.legend(*time.get_legend_handles_labels(), loc="lower center", ncols=5, fontsize=9.5)
    return page


def _panel(ax: Axes, rows: Sequence[Row], name: str, scale: float, title: str, label: str) -> None:
    """Draw a line for each command."""
    ax.set(xscale="log", yscale="log", xlabel="number of joints", ylabel=label)
    ax.set_title(title)
    for k, command in enumerate(dict.fromkeys(row.command for row in rows)):
        own = [row for row in rows if row.command == command]
        look: dict[str, Any] = {"color": style.COLOURS[k], "marker": MARKERS[k], "linestyle": style.DASHES[k]}
        ax.plot([r.joints for r in own], [scale * getattr(r, name) for r in own], ms=6.5, label=command, **look)
    for axis, wide in ((ax.xaxis, 100.0), (ax.yaxis, 1000.0)):
        low, high = axis.get_view_interval()
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < wide * low else (1.0,)))
        axis.set_major_formatter(FuncFormatter(_grouped))
        axis.set_minor_formatter(NullFormatter())


def _grouped(x: float, _: object = None) -> str:
    """Format a number with its digits in groups of three: ``10 000``, ``0.5``."""
    return f"{x:,.10g}".replace(",", "\N{NO-BREAK SPACE}")


def say(words: str) -> None:
    """Print on standard error."""
    print(words, file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    cores = available_cores()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path, help="study file (TOML)")
    parser.add_argument("--joints", type=numbers, default="1000,10000,100000", metavar="N,N,...", help="ascending")
    parser.add_argument("--workers", type=int, default=cores, metavar="W", help="worker processes; default: cores")
    parser.add_argument("--folder", type=Path, metavar="DIR", help="folder for the files, which are removed")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="figure to write: SVG, PNG or PDF")
    parser.add_argument("--into", type=Path, metavar="FILE", help=f"page with a place '{MARK}' for the table")
    given = parser.parse_args(arguments)
    if given.into is not None:
        split_page(given.into, MARK)
    busy = f"load of the machine before {os.getloadavg()[0]:.1f}"
    rows = measure(given.study, given.joints, given.workers, given.folder)
    load = next(iter(study.load(given.study).asked), "cross1.F")
    about = f"{given.study.name}, causes of {load}; {given.workers} workers on {cores} cores, {busy}.\n{machine()}."
    print(table.fitted(COLUMNS, records(rows))[0])
    say(about)
    if given.into is not None:
        cells = ([column.cell(row) for column in COLUMNS] for row in records(rows))
        filled = markdown([[column.head for column in COLUMNS], *cells])
        insert(given.into, MARK, "\n\n".join([filled, LEGEND, about]))
    if given.plot is not None:
        style.save(figure(rows, about), given.plot.with_suffix(""), (given.plot.suffix,))


if __name__ == "__main__":
    main()
