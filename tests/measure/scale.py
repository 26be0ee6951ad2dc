"""A campaign of many rows with a stub in the kernel's place: memory of the parent, time a row, size of the file.

``python -m tests.measure.scale 10000000 FOLDER`` prints what it measured; the file is deleted. The joints are drawn and
written as those of a real campaign; only their simulation is left out, so that what the campaign itself takes is seen.
After FOLDER may come the rows of a block, and then patterns of the results to keep, ``"cross*.F_max"`` among them.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support import fakes, synthetic
from tests.support.of_cardan import RESULT
from tolstat import joint, sampling, study
from tolstat.campaign import run as campaign
from tolstat.common.counts import Counts
from tolstat.common.fields import HistorySpec
from tolstat.common.memory import peak_bytes
from tolstat.common.tables import Options, Simulation, Status
from tolstat.store import ResultFile


def simulate(params: np.ndarray, options: Options, **rest: object) -> Simulation:
    """Stub: results that depend on the joint's errors and cost nothing."""
    results = np.zeros(len(params), RESULT)
    results["status"], results["settled"] = Status.OK, 1
    results["F_max"][:, 0] = 600.0 + 1e6 * params["pin_point"][:, 0, 1]
    return Simulation(results, {})


def no_histories(*_: object) -> dict[str, HistorySpec]:
    """Keep no histories."""
    return {}


def measure(n: int, folder: Path, block: int = 4096, results: Sequence[str] = ()) -> dict[str, Any]:
    """Run a campaign of `n` joints to the half, go on with it, and say what that took."""
    source = folder / "scale.toml"
    text = synthetic.STUDY.replace("n = 60", f"n = {n}")
    if results:
        text = f"{text.partition('[limits]')[0]}[output]\nresults = {json.dumps(results)}\n"
    source.write_text(text, encoding="utf-8")
    plan, path = study.load(source), folder / "scale.h5"
    small: dict[str, Any] = {"workers": 1, "block": block}
    stand_in = {"simulate_rows": simulate, "history_specs": no_histories, "warm_up": fakes.warm_up}
    fakes.replace_functions(pytest.MonkeyPatch(), **stand_in, is_compiled=lambda *_, **__: False)
    campaign.run(study.load(source, n=1000), folder / "first.h5", **small)  # what the code itself takes
    (folder / "first.h5").unlink()
    before, times = peak_bytes(), [time.perf_counter()]

    def note_begin(counts: Counts) -> None:
        if len(times) in (1, 3):
            times.append(time.perf_counter())

    campaign.run(plan, path, until_row=n // 2, progress=note_begin, **small)
    times.append(time.perf_counter())
    campaign.run(plan, path, progress=note_begin, **small)
    times.append(time.perf_counter())
    with ResultFile.open(path) as store:
        assert store.complete
        last = store.results(slice(n, n + 1))["F_max"][0, 0]
    params = joint.perturb(plan.joint, plan.operation, sampling.draw(plan, range(n, n + 1)))
    expected = 600.0 + 1e6 * params["pin_point"][0, 0, 1]
    assert last == expected
    made, half, resumed, rest = np.diff(times)
    found = {
        "rows": plan.rows,
        "block": block,
        "parent_MB_before": before / 1e6,
        "parent_MB_at_most": peak_bytes() / 1e6,
        "create_us_a_row": 1e6 * made / n,
        "store_us_a_row": 1e6 * (half + rest) / n,
        "resume_s": resumed,
        "file_bytes_a_row": path.stat().st_size / n,
    }
    path.unlink()
    return found


if __name__ == "__main__":
    rows, folder, *rest = sys.argv[1:]
    print(json.dumps(measure(int(rows), Path(folder), *map(int, rest[:1]), results=rest[1:]), indent=2))
