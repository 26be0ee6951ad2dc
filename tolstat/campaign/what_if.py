"""Simulate joints of a campaign's seed with other tolerances or other keys, and keep their loads in the file."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.campaign import pool
from tolstat.campaign.block import Block, Timed, loads_of, results_of
from tolstat.campaign.blocks import work_beside
from tolstat.common.counts import Counts
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Options, Status, worst_status
from tolstat.common.wording import row_of
from tolstat.joint import perturb
from tolstat.store import Reader, Writer, what_if
from tolstat.store.hdf5 import store_error
from tolstat.store.metadata import differing_code
from tolstat.store.recorded import settings
from tolstat.store.what_if import Altered
from tolstat.study import Study, axes, widths
from tolstat.study.assumptions import with_value
from tolstat.study.changes import differing
from tolstat.study.points import at
from tolstat.study.tolerances.correlation import Group

WIDTH, FIT, EXCHANGE, JOINT, STUDY, AS_DRAWN = "width", "fit", "exchange", "joint", "study", "as drawn"
"""Kinds of sets: a line with another width, fit, errors of another joint; other keys of the joint; of the study."""
BLOCK = 128
"""Number of joints that a worker takes at a time: enough to keep the lanes busy, and 0.2 s on the main job."""
SLOW_S = 60.0
"""Time of a joint that is assumed where all joints of the pilot crash, s."""
SAVE_S = 60.0
"""Time after which finished joints are written to the file, s: a kill loses those since."""


class Change(NamedTuple):
    """A change of the tolerances or of the joint, and which joints are wanted of it.

    Attributes
    ----------
    about : dict
        See `Altered.about`.
    study : Study
        The study as changed: its tolerances, its nominal joint, its operating points.
    draw : callable
        Range of consecutive joints -> their errors, table ERROR.
    numbers : range
        The joints; numbers are those of `Altered.first`.
    """

    about: Mapping[str, Any]
    study: Study
    draw: Callable[[range], NDArray[np.void]]
    numbers: range


def stepped(study: Study, line: Group, step: str, numbers: range) -> Change:
    """A line after a step (`widths.steps`); joint i is sample i of the campaign but for this line."""
    changed = widths.after(study, line, step)
    about: dict[str, Any] = {"step": step, "words": widths.words(study, line, step)}
    about |= {"tolerances": {name: changed.tolerances[name].describe() for name in line.names}}
    if step in widths.STEPS or changed.fit is None:
        return _change(WIDTH, line.label, changed, numbers, **about)
    return _change(FIT, line.label, changed, numbers, **about, diameters=changed.fit.diameters)


def exchanged(study: Study, line: Group, numbers: range) -> Change:
    """Joint i is sample 2i of the campaign with the line's errors of sample 2i + 1."""
    change = _change(EXCHANGE, line.label, study, numbers, names=list(line.names))
    return change._replace(draw=partial(_exchange, change.study, line))


def about_joint(study: Study, keys: Mapping[str, Any]) -> dict[str, Any]:
    """Return `Altered.about` of samples of the campaign with `keys` of what is assumed."""
    label = ", ".join(f"{key} = {value}" for key, value in keys.items())
    return {"kind": JOINT, "label": label, "seed": study.sampling.seed, "keys": dict(keys)}


def with_joint(study: Study, keys: Mapping[str, Any], numbers: range) -> Change:
    """Joint i is sample i of the campaign with `keys` of what is assumed, see `assumptions.with_value`.

    Raises
    ------
    InputError
        When the keys make no valid joint.
    """
    about = about_joint(study, keys)
    return _change(JOINT, about["label"], with_value(study, keys), numbers, keys=about["keys"])


def with_study(study: Study, changed: Study, label: str, numbers: range) -> Change:
    """Joint i is sample i of a changed study, `study.changes.read`, drawn with its seed; the label says the change."""
    return _change(STUDY, label, changed, numbers, differs=differing(study, changed))


def as_drawn(study: Study, numbers: range) -> Change:
    """Further samples of the campaign, or samples at random of one that is not: nothing is changed."""
    return _change(AS_DRAWN, "no line", study, numbers)


def _change(kind: str, label: str, changed: Study, numbers: range, **about: Any) -> Change:
    """Samples of a changed study, drawn at random with its seed."""
    drawn = widths.applied(changed, {})
    head = {"kind": kind, "label": label, "seed": drawn.sampling.seed}
    return Change(head | about, drawn, partial(_draw, drawn), numbers)


class Asked(NamedTuple):
    """What is kept of each joint.

    Attributes
    ----------
    loads : sequence of str
        Loads.
    points : sequence of str
        Operating points of the study that the joints are simulated at.
    """

    loads: Sequence[str]
    points: Sequence[str]

    def names(self, study: Study) -> tuple[str, ...]:
        """Names of the loads at each of the points, as `Altered.names`."""
        every = [point.name for point in study.points]
        return tuple(at(load, [point], every) for point in self.points for load in self.loads)


def missing(in_file: Mapping[str, Altered], wanted: Change, names: Sequence[str]) -> range:
    """Joints of a change that the file lacks; all of them if its own begin later, or lack one of the loads."""
    altered = in_file.get(what_if.key(wanted.about))
    if altered is None or altered.first > wanted.numbers.start or not altered.holds(names):
        return wanted.numbers
    return range(max(altered.end, wanted.numbers.start), max(altered.end, wanted.numbers.stop))


def options_of(study: Study, store: Writer) -> Options:
    """Solver options of the campaign's joints."""
    return settings(study.solver, store.fidelity)


def seconds_per_joint(study: Study, options: Options, joints: int, points: Sequence[str]) -> float:
    """Time of a joint at all these points in one process, s, from the first samples; kernels must be ready."""
    pilot = list(_blocks(options, [as_drawn(study, range(joints))], points))
    with closing(pool.map_blocks(work_beside(study.mechanism, Options()), pilot, 1)) as done:
        spent = sum(result.seconds for _, result in done if isinstance(result, Timed))
    return (spent or SLOW_S * joints) / joints


def simulate(
    study: Study,
    store: Writer,
    wanted: Sequence[Change],
    asked: Asked,
    workers: int,
    stop: Callable[[], bool],
    progress: Callable[[Counts], None],
) -> dict[str, Altered]:
    """Simulate what the file lacks and write it, also if interrupted.

    Parameters
    ----------
    study : Study
        The study of the campaign.
    store : Writer
        Its file.
    wanted : sequence of Change
        Changes with their joints, in the order in which they are simulated.
    asked : Asked
        Loads that are kept, and operating points.
    workers : int
        Number of processes; does not affect results.
    stop : callable
        Called often; once it returns True no further block is begun.
    progress : callable
        Called with the counts of the joints, each at every point.

    Returns
    -------
    dict of str to Altered
        All sets that the file holds.
    """
    in_file = what_if.read(store)
    names = asked.names(study)
    todo = [change._replace(numbers=lacking) for change in wanted if (lacking := missing(in_file, change, names))]
    table = _Table(todo, asked, names, study.mechanism)
    blocks = _blocks(options_of(study, store), todo, asked.points)
    done = pool.map_blocks(work_beside(study.mechanism, Options()), blocks, workers, stop)
    counts, saved = Counts(table.status.size, noun=f"{row_of(study.mechanism)}s"), time.monotonic()
    progress(counts)
    try:
        with closing(done):
            for block, result in done:
                counts = counts.after(table.put(block, results_of(block, result)))
                progress(counts)
                if time.monotonic() - saved > SAVE_S:
                    what_if.write(store, table.sets(in_file))
                    saved = time.monotonic()
    finally:
        new = table.sets(in_file)
        if new:
            what_if.write(store, new)
    return in_file | new


def check_code(store: Reader) -> None:
    """Refuse a file whose joints another version of the code simulated; raises a StoreError."""
    if differing_code(store.versions):
        remedy = "use that version, or run the campaign again: tolstat run STUDY --out OTHER.h5"
        raise store_error(store.path, "was made by another version of the code", remedy)


class _Table:
    """Loads, (n, points, k), and status, (n, points), of all joints to do, one set after the other."""

    def __init__(self, todo: Sequence[Change], asked: Asked, names: tuple[str, ...], mechanism: Mechanism) -> None:
        self.todo, self.asked, self.names, self.mechanism = todo, asked, names, mechanism
        n = sum(len(change.numbers) for change in todo)
        self.loads = np.full((n, len(asked.points), len(asked.loads)), np.nan)
        self.status = np.full((n, len(asked.points)), Status.PENDING, np.uint8)

    def put(self, block: Block, results: NDArray[np.void]) -> NDArray[np.uint8]:
        index = block.slots, self.asked.points.index(block.point)
        self.loads[index] = loads_of(results, self.asked.loads, self.mechanism)
        self.status[index] = results["status"]
        return np.asarray(self.status[index])

    def sets(self, in_file: Mapping[str, Altered]) -> dict[str, Altered]:
        """Sets that have grown: of each, the joints before the first that is not done, behind those in the file."""
        grown, begin = {}, 0
        for about, _, _, numbers in self.todo:
            here = slice(begin, begin + len(numbers))
            begin = here.stop
            waiting = np.flatnonzero((self.status[here] == Status.PENDING).any(axis=1))
            done = slice(here.start, here.start + int(waiting[0]) if waiting.size else here.stop)
            if done.stop > done.start:
                name, states = what_if.key(about), list(self.status[done].T)
                status = worst_status(states)
                loads, old = self.loads[done].reshape(-1, len(self.names)), in_file.get(name)
                grown[name] = Altered(about, numbers.start, self.names, loads, status)
                if old is not None and (old.end, old.names) == (numbers.start, self.names):
                    joined = np.concatenate([old.loads, loads]), np.concatenate([old.status, status])
                    grown[name] = old._replace(loads=joined[0], status=joined[1])
        return grown


def _blocks(options: Options, todo: Sequence[Change], points: Sequence[str]) -> Iterator[Block]:
    begin = 0
    for _, changed, draw, numbers in todo:
        operations = {point: changed.at(point).operation for point in points}
        for first in range(0, len(numbers), BLOCK):
            part = numbers[first : first + BLOCK]
            slots, errors = np.arange(begin + first, begin + first + len(part)), draw(part)
            for point, operation in operations.items():
                params = perturb(changed.joint, operation, errors)
                yield Block(point, slots, params, options, changed.mechanism)
        begin += len(numbers)


def _draw(study: Study, numbers: range) -> NDArray[np.void]:
    first = study.first_sample
    return sampling.draw(study, range(numbers.start + first, numbers.stop + first))


def _exchange(study: Study, line: Group, numbers: range) -> NDArray[np.void]:
    scores = sampling.scores(study, range(2 * numbers.start, 2 * numbers.stop))
    exchanged = {stream for name in line.names for stream in axes.streams_of(name)}
    moved = np.array([stream in exchanged for stream in sampling.streams(study)])
    return sampling.from_scores(study, np.where(moved, scores[1::2], scores[::2]))
