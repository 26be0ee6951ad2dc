"""Work of a command that simulates: progress on standard error, stop signals and dead workers as exit codes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from tolstat.cli._app import announce_compilation
from tolstat.cli._talk import fail, progress, say

if TYPE_CHECKING:
    from tolstat.campaign.work import Work


@contextmanager
def work(workers: int | None, folder: Path, study_file: Path | None = None) -> Iterator[Work]:
    """Work of one command: worker processes, the folder of its result files, progress on standard error."""
    from tolstat.campaign import run as campaign
    from tolstat.campaign.pool import WorkerDied
    from tolstat.campaign.work import Work

    announce_compilation()
    try:
        with progress() as shown:
            yield Work(workers, folder, shown, say, study_file)
    except campaign.Interrupted as stop:
        fail(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    except WorkerDied as error:
        fail(f"error: {error}")
        raise typer.Exit(1) from error
