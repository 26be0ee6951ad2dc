"""``tolstat new``, ``schema`` and ``spectrum``: studies to begin with, and schemas by which editors complete keys."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from tolstat.cli._library import np, schemas, spectra, starter, strict, studies, text
from tolstat.cli._shared import json_of, say
from tolstat.common.errors import Fault, InputError
from tolstat.display.options import Opt


def new(
    name: Annotated[Path, Opt("NAME")] = Path("study"), *, joint: Annotated[str, Opt("JOINT")] = "cirelli2021"
) -> None:
    """Write a study with comments that runs as it stands.

    The schema by which editors complete keys is written beside it. Existing studies and joints are not replaced.

    Example: tolstat new shaft --joint own

    Parameters
    ----------
    name : Path
        Name of the study, with or without .toml; may begin with a folder.
    joint : str
        own: write a joint file, too; or a joint that comes with tolstat.
    """
    path = name if name.suffix == ".toml" else name.with_name(f"{name.name}.toml")
    for file in starter.write(path, joint):
        say(f"wrote {file}")
    say(f"next: tolstat plan {quote(str(path))}")


def schema(
    kind: Annotated[str, Opt("study|joint|case")], *, out: Annotated[Path | None, Opt("JSON", writes=True)] = None
) -> None:
    """Print the JSON schema of a file, for editors.

    Editors with Taplo or Tombi complete and check keys by the schema that a TOML file names in its first line:
    #:schema ./study.schema.json

    Example: tolstat schema study --out study.schema.json

    Parameters
    ----------
    kind : str
        File that the schema is for.
    out : Path, optional
        Write the schema to a file instead of standard output.
    """
    if kind not in schemas.KINDS:
        remedy = strict.did_you_mean(kind, list(schemas.KINDS))
        raise InputError([Fault("tolstat schema", f"no file is called {kind!r}", remedy)])
    content = json_of(schemas.schema(kind))
    if out is None:
        typer.echo(content)
        return
    say(f"wrote {text.write(content + chr(10), out)}")


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
    studies.load(out, text=content)  # its faults, before anything is written
    text.write(content, out)
    rows = [("point", "alpha", "speed", "torque", "time", "damage")]
    values = (cycle.alpha, cycle.speed, cycle.torque, cycle.time, cycle.damage)
    for name, alpha, speed, torque, time, damage in zip(spectra.names(cycle), *values, strict=True):
        operation = f"{np.degrees(alpha):.4g} deg", f"{speed * 30 / np.pi:.4g} rpm", f"{torque:.4g} N m"
        rows.append((name, *operation, text.percent(time), text.percent(damage)))
    typer.echo(text.align(rows))
    share, rest = text.percent(1.0 - cycle.time.sum()), text.percent(max(0.0, 1.0 - cycle.damage.sum()))
    what = f"{rest} of the damage by revolutions (exponent {exponent:g})"
    say(f"left out: {share} of the time in which the shaft turns, with {what}")
    say(f"shares in the study are of the time at the points; the shaft stands still for {text.percent(cycle.standing)}")
    changes = f"their cycles of the torque do {text.percent(cycle.changes)} of the damage of those in the signal"
    others = f", {cycle.left_out} with smaller changes of the torque left out" if cycle.left_out else ""
    say(f"{len(cycle.visits)} visits of the points in {cycle.turns:.4g} revolutions{others}; {changes}")
    say(f"wrote {out}")
    say(f"next: tolstat run {quote(str(out))}")
