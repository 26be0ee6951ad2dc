"""All benchmarks on one study."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tolstat import study as studies
from tolstat.benchmarks import iteration, joints, others, scaling, startup

ROUNDS, QUICK_ROUNDS = 7, 2


@dataclass(frozen=True)
class Bench:
    """Results of all benchmarks.

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
    rates: joints.Rates
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


def bench(path: Path, n: int, quick: bool, cold: bool, say: Callable[[str], None]) -> Bench:
    """Run all benchmarks: two minutes, half a minute with `quick`, two minutes more with `cold`.

    Parameters
    ----------
    path : Path
        Study file.
    n : int
        Number of joints.
    quick : bool
        Fewer joints and repetitions, and no other integrators: to check that the benchmarks run, not for the numbers.
    cold : bool
        Measure compilation too.
    say : callable
        Called with progress messages.

    Returns
    -------
    Bench

    Raises
    ------
    InputError
        When the study cannot be used.
    """
    study = studies.load(path)
    rounds = QUICK_ROUNDS if quick else ROUNDS
    these = joints.sample(study, min(n, 32) if quick else n)
    say(f"{len(these.params)} joints, in lanes, alone and quasi-static")
    rates = joints.rates(these, rounds)
    say("parts of a Newton iteration")
    parts = iteration.measure(these, rounds)
    say("workers")
    scales = scaling.measure(these)
    say("start of a process, with compilation into an empty cache" if cold else "start of a process")
    starts = startup.measure(str(path), cold, 1 if quick else 3)
    against = None
    if not quick:
        say("other integrators on the same joints")
        against = others.compare(study, 2, 5.0, say)
    return Bench(study.name, machine(), rates, parts, scales, starts, against)


def machine() -> dict[str, str]:
    """Processor, system, and versions of the packages that compute."""
    import numba
    import numpy
    import scipy
    from llvmlite.binding import get_host_cpu_name

    return {
        "processor": get_host_cpu_name(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numba": numba.__version__,
        "numpy": numpy.__version__,
        "scipy": scipy.__version__,
    }
