"""States of joints in the kernel: joints of a study, the last point of a revolution, lanes filled with such points.

The kernel's lanes are imported where they are used: the rest also runs without compilation.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.precision.measuring import parameters
from tests.support.of_cardan import RESULT, for_kernels
from tolstat.common.cardan import CARDAN
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Fidelity, Method, Options
from tolstat.solver import simulation

if TYPE_CHECKING:
    from tolstat.kernel.lanes.batch import Batch
    from tolstat.study import Study


UNLIMITED = 2**62
"""Newton iterations allowed to a joint."""


class Sample(NamedTuple):
    """Joints that are measured, and their settings.

    Attributes
    ----------
    params : ndarray of PARAM, shape (n,)
        Joints, all with the same number of contact stations.
    options : Options
        Settings of the study, with BDF2 at fixed steps, dynamic fidelity and no refinement: the same work in lanes and
        one at a time.
    """

    params: NDArray[np.void]
    options: Options


def sample(study: Study, n: int) -> Sample:
    """Take the first n random joints of a study, and keep those with as many contact stations as the first."""
    first = study.first_sample
    params = parameters(study, np.arange(first, min(first + n, study.rows)))
    alike = (params["n_stations"] == params["n_stations"][0]).all(axis=1)
    options = study.solver.options()
    fixed = options._replace(fidelity=int(Fidelity.DYNAMIC), method=int(Method.BDF2), rtol=0.0, max_refinements=0)
    return Sample(np.ascontiguousarray(params[alike]), fixed)


class Snapshot(NamedTuple):
    """State of a joint at one instant.

    Attributes
    ----------
    params : ndarray of PARAM, shape (1,)
        The joint.
    t, cv, ca : float
        Time, s; derivatives of velocity and acceleration by the unknowns in a step, 1/s and 1/s^2.
    q, v, a : ndarray, shape (dof,)
        Unknowns and derivatives; m, rad and s.
    """

    params: NDArray[np.void]
    t: float
    cv: float
    ca: float
    q: NDArray[np.float64]
    v: NDArray[np.float64]
    a: NDArray[np.float64]


def snapshots(these: Sample, n: int) -> Iterator[Snapshot]:
    """Yield the last recorded state of each of the first n joints."""
    params, options = these[0][:n], these.options
    results, left = np.zeros(len(params), RESULT).view(np.recarray), np.full(len(params), UNLIMITED)
    for i, samples in simulation.simulate_together(params, options, left, True, results):
        h = 2 * np.pi / (abs(float(params["omega"][i])) * options.steps_per_rev)
        k = round(float(results[i].revolutions) * options.steps_per_rev)
        here, before, first = (samples[(k - back) % options.steps_per_rev] for back in range(3))
        acceleration = (3 * here.v - 4 * before.v + first.v) / (2 * h)
        yield Snapshot(params[i : i + 1], k * h, 1.5 / h, (1.5 / h) ** 2, here.q.copy(), here.v.copy(), acceleration)


def into_lanes(snaps: list[Snapshot], options: Options) -> Batch:
    """Make lanes with a state in each, in memory of their own; states repeat where there are fewer than lanes."""
    from tolstat.kernel.lanes.batch import make_batch, put_joint
    from tolstat.kernel.simd.lane import WIDTH

    batch = make_batch(options)
    for lane in range(WIDTH):
        snap = snaps[lane % len(snaps)]
        put_joint(lane, snap.params.view(np.float64), batch)
        for name in ("q", "v", "a"):
            batch.motion[name][:, lane] = getattr(snap, name)
        for name in ("t", "cv", "ca"):
            batch.control[name][lane] = getattr(snap, name)
    batch.par.n_stations = snaps[0].params["n_stations"][0]
    return batch


def tally(these: Sample) -> NDArray[np.int64]:
    """Counts of all joints in lock-step: rounds, lanes with a joint summed over rounds, rounds with new tangents."""
    from tolstat.kernel.revolution.settle import make_samples

    params, options = these
    left, samples = np.full(len(params), UNLIMITED), make_samples(0, options.steps_per_rev)
    none = for_kernels(simulation.blank_results((0, 0), CARDAN))
    return simulation.run_lanes(simulation.make_queue(params, options, left, samples, none), options)


def dense(work: np.record, mechanism: Mechanism = CARDAN) -> NDArray[np.float64]:
    """Tangent as one matrix, (dof, dof): the blocks of `work` after assembly and before elimination."""
    lumps, shafts = len(mechanism.lumps), 6 * len(mechanism.lumps)
    s, m, body = np.zeros((mechanism.dof, mechanism.dof)), work.block, mechanism.bodies.index

    def rows(name: str) -> slice:
        return slice(6 * body(name), 6 * body(name) + 6)

    def put(first: slice, second: slice, block: NDArray[np.float64]) -> None:
        s[first, second], s[second, first] = block, block.T

    for lump, block in zip(mechanism.lumps, m, strict=False):
        s[rows(lump.name), rows(lump.name)] = np.triu(block) + np.triu(block, 1).T
    for pair, block in zip(mechanism.pairs, m[lumps:], strict=False):
        put(rows(pair.hole), rows(pair.pin), block)
    held = [bushing for bushing in mechanism.bushings if body(bushing.base) < lumps]
    for bushing, block in zip(held, m[lumps + len(mechanism.pairs) :], strict=False):
        put(rows(bushing.lump), rows(bushing.base), block)
    for bushing in mechanism.bushings:
        for shaft in mechanism.shafts:
            for name in {shaft.turns, shaft.slides} & {*mechanism.unknowns}:
                if shaft.name == bushing.base:
                    u = mechanism.unknowns.index(name)
                    put(rows(bushing.lump), slice(shafts + u, shafts + u + 1), work.edge[u, [body(bushing.lump)]].T)
    s[shafts:, shafts:] = np.triu(work.corner) + np.triu(work.corner, 1).T
    return s
