"""What a question that simulates is given: worker processes, a folder for result files, progress and messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from tolstat.display.progress import Display, silent

if TYPE_CHECKING:
    from tolstat.study import Study


@dataclass(frozen=True)
class Work:
    """Simulation for a question.

    Attributes
    ----------
    workers : int, optional
        Number of worker processes; by default one per core.
    folder : Path
        Folder of result files.
    display : Display
        Shows progress.
    tell : callable
        Receives messages.
    study_file : Path, optional
        Study to read instead of the text stored in a result file that is simulated further.
    point : str
        Operating point asked for, for a simulation that can have only one.
    """

    workers: int | None = None
    folder: Path = Path()
    display: Display = field(default_factory=Display)
    tell: Callable[[str], None] = silent
    study_file: Path | None = None
    point: str = ""

    def run(self, study: Study, name: str) -> Path:
        """Simulate the pending joints of a campaign into the file `name` of the folder; returns its path.

        Raises
        ------
        StoreError, Interrupted, WorkerDied
            As `campaign.run.run`.
        """
        from tolstat.campaign.run import run  # of a question that simulates, `--help` reads this file

        path, shown = self.folder / name, self.display
        counts = run(study, path, self.workers, progress=shown, tell=self.tell, stage=shown.stage)
        self.tell(f"{path}: {counts.done} {counts.counted}, {counts.shortfall}")
        return path
