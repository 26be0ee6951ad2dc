"""``python -m tests.measure.cost studies/rigid_shafts.toml``: what a joint costs and where the time goes; two minutes.

Prints joints a second in lanes, one at a time and quasi-static; the time of each part; the share of the core's peak
rate; ratios to a dense LAPACK solution; workers; start-up; other integrators at an error of 1e-3. Everything is timed
in turn, in one run: on a machine with other load only the ratios count.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from tolstat.common.cores import available_cores, limit_threads

if __name__ == "__main__":
    limit_threads()  # of the libraries that are imported below, here and in workers

import numpy as np
from numpy.typing import NDArray

from studies.precision import runs
from studies.precision.integrators import Code, both_ways, installed
from studies.precision.measuring import choose, in_turn, machine
from studies.precision.points import build, cheapest
from studies.precision.runs import TRUTH, Job, OtherJob, OwnJob, TruthJob
from tests.measure import kernel_parts
from tests.measure.commands import say
from tests.support.kernel_states import Sample, sample
from tolstat.common.memory import peak_bytes
from tolstat.common.tables import Fidelity, Method, Options, Start, Status
from tolstat.display.text import align
from tolstat.solver import compilation, simulation
from tolstat.study import load

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.study import Study

Table = tuple[str, list[list[str]]]
"""Title and rows, the first of which is the head."""
ERROR = 1e-3
"""Error of the largest loads at which times are compared: of the worst joint, relative to its largest load."""
STEPS = (24, 36, 60, 90, 180, 360)
"""Steps a revolution of tolstat, beside those of the study; the cheapest that meets `ERROR` counts."""
RTOL = (1e-2, 1e-3, 1e-4, 1e-5)
"""Relative tolerances of the other integrators, of which the cheapest that meets `ERROR` counts."""
REVOLUTIONS, LIMIT = 2, 5.0
"""Revolutions that the other integrators compute, the last of which counts; CPU time at which they are stopped, s."""
TRUTH_RTOL = (1e-7, 1e-6)
JOINTS, BLOCK, REPEATS, SEED = 2, 64, 5, 4
IN_LANES = f"BDF2, {BLOCK} joints at once"
FIRST_JOINT = """
import sys
from tolstat import joint, sampling, study
from tolstat.solver import simulation
plan = study.load(sys.argv[1], n=1).at("")
params = joint.perturb(plan.joint, plan.operation, sampling.draw(plan, range(1)))
simulation.simulate_rows(params, plan.solver.options())
"""
COMPILE = """
import sys
from tolstat.common.tables import Fidelity, Options
from tolstat.solver import compilation
compilation.warm_up(Options(fidelity=int(Fidelity[sys.argv[1]])))
"""


def rates(these: Sample, rounds: int) -> Table:
    """CPU time of a joint on one core in each way, and counts of its numerical work."""
    params, options = these
    static = options._replace(fidelity=int(Fidelity.QUASISTATIC))
    ways = {
        "dynamic, in lanes": lambda: simulation.simulate_rows(params, options),
        "dynamic, one at a time": lambda: kernel_parts.alone(params, options),
        "quasi-static": lambda: simulation.simulate_rows(params, static),
    }
    times = in_turn(ways, rounds)
    lanes, alone, _ = ways
    results = times.returned[lanes].results
    steps, iterations, tangents, halvings = (
        float(results[name].mean()) for name in ("steps", "newton_iterations", "factorisations", "halvings")
    )
    title = (
        f"{len(params)} joints on one core, {(results['status'] == Status.OK).sum()} settled; dynamic: "
        f"{np.nanmean(results['revolutions']):.3g} revolutions,\n{steps:.4g} steps, {iterations:.4g} Newton iterations "
        f"({iterations / steps:.3g} a step), {tangents:.3g} tangents, {halvings:.2g} halvings"
    )
    rows = [["", "ms a joint", "joints/s", "speed, one at a time = 1", "speed, in lanes = 1"]]
    for name in ways:
        each = times.typical(name) / len(params)
        ratios = [f"{times.ratio(other, name):.3g}" for other in (alone, lanes)]
        rows.append([name, f"{1e3 * each:.3g}", f"{1 / each:.4g}", *ratios])
    return title, rows


class Stint(NamedTuple):
    """One block in one process: process id, joints, clock at begin and end (s), CPU time (s), peak memory (MB)."""

    process: int
    joints: int
    begin: float
    end: float
    cpu: float
    mb: float


def workers(these: Sample, blocks: int, size: int) -> Table:
    """Simulate `blocks` blocks a worker of `size` joints, with 1, 2, 4 and so on workers, up to one a core."""
    most, block = available_cores(), np.resize(these.params, size)
    stints = {}
    for n in [*(2**k for k in range(most.bit_length()) if 2**k < most), most]:
        ready = partial(compilation.warm_up, these.options)
        with ProcessPoolExecutor(n, get_context("spawn"), initializer=ready) as pool:
            stints[n] = list(pool.map(partial(_simulate, these.options), [block] * (blocks * n)))
    return "Workers", efficiency(stints)


def efficiency(stints: dict[int, list[Stint]]) -> list[list[str]]:
    """Rows for each number of workers, from their blocks; the first number is the reference."""
    rows = [["workers", "joints/s", "efficiency", "by CPU time", "MB a worker", "growth, MB"]]
    one, *_ = stints
    rate, of_cpu = ({n: own(done) for n, done in stints.items()} for own in (_rate, _cpu_rate))
    for n, done in stints.items():
        first: dict[int, float] = {}
        for stint in sorted(done, key=lambda stint: stint.begin):
            first.setdefault(stint.process, stint.mb)
        largest = max(stint.mb for stint in done)
        shares = [one * rate[n] / (n * rate[one]), of_cpu[n] / of_cpu[one]]
        memory = [f"{largest:.4g}", f"{largest - max(first.values()):.2g}"]
        rows.append([str(n), f"{rate[n]:.4g}", *(f"{share:.3g}" for share in shares), *memory])
    return rows


def _rate(done: list[Stint]) -> float:
    """Joints a second over the time in which all processes were busy."""
    processes = {one.process for one in done}
    begin = max(min(one.begin for one in done if one.process == p) for p in processes)
    end = min(max(one.end for one in done if one.process == p) for p in processes)
    inside = [(one, min(one.end, end) - max(one.begin, begin)) for one in done]
    joints = sum(one.joints * max(both, 0.0) / (one.end - one.begin) for one, both in inside)
    return joints / (end - begin)


def _cpu_rate(done: list[Stint]) -> float:
    """Joints per second of CPU time: excludes other programs on the machine, shows shared caches and memory."""
    return sum(one.joints for one in done) / sum(one.cpu for one in done)


def _simulate(options: Options, block: NDArray[np.void]) -> Stint:
    begin, cpu = time.monotonic(), time.process_time()
    simulation.simulate_rows(block, options)
    return Stint(os.getpid(), len(block), begin, time.monotonic(), time.process_time() - cpu, peak_bytes() * 1e-6)


def startup(study: Path, cold: bool, repeats: int) -> Table:
    """Times from the start of a process, the shortest of `repeats`; with `cold` also compilation into empty caches."""
    shown = min(_run(["-m", "tolstat", "--help"])[0] for _ in range(repeats))
    first = np.min([_run(["-c", FIRST_JOINT, str(study)]) for _ in range(repeats)], axis=0)
    rows = [
        ["", "s", "CPU time, s"],
        ["tolstat --help", f"{shown:.2f}", ""],
        ["first joint, kernels in the cache", f"{first[0]:.2f}", f"{first[1]:.2f}"],
    ]
    for fidelity in ("dynamic", "quasistatic") if cold else ():
        with tempfile.TemporaryDirectory() as folder:
            seconds, cpu = _run(["-c", COMPILE, fidelity.upper()], XDG_CACHE_HOME=folder)
        rows.append([f"compilation for {fidelity} joints", f"{seconds:.0f}", f"{cpu:.0f}"])
    return "Start-up", rows


def _run(arguments: list[str], **changed: str) -> tuple[float, float]:
    """Run a Python process; its wall-clock and CPU time, s."""
    here = {name: text for name, text in os.environ.items() if name != "NUMBA_CACHE_DIR" or not changed}
    before, begin = os.times(), time.perf_counter()
    subprocess.run([sys.executable, *arguments], env=here | changed, stdout=subprocess.DEVNULL, check=True)
    wall, after = time.perf_counter() - begin, os.times()
    return wall, sum(after[2:4]) - sum(before[2:4])


def others(study: Study) -> Table:
    """Solve some joints with tolstat and with other integrators at several settings."""
    options = study.solver.options()
    params, count = choose(study, JOINTS, SEED, BLOCK)
    points, truth = build(runs.run([*jobs(params, count, options)], say))
    title = f"Cheapest setting whose error of the largest loads is at most {ERROR:g} in all {len(truth)} joints"
    return title, contenders(points, options.steps_per_rev)


def jobs(params: NDArray[np.void], count: int, options: Options) -> Iterator[Job]:
    """All jobs on the first `count` joints, and tolstat's on the block of all joints."""
    rows = [(i, params[i : i + 1]) for i in range(count)]
    yield from (TruthJob(TRUTH, TRUTH_RTOL, row, options, i) for i, row in rows)
    codes: list[Code] = ["Radau", "CVODE"]
    tasks = [(str(one), one, options) for one in both_ways([code for code in codes if installed(code)])]
    # without tolstat's initial equilibrium: at rest, with a rising torque
    ramp = options._replace(start=int(Start.RAMP))
    tasks += [(f"{one}, from rest", one, ramp) for one in both_ways(["Radau"])]
    for name, integrator, start in tasks:
        yield from (OtherJob(name, integrator, RTOL, row, start, i, REVOLUTIONS, LIMIT) for i, row in rows)
    steps = sorted({*STEPS, options.steps_per_rev})
    bdf2 = [options._replace(fidelity=int(Fidelity.DYNAMIC), method=int(Method.BDF2), steps_per_rev=n) for n in steps]
    static = [one._replace(fidelity=int(Fidelity.QUASISTATIC)) for one in bdf2]
    for name, ladder in (("BDF2", bdf2), ("quasistatic", static)):
        yield from (OwnJob(name, tuple(ladder), row, i, REPEATS, 1) for i, row in rows)
    yield OwnJob(IN_LANES, tuple(bdf2), params, 0, REPEATS, count)


def contenders(points: pd.DataFrame, steps_per_rev: int) -> list[list[str]]:
    """Rows of the cheapest setting of each contender that meets the error.

    Parameters
    ----------
    points : DataFrame
        As `points.build` makes it.
    steps_per_rev : int
        The study's own setting.
    """
    lanes = points[points["contender"] == IN_LANES]
    best = float(lanes.loc[lanes["loads_worst"] <= ERROR, "ms"].min())
    default = float(lanes.loc[lanes["setting"] == steps_per_rev, "ms"].iloc[0])
    met = cheapest(points, "loads_worst", ERROR).to_dict("index")
    rows = [["", "setting", "ms a joint", "error", "time over ours in lanes", "with the study's steps"]]
    for name, group in points.groupby("contender", sort=False):
        one = met.get(name)
        ms = one["ms"] if one else float(group["ms"].max())  # without one, a lower bound
        times = [f"{'' if one else '> '}{value:.3g}" for value in (ms, ms / best, ms / default)]
        setting, error = (f"{one['setting']:g}", f"{one['loads_worst']:.1e}") if one else ("none met", "-")
        rows.append([str(name), setting, times[0], error, *times[1:]])
    return rows


def tables(study: Study, n: int, quick: bool, cold: bool) -> Iterator[Table]:
    """Make all measurements, one after the other."""
    rounds = 2 if quick else 7
    these = sample(study, min(n, 32) if quick else n)
    yield rates(these, rounds)
    yield from kernel_parts.measure(these, rounds)
    yield workers(these, *((2, 32) if quick else (8, 128)))
    yield startup(study.path, cold, 1 if quick else 3)
    if not quick:
        yield others(study)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path, help="study file (TOML)")
    parser.add_argument("--joints", type=int, default=256, metavar="N", help="number of joints; default 256")
    parser.add_argument("--quick", action="store_true", help="few joints and rounds, no others: half a minute")
    parser.add_argument("--cold", action="store_true", help="also compilation into an empty cache: two minutes more")
    given = parser.parse_args(arguments)
    study = load(given.study).at("")
    print(f"{study.name}: {machine()}")
    for title, rows in tables(study, given.joints, given.quick, given.cold):
        print(f"\n{title}\n\n{align(rows)}", flush=True)


if __name__ == "__main__":
    main()
