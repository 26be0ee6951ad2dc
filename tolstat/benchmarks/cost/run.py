"""All measurements of what a joint of a study costs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tolstat.benchmarks.cost import iteration, others, rates, scaling, startup
from tolstat.benchmarks.machine import machine
from tolstat.study import load

ROUNDS, QUICK_ROUNDS = 7, 2


@dataclass(frozen=True)
class Cost:
    """Results of all measurements.

    Attributes
    ----------
    study : str
        Name of the study.
    machine : dict of str to str
        Processor and versions.
    rates : Rates
        Joints a second.
    iteration : Iteration
        Time of a joint by part.
    scaling : list of Scale
        Joints a second for each number of workers.
    startup : Startup
        Times before the first joint.
    others : Comparison or None
        Comparison with other integrators; None if left out.
    """

    study: str
    machine: dict[str, str]
    rates: rates.Rates
    iteration: iteration.Iteration
    scaling: list[scaling.Scale]
    startup: startup.Startup
    others: others.Comparison | None

    def plain(self) -> dict[str, Any]:
        """Convert to plain values, parts by their names; numbers that are not finite become None."""
        facts = asdict(self)
        for name in ("lanes", "alone"):
            split = getattr(self.iteration, name)
            facts["iteration"][name] |= {"joint_us": split.joint_us._asdict(), "once_us": split.once_us._asdict()}
        return {name: _finite(value) for name, value in facts.items()}


def _finite(value: Any) -> Any:
    """Replace numbers that are not finite, which JSON lacks, by None."""
    if isinstance(value, dict):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def measure(path: Path, n: int, quick: bool, cold: bool, say: Callable[[str], None]) -> Cost:
    """Make all measurements: two minutes, half a minute with `quick`, two minutes more with `cold`.

    Parameters
    ----------
    path : Path
        Study file.
    n : int
        Number of joints.
    quick : bool
        Fewer joints and repetitions, and no other integrators: to check that everything runs, not for the numbers.
    cold : bool
        Measure compilation too.
    say : callable
        Called with progress messages.

    Returns
    -------
    Cost

    Raises
    ------
    InputError
        When the study cannot be used.
    """
    study = load(path).at("")
    rounds = QUICK_ROUNDS if quick else ROUNDS
    these = rates.sample(study, min(n, 32) if quick else n)
    say(f"{len(these.params)} joints, in lanes, alone and quasi-static")
    speeds = rates.measure(these, rounds)
    say("parts of a Newton iteration")
    parts = iteration.measure(these, rounds)
    say("workers")
    scales = scaling.measure(these, quick)
    say("start of a process, with compilation into an empty cache" if cold else "start of a process")
    starts = startup.measure(str(path), cold, 1 if quick else 3)
    against = None
    if not quick:
        say("other integrators on the same joints")
        against = others.compare(study, 2, 5.0, say)
    return Cost(study.name, machine(), speeds, parts, scales, starts, against)
