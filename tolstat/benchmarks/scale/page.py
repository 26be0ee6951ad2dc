"""Table and figure of the commands over the number of joints."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from tolstat.benchmarks import machine
from tolstat.benchmarks.scale.run import Row, Setup, growth
from tolstat.common.cores import available_cores
from tolstat.display import style, table, text
from tolstat.display.table import Column

MARKERS = ("o", "s", "D", "^")
COLUMNS = [
    Column("joints", lambda row: str(row["joints"])),
    Column("command", lambda row: row["command"], words=True),
    Column("clock, s", lambda row: text.formed(row["wall"])),
    Column("processor, s", lambda row: text.formed(row["cpu"])),
    Column("memory, MB", lambda row: text.formed(row["memory"] / 1e6, ".0f")),
    Column("file, MB", lambda row: text.formed(row["size"] / 1e6)),
    Column("growth", lambda row: text.formed(row["growth"], ".2f")),
    Column("failed", lambda row: row["failed"] or "", words=True, shown=table.has("failed")),
]
LEGEND = (
    "Processor: of all processes of a command. Memory: of the largest of them, not of all together. File: what the "
    "command writes. Growth: exponent of the processor time over the number of joints, from this number and the one "
    "before; 1 is in proportion."
)


def grouped(x: float, _: object = None) -> str:
    """Format a number with its digits in groups of three: ``10 000``, ``0.5``."""
    return f"{x:,.10g}".replace(",", "\N{NO-BREAK SPACE}")


def circumstances(setup: Setup) -> str:
    """Study, machine and versions; the load of the machine at this moment, which other programs cause."""
    busy = f"load of the machine before {os.getloadavg()[0]:.1f}"
    workers = f"{setup.workers} workers on {available_cores()} cores"
    return f"{setup.path.name}, causes of {setup.load}; {workers}, {busy}.\n{machine.text(machine.machine())}."


def records(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Rows by column, with ``growth``."""
    return [{**row._asdict(), "growth": own} for row, own in zip(rows, growth(rows), strict=True)]


def plain(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Rows for JSON, in seconds and bytes; None where there is no number."""
    return [{name: None if x != x else x for name, x in row.items()} for row in records(rows)]


def terminal(rows: Sequence[Row]) -> str:
    """Table for a terminal."""
    return table.as_text(COLUMNS, records(rows))


def markdown(rows: Sequence[Row], about: str) -> str:
    """Table for a document, with its legend and the circumstances `about`."""
    return "\n\n".join([text.markdown(table.cells(COLUMNS, records(rows))), LEGEND, about])


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
        good = [row for row in rows if row.failed is None]
        if good:
            _in_proportion(time, good)
        style.legend(page, *time.get_legend_handles_labels())
    return page


def _panel(ax: Axes, rows: Sequence[Row], name: str, scale: float, title: str, label: str) -> None:
    """Draw a line for each command; commands that failed have no point."""
    ax.set(xscale="log", yscale="log", xlabel="number of joints", ylabel=label)
    ax.set_title(title)
    for k, command in enumerate(dict.fromkeys(row.command for row in rows)):
        own = [row for row in rows if row.command == command]
        look: dict[str, Any] = {"color": style.COLOURS[k], "marker": MARKERS[k], "linestyle": style.DASHES[k]}
        ax.plot([r.joints for r in own], [scale * getattr(r, name) for r in own], ms=6.5, label=command, **look)
    for axis, wide in ((ax.xaxis, 100.0), (ax.yaxis, 1000.0)):
        low, high = axis.get_view_interval()
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < wide * low else (1.0,)))
        axis.set_major_formatter(FuncFormatter(grouped))
        axis.set_minor_formatter(NullFormatter())


def _in_proportion(ax: Axes, good: Sequence[Row]) -> None:
    """Draw the line of slope one through the last point of the first command, within the axes as they are."""
    last = max((row for row in good if row.command == good[0].command), key=lambda row: row.joints)
    ends = ax.get_xlim()
    with_limits = ax.get_ylim()
    through = [last.wall * x / last.joints for x in ends]
    ax.plot(ends, through, color=style.FAINT, lw=0.9, zorder=1, label="in proportion to the number of joints")
    ax.set(xlim=ends, ylim=with_limits)
