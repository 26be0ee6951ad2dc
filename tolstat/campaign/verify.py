"""Numerical error of a campaign: some joints are simulated again with other settings or another solver.

Any joints of the file are checked, or those nearest to a limit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.accuracy import LEAST_NEAR
from tolstat.campaign import chosen, pool
from tolstat.campaign.blocks import simulate_beside
from tolstat.campaign.chosen import choose, nearest, settled
from tolstat.campaign.pool import Lost, Work, kept_workers
from tolstat.campaign.stop_rule import limit_of
from tolstat.campaign.what_if import check_code
from tolstat.common import tables
from tolstat.common.columns import blank_others, holds
from tolstat.common.counts import Counts
from tolstat.common.errors import Fault, InputError, gather, input_error, raise_all
from tolstat.common.loads import load_of
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Fidelity, Method, Options, Simulation, Start, Status
from tolstat.common.wording import row_of
from tolstat.sampling import draw
from tolstat.solver.reference import reference_rows
from tolstat.store import Reader, Writer, verification
from tolstat.store.hdf5 import pick, store_error
from tolstat.store.recorded import options_of, parameters, perturbed, variants
from tolstat.store.verification import Check, Verification
from tolstat.study import Study, load

QUICK_CHECKS = ("finer",)
"""The check at the end of every run; it needs no code beyond that of the run."""
ALL_CHECKS = ("half_step", "newton", "settling", "method", "reference")
"""Checks of `tolstat verify`, which tell what an error comes from."""
MIN_STEPS = 180
"""Minimum steps per revolution of the dynamic simulation that checks one of lower fidelity."""
EXAMPLE = 'write --near "cross1.F > 700 N", or --near "any limit"'

Simulate = Callable[..., Simulation]
Progress = Callable[[Counts], None]


CHECKS = {
    "half_step": "twice as many steps a revolution",
    "finer": "twice as many steps, 1/100 of solver.newton_tol and solver.settle_tol",
    "newton": "a hundredth of solver.newton_tol",
    "settling": "the other solver.start, 1/100 of solver.settle_tol, 1/10 of solver.newton_tol",
    "method": "another solver.method",
    "fidelity": "dynamic fidelity instead of a lower one",
    "reference": "scipy's Radau, rtol 1e-7, largest loads at 2880 angles and all steps",
}
"""What differs from the campaign, in words, by name of the check; see `options_of_check`."""


def no_progress(counts: Counts) -> None:
    """Report no progress."""


def options_of_check(options: Options, check: str) -> Options:
    """Return the solver options of a check, a key of `CHECKS`, for a joint with these options in the campaign."""
    steps, newton, settle = options.steps_per_rev, options.newton_tol, options.settle_tol
    changes: dict[str, dict[str, Any]] = {
        "half_step": {"steps_per_rev": 2 * steps},
        "finer": {"steps_per_rev": 2 * steps, "newton_tol": 0.01 * newton, "settle_tol": 0.01 * settle},
        "newton": {"newton_tol": 0.01 * newton},
        "settling": {
            "start": int(Start.RAMP if options.start == Start.STATIC else Start.STATIC),
            "settle_tol": 0.01 * settle,
            "newton_tol": 0.1 * newton,
        },
        "method": {"method": int(Method.BDF2 if options.method == Method.TR_BDF2 else Method.TR_BDF2)},
    }
    if options.fidelity != Fidelity.DYNAMIC:
        changes["fidelity"] = {"fidelity": int(Fidelity.DYNAMIC), "steps_per_rev": max(steps, MIN_STEPS)}
    return options._replace(**changes.get(check, {}))


def run_checks(
    params: NDArray[np.void],
    options: Sequence[Options],
    mechanism: Mechanism,
    names: Iterable[str] = ALL_CHECKS,
    simulate: Simulate = simulate_beside,
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
    mechanism : Mechanism
        What they are.
    names : iterable of str
        Names from `ALL_CHECKS`; ``fidelity`` is added if a joint is below dynamic fidelity.
    simulate : callable
        As `simulation.simulate_rows`; joints are simulated with it, without histories.
    workers : int
        Processes that compute the references, seconds each; their number changes results within the tolerance only.
    progress : callable
        Called with the counts of joints whose reference is computed.

    Returns
    -------
    dict of str to Check
    """
    lower = any(changed.fidelity != Fidelity.DYNAMIC for changed in options)
    checks = {}
    with kept_workers():
        for name in (*names, *(("fidelity",) if lower else ())):
            changed = [options_of_check(of_joint, name) for of_joint in options]
            if name == "reference":
                results = _references(params, changed, mechanism, workers, progress)
            else:
                results = simulate_each(params, changed, mechanism, simulate)
            checks[name] = Check(CHECKS[name], tables.to_names(changed[0]), results)
    return checks


def _references(
    params: NDArray[np.void], options: Sequence[Options], mechanism: Mechanism, workers: int, progress: Progress
) -> NDArray[np.void]:
    """Compute the reference of each joint, (m,) table RESULT; each process computes one joint at a time."""
    joints = [(i, params[i : i + 1], of_joint) for i, of_joint in enumerate(options)]
    done = pool.map_blocks(Work(partial(_reference, mechanism)), joints, min(workers, len(joints)))
    results, counts = (
        tables.without_results(len(joints), Status.CRASHED, mechanism),
        Counts(len(joints), noun=f"{row_of(mechanism)}s"),
    )
    progress(counts)
    with closing(done):
        for (i, _, _), result in done:
            if not isinstance(result, Lost):
                results[i] = result[0]
            counts = counts.after(results["status"][i : i + 1])
            progress(counts)
    return results


def _reference(mechanism: Mechanism, joint: tuple[int, NDArray[np.void], Options]) -> NDArray[np.void]:
    """Reference of a joint, given by its index, its row of PARAM, shape (1,), and its solver options."""
    return reference_rows(*joint[1:], mechanism=mechanism)


def simulate_each(
    params: NDArray[np.void], options: Sequence[Options], mechanism: Mechanism, simulate: Simulate = simulate_beside
) -> NDArray[np.void]:
    """Results of joints, (m,) table RESULT, each with its own options, without histories."""
    results = np.empty(len(params), tables.tables(mechanism).RESULT)
    for distinct in dict.fromkeys(options):
        here = np.array([each == distinct for each in options])
        results[here] = simulate(params[here], distinct, mechanism=mechanism).results
    return results


Make = Callable[[NDArray[np.void], Sequence[Options], Mechanism], dict[str, Check]]
"""Function that simulates joints again, see `run_checks`."""


def check_campaign(store: Reader, joints: int | None, seed: int, make: Make) -> Verification | None:
    """Check so many settled joints, all with None; the nominal one only where no other is settled. None without any.

    `make` makes the checks from parameters and solver options of joints; `seed` is that of the random choice.
    """
    slots = choose(settled(store), joints, seed)
    return check_slots(store, slots, seed, make) if slots.size else None


def check_slots(store: Reader, slots: NDArray[np.intp], seed: int, make: Make) -> Verification:
    """Check the joints in file slots, (m,) ascending; parameters otherwise as in `check_campaign`."""
    attempts = pick(store.attempt, slots)
    options = [options_of(store, *of_joint) for of_joint in zip(slots.tolist(), attempts.tolist(), strict=True)]
    checks = make(parameters(store, slots), options, store.mechanism)
    for check in checks.values():
        blank_others(check.results, store.columns, store.mechanism)
    return Verification(seed, store.row(slots), pick(store.results, slots), checks)


def check_few(store: Writer, workers: int) -> None:
    """Check a few joints of a campaign at each operating point at which it is complete, and store the checks.

    Does nothing if the file is a slice, and leaves checks that it has as they are.
    """
    parts = list[tuple[Writer, str, Verification]]()
    for at_point in store.each() if store.whole else ():
        if at_point.complete and verification.read(at_point) is None:
            parts += [(at_point, name, part) for name, part in _check_few(at_point, workers).items()]
    if parts:
        verification.write(parts)


def _check_few(store: Reader, workers: int) -> dict[str, Verification]:
    """Checks of the joints of `chosen.quick`, simulated in lanes together, by name of the group."""
    at_random, near = chosen.quick(store)
    slots = np.union1d(at_random, near)
    if not slots.size:
        return {}
    make = partial(run_checks, names=QUICK_CHECKS, simulate=partial(simulate_beside, workers=workers))
    checked = check_slots(store, slots, int(store.sampling["seed"]), make)
    groups = {verification.VERIFY: at_random, verification.NEAR: near}
    return {name: checked.only(np.isin(slots, of_group)) for name, of_group in groups.items() if of_group.size}


def check(
    path: Path, joints: int | str = 24, seed: int | None = None, workers: int = 1, progress: Progress = no_progress
) -> Verification:
    """Check joints of a study file (``.toml``) or of a result file; see `check_study` and `check_file`.

    `joints` is a number, or ``"all"`` for all settled joints.

    Raises
    ------
    InputError
        When `joints` is neither a positive integer nor ``"all"``, or with the faults of the study.
    """
    faults: list[Fault] = []
    with gather(faults):
        number = _parse_joints(joints)
    if is_study := path.suffix.lower() == ".toml":
        with gather(faults):
            study = load(path)
    raise_all(faults)
    make = partial(run_checks, workers=workers, progress=progress)
    return check_study(study, number, seed, make) if is_study else check_file(path, number, seed, make)


def check_file(path: Path, joints: int | None, seed: int | None = None, make: Make = run_checks) -> Verification:
    """Check joints of a result file and store the checks in it, replacing an earlier verification.

    Parameters
    ----------
    path : Path
        The file; its campaign may be unfinished.
    joints : int or None
        Number of joints; None for all settled joints.
    seed : int, optional
        Seed of the random choice; the campaign's own seed without it.
    make : callable
        As in `check_campaign`.

    Returns
    -------
    Verification

    Raises
    ------
    StoreError
        When the file cannot be used, was made by other code, or has no settled joint.
    """
    with Writer.open(path) as store:
        check_code(store)
        seed = int(store.sampling["seed"]) if seed is None else seed
        if not any((at_point.status() == Status.OK).any() for at_point in store.each()):
            raise store_error(path, "has no settled joint", f"run the campaign first: tolstat run STUDY --out {path}")
        for at_point in store.each():
            if verified := check_campaign(at_point, joints, seed, make):
                verification.write([(at_point, verification.VERIFY, verified)])
        return verification.together(verification.read_each(store.each(), verification.VERIFY))


def check_near(
    path: Path, text: str, joints: int | str = LEAST_NEAR, workers: int = 1, progress: Progress = no_progress
) -> Verification:
    """Make the `QUICK_CHECKS` of the joints of a result file nearest to a limit, and add them to those that it holds.

    Parameters
    ----------
    path : Path
        The file.
    text : str
        ``"cross*.F > 700 N"``, or ``"any limit"``.
    joints : int
        Number of joints for each load of the limit, at least `LEAST_NEAR`.
    workers, progress
        As in `run_checks`.

    Returns
    -------
    Verification
        All verified joints near limits of the file.

    Raises
    ------
    InputError
        With every fault of limit and number.
    StoreError
        As `check_file`, or when too few joints are settled.
    """
    number = _parse_joints(joints)
    if number is None or number < LEAST_NEAR:
        found = f"{joints} joints do not tell the numerical error near a limit"
        raise input_error("--joints", found, f"give {LEAST_NEAR} or more")
    with Writer.open(path) as store:
        limit = limit_of(text, store.limits, store.mechanism, "--near", EXAMPLE)
        lacking = [name for name in limit.loads if not holds(store.columns, load_of(name, store.mechanism))]
        if lacking:
            found = f"the file does not keep {', '.join(lacking)}"
            raise input_error("--near", found, "give loads that it keeps, see tolstat status")
        check_code(store)
        slots_of = [(at_point, nearest(at_point, limit, number)) for at_point in store.each()]
        fewest = min((slots.size for _, slots in slots_of if slots.size), default=0)
        if fewest < LEAST_NEAR:
            found = f"has {fewest} settled joints; {LEAST_NEAR} are needed"
            raise store_error(path, found, f"add joints: tolstat extend {path}")
        for at_point, slots in slots_of:
            before = verification.read(at_point, verification.NEAR)
            new = slots if before is None else slots[~np.isin(at_point.row(slots), before.rows)]
            if new.size:
                make = partial(run_checks, names=QUICK_CHECKS, workers=workers, progress=progress)
                checked = check_slots(at_point, new, 0, make)
                merged = checked if before is None else verification.together((before, checked))
                verification.write([(at_point, verification.NEAR, merged.only(np.argsort(merged.rows)))])
        return verification.together(verification.read_each(store.each(), verification.NEAR))


def check_study(
    study: Study, joints: int | None = 24, seed: int | None = None, make: Make = run_checks
) -> Verification:
    """Check joints of a study that has not been run: simulate them with its own settings and for each check.

    Parameters and returns as `check_file`; the joints returned include those that do not settle. Of several operating
    points the joints follow one another.

    Raises
    ------
    InputError
        When the study chooses its fidelity with ``auto``.
    """
    if study.solver.fidelity == "auto":
        found, remedy = "'auto' is resolved when the campaign runs", "run the study, and verify its result file"
        raise InputError([study.fault("solver.fidelity", found, remedy)])
    seed = study.sampling.seed if seed is None else seed
    rows = choose(np.arange(study.first_sample, study.rows), joints, seed)
    errors = draw(study)[rows]
    options = [study.solvers[number].options() for number in variants(study, rows).tolist()]
    each = []
    for point in study.points:
        params = perturbed(study.at(point.name), rows, errors)
        base = simulate_each(params, options, study.mechanism)
        checks = make(params, options, study.mechanism)
        for results in (base, *(check.results for check in checks.values())):
            blank_others(results, study.columns, study.mechanism)
        each.append(Verification(seed, rows, base, checks))
    return verification.together(each)


def _parse_joints(joints: int | str) -> int | None:
    """Parse a number of joints; None for ``"all"``.

    Raises
    ------
    InputError
        When it is neither a positive integer nor ``"all"``.
    """
    if joints == "all":
        return None
    if not (str(joints).isdecimal() and int(joints)):
        found = f"{joints} is not a whole number of at least one"
        raise input_error("joints", found, "write --joints 24, or --joints all")
    return int(joints)
