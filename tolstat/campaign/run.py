"""Run a campaign: simulate the pending rows of a result file and write their results to it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from tolstat.campaign import verify
from tolstat.campaign.block import Block
from tolstat.campaign.blocks import Executor, compile_for, simulate_beside, simulate_pending
from tolstat.campaign.extend import NOT_EXTENDABLE, OTHER_CODE, code_of
from tolstat.campaign.extend import extend as with_more
from tolstat.campaign.pool import SIGNALS, Unguarded, WorkerDied, end_second_script, kept_workers
from tolstat.campaign.remedy import Retry, begin_retry
from tolstat.common.cores import available_cores
from tolstat.common.counts import Counts
from tolstat.common.errors import Fault, InputError, StoreError, input_error
from tolstat.common.tables import Simulation, Status
from tolstat.display.progress import JOINTS, Reporter, Tell, display, note, silent
from tolstat.sampling import draw_blocks, origin_blocks
from tolstat.solver import fidelity
from tolstat.solver.compilation import stage_name
from tolstat.solver.histories import MIN_SAMPLES, Histories, history_specs
from tolstat.store import Reader, Writer, metadata
from tolstat.store.hdf5 import store_error
from tolstat.store.metadata import differing_code
from tolstat.store.recorded import differing_keys, perturbed, settings
from tolstat.study import Given, Study, load


class Stop:
    """Whether a signal has requested a stop, and which one.

    Attributes
    ----------
    number : signal.Signals
        The last signal received; SIGINT before any.
    """

    def __init__(self) -> None:
        self.number = signal.SIGINT
        self._asked = False
        self._deferred = False

    def __call__(self) -> bool:
        """Whether to stop."""
        return self._asked

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """Inside, the first signal only requests a stop, so that no write is interrupted; a second one interrupts."""
        self._deferred = True
        try:
            yield
        finally:
            self._deferred = False

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        again, self._asked, self.number = self._asked, True, signal.Signals(number)
        if again:  # no signal may interrupt the cleanup that follows
            for caught in SIGNALS:
                signal.signal(caught, signal.SIG_IGN)
        if again or not self._deferred:
            raise KeyboardInterrupt


@contextmanager
def signals_caught() -> Iterator[Stop]:
    """Catch `SIGNALS`; the previous handlers are restored at the end.

    A hang-up that is already ignored (nohup) stays ignored. Only the main thread can catch signals; in other threads
    the caller has to handle them.
    """
    stop = Stop()
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            if number in (signal.SIGINT, signal.SIGTERM) or signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop.handle)
    try:
        yield stop
    finally:
        for caught, handler in before.items():
            signal.signal(caught, signal.SIG_DFL if handler is None else handler)


class Interrupted(KeyboardInterrupt):
    """A campaign was stopped, by Ctrl-C or another signal; the file holds all finished blocks.

    Attributes
    ----------
    path : Path
        The result file.
    counts : Counts
        Numbers of joints by status.
    exit_code : int
        128 plus the number of the signal: 130 after Ctrl-C, 143 after SIGTERM.
    """

    def __init__(self, path: Path, counts: Counts, number: int = signal.SIGINT) -> None:
        self.path = path
        self.counts = counts
        self.exit_code = 128 + number
        held = f"{path} holds the results of {counts.done} of {counts.total} joints"
        super().__init__(f"stopped: {held}\n  hint: to resume, run the same command again")


def run(
    study: Given,
    out: str | Path,
    workers: int | None = None,
    block: int | None = None,
    progress: Reporter | bool = False,
    rows: range | None = None,
    until_row: int | None = None,
    executor: Executor = "processes",
    scheduler: str | None = None,
    retry: Retry | None = None,
    tell: Tell = note,
    check: bool = True,
    stage: Tell = silent,
) -> Counts:
    """Simulate the joints of a study whose results its result file does not hold yet.

    The number of workers, the block size and interruptions do not affect the results.

    Parameters
    ----------
    study : Study, str, Path or mapping
        The study, see `study.load`.
    out : str or Path
        Result file; created if it does not exist. Otherwise its pending rows are simulated, and its limits, study
        text and study name are updated from `study`.
    workers : int, optional
        Number of processes; without it the number of cores.
    block : int, optional
        Joints per block; without it as many as take some seconds, see `blocks.Pace`.
    progress : bool or Reporter
        Whether to show a bar, on a terminal or in a notebook; or what is called with the counts at the start and after
        every block.
    rows : range, optional
        Rows of the campaign that the file holds, if a slice; all without it.
    until_row : int, optional
        Rows of the campaign from this one on are left pending.
    executor : {"processes", "dask"}
        Worker processes on this machine, or a cluster.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://host:8786``; without it a cluster is started on this machine.
    retry : Retry, optional
        Joints that are simulated again, and how.
    tell : callable, optional
        Called with messages: fidelity that ``auto`` chose, why a joint was given up, how many are simulated again.
    check : bool
        Whether to verify a few joints at the end, to estimate the numerical error; see `verify.check_few`.
    stage : callable, optional
        Called with the name of each stage when it begins, such as `progress.Display.stage`.

    Returns
    -------
    Counts
        Numbers of joints by status.

    Raises
    ------
    InputError
        When workers or block size are not positive, or `rows` are not rows of the study.
    StoreError
        When the file is of another study or other code (the message names the differences), or cannot be used.
    Interrupted
        When Ctrl-C was pressed or the process was asked to end.
    WorkerDied
        When worker processes die whichever block they work on; the file holds all finished blocks.
    """
    end_second_script()
    study = load(study)
    if progress is True:
        with display(tell) as shown:
            others = rows, until_row, executor, scheduler, retry, tell, check
            return run(study, out, workers, block, shown, *others, stage=shown.stage)
    numbers = {"workers": workers, "block": block}
    wrong = {name: number for name, number in numbers.items() if number is not None and number < 1}
    if wrong:
        remedy = "give a whole number of at least 1"
        raise InputError([Fault(name, f"{number} is too small", remedy) for name, number in wrong.items()])
    path = Path(out)
    stage("drawing the errors" if not path.exists() else "opening the file")
    with signals_caught() as stop, _create_or_resume(study, path, rows, tell) as store, kept_workers():
        if retry:
            retry = retry.chosen(store.fidelity)
            begin_retry(store, retry, history_specs(retry.options, *_history_options(study), study.mechanism), tell)
        counts = store.counts()
        last = store.n if until_row is None else store.slot(until_row)
        try:
            if next(store.pending_blocks(last), None) is not None:
                stage(stage_name(study.mechanism))
                compile_for(study, store)
                store.begin_session(counts.done)
            stage(JOINTS)
            finished = simulate_pending(study, store, last, workers, block, executor, scheduler, stop)
            with stop.deferred(), closing(finished):
                counts = _write_blocks(store, finished, counts, progress or None, tell)
            if check:
                stage("check of the numerical error")
                verify.check_few(store, workers or available_cores())
            store.finish()
        except KeyboardInterrupt:
            raise Interrupted(path, store.counts(), stop.number) from None
        except Unguarded:
            raise
        except WorkerDied as error:
            reached = store.counts()
            kept = f"{path} holds the results of {reached.done} of {reached.total} joints"
            raise WorkerDied(f"{error}\n  {kept}; to resume, run the same command again") from error
        if next(store.pending_blocks(last), None) is not None:
            raise Interrupted(path, counts, stop.number)
        return counts


def extend(
    path: str | Path,
    n: int,
    study_path: Path | None = None,
    workers: int | None = None,
    progress: Reporter | bool = False,
    tell: Tell = note,
) -> Counts:
    """Add the next joints of its sampling sequence to a campaign and simulate them, see `run`.

    Joints already in the file do not change: it then equals that of a campaign that had `n` joints from the start.

    Parameters
    ----------
    path : str or Path
        Result file of a whole campaign.
    n : int
        New number of joints, without the nominal joint.
    study_path : Path, optional
        The study file, if the study text in the result file can no longer be read.
    workers, progress, tell
        As of `run`.

    Returns
    -------
    Counts
        Numbers of joints by status.

    Raises
    ------
    InputError
        When the campaign cannot be extended to `n` joints, or its study cannot be read.
    StoreError, Interrupted, WorkerDied
        As `run`.
    """
    return run(with_more(Path(path), n, study_path), path, workers, progress=progress, tell=tell)


def _write_blocks(
    store: Writer,
    finished: Iterable[tuple[Block, Simulation, str]],
    counts: Counts,
    progress: Reporter | None,
    tell: Tell,
) -> Counts:
    """Write blocks to the file as they are finished; return the numbers of joints by status after the last one."""
    if progress:
        progress(counts)
    for block, simulation, trouble in finished:
        store.at(block.point).write(block.slots, simulation)
        counts = counts.after(simulation.results["status"])
        if trouble:
            joint = f"row {store.rows[block.slots[0]]}" + (f" at {block.point}" if block.point else "")
            tell(f"{joint}: {Status.CRASHED.label}: {trouble}")
        if progress:
            progress(counts)
    return counts


def _create_or_resume(study: Study, path: Path, rows: range | None, tell: Tell) -> Writer:
    rows = range(study.rows) if rows is None else rows
    if not (0 <= rows.start < rows.stop <= study.rows and rows.step == 1):
        found = f"{rows.start}:{rows.stop} is no part of the rows 0:{study.rows} of the study"
        raise input_error("rows", found, f"write --rows A:B with 0 <= A < B <= {study.rows}")
    if not path.exists():
        choice = choose_fidelity(study) if study.solver.fidelity == "auto" else {}
        if choice:
            tell(fidelity.describe(choice))
        options = settings(study.solver, choice)
        histories = history_specs(options, *_history_options(study), study.mechanism)
        errors = draw_blocks(study, rows)
        origin = origin_blocks(study, rows)
        return Writer.create(path, study, errors, histories, rows, options, choice, origin)
    store = Writer.open(path)
    try:
        _check_same(store, study, rows)
        store.change(**metadata.editable(study))
    except StoreError:
        store.close()
        raise
    return store


def choose_fidelity(study: Study) -> dict[str, Any]:
    """Choose the fidelity of a new campaign from a pilot of its joints, simulated as in the campaign.

    Returns
    -------
    dict
        The record of the choice, see `fidelity.choose`.
    """
    options = study.solver.options()
    rows = fidelity.pilot(study.rows, study.first_sample, study.sampling.seed)
    errors = np.concatenate([part for row in rows.tolist() for part in draw_blocks(study, range(row, row + 1))])
    each = [perturbed(study.at(point.name), rows, errors) for point in study.points]
    params = np.concatenate(each)  # one choice for all points
    histories, n_harmonics = _history_options(study)
    least = [2 * n_harmonics + 1] * ("harmonics" in histories) + [MIN_SAMPLES] * ("cycles" in histories)
    budget, min_steps = study.solver.error_budget, max(least, default=0)  # steps from which histories can be computed
    with kept_workers():
        closed_form = not study.no_closed_form
        simulate = partial(simulate_beside, mechanism=study.mechanism)
        settings_of_choice = params, options, budget, study.asked, simulate, min_steps, closed_form
        return fidelity.choose(*settings_of_choice, mechanism=study.mechanism)


def _check_same(store: Reader, study: Study, rows: range) -> None:
    differing = differing_keys(store.identity, study.identity())
    found, remedy = "is the result file of another study", "give another file: --out OTHER.h5"
    if not differing:
        found, remedy = OTHER_CODE, f"run the study into another file (--out OTHER.h5), or resume with {code_of(store)}"
    differing += differing_code(store.versions)
    if len(differing) == 1 and differing[0].startswith("sampling.n:") and store.whole:
        raise _of_number(store, study.samples)
    if not differing and store.rows != rows:
        in_file, asked = (f"{r.start}:{r.stop}" for r in (store.rows, rows))
        raise store_error(store.path, f"holds rows {in_file}, not {asked}", f"give --rows {in_file}")
    if differing:
        raise store_error(store.path, "\n    ".join([found, *differing]), remedy)


def _of_number(store: Reader, asked: int) -> StoreError:
    """Error of a file of this study with another number of joints."""
    path, joints, method = store.path, int(store.sampling["n"]), store.sampling["method"]
    remedy = f"simulate more of its joints: tolstat extend {path} --n {asked}"
    if asked < joints:
        remedy = f"read it as it is: tolstat report {path}, or give another file: --out OTHER.h5"
    elif method in NOT_EXTENDABLE:
        remedy = f"give another file: --out OTHER.h5; {NOT_EXTENDABLE[method]}"
    return store_error(path, f"is the result file of this study with {joints} joints, not {asked}", remedy)


def _history_options(study: Study) -> tuple[Histories, int]:
    return study.output.histories, study.output.harmonics
