"""Start-up times: ``--help``, time to the first joint with kernels from the cache, compilation of the kernels."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

import numpy as np

FIRST_JOINT = "from tolstat.benchmarks.cost.startup import first_joint; first_joint({path!r})"
COMPILE = "from tolstat.benchmarks.cost.startup import compile_kernels; compile_kernels({fidelity!r})"


@dataclass(frozen=True)
class Startup:
    """Times from the start of a process; those without compilation are the shortest of a few.

    Attributes
    ----------
    help_s : float
        ``tolstat --help``, wall-clock time.
    first_joint_s : float
        Until the first joint of the study is simulated with kernels from the cache, wall-clock time.
    first_joint_cpu_s : float
        CPU time of the same.
    cold_s, cold_cpu_s : float or None
        Compiling the kernels of dynamic joints, wall-clock and CPU time; None if not measured.
    cold_quasistatic_s, cold_quasistatic_cpu_s : float or None
        Compiling the kernels of quasi-static joints.
    """

    help_s: float
    first_joint_s: float
    first_joint_cpu_s: float
    cold_s: float | None
    cold_cpu_s: float | None
    cold_quasistatic_s: float | None
    cold_quasistatic_cpu_s: float | None


def measure(study_path: str, cold: bool, repeats: int = 3) -> Startup:
    """Measure start-up times of new processes.

    Parameters
    ----------
    study_path : str
        Study of which the first joint is simulated.
    cold : bool
        Measure compilation too, into an empty cache of its own: minutes.
    repeats : int
        Repetitions of the measurements without compilation.

    Returns
    -------
    Startup
    """
    here = dict(os.environ)
    shown = min(_run(["-m", "tolstat", "--help"], here)[0] for _ in range(repeats))
    runs = [_run(["-c", FIRST_JOINT.format(path=study_path)], here) for _ in range(repeats)]
    compiled: dict[str, tuple[float, float]] = {}
    for fidelity in ("dynamic", "quasistatic") if cold else ():
        with tempfile.TemporaryDirectory() as folder:
            elsewhere = {name: text for name, text in here.items() if name != "NUMBA_CACHE_DIR"}
            elsewhere["XDG_CACHE_HOME"] = folder
            compiled[fidelity] = _run(["-c", COMPILE.format(fidelity=fidelity)], elsewhere)
    return Startup(
        shown,
        min(run[0] for run in runs),
        min(run[1] for run in runs),
        *compiled.get("dynamic", (None, None)),
        *compiled.get("quasistatic", (None, None)),
    )


def first_joint(study_path: str) -> None:
    """Simulate the first joint of a study as a campaign does; `measure` calls this in a new process."""
    from tolstat import study
    from tolstat.benchmarks.joints import parameters
    from tolstat.solver import simulation

    loaded = study.load(study_path, n=1).at("")
    simulation.simulate_rows(parameters(loaded, np.arange(1)), loaded.solver.options())


def compile_kernels(fidelity: str) -> None:
    """Compile the kernels for joints of a fidelity; `measure` calls this in a new process."""
    from tolstat.common.tables import Fidelity, Options
    from tolstat.solver import compilation

    compilation.warm_up(Options(fidelity=int(Fidelity[fidelity.upper()])))


def _run(arguments: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Run a Python process; its wall-clock and CPU time, s."""
    before, begin = _children_s(), time.perf_counter()
    subprocess.run([sys.executable, *arguments], env=environment, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begin, _children_s() - before


def _children_s() -> float:
    times = os.times()
    return times.children_user + times.children_system
