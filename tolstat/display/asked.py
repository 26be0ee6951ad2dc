"""What the reader of a page asks for, and the remarks that its sections add."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tolstat.common.errors import TolstatError
from tolstat.display.progress import Tell, silent


@dataclass(frozen=True)
class Asked:
    """Settings of a page that its sections follow.

    Attributes
    ----------
    path : Path
        The result file.
    accepted : float
        Accepted share: share of the joints that may be above a limit; NaN if none is given.
    replay : int
        Number of joints whose load histories are evaluated; without stored histories they are simulated again. With 0
        the page shows no histories.
    notes : list of str
        Remarks that concern the whole page; sections append to it.
    stage : callable
        Called with the name of each part of the page when its computation begins.
    processes : int
        Number of processes that make the page, whose bytes do not depend on it.
    """

    path: Path
    accepted: float = math.nan
    replay: int = 0
    notes: list[str] = field(default_factory=list)
    stage: Tell = silent
    processes: int = 1

    @contextmanager
    def noting(self, what: str) -> Iterator[None]:
        """Turn a `TolstatError` into a note that begins with `what`, so that the rest of the page is still made.

        The note names the file without its folder, so that the page does not depend on the folder.
        """
        try:
            yield
        except TolstatError as error:
            self.notes.append(f"{what}: {str(error).splitlines()[0].replace(str(self.path), self.path.name)}")
