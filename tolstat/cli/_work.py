"""Simulations of a command: progress and notes on standard error, stop signals and dead workers as exit codes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from tolstat.cli._library import campaigns, compilation, listed, mounting, plausible, pool, works
from tolstat.cli._talk import fail, progress, say, warn
from tolstat.common.errors import Fault

if TYPE_CHECKING:
    from tolstat.common.tables import Variant
    from tolstat.joint import Joint
    from tolstat.study import Study


@contextmanager
def work(**settings: Any) -> Iterator[works.Work]:
    """Work of one command with progress on standard error; `settings` are fields of `Work`.

    A simulation that is stopped, or loses its workers, says how far it came and ends with the exit code of that.
    """
    compilation.announce()
    try:
        with progress() as shown:
            yield works.Work(display=shown, tell=say, **settings)
    except campaigns.Interrupted as stop:
        fail(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    except pool.WorkerDied as error:
        fail(f"error: {error}")
        raise typer.Exit(1) from error


def print_warnings(path: Path, joints: Iterable[Joint], variants: Iterable[Variant] = ()) -> None:
    """Print the warnings of the joint of a case or study, or of the joints of its `variants`; see `Joint.warnings`.

    Of several joints with a warning about the same key the first is printed, and how many others there are.
    """
    places = [f"variant {variant.family!r}: joint" for variant in variants] or ["joint"]
    faults: dict[str, list[Fault]] = {}
    for place, joint in zip(places, joints, strict=True):
        for fault in joint.warnings():
            faults.setdefault(fault.place, []).append(replace(fault, place=f"{place}.{fault.place}"))
    for first, *others in faults.values():
        more = f" (and {len(others)} more joints)" if others else ""
        warn(f"warning: {path}: {replace(first, found=first.found + more)}")


def print_study_notes(path: Path, study: Study) -> None:
    """Print what a study stands on, and its warnings.

    These are mounting and contact law; measured signals; warnings of its joints, of values that are probably not meant,
    shares without an interval, and a note where rigid shafts meet errors along them.
    """
    say(f"{study.name}: {study.joint_in_words}")
    for note in study.signals:
        say(f"note: {note}")
    axial = [joint.shaft.axial for joint in study.joints]
    if note := mounting.note(study.tolerances, axial, mounting.command(str(path), path.stem, study.joint)):
        say(f"note: {note}")
    print_warnings(path, study.joints, study.variants)
    for fault in plausible.warnings(study):
        warn(f"warning: {fault}")
    if not study.sampling.has_replicates and (reason := listed.without_interval(study.sampling.method)):
        warn(f"warning: {reason}")
