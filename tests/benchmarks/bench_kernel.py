"""Times of the kernel's parts, for one joint and for all lanes: ``pytest tests/benchmarks/bench_kernel.py``.

Each call does a part `iteration.TIMES` times; a lane's share of a call in lanes is that over the joints in lock-step.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import REFERENCE
from tolstat import study
from tolstat.benchmarks.cost import iteration, parts, rates
from tolstat.benchmarks.cost.split import Once
from tolstat.common.tables import Fidelity
from tolstat.solver import simulation

pytest.importorskip("pytest_benchmark")
STUDY = REFERENCE.parents[1] / "studies" / "rigid_shafts.toml"


@pytest.fixture(scope="module")
def these():
    return rates.sample(study.load(STUDY), 64)


@pytest.fixture(scope="module")
def snaps(these):
    return list(iteration.snapshots(these, iteration.STATES))


@pytest.mark.parametrize("part", Once._fields)
def test_part_of_one_joint(benchmark, these, snaps, part):
    work, state, *_ = simulation.scratch(these.options)
    snap = snaps[0]
    state.q[:], state.v[:], state.a[:] = snap.q, snap.v, snap.a
    par = snap.params.view(np.recarray)[0]
    which = getattr(parts, part.upper())
    benchmark(parts.repeat, which, iteration.TIMES, snap.t, snap.cv, snap.ca, state, par, these.options, work)


@pytest.mark.parametrize("part", Once._fields)
def test_part_in_lanes(benchmark, these, snaps, part):
    batch = iteration.into_lanes(snaps, these.options)
    benchmark(parts.repeat_in_lanes, getattr(parts, part.upper()), iteration.TIMES, these.options, batch)


def test_start(benchmark, these):
    rows = these.params.view(np.recarray)
    benchmark(parts.start, rows, these.options, simulation.scratch(these.options))


def test_joints_in_lanes(benchmark, these):
    benchmark(simulation.simulate_rows, these.params, these.options)


def test_joints_one_at_a_time(benchmark, these):
    benchmark(rates.alone, these.params, these.options)


def test_quasistatic_joints(benchmark, these):
    static = these.options._replace(fidelity=int(Fidelity.QUASISTATIC))
    benchmark(simulation.simulate_rows, these.params, static)
