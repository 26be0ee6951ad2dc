"""``python -m tests.measure.rounds studies/iso2768_f.toml``: where the evaluations of lanes go, by cause.

A round evaluates all lanes once, so its cost is one evaluation for each lane, with a joint or without. Everything is
counted but processor time, which is told beside the counts: on a machine with other load only its ratios count.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from tests.measure.kernel_parts import begin
from tests.support.kernel_states import Sample, sample
from tolstat.common.tables import Options
from tolstat.display.text import align
from tolstat.kernel.simd.lane import WIDTH
from tolstat.solver import simulation
from tolstat.study import load


class Calls(NamedTuple):
    """Sums over the calls of the lock-step with one kind of steps."""

    joints: int
    slots: int  # evaluations of all lanes, with a joint or without
    live: int  # evaluations of lanes with a joint
    steps: int
    iterations: int
    tangents: int  # rounds in which a tangent is computed
    seconds: float  # processor time


UNIFORM, REFINED, ALONE = "uniform steps", "refined joints", "joints alone"
NONE = Calls(0, 0, 0, 0, 0, 0, 0.0)


@contextmanager
def counting() -> Iterator[dict[str, Calls]]:
    """Count the calls of the lock-step, by kind of steps, and joints simulated alone, while the context lasts."""
    counts = dict.fromkeys((UNIFORM, REFINED, ALONE), NONE)
    run_lanes = simulation.run_lanes

    def counted(queue: Any, options: Options) -> NDArray[np.int64]:
        since, width = time.process_time(), simulation.width_for(len(queue.rows))
        tally = run_lanes(queue, options)
        spent, out = time.process_time() - since, queue.results
        rounds, live, tangents = (int(count) for count in tally)
        done = (int(out["steps"].sum()), int(out["newton_iterations"].sum()))
        made = Calls(len(out), rounds * width, live, *done, tangents * width, spent)
        kind = ALONE if width == 1 else REFINED if options.rtol > 0 else UNIFORM
        counts[kind] = Calls._make(before + more for before, more in zip(counts[kind], made, strict=True))
        return tally

    with mock.patch.object(simulation, "run_lanes", counted):
        yield counts


def count(params: NDArray[np.void], options: Options, block: int) -> dict[str, Calls]:
    """Simulate joints in blocks of `block`; counts by kind of steps."""
    with counting() as counts:
        for first in range(0, len(params), block):
            simulation.simulate_rows(params[first : first + block], options)
    return counts


def start_iterations(params: NDArray[np.void], options: Options) -> int:
    """Newton iterations of the starts of all joints."""
    return int(begin(params, options)["newton_iterations"].sum())


def causes(these: Sample, block: int) -> list[list[str]]:
    """Rows of the table: cause, evaluations a joint and their share, processor time a joint."""
    params, options = these
    count(params[:block], options, block)  # compiles, or loads, the kernels
    counts = count(params, options, block)
    plain = count(params, options._replace(peak_substeps=1, max_refinements=0), block)[UNIFORM]
    uniform, refined = counts[UNIFORM], counts[REFINED]
    began, n = start_iterations(params, options), len(params)
    looked = uniform.live - plain.live
    of_steps = [
        ("starts", began),
        ("uniform steps: one evaluation each", plain.steps),
        ("uniform steps: Newton's iterations", plain.iterations - began),
        ("lanes that wait for a tangent", plain.live - plain.steps - plain.iterations),
        ("closer look at peaks, with its waiting", looked),
        ("lanes without a joint", uniform.slots - uniform.live),
    ]
    of_refined = [
        (f"refined joints ({refined.joints} simulations): parts and iterations", refined.steps + refined.iterations),
        ("refined joints: lanes that wait for a tangent", refined.live - refined.steps - refined.iterations),
        ("refined joints: lanes without a joint", refined.slots - refined.live),
    ]
    total = uniform.slots + refined.slots
    rows = [["", "evaluations a joint", "share"]]
    rows += [[name, f"{part / n:.1f}", f"{part / total:.1%}"] for name, part in of_steps + of_refined]
    rows.append(["all", f"{total / n:.1f}", ""])
    for name, calls in (("uniform steps", uniform), ("refined joints", refined)):
        each = [f"{1e3 * calls.seconds / n:.3g} ms a joint", f"{1e6 * calls.seconds / max(1, calls.slots):.3g} us each"]
        rows.append([f"{name}: {calls.tangents / WIDTH / n:.3g} rounds with tangents a joint", *each])
    alone = counts[ALONE]
    name = f"joints alone ({alone.joints} simulations), beside these: evaluations"
    rows.append([name, f"{(alone.steps + alone.iterations) / n:.1f}", f"{1e3 * alone.seconds / n:.3g} ms a joint"])
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path, help="study file (TOML)")
    parser.add_argument("--joints", type=int, default=1024, metavar="N", help="number of joints; default 1024")
    parser.add_argument("--block", type=int, default=256, metavar="N", help="joints simulated at a time; default 256")
    parser.add_argument("--steps", type=int, metavar="N", help="steps a revolution instead of the study's")
    parser.add_argument("--torque", type=float, metavar="Nm", help="torque instead of the study's")
    given = parser.parse_args(arguments)
    study = load(given.study).at("")
    these = sample(study, given.joints)._replace(options=study.solver.options())
    if given.steps:
        these = these._replace(options=these.options._replace(steps_per_rev=given.steps))
    if given.torque:
        these.params["torque"] = given.torque
    print(f"{given.study.stem}: {len(these.params)} joints in blocks of {given.block}, {WIDTH} lanes\n")
    print(align(causes(these, given.block)), flush=True)


if __name__ == "__main__":
    main()
