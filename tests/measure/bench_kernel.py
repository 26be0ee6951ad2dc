"""Times of the kernel's parts, for one joint and for all lanes: ``pytest tests/measure/bench_kernel.py``.

Each call does a part `kernel_parts.TIMES` times; in lanes, a joint's share is that over the lanes.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.measure import kernel_parts
from tests.measure.kernel_parts import STATES, TIMES, Once
from tests.support.environment import ROOT
from tests.support.kernel_states import into_lanes, sample, snapshots
from tolstat import study
from tolstat.common.tables import Fidelity, Status
from tolstat.solver import simulation

pytest.importorskip("pytest_benchmark")
STUDY = ROOT / "studies" / "rigid_shafts.toml"


@pytest.fixture(scope="module")
def these():
    return sample(study.load(STUDY), 64)


@pytest.fixture(scope="module")
def snaps(these):
    return list(snapshots(these, STATES))


@pytest.mark.parametrize("part", Once._fields)
def test_part_of_one_joint(benchmark, these, snaps, part):
    work, state, *_ = simulation.scratch(these.options)
    snap = snaps[0]
    state.q[:], state.v[:], state.a[:] = snap.q, snap.v, snap.a
    par = snap.params.view(np.recarray)[0]
    which = getattr(kernel_parts, part.upper())
    benchmark(kernel_parts.repeat, which, TIMES, snap.t, snap.cv, snap.ca, state, par, these.options, work)
    assert np.isfinite(state.residual).all()
    assert state.residual.any()


@pytest.mark.parametrize("part", Once._fields)
def test_part_in_lanes(benchmark, these, snaps, part):
    batch = into_lanes(snaps, these.options)
    benchmark(kernel_parts.repeat_in_lanes, getattr(kernel_parts, part.upper()), TIMES, these.options, batch)
    residual = batch.motion["residual"]
    assert np.isfinite(residual).all()
    assert residual.any()


def test_start(benchmark, these):
    rows = these.params.view(np.recarray)
    scratch = simulation.scratch(these.options)
    benchmark(kernel_parts.start, rows, these.options, scratch)
    assert np.isfinite(scratch[1].q).all()
    assert scratch[1].q.any()


def test_joints_in_lanes(benchmark, these):
    found = benchmark(simulation.simulate_rows, these.params, these.options)
    assert (found.results["status"] == Status.OK).all()


def test_joints_one_at_a_time(benchmark, these):
    results = benchmark(kernel_parts.alone, these.params, these.options)
    assert (results["status"] == Status.OK).all()


def test_quasistatic_joints(benchmark, these):
    static = these.options._replace(fidelity=int(Fidelity.QUASISTATIC))
    found = benchmark(simulation.simulate_rows, these.params, static)
    assert (found.results["status"] == Status.OK).all()
