"""Extend a campaign by further joints; merge the slices of a campaign."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from itertools import accumulate, chain
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import drawn_columns
from tolstat.common.counts import Counts
from tolstat.common.errors import Fault, input_error, raise_all
from tolstat.common.tables import Status
from tolstat.sampling import draw_blocks, origin_blocks
from tolstat.store import Reader, Writer, layout, what_if
from tolstat.store.hdf5 import BLOCK
from tolstat.store.metadata import differing, differing_code
from tolstat.store.recorded import differing_keys, recall
from tolstat.store.writer import check_free, write_new
from tolstat.study import Study

NOT_EXTENDABLE = {
    "sweep": "the points of a sweep determine its number of joints",
    "cases": "its study lists the joints one by one",
    "subset": "the levels of a subset simulation determine its number of joints",
}
"""Sampling methods whose campaigns cannot be extended, and the reason."""
COPY_BYTES = 1 << 25
"""Approximate number of bytes of a column that are copied at a time."""
OTHER_FILE = "give another file: --out OTHER.h5"
"""Remedy where a file exists already."""
OTHER_CODE = "was begun by another version of the code"
"""Fault of a file that gets no further results, because they could differ."""


class Merged(NamedTuple):
    """Outcome of a merge.

    Attributes
    ----------
    counts : Counts
        Numbers of joints of the campaign by status.
    twice : int
        Number of surplus copies of rows that several files hold with the same results.
    """

    counts: Counts
    twice: int


def extend(path: Path, n: int, study_path: Path | None = None) -> Study:
    """Add further joints to a campaign, pending: the next ones of its sampling sequence.

    Existing rows do not change. `campaign.run` with the returned study simulates the new joints; the datasets are then
    equal to those of a campaign that had `n` joints from the start.

    Parameters
    ----------
    path : Path
        Result file of a whole campaign. A new file replaces it when complete.
    n : int
        New number of joints, without the nominal joint.
    study_path : Path, optional
        The study file, if the study text in the result file can no longer be read.

    Returns
    -------
    Study
        The study with `n` joints.

    Raises
    ------
    InputError
        When the campaign cannot be extended to `n` joints, or its study cannot be read.
    StoreError
        When the file cannot be used or replaced.
    """
    with Writer.open(path) as store:
        _check_extendable(store, n)
        study = recall(store, n, study_path)
        more = range(store.n, study.rows)
        altered = what_if.read(store)
        grow(store, study, draw_blocks(study, more), origin_blocks(study, more))
    if altered:  # these joints are samples of the larger campaign, too
        with Writer.open(path) as store:
            what_if.write(store, altered)
    return study


def grow(
    store: Writer, study: Study, errors: Iterable[NDArray[np.void]], origin: Iterable[NDArray[np.void]] | None = None
) -> None:
    """Replace a result file by one with further pending rows; existing rows do not change.

    Parameters
    ----------
    store : Writer
        The file, open for writing; not usable afterwards.
    study : Study
        The study of the larger campaign.
    errors, origin : iterable of tables
        Errors of the further rows in consecutive blocks; how they were drawn, for methods with `columns.drawn_columns`.

    Raises
    ------
    StoreError
        When the file cannot be replaced.
    """
    changes = {
        "identity": study.identity(),
        "sampling": study.sampling.model_dump(mode="json"),
        "stop": {"reached": False, "looks": store.stop["looks"]} if store.stop else {},  # looks of a rule stay looks
        "campaign_rows": study.rows,
        "n": study.rows,
    }
    document = store.metadata.model_copy(update=changes)
    tables = {"errors": chain(_blocks(store, store.errors), errors)}
    if origin is not None:
        tables["origin"] = chain(_blocks(store, store.origin), origin)

    def fill(file: h5py.File) -> None:
        _copy_results(file, [store])
        store.release()

    write_new(store.path, document, OTHER_FILE, tables, fill, overwrite=True)


def merge(paths: Sequence[str | Path], out: str | Path) -> Merged:
    """Merge the files of slices into the file of the whole campaign, equal to that of a single run.

    A row may be in several files if its results are the same to the last bit. Rows that are pending in all files
    are pending in the new one; `campaign.run` resumes them.

    Parameters
    ----------
    paths : sequence of str or Path
        Result files of slices, in any order.
    out : str or Path
        The file to make.

    Returns
    -------
    Merged

    Raises
    ------
    InputError
        When the files are not of one campaign, made by one version of the code, or do not cover it; with all faults.
    StoreError
        When a file cannot be used, or `out` cannot be created.
    """
    out = Path(out)
    check_free(out, OTHER_FILE)
    with ExitStack() as opened:
        stores = [opened.enter_context(Reader.open(path)) for path in paths]
        stores.sort(key=lambda store: (store.rows[0], store.rows.stop))
        _check_one_campaign(stores)
        rows = stores[0].campaign_rows
        looks = sorted({look for store in stores for look in store.stop.get("looks", ())})  # they stay looks
        stop = {"reached": False, "looks": looks} if looks else {}
        document = stores[0].metadata.model_copy(update={"stop": stop, "first_row": 0, "n": rows})
        # each file that adds rows to those of the files before it, and the first file slot that does
        shares = [(s, s.slot(end)) for s, end in zip(stores, _ends(stores), strict=False) if s.rows.stop > end]
        tables = {"errors": (block for store, begin in shares for block in _blocks(store, store.errors, begin))}
        if stores[0].variants:
            tables["design"] = (s.design[begin:] for s, begin in shares)
        if drawn_columns(stores[0].sampling):
            tables["origin"] = (block for store, begin in shares for block in _blocks(store, store.origin, begin))
        write_new(out, document, OTHER_FILE, tables, partial(_copy_results, sources=stores))
        twice = sum(len(store.rows) for store in stores) - rows
    with Reader.open(out) as store:
        return Merged(store.counts(), twice)


def _check_extendable(store: Reader, n: int) -> None:
    place, joints = str(store.path), store.sampling["n"]
    faults = []
    reason = NOT_EXTENDABLE.get(store.sampling["method"])
    if reason:
        remedy = "change the study, and run it as another campaign: tolstat run STUDY --out OTHER.h5"
        faults.append(Fault(place, f"cannot be extended: {reason}", remedy))
    elif n <= joints:
        remedy = f"give a larger number, for example --n {2 * joints}"
        faults.append(Fault(place, f"has {joints} joints already", remedy))
    if not store.whole:
        found = f"holds only rows {store.rows[0]}:{store.rows.stop} of the campaign"
        faults.append(Fault(place, found, "merge all slices first: tolstat merge SLICE... --out FILE"))
    if other := differing_code(store.versions):
        remedy = f"extend it with {code_of(store)}, or run its study into another file: tolstat run STUDY --n {n} --out"
        faults.append(Fault(place, "\n    ".join([OTHER_CODE, *other]), f"{remedy} OTHER.h5"))
    raise_all(faults)


def code_of(store: Reader) -> str:
    """Name the code that began a file."""
    return f"commit {store.git_commit}" if store.git_commit else "the version that began it"


def _check_one_campaign(stores: Sequence[Reader]) -> None:
    first = stores[0]
    faults = []
    for store in stores[1:]:
        lines = differing_keys(store.identity, first.identity)
        code = {name: first.versions[name] for name in ("tolstat", "sources")}
        lines += differing(store.versions, code, "in the file", f"in {first.path}")
        lines = [line.replace("in the study", f"in {first.path}") for line in lines]
        if store.retries != first.retries:
            lines.append(f"its retries differ from those of {first.path}")
        if lines:
            found = "\n    ".join([f"belongs to another campaign than {first.path}", *lines])
            faults.append(Fault(str(store.path), found, "leave it out, or run it again with the same study and code"))
    begins = [*(store.rows.start for store in stores), first.campaign_rows]
    missing = [range(end, begin) for end, begin in zip(_ends(stores), begins, strict=True) if begin > end]
    if missing:
        listed = ", ".join(f"{part.start}:{part.stop}" for part in missing)
        remedy = f"simulate them: tolstat run STUDY --rows {missing[0].start}:{missing[0].stop} --out FILE"
        faults.append(Fault("merge", f"no slice holds rows {listed} of {first.campaign_rows}", remedy))
    raise_all(faults)


def _ends(stores: Sequence[Reader]) -> list[int]:
    """First row that no file before the first one, the second one, ... holds, and that none of all holds."""
    return list(accumulate((store.rows.stop for store in stores), max, initial=0))


def _blocks(store: Reader, read: Callable[[slice], NDArray[np.void]], begin: int = 0) -> Iterator[NDArray[np.void]]:
    for first in range(begin, store.n, BLOCK):
        yield read(slice(first, first + BLOCK))


def _copy_results(file: h5py.File, sources: Sequence[Reader]) -> None:
    """Copy finished joints from files with rows of a campaign to the new file of the whole campaign.

    For a row in several of them, a finished result takes precedence over pending.

    Raises
    ------
    InputError
        When two of them hold different results of one row.
    """
    for source in sources:
        for at_point in source.each():
            for row, column in _copy(file, at_point):
                holding = [str(store.path) for store in sources if row in store.rows]
                found = f"hold different results of row {row}: {column} differs"
                remedy = f"find the file that is wrong, and leave it out: tolstat replay {holding[0]} --row {row}"
                raise input_error(" and ".join(holding), found, remedy)


def _copy(file: h5py.File, source: Reader) -> Iterator[tuple[int, str]]:
    """Copy finished joints; yield row and column of those that the file has already with another result."""
    place = layout.place_of(source.point or "") or "/"
    columns = [("ledger", "attempt"), *(("histories", name) for name in source.history_specs)]
    # the status last: it says what a file holds
    columns += sorted((("results", c.name) for c in source.columns), key=lambda column: column[1] == "status")
    for group, name in columns:
        dataset = file[place][group][name]
        size = min(BLOCK, max(1, COPY_BYTES // (dataset.dtype.itemsize * math.prod(dataset.shape[1:]))))
        for first in range(0, source.n, size):
            slots = slice(first, min(first + size, source.n))
            rows = slice(source.row(slots.start), source.row(slots.stop))
            done = source.status(slots) != Status.PENDING
            finished = file[place]["results/status"][rows] != Status.PENDING
            values, before = source.column(group, name, slots), dataset[rows]
            # also pending joints have an attempt, the one to come
            new = ~finished if group == "ledger" else done & ~finished
            both = np.flatnonzero(done & finished)
            same = (_bytes(values[both]) == _bytes(before[both])).all(axis=1)
            if group != "ledger" and not same.all():
                yield int(rows.start + both[np.argmin(same)]), name
            before[new] = values[new]
            dataset[rows] = before


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    """Bytes of each row, (m, size), so that a NaN compares equal to the same NaN."""
    size = values.dtype.itemsize * math.prod(values.shape[1:])
    return np.ascontiguousarray(values).view(np.uint8).reshape(len(values), size)
