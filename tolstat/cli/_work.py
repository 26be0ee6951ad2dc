"""Work of a command that simulates: progress on standard error, stop signals and dead workers as exit codes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

from tolstat.cli._app import announce_compilation
from tolstat.cli._talk import fail, progress, say

if TYPE_CHECKING:
    from tolstat.campaign.work import Work


@contextmanager
def exit_codes() -> Iterator[None]:
    """Say how far a simulation came that was stopped, or lost its workers, and end with the exit code of that."""
    from tolstat.campaign import run as campaign
    from tolstat.campaign.pool import WorkerDied

    try:
        yield
    except campaign.Interrupted as stop:
        fail(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    except WorkerDied as error:
        fail(f"error: {error}")
        raise typer.Exit(1) from error


@contextmanager
def work(**settings: Any) -> Iterator[Work]:
    """Work of one command with progress on standard error; `settings` are fields of `Work`."""
    from tolstat.campaign.work import Work

    announce_compilation()
    with exit_codes(), progress() as shown:
        yield Work(display=shown, tell=say, **settings)
