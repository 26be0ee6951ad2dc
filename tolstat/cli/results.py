"""``tolstat status``, ``verify``, ``export``, ``report``: what a result file holds, and files made of it."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli import _library as library
from tolstat.cli._library import np
from tolstat.cli._shared import (
    answered,
    deliver,
    echo,
    json_of,
    loaded,
    opened,
    print_json,
    print_table,
    progress,
    say,
    told,
    wrapped,
    write,
    write_frame,
)
from tolstat.common.cores import available_cores
from tolstat.common.errors import Fault, StoreError
from tolstat.common.files import check_target
from tolstat.common.late import pandas as pd
from tolstat.common.mechanism import Mechanism
from tolstat.display.options import Accepted, AsJson, Opt, Point, ResultPath, Wide, Workers
from tolstat.display.progress import clock

if TYPE_CHECKING:
    from numpy.typing import NDArray

PAGES = (".html", ".htm")


def status(file: ResultPath, *, check: bool = False, wide: Wide = False, as_json: AsJson = False) -> None:
    """Print the number of joints by status.

    Prints the number of joints, why joints have no valid load and what to do, and the share of joints above each limit
    so far with its 95 % interval. During a run, prints also its rate and the remaining time; reading the file does not
    disturb the run. Of several operating points the worst status of a joint counts, and each has a line of its own.
    With --json, prints the number of every status.

    With --check, says whether all numbers in the file are as they were written: what is damaged, or that results are
    unchecked because a run is under way or was killed.

    Example: tolstat status iso2768_f.h5

    Parameters
    ----------
    check : bool
        Compare all that is in the file with its checksums; exit code 2 if damaged.
    """
    with progress("reading the file"), opened(file) as store:
        states = {at.point or "": at.status() for at in store.each()}
        facts, view = _facts(store, states), store.view()
        # joints of a subset simulation are no sample
        tables = library.exceedance.limit_tables(view) if view.counts.done and view.method != "subset" else []
        if check:
            facts["checked"] = _checked(store)
        reasons = library.remedy.reasons(store, states)
    if as_json:
        causes = {f"{r.status.label} at {r.point}" if r.point else r.status.label: r for r in reasons}
        hints = {name: {"row": reason.row, "remedy": reason.remedy} for name, reason in causes.items()}
        shares = [row for table in tables[:1] for row in table.rows]
        print_json(library.text.plain(facts | {"exceedance": shares, "causes": hints}))
        return
    echo("\n".join([*map(told, _lines(facts)), *(wrapped(told(text)) for text in library.remedy.in_words(reasons))]))
    for table in answered(library.answers.Answer("status", "", tables[:1])).tables.values():
        echo()
        print_table(table.columns, table.for_people, wide)


def _facts(store: library.stores.ResultFile, states: dict[str, NDArray[np.uint8]]) -> dict[str, Any]:
    """Study, counts by status, in all and by point, and the pace of the run under way; `states` by point."""
    facts: dict[str, Any] = {"study": store.study_name, "joints": store.n}
    facts |= _counts(library.tables.worst_status(list(states.values())))
    counts = {point: _counts(status) for point, status in states.items()}
    if len(counts) > 1:
        facts["points"] = {point: {k: n for k, n in numbers.items() if n} for point, numbers in counts.items()}
    points, waiting = store.each(), library.tables.Status.PENDING.label
    pending = sum(numbers[waiting] for numbers in counts.values())
    stored = sum(_counts(at.column("results", "status", slice(None)))[waiting] for at in points)
    again = sum(int(np.count_nonzero(at.attempt())) for at in points)
    condition = {"damaged": pending - stored, "simulated_again": again}
    facts |= {name: number for name, number in condition.items() if number}
    session = store.session()
    facts["running"] = session is not None
    if session is not None and (done := len(states) * store.n - pending - session.done) > 0:
        rate = done / max(time.time() - session.started, 1e-3)
        facts |= {"joints_per_s": float(f"{rate:.3g}"), "s_to_go": round(pending / rate)}
    return facts


def _counts(states: NDArray[np.uint8]) -> dict[str, int]:
    return {state.label: int(np.count_nonzero(states == state)) for state in library.tables.Status}


def _lines(facts: dict[str, Any]) -> Iterator[str]:
    """Counts and pace; statuses without joints are left out."""
    unchecked = "errors match; results have none while a run is under way, or after one that was killed"
    pace = f", {facts['joints_per_s']:g} joints/s, {clock(facts['s_to_go'])} left" if "s_to_go" in facts else ""
    for name, value in facts.items():
        if name == "points":
            for point, counts in value.items():
                yield f"at {point}: {', '.join(f'{count} {label}' for label, count in counts.items())}"
        elif name == "running":
            yield f"running: {'yes' if value else 'no'}{pace}"
        elif name == "checked":
            yield f"checksums: {'all match' if value else unchecked}"
        elif value and name not in ("joints_per_s", "s_to_go"):
            yield f"{name}: {value}"


def _checked(store: library.stores.ResultFile) -> bool:
    """Whether all results have checksums, which match.

    Raises
    ------
    StoreError
        With everything that does not match its checksum.
    """
    integrity, altered = store.check(), library.what_if.damaged(store)
    faults = [f"{path} of rows {', '.join(rows)}" for path, rows in integrity.damaged.items()]
    faults += [f"what_if: {altered} {'change' if altered == 1 else 'changes'}"] * bool(altered)
    if faults:
        remedy = "simulate joints with damaged results again: tolstat run STUDY; for damaged errors restore a copy"
        raise StoreError(str(Fault(str(store.path), "\n    ".join(["is damaged:", *faults]), remedy)))
    for at in store.each():
        for name in (library.verification.VERIFY, library.verification.NEAR):
            library.verification.read(at, name)
    return integrity.checked


def verify(
    what: Annotated[Path, Opt("STUDY|FILE")],
    *,
    joints: Annotated[str | None, Opt("N|all")] = None,
    near: Annotated[str | None, Opt("LIMIT")] = None,
    seed: Annotated[int | None, Opt("S", least=0)] = None,
    out: Annotated[Path | None, Opt("CSV", writes=True)] = None,
    workers: Workers = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Estimate the numerical error on some joints.

    Simulates joints again with half the step, with a smaller Newton tolerance, from another initial state, with another
    integration method, and with a tight reference solution (scipy's Radau). Prints the distribution of the errors of
    the largest loads, relative to the largest load of the kind in the joint.

    Of a result file, checks settled joints and stores the checks in the file for the report. With --near, checks the
    joints nearest to a limit, 50 for each load of it, without another method and reference: how far their loads change,
    and to which side, tells how far the share above the limit moves. Intervals of all commands use it from then on.

    Example: tolstat verify iso2768_f.h5 --joints 2 --out errors.csv

    Parameters
    ----------
    what : Path
        Study file (TOML) or result file (HDF5).
    joints : str, optional
        Number of joints to check, or all; default: 24, near a limit 50.
    near : str, optional
        Check the joints nearest to a limit: "cross1.F > 700 N", "cross*.F > 700 N" or "any limit".
    seed : int, optional
        Seed of the choice of joints; default: that of the study.
    out : Path, optional
        Write the errors of each joint, check and load as CSV.
    """
    with progress("checks, then tight references") as shown:
        count = workers or available_cores()
        if near is None:
            verification = library.checks.check(what, joints or 24, seed, count, progress=shown)
        else:
            verification = library.checks.check_near(what, near, joints or library.numerical.LEAST_NEAR, count, shown)
    units = dict.fromkeys(("median", "usual", "worst"), "1")
    mechanism, method = _sampled(what)
    is_sample = near is None and method == "random"
    rows, by_load = (library.accuracy.error_rows(verification, mechanism, by_kind) for by_kind in (True, False))
    parts: list[library.answers.Part] = [
        library.answers.Table("kinds", "By kind of load", library.accuracy.ERRORS, rows, units),
        library.answers.Table("loads", "By load", (), by_load, units),
        library.answers.Sentence(library.accuracy.error_note(verification, mechanism, (), is_sample)),
    ]
    facts = {"rows": verification.rows, "seed": verification.seed}
    facts |= {"checks": {name: check.description for name, check in verification.checks.items()}}
    deliver(answered(library.answers.Answer("verify", "Numerical error", parts, facts)), wide, as_json)
    if out is not None:
        write_frame(pd.DataFrame(library.accuracy.joint_rows(verification, mechanism)), out)


def _sampled(what: Path) -> tuple[Mechanism, str]:
    """What the joints of a study or result file are, and by which method they are sampled."""
    if what.suffix.lower() == ".toml":
        study = loaded(what)
        return study.mechanism, study.sampling.method
    with opened(what) as store:
        return store.mechanism, str(store.sampling["method"])


def export(
    file: ResultPath,
    *,
    joints: Annotated[str | None, Opt("OUT", name="csv", writes=True)] = None,
    parquet: Annotated[Path | None, Opt("OUT.parquet", writes=True)] = None,
    xlsx: Annotated[Path | None, Opt("OUT.xlsx", writes=True)] = None,
    cycles: Annotated[str | None, Opt("OUT", name="pylife", writes=True)] = None,
    statistics: Annotated[str | None, Opt("OUT", writes=True)] = None,
    accepted: Accepted = math.nan,
    nominal: bool = False,
    point: Point = None,
) -> None:
    """Export joints, load cycles or statistics to files.

    --csv, --parquet and --xlsx write one row per joint: its errors, then its results, in SI units. If the study lists
    its joints, case and variant come first. Pending and failed joints are included; unknown values are empty. The first
    line has the names of the columns, the second their units, in Parquet they are metadata: read the CSV file with
    pandas.read_csv(OUT, header=[0, 1], index_col=0). The joint without errors is left out unless --nominal is given.

    If the study has several operating points, --statistics is of the worst of them, --pylife of the duty cycle, and a
    table of joints has all rows at the first one, then at the next; the column point says at which.

    --statistics writes the verdict, the share above each limit, quantiles, capability, the numerical error and the
    versions; causes of a load: tolstat causes FILE --by LOAD --json.

    --pylife writes every cycle of each load component: range, mean, and how often it occurs in a revolution, those
    between operating points and of starts included. To read it with pyLife: tolstat docs fatigue

    Example: tolstat export iso2768_f.h5 --csv joints.csv

    Parameters
    ----------
    joints : str, optional
        Write errors and results as CSV; - for standard output.
    parquet : Path, optional
        Write errors and results as Parquet.
    xlsx : Path, optional
        Write errors and results for Excel.
    cycles : str, optional
        Write load cycles as CSV for pyLife; - for standard output.
    statistics : str, optional
        Write all statistics as JSON; - for standard output.
    nominal : bool
        Include the joint without errors, marked by a column.
    """
    tables = [str(path) for path in (parquet, xlsx) if path is not None]
    targets = [*(target for target in (joints, cycles, statistics) if target is not None), *tables]
    repeated = not targets or len(set(targets)) < len(targets)
    wrong = {
        "give one or more of --csv, --parquet, --xlsx, --statistics and --pylife, each its own OUT": repeated,
        "--accept is used with --statistics only: add --statistics OUT": accepted == accepted and statistics is None,
        "--nominal is used with tables of joints and --pylife: add one of them": nominal and targets == [statistics],
    }
    for message, applies in wrong.items():
        if applies:
            raise typer.BadParameter(message)
    with progress("export"), opened(file) as whole:
        view = whole.view().at(point or "")
        store = view.store
        if cycles is not None:
            table = library.fatigue.pylife_frame(view, nominal=nominal)
            write_frame(table, cycles, f"cycles of {table['joint'].nunique()} joints")
        if statistics is not None:
            values = library.reports.statistics(view, accepted=accepted)
            write(statistics, lambda out: out.write(json_of(values) + "\n"), "all statistics")
        if joints is not None:
            if joints == "-":
                list(library.result_file.in_blocks(store, nominal))  # damage is found before anything is printed
            n = store.n - (0 if nominal else store.first_sample)
            write(joints, partial(library.exchange.write_csv, store, nominal=nominal), f"{n} joints")
        for path in tables:
            say(f"wrote {library.exchange.write_table(store, path, nominal)}")


def report(
    file: ResultPath,
    *,
    out: Annotated[Path | None, Opt("DIR|PAGE.html")] = None,
    accepted: Accepted = math.nan,
    again: Annotated[int | None, Opt("N", least=0, name="replay")] = None,
    full: bool = False,
    brief: bool = False,
    point: Point = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Report the share of joints above each load.

    Prints the verdict and the share of joints above each limit; without limits, the quantiles of each bushing load; for
    a sweep, the loads against the swept value. Writes the curves as PNG, SVG and CSV.

    With --out PAGE.html, writes a single page instead, with verdict, exceedance, capability, causes, worst joints,
    fatigue, contact modes, numerical error, failed joints and provenance. The campaign may be unfinished.

    Example: tolstat report iso2768_f.h5 --out page.html --accept "1 %"

    Parameters
    ----------
    out : Path, optional
        Folder for the files, created if missing (default: folder of FILE), or an HTML page to write.
    again : int, optional
        With an HTML page: number of joints evaluated over the input angle, simulated again if FILE has no load
        histories; default: 1000, but none is simulated again if FILE has pending joints.
    full : bool
        With an HTML page: open all its sections.
    brief : bool
        With an HTML page: verdict and line to change only, on one printed sheet.
    """
    if out is not None and out.suffix.lower() in PAGES:
        _page(file, out, accepted, again, point or "", full, brief)
        return
    with opened(file) as store:
        view = store.view()
        stem = (out or file.parent) / (f"{file.stem}_{point}" if point else file.stem)
        check_target(stem)
        with progress("report"):
            answer = library.reports.report(view.at(point or ""), accepted)
        deliver(answer, wide, as_json, None if as_json else stem)
        if (note := library.recorded.note_on_mounting(view.store)) and not as_json:
            say(f"note: {note}")


def _page(file: Path, out: Path, accepted: float, again: int | None, point: str, full: bool, brief: bool) -> None:
    check_target(out, file)
    with opened(file) as store:
        view = store.view()
        has_histories = bool(library.revolutions.held(view.store))
        if again is None:
            with progress("reading the file"):
                done = view.counts.done == view.counts.total
            again = library.page.REPLAYED if has_histories or done else 0
            if not again:
                say(f"{file} has pending joints: the page shows the others, and none over the input angle (--replay)")
        with progress("page") as shown:
            library.page.write_page(view, out, accepted, again, shown.stage, point, available_cores(), full, brief)
    say(f"wrote {out}")
