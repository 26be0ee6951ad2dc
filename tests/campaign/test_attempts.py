"""How often a joint that kills its worker is tried: twice when it is alone, whatever block it was in before."""

from __future__ import annotations

import os
import signal
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support import fakes
from tests.support.systems import needs_posix
from tolstat.common.tables import Options, Simulation, Status
from tolstat.store import ResultFile


def simulate_deadly(
    params: np.ndarray, options: Options, folder: Path, deadly: float, alone: int, **kept: Any
) -> Simulation:
    """Simulate; one joint kills its process in a block with others, and `alone` times when it is alone."""
    if deadly in params["R"]:
        number = len(list(folder.glob("alone_*")))
        (folder / f"{'alone' if len(params) == 1 else 'among'}_{os.getpid()}_{number}").touch()
        if len(params) > 1 or number < alone:
            os.kill(os.getpid(), signal.SIGKILL)
    return fakes.simulate(params, options, **kept)


@needs_posix
@pytest.mark.slow
@pytest.mark.parametrize("block", [1, 4])
@pytest.mark.parametrize(("alone", "crashed"), [(1, False), (100, True)])
def test_a_joint_whose_worker_dies_twice_when_it_is_alone_is_crashed(
    tmp_path: Path, block: int, alone: int, crashed: bool
) -> None:
    """The joint is row 5 of the campaign, in the fourth slot of a slice."""
    plan, path, tried = fakes.Study(n=8), tmp_path / "a.h5", tmp_path / "tried"
    tried.mkdir()
    deadly = fakes.draw(plan)["pin1.offset_t"][5]
    simulate = partial(simulate_deadly, folder=tried, deadly=deadly, alone=alone)
    told: list[str] = []
    slice_of_rows = {"rows": range(2, 8), "workers": 2, "block": block}
    counts = fakes.run(plan, path, simulate_rows=simulate, tell=told.append, **slice_of_rows)
    assert counts.done == 6
    with ResultFile.open(path) as store:
        status = store.status()
    assert np.flatnonzero(status == Status.CRASHED).tolist() == ([3] if crashed else [])
    assert len(list(tried.glob("alone_*"))) == 2
    assert bool(list(tried.glob("among_*"))) == (block > 1)
    assert any("row 5: crashed" in message for message in told) == crashed
