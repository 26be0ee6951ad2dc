"""Damaged and hostile result files, and commands that read them, each in a forked child of one warm process."""

from __future__ import annotations

import contextlib
import json
import os
import re
import resource
import shutil
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
from tolstat.store.histories import parts_folder
from typer.testing import CliRunner

from tolstat import cli
from tolstat.store import integrity, result_file

LIMIT_S = 30
"""Processor seconds of a command."""
WALL_S = 600.0
LEAVES_S = 10.0
"""Time in which the processes that a command started must end after it."""
LEFT_BEHIND = 97
"""Exit code of a command whose processes had to be killed after it."""
LIMIT_BYTES = 1 << 30
ODD: tuple[Any, ...] = (
    *(None, True, -1, 0, 1, 2**31, 2**33, 10**9, 10**400, 1e300, -1e300, 0.5, float("nan"), float("inf")),
    *("", "x", "../x", "/dev/zero", "\x1b[31m", "=1+1", "a" * 10**6, [], [[]], {}, {"": {}}, [1, "a"]),
)
"""Values that a leaf of a JSON attribute is replaced by."""


def corrupt(path: Path, rng: np.random.Generator) -> str:
    """Change a file in one of the ways below; return what was done.

    Where histories of an unfinished campaign lie beside it, mostly one of their parts is changed.
    """
    ways: tuple[Callable[[Path, np.random.Generator], str], ...]
    ways = (flipped, flipped_early, cut, flipped_value, swapped, reshaped)
    parts = sorted(parts_folder(path).glob("**/*.h5"))
    if parts and rng.random() < 0.7:
        path = parts[rng.integers(len(parts))]
    else:
        ways = (*ways, mutated, mutated, odd_number)
    way = ways[rng.integers(len(ways))]
    return f"{way.__name__} {path.name} {way(path, rng)}"


def flipped(path: Path, rng: np.random.Generator, part: float = 1.0) -> str:
    """Flip one bit anywhere in the first `part` of a file."""
    content = bytearray(path.read_bytes())
    at, bit = int(rng.integers(int(part * len(content)))), int(rng.integers(8))
    content[at] ^= 1 << bit
    path.write_bytes(content)
    return f"bit {bit} of byte {at}"


def flipped_early(path: Path, rng: np.random.Generator) -> str:
    """Flip a bit where HDF5 has its own structures."""
    return flipped(path, rng, 0.05)


def cut(path: Path, rng: np.random.Generator) -> str:
    """Truncate a file."""
    size = int(rng.integers(path.stat().st_size))
    os.truncate(path, size)
    return f"to {size} bytes"


def flipped_value(path: Path, rng: np.random.Generator) -> str:
    """Flip a bit of the raw data of a dataset."""
    with h5py.File(path) as file:
        dataset = _any_dataset(file, rng)
        name, begin, size = dataset.name, dataset.id.get_offset(), dataset.id.get_storage_size()
        if begin is None and dataset.chunks and dataset.id.get_num_chunks():
            chunk = dataset.id.get_chunk_info(int(rng.integers(dataset.id.get_num_chunks())))
            begin, size = chunk.byte_offset, chunk.size
    if begin is None:
        return f"no bit of {name}"
    content = bytearray(path.read_bytes())
    at, bit = begin + int(rng.integers(max(1, size))), int(rng.integers(8))
    content[at] ^= 1 << bit
    path.write_bytes(content)
    return f"bit {bit} of {name}, byte {at - begin}"


def swapped(path: Path, rng: np.random.Generator) -> str:
    """Exchange two datasets of a group."""
    with h5py.File(path, "r+") as file:
        group = _any_dataset(file, rng).parent
        names = [name for name in group if name not in result_file.LINKED]
        if len(names) < 2:
            return f"nothing of {group.name}"
        one, other = rng.choice(names, 2, replace=False)
        group.move(one, "held")
        group.move(other, one)
        group.move("held", other)
        return f"{group.name}/{one} and {other}"


def reshaped(path: Path, rng: np.random.Generator) -> str:
    """Put a dataset of another shape or type in the place of one; its values are zero."""
    with h5py.File(path, "r+") as file:
        dataset = _any_dataset(file, rng)
        name, shape, dtype = dataset.name, dataset.shape, dataset.dtype
        shapes = (shape[::-1], shape[1:], (*shape, 2), (0,), (2**33,), (2**20, *shape[1:]), (), shape)
        types = (dtype, dtype, np.dtype("f8"), np.dtype("i8"), np.dtype("u1"), np.dtype("S4"), np.dtype([("a", "f4")]))
        wanted, kind = shapes[rng.integers(len(shapes))], types[rng.integers(len(types))]
        del file[name]
        if rng.random() < 0.1:
            return f"{name} deleted"
        file.create_dataset(name, wanted, kind, chunks=True if np.prod(wanted) > 2**24 else None)
        return f"{name} of shape {wanted} and type {kind}"


def _any_dataset(file: h5py.File, rng: np.random.Generator) -> h5py.Dataset:
    """Any dataset: of any group first, so that a table of many columns does not hide the others."""
    groups: dict[str, list[h5py.Dataset]] = {}
    file.visititems(
        lambda _, item: groups.setdefault(item.parent.name, []).append(item) if isinstance(item, h5py.Dataset) else None
    )
    held = groups[sorted(groups)[rng.integers(len(groups))]]
    return held[rng.integers(len(held))]


def mutated(path: Path, rng: np.random.Generator) -> str:
    """Replace a leaf, a table or a list of a JSON attribute, with a valid checksum."""
    with h5py.File(path, "r+") as file:
        texts = {name: value for name, value in file.attrs.items() if isinstance(value, (bytes, str))}
        names = [name for name in texts if result_file.text(file.attrs, name)[:1] in ("{", "[")]
        name = names[rng.integers(len(names))]
        value = json.loads(result_file.text(file.attrs, name))
        odd = ODD[rng.integers(len(ODD))]
        where: list[Any] = []
        holder, last = {"": value}, ""
        while isinstance(holder[last], (dict, list)) and holder[last] and rng.random() < 0.8:
            holder = holder[last]
            keys = list(holder) if isinstance(holder, dict) else range(len(holder))
            last = keys[rng.integers(len(keys))]
            where.append(last)
        if rng.random() < 0.2 and isinstance(holder, dict):
            holder.pop(last)
        else:
            holder[last] = odd
        result = value if where else odd
        result_file.put_attributes(file, {name: json.dumps(result)})
        integrity.seal(file)
        return f"{name}{where} = {repr(odd)[:40]}"


def odd_number(path: Path, rng: np.random.Generator) -> str:
    """Replace a plain attribute, with a valid checksum."""
    with h5py.File(path, "r+") as file:
        name = ("first_row", "campaign_rows", "study", "study_name", "created", "filetype")[rng.integers(6)]
        odd = (0, 1, -1, 2**62, 0.5, "", "\x1b[2J\u202e", "[" * 20_000, [1, 2])[rng.integers(9)]
        file.attrs[name] = odd
        integrity.seal(file)
        return f"{name} = {repr(odd)[:40]}"


class Ended(NamedTuple):
    """How a command ended: exit code, or minus a signal; what it said; seconds; bytes of memory beyond the parent's."""

    code: int
    out: str
    err: str
    seconds: float
    memory: int


def call(words: Sequence[object], folder: Path) -> Ended:
    """Run a command in a forked child with limits of time and memory."""
    begun = time.monotonic()
    out, err = folder / "stdout", folder / "stderr"
    pid = os.fork()
    if pid == 0:
        _be_command([str(word) for word in words], out, err, folder)
    while True:
        ended, state, usage = os.wait4(pid, os.WNOHANG)
        if ended:
            break
        if time.monotonic() - begun > WALL_S:
            os.killpg(pid, signal.SIGKILL)
        time.sleep(0.002)
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    code = LEFT_BEHIND if _left_behind(pid) else os.waitstatus_to_exitcode(state)
    said, told = (path.read_text(encoding="utf-8", errors="replace") for path in (out, err))
    said = re.sub(r'.*"wall_s".*\n', "", said)  # the one number that is another in each run
    return Ended(code, said, told, time.monotonic() - begun, 1024 * (usage.ru_maxrss - own))


def run(words: Sequence[str], copied: Path) -> Ended:
    """Pass a file to a command; what the command wrote is part of its output.

    A page is text; a result file is exported, each operating point for itself.
    """
    folder = copied.parent
    ended = call([copied if word == "FILE" else word for word in words], folder)
    page, whole = folder / "page.html", folder / "whole.h5" if words[0] == "merge" else copied
    if page.exists():
        ended = ended._replace(out=ended.out + page.read_text(encoding="utf-8"))
    if ended.code == 0 and words[0] in ("extend", "merge", "run"):
        with h5py.File(whole) as file:
            points = list(file.get("points", ()))
        for point in points or [None]:
            after = call(["export", whole, "--csv", "-", "--quiet", *(("--point", point) if point else ())], folder)
            memory = max(ended.memory, after.memory)
            code = after.code or ended.code  # one point that is refused decides
            ended = after._replace(code=code, out=ended.out + after.out, err=ended.err + after.err, memory=memory)
    return ended


def _left_behind(group: int) -> bool:
    """Whether processes of a command outlive it; they are killed."""
    begun = time.monotonic()
    with contextlib.suppress(ProcessLookupError):
        while time.monotonic() - begun < LEAVES_S:
            os.killpg(group, 0)
            time.sleep(0.002)
        os.killpg(group, signal.SIGKILL)
        return True
    return False


def _be_command(words: list[str], out: Path, err: Path, folder: Path) -> None:
    code = 99
    os.setsid()
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        limit = pages * resource.getpagesize() + LIMIT_BYTES
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        used = int(time.process_time())
        resource.setrlimit(resource.RLIMIT_CPU, (used + LIMIT_S, used + LIMIT_S))
        for number, path in ((1, out), (2, err)):
            os.dup2(os.open(path, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), number)
        sys.stdout, sys.stderr = (os.fdopen(k, "w", encoding="utf-8", closefd=False) for k in (1, 2))
        os.chdir(folder)
        cli.app(words, prog_name="tolstat")
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 98
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def fault(ended: Ended, usual: Ended) -> str:
    """What is wrong with the end of a command over a corrupted file; empty if nothing is."""
    if ended.code < 0:
        return f"signal {-ended.code} after {ended.seconds:.1f} s"
    if "Traceback" in ended.err or ended.code not in (0, 2, usual.code):
        return f"exit code {ended.code}"
    if ended.memory > LIMIT_BYTES:
        return f"{ended.memory >> 20} MiB"
    if ended.code == 2:
        return "" if "error: " in ended.err and "hint: " in ended.err else "no message"
    on_page = "is damaged" in ended.out and "is damaged" not in usual.out
    told = on_page or "damaged" in ended.err or "pending" in ended.err
    return "" if ended.out == usual.out or told else "silent difference"


class Found(NamedTuple):
    """A fault: the corruption, the command, what was wrong, the end of the command."""

    corruption: str
    words: str
    fault: str
    ended: Ended


def search(
    path: Path, folder: Path, numbers: range, commands: Sequence[Sequence[str]]
) -> tuple[list[Found], dict[str, int]]:
    """Corrupt a file once for each number and pass it to the commands; ``FILE`` in their words stands for it.

    Attributes that were changed together with their checksum may change the output: checksums are no signatures.

    Returns
    -------
    list of Found
        All faults.
    dict
        Number of ends by kind: the same output, refused, told, meant (other attributes with a valid checksum).
    """
    copied = folder / path.name
    usual = {}
    for words in commands:
        _fresh(path, folder)
        usual[tuple(words)] = run(words, copied)
        assert usual[tuple(words)].code in (0, 1), usual[tuple(words)]
    found, kinds = [], {"same": 0, "refused": 0, "told": 0, "meant": 0}
    for number in numbers:
        for words in commands:
            _fresh(path, folder)
            rng = np.random.default_rng(number)
            done = corrupt(copied, rng)
            ended = run(words, copied)
            wrong = fault(ended, usual[tuple(words)])
            differs = wrong == "exit code 1" and words[0] == "replay" and "Traceback" not in ended.err
            meant = (differs or wrong == "silent difference") and done.startswith(("mutated", "odd_number"))
            if wrong and not meant:
                found.append(Found(f"{number}: {done}", " ".join(words), wrong, ended))
            same = ended.out == usual[tuple(words)].out
            kinds["meant" if meant else "refused" if ended.code == 2 else "same" if same else "told"] += 1
    return found, kinds


def warm(path: Path, folder: Path, commands: Sequence[Sequence[str]]) -> None:
    """Run commands once in this process, so that its children inherit loaded modules and kernels."""
    _fresh(path, folder / "warm")
    copied = folder / "warm" / path.name
    with contextlib.chdir(folder / "warm"):
        for words in commands:
            CliRunner().invoke(cli.app, [str(copied) if word == "FILE" else word for word in words])


def _fresh(path: Path, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    shutil.copy(path, folder / path.name)
    if parts_folder(path).exists():
        shutil.copytree(parts_folder(path), parts_folder(folder / path.name))
