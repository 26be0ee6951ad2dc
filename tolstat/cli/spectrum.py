"""``tolstat spectrum``: a study of the duty cycle in a measured signal."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import numpy as np
import typer

from tolstat import study
from tolstat.cli._talk import say
from tolstat.common.files import atomic_write
from tolstat.display import table, text
from tolstat.display.options import Opt
from tolstat.display.table import Column
from tolstat.study import spectrum as spectra

COLUMNS = (
    Column("point", lambda row: str(row["point"])),
    Column("alpha", lambda row: f"{np.degrees(row['alpha']):.4g} deg"),
    Column("speed", lambda row: f"{row['speed'] * 30 / np.pi:.4g} rpm"),
    Column("torque", lambda row: f"{row['torque']:.4g} N m"),
    Column("time", lambda row: text.percent(row["time"])),
    Column("damage", lambda row: text.percent(row["damage"])),
)


def spectrum(
    signal: Annotated[Path, Opt("CSV")],
    *,
    out: Annotated[Path, Opt("STUDY", writes=True)],
    exponent: Annotated[float, Opt("M", least=1.0, most=20.0)] = 3.0,
    base: Annotated[Path | None, Opt("STUDY")] = None,
) -> None:
    """Write a study of the duty cycle in a measured signal.

    The signal has columns time, torque, speed of the input shaft and misalignment alpha, with units in the header: time
    [s], torque [N*m], speed [rpm], alpha [deg]. Samples are sorted in classes; the 12 classes that do most of the
    damage, by revolutions and by changes of the torque, become operating points with their shares of the time. The
    order of their visits is written, too, for tolstat fatigue. Prints the points; what is left out is told.

    Example: tolstat spectrum studies/drive_cycle.csv --out drive_cycle.toml

    Parameters
    ----------
    signal : Path
        Measured signal (CSV).
    out : Path
        Study file (TOML) to write.
    exponent : float
        Wöhler exponent: damage of a revolution is proportional to the torque to this power.
    base : Path, optional
        Study file (TOML) whose operating points are replaced; default: the study of tolstat new.
    """
    cycle = spectra.read(signal, exponent)
    content = spectra.text(cycle, signal, out, base)
    study.load(out, text=content)  # its faults, before anything is written
    with atomic_write(out) as temporary:
        temporary.write_text(content, encoding="utf-8")
    keys = ("alpha", "speed", "torque", "time", "damage")
    rows: list[dict[str, Any]] = [
        {"point": name, **{key: getattr(cycle, key)[place] for key in keys}}
        for place, name in enumerate(spectra.names(cycle))
    ]
    typer.echo(table.as_text(COLUMNS, rows))
    share, damage = text.percent(1.0 - cycle.time.sum()), text.percent(max(0.0, 1.0 - cycle.damage.sum()))
    what = f"{damage} of the damage by revolutions (exponent {exponent:g})"
    say(f"left out: {share} of the time in which the shaft turns, with {what}")
    say(f"shares in the study are of the time at the points; the shaft stands still for {text.percent(cycle.standing)}")
    changes = f"their cycles of the torque do {text.percent(cycle.changes)} of the damage of those in the signal"
    others = f", {cycle.left_out} with smaller changes of the torque left out" if cycle.left_out else ""
    say(f"{len(cycle.visits)} visits of the points in {cycle.turns:.4g} revolutions{others}; {changes}")
    say(f"wrote {out}")
    say(f"next: tolstat run {quote(str(out))}")
