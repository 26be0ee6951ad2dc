"""``tolstat plan``, ``run``, ``extend`` and ``merge``: a campaign, and the one file that holds its joints."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from tolstat.cli import _library as library
from tolstat.cli._shared import (
    about,
    deliver,
    echo,
    loaded,
    print_json,
    print_study_notes,
    progress,
    say,
    told,
    work,
    wrapped,
)
from tolstat.common.errors import Fault, InputError, gather, raise_all
from tolstat.common.files import check_target
from tolstat.common.shell import quote
from tolstat.display.options import (
    Accepted,
    AsJson,
    Joints,
    Opt,
    OtherStudy,
    Report,
    ResultPath,
    StudyPath,
    Wide,
    Workers,
)


def plan(
    study_file: StudyPath,
    *,
    n: Joints = None,
    workers: Workers = None,
    pilot: Annotated[int | None, Opt("K", least=1)] = None,
    accepted: Accepted = math.nan,
    as_json: AsJson = False,
) -> None:
    """Predict time, memory and precision of a campaign.

    Simulates a few joints (pilot) and writes nothing. Prints the time of the whole command tolstat run (start, joints,
    check, report), memory and file size of the campaign, the width of the 95 % interval of exceedances and of each
    limit's exceedance, the number of joints that a 95 % bound of a quantile needs, and what each entry of [tolerances]
    means: half width, radius or diameter, standard deviation of the error, share of the parts outside. With --accept
    also the number of joints that decides the verdict in nine campaigns of ten, if the true share is half of the
    accepted one, or 0.8 of it.

    Example: tolstat plan studies/iso2768_f.toml

    Parameters
    ----------
    pilot : int, optional
        Number of joints simulated for the prediction; default: 128, fewer if they take more than 20 s.
    """
    study = loaded(study_file, n=n)
    print_study_notes(study_file, study)
    if note := library.mounting.note_on_pins(study.tolerances, study.mechanism):
        say(f"note: {note}")
    with progress() as shown:
        prediction = library.plan.plan(study, workers, pilot or library.plan.PILOT, shown.stage, accepted)
    if as_json:
        print_json(asdict(prediction) | {"seconds": prediction.seconds})
    else:
        echo(wrapped(told("\n".join(_lines(prediction)))))
        meanings = {library.joints.ENTRIES: prediction.tolerances, library.joints.CORRELATED: prediction.correlations}
        for columns, rows in meanings.items():
            if rows:
                echo(f"\n{library.table.fitted(columns, rows)[0]}")
    say(f"next: tolstat run {quote(str(study_file))}" + ("" if n is None else f" --n {n}"))


def run(
    study_file: StudyPath,
    *,
    out: Annotated[Path | None, Opt("FILE")] = None,
    n: Joints = None,
    workers: Workers = None,
    executor: Annotated[Literal["processes", "dask"], Opt("WHERE")] = "processes",
    scheduler: Annotated[str | None, Opt("URL")] = None,
    retry: Annotated[str | None, Opt("STATES")] = None,
    settings: Annotated[list[str] | None, Opt("KEY=VALUE", name="set")] = None,
    rows: Annotated[str | None, Opt("A:B")] = None,
    until: Annotated[str | None, Opt("RULE")] = None,
    verify: bool = True,
    report: Report = True,
    wide: Wide = False,
) -> None:
    """Simulate the joints of a study and print a report.

    Simulates the joints that are pending in the result file, which is created if missing. To resume after an
    interruption (Ctrl-C, kill, power failure), run the same command again.

    With --set the study is run with another value of a key of its sections joint, mechanism, operation, sampling or
    output: give --out, too, and the same --set again to resume.

    Prints the share of joints above each limit (see tolstat report) and of those that keep all limits, why joints have
    no valid load, and the next command. Writes the result file, and beside it a picture of the curves; for CSV tables
    and SVG: tolstat report FILE.

    Example: tolstat run studies/iso2768_f.toml --n 512 --out first.h5

    Parameters
    ----------
    out : Path, optional
        Result file; default: STUDY.h5 in the current folder.
    executor : str
        processes (of this machine), or dask (a cluster).
    scheduler : str, optional
        Address of a Dask scheduler, tcp://HOST:PORT; default: start a cluster on this machine.
    retry : str, optional
        Statuses of joints to simulate again, such as newton_failed,crashed.
    settings : list of str, optional
        Key in place of that of the study, joint.shaft.axial=free; with --retry also of the solver for the joints
        simulated again, solver.steps_per_rev=360; repeatable.
    rows : str, optional
        Simulate rows A to B-1 only; FILE is then a slice for tolstat merge.
    until : str, optional
        Stop when a 95 % interval is narrow enough: "P(cross*.F > 700 N) width < 0.01", "P(any limit) ...".
    verify : bool
        Check the numerical error at the end: on one joint in 100 (29 to 299), and on as many near the limits.
    """
    retried = [text for text in settings or () if text.startswith("solver.")]
    changes = [text for text in settings or () if text not in retried]
    wrong = (
        (rows and until, "--until", "cannot be combined with --rows", "remove --until or --rows"),
        (until and retry, "--until", "cannot be combined with --retry", "remove --until or --retry"),
        (
            *(retried and not retry, f"--set {next(iter(retried), '')!r}", "sets the solver, which --retry alone can"),
            "add --retry newton_failed, or edit the study",
        ),
        (scheduler and executor != "dask", "--scheduler", "is used with --executor dask only", "add --executor dask"),
    )
    faults = [Fault(*words) for applies, *words in wrong if applies]
    with gather(faults):
        part = None if rows is None else parse_rows(rows)
    path = out if out is not None else Path(f"{study_file.stem}.h5")
    with gather(faults):
        check_target(path)  # now, not when the pictures of the report are written
    with gather(faults):
        text = library.rewriting.with_settings(library.strict.read_text(study_file), changes) if changes else None
        plan = loaded(study_file, n=n, text=text)
        again = None if retry is None else library.remedy.parse_retry(retry, retried, plan)
    raise_all(faults)
    print_study_notes(study_file, plan)
    if exact := library.assumptions.unselected(plan):
        say(f"no tolerance, taken as exact: {', '.join(exact)}")
    where = {"workers": workers, "executor": executor, "scheduler": scheduler}
    simulate(plan, path, until=until, check=verify, rows=part, retry=again, **where)
    conclude(path, report, wide, " ".join([str(study_file), *(f"--set {quote(text)}" for text in changes)]))


def extend(
    file: ResultPath,
    *,
    n: Annotated[int, Opt("N", least=1)],
    study_file: OtherStudy = None,
    workers: Workers = None,
    report: Report = True,
    wide: Wide = False,
) -> None:
    """Add joints to a campaign and simulate them.

    Draws the next joints of the sampling sequence and simulates them; the joints already in FILE do not change. FILE
    then equals that of a campaign with N joints from the start. Sweeps and listed joints cannot be
    extended. Prints the report and writes its files as tolstat run does.

    To resume after an interruption: tolstat run STUDY --n N --out FILE

    Example: tolstat extend iso2768_f.h5 --n 2000

    Parameters
    ----------
    n : int
        New number of joints, without the nominal joint.
    """
    with progress("drawing the errors"):
        plan = library.extend.extend(file, n, study_file)
    about(plan.wording)
    say(f"{file}: extended to {library.text.several(n, 'joint')}")
    simulate(plan, file, workers=workers)
    conclude(file, report, wide)


def merge(files: Annotated[list[Path], Opt("SLICE")], *, out: Annotated[Path, Opt("FILE")]) -> None:
    """Merge the slices of a campaign into one result file.

    Slices are made by tolstat run --rows. They must have the same study and version of the code, and together hold all
    rows of the campaign; a row in several slices must have identical results. FILE then equals that of a single run.

    Prints the number of joints by outcome on standard error.

    Example: tolstat merge part1.h5 part2.h5 --out whole.h5

    Parameters
    ----------
    files : list of Path
        Result files (HDF5) of the slices, in any order.
    out : Path
        Result file to create; must not exist.
    """
    with progress("merging"):
        merged = library.extend.merge(files, out)
    counts = merged.counts
    pending = counts.total - counts.done
    say(f"{out}: {counts.done} {counts.counted}, {counts.shortfall}")
    if merged.twice:
        say(f"{merged.twice} surplus copies of rows, with identical results")
    if pending:
        say(f"{pending} {counts.counted} are pending; to simulate them: tolstat run STUDY --out {out}")
    else:
        say(f"next: tolstat report {quote(str(out))} --out {quote(str(out.with_suffix('.html')))}")


def parse_rows(text: str) -> range:
    """Parse a range of rows, ``"5000:10000"``: the first row, and the row after the last.

    Raises
    ------
    InputError
        When the text is not a range with at least one row.
    """
    first, colon, last = text.partition(":")
    if not (colon and first.isdecimal() and last.isdecimal() and int(first) < int(last)):
        raise InputError([Fault("--rows", f"{text!r} is not a range of rows", "write --rows 5000:10000")])
    return range(int(first), int(last))


def simulate(plan: library.studies.Study, path: Path, until: str | None = None, **choices: Any) -> None:
    """Simulate a campaign with progress on standard error; `choices` go to `campaign.run`."""
    with work() as running:
        shown = running.display
        run = partial(library.run.run, plan, path, progress=shown, tell=say, stage=shown.stage, **choices)
        if until is None:
            counts = run()
        else:
            rule = library.stop_rule.parse(until, plan.limits, plan.mechanism)
            outcome = library.stop_rule.run_until(plan, path, rule, lambda row: run(until_row=row))
    if until is not None:
        look, end = outcome.look, "reached" if outcome.reached else "not reached"
        biased = f", {library.stop_rule.BIASED}: go by the interval" if outcome.reached else ""
        say(
            f"{rule.text}: {end} with {library.text.several(look.joints, 'joint')}, {look.above} above, "
            f"{look.n_unresolved} failed or not settled\n"
            f"{100 * library.stop_rule.CONFIDENCE:.0f} % interval {look.lower:.5f} to {look.upper:.5f}, valid after "
            "any number of looks, as those of the report are (failed and unsettled joints: below at its lower end, "
            f"above at its upper end)\nshare above {look.estimate:.5f}{biased}"
        )
        with library.stores.ResultFile.open(path) as store:
            counts = store.counts()
    say(f"{path}: {counts.done} {counts.counted}, {counts.shortfall}")


def conclude(path: Path, report: bool, wide: bool, study_file: str = "STUDY") -> None:
    """Print the report of a campaign if asked for, why joints have no valid load, and the next command.

    `study_file` is the study file as the user gave it, with its settings.
    """
    with library.stores.ResultFile.open(path) as store:
        if report:
            with progress("report"):
                answer = library.reports.report(store.view())
            deliver(answer, wide, stem=path.with_suffix(""), which="picture")
        without_load = library.remedy.reasons(store, {at.point or "": at.status() for at in store.each()})
        for text in library.remedy.in_words(without_load):
            say(text)
        for options in dict.fromkeys(reason.retry for reason in without_load if reason.retry):
            say(f"again: tolstat run {study_file} --out {path} {options}")
        source, csv, page = (quote(str(name)) for name in (path, path.with_suffix(".csv"), path.with_suffix(".html")))
        following = f"export {source} --csv {csv}" if store.case_names else f"report {source} --out {page}"
        say(f"next: tolstat {following if store.whole else f'merge {source} OTHER_SLICES --out WHOLE.h5'}")


def _lines(prediction: library.plan.Plan) -> Iterator[str]:
    yield f"joints: {prediction.rows}" + (f", each at {', '.join(prediction.points)}" if all(prediction.points) else "")
    if of := prediction.constraints:
        yield f"mobility {of['mobility']}, redundant constraints {of['redundant']}"
    yield f"random numbers a joint: {prediction.dimensions}"
    pilot = library.text.several(prediction.pilot, "joint")
    yield f"pilot: {pilot}, {prediction.failed} failed, {prediction.unsettled} not settled"
    if prediction.fidelity:
        yield prediction.fidelity
    if rattle := prediction.reversals.joints:
        yield (
            f"warning: the torque reverses in {rattle} of {prediction.pilot} joints: inertia torque up to "
            f"{prediction.reversals.torque:.3g} N m; these joints rattle and cost {prediction.reversals.cost:.2g} "
            "times as much as others"
        )
    if misfits := prediction.assembly.misfits:
        ends = [f"{100 * end:.2g}" for end in prediction.assembly.interval or ()]
        interval = f"; 95 % interval of their share {' to '.join(ends)} %" if ends else ""
        joints = f"{misfits} of {prediction.assembly.of} joints"
        yield f"warning: {joints} have a pin larger than its hole and cannot be simulated{interval}"
    yield f"time a joint: {1e3 * prediction.seconds_per_joint:.3g} ms"
    yield f"time: about {_duration(prediction.seconds)} on {prediction.workers} cores, of which"
    for stage, seconds in prediction.stages.items():
        yield f"  {stage}: {_duration(seconds)}"
    yield f"memory: {prediction.process_bytes / 1e6:.0f} MB a process, {prediction.workers + 1} processes"
    yield f"file: {_size(prediction.file_bytes)}"
    yield from (*prediction.fit, *prediction.sweep)
    if prediction.exact:
        yield f"no tolerance, taken as exact: {', '.join(prediction.exact)}"
    for share, width in prediction.widths.items():
        yield f"95 % interval of a share of {100 * share:g} %: {100 * width:.2g} points wide"
    for limit in prediction.limits:
        interval = f"interval at most {100 * limit.width:.2g} points wide"
        yield f"limit {limit.load}: {limit.above} of {limit.of} above in the pilot; {interval}"
    for q, n in prediction.wilks.items():
        yield f"joints for a load that {100 * q:g} % stay below, with 95 % confidence: {n}"
    for true, number in prediction.deciding.items():
        often = f"in {100 * library.counts.POWER:.0f} % of campaigns"
        yield f"joints that decide the verdict {often} if {100 * true:.3g} % is the true share: {number:.0f}"


def _duration(seconds: float) -> str:
    units = (("d", 86400.0), ("h", 3600.0), ("min", 60.0))
    short = f"{float(f'{seconds:.2g}'):g} s" if seconds >= 1 else "less than 1 s"
    return next((f"{seconds / size:.3g} {unit}" for unit, size in units if seconds >= 2 * size), short)


def _size(size: int) -> str:
    units = (("TB", 1e12), ("GB", 1e9), ("MB", 1e6))
    return next((f"{size / factor:.3g} {unit}" for unit, factor in units if size >= factor), f"{size / 1e3:.3g} kB")
