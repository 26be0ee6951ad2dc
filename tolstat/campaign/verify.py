"""Estimate the numerical error of a campaign: simulate some joints again with other settings or another solver."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign import blocks
from tolstat.campaign.executors import Lost, Work, kept_workers, map_in_processes, map_serially
from tolstat.campaign.supervised import supervised
from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError, StoreError, gather
from tolstat.common.solver_options import to_names
from tolstat.common.tables import RESULT, Fidelity, Method, Options, Simulation, Start, Status, without_results
from tolstat.store import Counts, Reader, ResultStore, recorded, verification, worst
from tolstat.store.provenance import differing_code
from tolstat.store.verification import Check, Verification

if TYPE_CHECKING:
    from tolstat.study import Study

QUICK_CHECKS = ("half_step", "newton", "settling")
"""Checks at the end of every run; they need no code beyond that of the run."""
ALL_CHECKS = (*QUICK_CHECKS, "method", "reference")
MIN_STEPS = 180
"""Minimum steps per revolution of the dynamic simulation that checks one of lower fidelity."""
DESCRIPTION = {
    "half_step": "twice as many steps a revolution",
    "newton": "a hundredth of solver.newton_tol",
    "settling": "the other solver.start, and a hundredth of solver.settle_tol",
    "method": "another solver.method",
    "fidelity": "dynamic fidelity instead of a lower one",
    "reference": "scipy's Radau, rtol 1e-7, largest loads at 2880 angles and all steps",
}
JOINTS_PER_CHECKED, MAX_CHECKED = 400, 16
"""At the end of a run one joint in 400 is checked, at least one and at most 16: some 2 % of the run's time."""

Simulate = Callable[..., Simulation]
Progress = Callable[[Counts], None]


def no_progress(counts: Counts) -> None:
    """Report no progress."""


def options_of_check(options: Options, check: str) -> Options:
    """Return the solver options of a check.

    Parameters
    ----------
    options : Options
        Solver options of the campaign.
    check : str
        One of `ALL_CHECKS`, or ``fidelity``.
    """
    if check == "half_step":
        return options._replace(steps_per_rev=2 * options.steps_per_rev)
    if check == "newton":
        return options._replace(newton_tol=0.01 * options.newton_tol)
    if check == "settling":
        other_start = Start.RAMP if options.start == Start.STATIC else Start.STATIC
        return options._replace(settle_tol=0.01 * options.settle_tol, start=int(other_start))
    if check == "method":
        other = Method.BDF2 if options.method == Method.TR_BDF2 else Method.TR_BDF2
        return options._replace(method=int(other))
    if check == "fidelity" and options.fidelity != Fidelity.DYNAMIC:
        steps = max(options.steps_per_rev, MIN_STEPS)
        return options._replace(fidelity=int(Fidelity.DYNAMIC), steps_per_rev=steps)
    return options


def choose(rows: NDArray[np.intp], joints: int | None, seed: int) -> NDArray[np.intp]:
    """Choose `joints` of the `rows` at random, ascending; all if there are fewer, or if `joints` is None."""
    if joints is None:
        return rows
    rng = np.random.default_rng([seed, 4])  # 4: another random stream than that of the errors
    return np.sort(rng.choice(rows, min(joints, len(rows)), replace=False))


def run_checks(
    params: NDArray[np.void],
    options: Sequence[Options],
    names: Iterable[str],
    simulate: Simulate | None = None,
    workers: int = 1,
    progress: Progress = no_progress,
) -> dict[str, Check]:
    """Simulate joints again, once for each check.

    Parameters
    ----------
    params : ndarray of PARAM, shape (m,)
        Parameters of the joints.
    options : sequence of Options
        Solver options of each joint in the campaign.
    names : iterable of str
        Names from `ALL_CHECKS`; ``fidelity`` is added if a joint is below dynamic fidelity.
    simulate : callable, optional
        Replaces `simulation.simulate_rows` in supervised processes.
    workers : int
        Processes that compute the references, seconds each; their number changes results within the tolerance only.
    progress : callable
        Called with the counts of joints whose reference is computed.

    Returns
    -------
    dict of str to Check
    """
    lower = any(own.fidelity != Fidelity.DYNAMIC for own in options)
    checks = {}
    with kept_workers():
        for name in (*names, *(("fidelity",) if lower else ())):
            own = [options_of_check(one, name) for one in options]
            if name == "reference":
                results = _references(params, own, workers, progress)
            else:
                results = solve_by_options(partial(_plain, simulate), params, own)
            checks[name] = Check(DESCRIPTION[name], to_names(own[0]), results)
    return checks


Single = tuple[int, NDArray[np.void], Options]
"""A joint: its index, its row of PARAM, shape (1,), and its solver options."""


def _references(
    params: NDArray[np.void], options: Sequence[Options], workers: int, progress: Progress
) -> NDArray[np.void]:
    """Compute the reference of each joint, (m,) table RESULT; each process computes one joint at a time."""
    joints: list[Single] = [(i, params[i : i + 1], one) for i, one in enumerate(options)]
    work: Work[Single, NDArray[np.void] | Lost] = Work(_reference)
    workers = min(workers, len(joints))
    serial = blocks.default_kind(workers, len(joints)) == "serial"
    done: Generator[tuple[Single, NDArray[np.void] | Lost], None, None]
    done = map_serially(work, joints) if serial else map_in_processes(work, joints, workers)
    results, counts = without_results(len(joints), Status.CRASHED), Counts(len(joints), 0, 0, 0)
    progress(counts)
    with closing(done):
        for (i, _, _), result in done:
            if not isinstance(result, Lost):
                results[i] = result[0]
            counts = counts.after(results["status"][i : i + 1])
            progress(counts)
    return results


def _reference(joint: Single) -> NDArray[np.void]:
    from tolstat.solver.reference import reference_rows

    _, params, options = joint
    return reference_rows(params, options)


def _plain(simulate: Simulate | None, params: NDArray[np.void], options: Options) -> NDArray[np.void]:
    from tolstat.solver.compilation import warm_up
    from tolstat.solver.simulation import simulate_rows

    simulate = simulate or supervised(simulate_rows, warm_up, [Options()], blocks.Execution())
    return simulate(params, options, histories="none", n_harmonics=0).results


def solve_by_options(
    solve: Callable[[NDArray[np.void], Options], NDArray[np.void]],
    params: NDArray[np.void],
    options: Sequence[Options],
) -> NDArray[np.void]:
    """Results of joints with individual options, (m,) table RESULT; one call of `solve` per distinct option set."""
    results = np.empty(len(params), RESULT)
    for one in dict.fromkeys(options):
        here = np.array([own == one for own in options])
        results[here] = solve(params[here], one)
    return results


def check_campaign(
    store: Reader,
    parameters: Callable[[NDArray[np.intp]], NDArray[np.void]],
    names: Iterable[str],
    joints: int | None,
    seed: int,
    simulate: Simulate | None = None,
    workers: int = 1,
    progress: Progress = no_progress,
) -> Verification | None:
    """Check settled joints of a campaign.

    Parameters
    ----------
    store : Reader
        Result file of the campaign.
    parameters : callable
        File slots (m,) -> their parameters, (m,) table PARAM.
    names, simulate, workers, progress
        As in `run_checks`.
    joints : int or None
        Number of joints; None for all, including the nominal joint.
    seed : int
        Seed of the random choice.

    Returns
    -------
    Verification or None
        None when no joint is settled.
    """
    settled = np.flatnonzero(store.status() == Status.OK)
    if joints is not None and len(settled) > 1:
        settled = settled[settled >= store.first_sample]  # the nominal joint is not in the statistics either
    slots = choose(settled, joints, seed)
    if not slots.size:
        return None
    return check_slots(store, parameters, slots, names, seed, simulate, workers, progress)


def check_slots(
    store: Reader,
    parameters: Callable[[NDArray[np.intp]], NDArray[np.void]],
    slots: NDArray[np.intp],
    names: Iterable[str],
    seed: int = 0,
    simulate: Simulate | None = None,
    workers: int = 1,
    progress: Progress = no_progress,
) -> Verification:
    """Check the joints in file slots, (m,) ascending; parameters otherwise as in `check_campaign`."""
    options = [recorded.options_of(store, slot) for slot in slots.tolist()]
    checks = run_checks(parameters(slots), options, names, simulate, workers, progress)
    for check in checks.values():
        selected_results.blank_others(check.results, store.columns)
    base = np.concatenate([store.results(slice(slot, slot + 1)) for slot in slots.tolist()])
    return Verification(seed, store.row(slots), base, checks)


def few(rows: int) -> int:
    """Number of joints that are checked at the end of a campaign of `rows` joints."""
    return min(max(rows // JOINTS_PER_CHECKED, 1), MAX_CHECKED)


def check_few(store: ResultStore, parameters: Callable[..., NDArray[np.void]], simulate: Simulate) -> None:
    """Check a few joints of a complete campaign and store the checks, unless the file is a slice or has checks."""
    if not (store.complete and store.whole) or verification.read(store) is not None:
        return
    seed = int(store.sampling["seed"])
    if found := check_campaign(store, parameters, QUICK_CHECKS, few(store.n), seed, simulate):
        verification.write(store, found)


def check(
    path: Path,
    joints: int | str = 24,
    seed: int | None = None,
    on_start: Callable[[], None] = lambda: None,
    workers: int = 1,
    progress: Progress = no_progress,
) -> Verification:
    """Check joints of a study file (``.toml``) or of a result file; see `check_study` and `check_file`.

    `on_start` is called after the input has been validated, before the simulations.
    """
    from tolstat.study import load

    if path.suffix != ".toml":
        return check_file(path, joints, seed, on_start=on_start, workers=workers, progress=progress)
    faults: list[Fault] = []
    with gather(faults):
        parse_joints(joints)
    with gather(faults):
        plan = load(path)
    if faults:
        raise InputError(faults)
    on_start()
    return check_study(plan, joints, seed, workers=workers, progress=progress)


def check_file(
    path: Path,
    joints: int | str = 24,
    seed: int | None = None,
    names: Iterable[str] = ALL_CHECKS,
    on_start: Callable[[], None] = lambda: None,
    workers: int = 1,
    progress: Progress = no_progress,
) -> Verification:
    """Check joints of a result file and store the checks in it, replacing an earlier verification.

    Parameters
    ----------
    path : Path
        The file; its campaign may be unfinished.
    joints : int or "all"
        Number of joints; ``"all"`` for all settled joints, including the nominal joint.
    seed : int, optional
        Seed of the random choice; the campaign's own seed without it.
    names : iterable of str
        Names from `ALL_CHECKS`.
    on_start : callable
        Called after the file has been validated, before the simulations.
    workers, progress
        As in `run_checks`.

    Returns
    -------
    Verification

    Raises
    ------
    StoreError
        When the file cannot be used, was made by other code, or has no settled joint.
    InputError
        When `joints` is neither a positive integer nor ``"all"``.
    """
    number = parse_joints(joints)
    with ResultStore.open_to_write(path) as store:
        check_version(store)
        seed = int(store.sampling["seed"]) if seed is None else seed
        if not any((one.status() == Status.OK).any() for one in store.each()):
            remedy = f"run the campaign first: tolstat run STUDY --out {path}"
            raise StoreError(str(Fault(str(path), "has no settled joint", remedy)))
        on_start()
        for one in store.each():
            params = partial(recorded.parameters, one)
            if found := check_campaign(one, params, names, number, seed, None, workers, progress):
                verification.write(one, found)
        checked = worst.checks([one for one in map(verification.read, store.each()) if one is not None])
        assert checked is not None
    return checked


def check_version(store: Reader) -> None:
    """Raise a StoreError for a file that other code made."""
    if differing_code(store.versions):
        remedy = "verify it with that version, or run the campaign again: tolstat run STUDY --out OTHER.h5"
        raise StoreError(str(Fault(str(store.path), "was made by another version of the code", remedy)))


def check_study(
    plan: Study,
    joints: int | str = 24,
    seed: int | None = None,
    names: Iterable[str] = ALL_CHECKS,
    workers: int = 1,
    progress: Progress = no_progress,
) -> Verification:
    """Check joints of a study that has not been run: simulate them with its own settings and for each check.

    Parameters, returns and raises as `check_file`; the joints returned include those that do not settle. Of several
    operating points the joints follow one another.
    """
    each = [_check_at(plan.at(point.name), joints, seed, names, workers, progress) for point in plan.points]
    found = worst.checks(each)
    assert found is not None
    return found


def _check_at(
    plan: Study, joints: int | str, seed: int | None, names: Iterable[str], workers: int, progress: Progress
) -> Verification:
    """Check joints of a study with one operating point."""
    from tolstat.joint import perturb
    from tolstat.sampling import draw

    number, seed = parse_joints(joints), plan.sampling.seed if seed is None else seed
    if plan.solver.fidelity == "auto":
        found, remedy = "'auto' is resolved when the campaign runs", "run the study, and verify its result file"
        raise InputError([plan.fault("solver.fidelity", found, remedy)])
    first = 0 if number is None else plan.first_sample
    rows = choose(np.arange(first, plan.rows), number, seed)
    params = recorded.perturbed(plan, rows, draw(plan)[rows], perturb)
    options = [plan.solvers[number].options() for number in recorded.variants(plan, rows).tolist()]
    base = solve_by_options(partial(_plain, None), params, options)
    checks = run_checks(params, options, names, None, workers, progress)
    for results in (base, *(check.results for check in checks.values())):
        selected_results.blank_others(results, plan.output.columns)
    return Verification(seed, rows, base, checks)


def parse_joints(joints: int | str) -> int | None:
    """Parse a number of joints; None for ``"all"``.

    Raises
    ------
    InputError
        When it is neither a positive integer nor ``"all"``.
    """
    if joints == "all":
        return None
    try:
        number = int(joints)
    except ValueError:
        found = f"{joints!r} is not a whole number"
    else:
        if number >= 1:
            return number
        found = f"{number} is less than one"
    raise InputError([Fault("joints", found, "write --joints 24, or --joints all")])
