"""``tolstat new``: studies to begin with, of a joint, a drive shaft, another mechanism, or from a measured signal."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated, Literal

from tolstat.cli._library import np, spectra, starter, studies, text
from tolstat.cli._shared import echo, say
from tolstat.common.errors import Fault, gather, raise_all
from tolstat.common.files import check_target, write_text
from tolstat.common.shell import quote
from tolstat.display.options import Opt

RIGHT = 0.5 * math.pi
"""Right angle, rad."""


def new(
    name: Annotated[Path, Opt("NAME")] = Path("study"),
    *,
    joint: Annotated[str | None, Opt("JOINT")] = None,
    signal: Annotated[Path | None, Opt("CSV")] = None,
    alpha: Annotated[float | None, Opt("ANGLE", least=-RIGHT, most=RIGHT, unit="rad")] = None,
    exponent: Annotated[float | None, Opt("M", least=1.0, most=20.0)] = None,
    base: Annotated[Path | None, Opt("STUDY")] = None,
    shaft: bool = False,
    size: Annotated[str | None, Opt("SIZE")] = None,
    kind: Annotated[Literal["hinge", "cranks", "fourbar"] | None, Opt("KIND")] = None,
) -> None:
    """Write a study with comments that runs as it stands.

    The schema by which editors complete keys is written beside it. Existing studies and joints are not replaced.

    With --signal, operating points are the duty cycle in a measured signal with columns time, torque, speed of the
    input shaft and misalignment alpha, with units in the header: time [s], torque [N*m], speed [rpm], alpha [deg].
    Samples are sorted in classes; the 12 classes that do most of the damage, by revolutions and by changes of the
    torque, become operating points with their shares of the time. The order of their visits is written, too, for
    tolstat fatigue. Prints the points; what is left out is told.

    With --shaft, the study is of a drive shaft: two joints, two tubes and a spline. With --size, too, a joint file is
    written of a cross in the table that comes with tolstat, with its source and what is computed or assumed.

    With --kind, the study is of another over-constrained mechanism: a flap on three hinges, a plate on three parallel
    cranks, or a planar four-bar linkage.

    Example: tolstat new shaft --joint own

    Parameters
    ----------
    name : Path
        Name of the study, with or without .toml; may begin with a folder.
    joint : str, optional
        own: write a joint file, too; or a joint that comes with tolstat; default: cirelli2021.
    signal : Path, optional
        Measured signal (CSV) of which the operating points are made.
    alpha : float, optional
        Misalignment of a signal that has no column alpha; "9 deg".
    exponent : float, optional
        Wöhler exponent of the signal's damage, which is proportional to the torque to this power; default: 3.
    base : Path, optional
        Study file (TOML) whose operating points those of the signal replace; default: the study of tolstat new.
    shaft : bool
        Study of a drive shaft of two joints.
    size : str, optional
        Size of the crosses of a drive shaft, cup x length over two cups in mm: "27 x 81.8"; another one lists all.
    kind : str, optional
        Mechanism of the study: hinge, cranks or fourbar; default: a Cardan joint.
    """
    path = name if name.suffix.lower() == ".toml" else name.with_name(f"{name.name}.toml")
    faults: list[Fault] = []
    if sys.flags.optimize > 1:
        faults.append(Fault("python -OO", "leaves out the texts of the comments", "write studies without -OO"))
    if signal is None and any(value is not None for value in (alpha, base, exponent)):
        faults.append(Fault("--alpha, --base, --exponent", "are about a measured signal", "give it, too: --signal CSV"))
    if signal is not None and joint is not None:
        faults.append(Fault("--joint", "cannot be used together with --signal", "name a study with the joint: --base"))
    if shaft and (signal is not None or joint is not None):
        given = " and ".join(f"--{name}" for name, value in (("joint", joint), ("signal", signal)) if value is not None)
        remedy = "name the joint or the signal in the study that it writes"
        faults.append(Fault("--shaft", f"cannot be used together with {given}", remedy))
    others = {"shaft": shaft, "joint": joint is not None, "signal": signal is not None}
    if kind is not None and any(others.values()):
        given = " and ".join(f"--{name}" for name, there in others.items() if there)
        faults.append(Fault("--kind", f"cannot be used together with {given}", "remove one of the two"))
    if size is not None and not shaft:
        faults.append(Fault("--size", "is the size of the crosses of a drive shaft", "give --shaft, too"))
    if signal is not None and path.exists():
        faults.append(Fault(str(path), "exists", "give the study another name"))
    with gather(faults):
        check_target(path)
    raise_all(faults)
    if kind is not None:
        files = starter.write_linkage(path, kind)
    elif shaft:
        files = starter.write_shaft(path, size)
    elif signal is None:
        files = starter.write(path, joint or "cirelli2021")
    else:
        files = [_write_cycle(path, signal, alpha, exponent or spectra.EXPONENT, base)]
    for file in files:
        say(f"wrote {file}")
    say(f"next: tolstat plan {quote(str(path))}")


def _write_cycle(path: Path, signal: Path, alpha: float | None, exponent: float, base: Path | None) -> Path:
    """Write the study of the duty cycle in a signal, and print the duty cycle."""
    cycle = spectra.spectrum(signal, exponent, alpha)
    content = spectra.text(cycle, signal, path, base)
    studies.load(path, text=content)  # its faults, before anything is written
    write_text(path, content)
    rows = [("point", "alpha", "speed", "torque", "time", "damage")]
    values = (cycle.alpha, cycle.speed, cycle.torque, cycle.time, cycle.damage)
    for name, alpha, speed, torque, time, damage in zip(cycle.names, *values, strict=True):
        operation = f"{np.degrees(alpha):.4g} deg", f"{speed * 30 / np.pi:.4g} rpm", f"{torque:.4g} N m"
        rows.append((name, *operation, text.percent(time), text.percent(damage)))
    echo(text.align(rows))
    for gap in cycle.gaps:
        say(f"{gap}, which is not counted")
    share, rest = text.percent(1.0 - cycle.time.sum()), text.percent(max(0.0, 1.0 - cycle.damage.sum()))
    what = f"{rest} of the damage by revolutions (exponent {exponent:g})"
    say(f"left out: {share} of the time in which the shaft turns, with {what}")
    say(f"shares in the study are of the time at the points; the shaft stands still for {text.percent(cycle.standing)}")
    changes = f"their cycles of the torque do {text.percent(cycle.changes)} of the damage of those in the signal"
    others = f", {cycle.left_out} with smaller changes of the torque left out" if cycle.left_out else ""
    say(f"{len(cycle.visits)} visits of the points in {cycle.turns:.4g} revolutions{others}; {changes}")
    return path
