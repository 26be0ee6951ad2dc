"""All instruments on one study."""

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
    """What the instruments show.

    Attributes
    ----------
    study : str
        Its name.
    machine : dict of str to str
        Processor and versions.
    rates : Rates
        Joints a second.
    iteration : Iteration
        Where the time goes.
    scaling : list of Scale
        Over workers.
    startup : Startup
        Before the first joint.
    others : Comparison or None
        Against other integrators; None where that was left out.
    """

    study: str
    machine: dict[str, str]
    rates: joints.Rates
    iteration: iteration.Iteration
    scaling: list[scaling.Scale]
    startup: startup.Startup
    others: others.Comparison | None

    def plain(self) -> dict[str, Any]:
        """As plain values, parts by their names; None where a ratio has no number."""
        facts = asdict(self)
        for name in ("lanes", "alone"):
            split = getattr(self.iteration, name)
            facts["iteration"][name] |= {"joint_us": split.joint_us._asdict(), "once_us": split.once_us._asdict()}
        return {name: _finite(value) for name, value in facts.items()}


def _finite(value: Any) -> Any:
    """None in place of numbers that JSON does not have."""
    if isinstance(value, dict):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def bench(path: Path, n: int, quick: bool, cold: bool, say: Callable[[str], None]) -> Bench:
    """Measure; two minutes, with `quick` half of one, with `cold` two more.

    Parameters
    ----------
    path : Path
        Study file.
    n : int
        Joints of a campaign.
    quick : bool
        Fewer of everything, and no other integrators: a look at the machinery, not at the figures.
    cold : bool
        Measure compilation too.
    say : callable
        Told what is being measured.

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
    """Processor and versions of what computes."""
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
