"""Directory and tables of the package's data, reading of input files, and atomic writing of files."""

from __future__ import annotations

import csv
import errno
import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tolstat.common.errors import input_error

MAX_INPUT_BYTES = 64_000_000
"""Largest size of a text file that is read, bytes."""
UTF_16 = (b"\xff\xfe", b"\xfe\xff")
"""Marks before text in UTF-16."""
HDF5 = b"\x89HDF\r\n\x1a\n"
"""First bytes of a result file."""
WIDE = 64
"""First bytes of a file, of which every second one is zero in UTF-16."""


def data_dir() -> Path:
    """Directory of the data that comes with the package."""
    return _delivered("data")


def data_rows(name: str) -> list[dict[str, str]]:
    """Rows of a table (CSV) of the data folder, below its comments: column to text."""
    with (data_dir() / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def docs_dir() -> Path:
    """Directory of the pages for users, as text."""
    return _delivered("docs")


def _delivered(name: str) -> Path:
    """Directory that is inside the package in an installed wheel, and beside it in a checkout."""
    package = Path(__file__).parent.parent
    return package / name if (package / name).is_dir() else package.parent / name


def reason(error: OSError) -> str:
    """Say in a few words why a file cannot be used; of the messages of HDF5 the system's own words are taken."""
    if error.strerror:
        return error.strerror
    of_system = re.search(r"error message = '([^']*)'", str(error))
    return of_system[1] if of_system else " ".join(str(error).split())


def read_input(path: Path, utf_16: bool = False) -> str:
    """Read a text file that a user names; the mark that some editors put before UTF-8 text is left out.

    With `utf_16`, it may also be UTF-16 text with its mark.

    Raises
    ------
    OSError
        When it is missing, not permitted, not a regular file (a pipe would wait for ever, a device may have no end),
        or larger than `MAX_INPUT_BYTES`.
    UnicodeDecodeError
        When it is not UTF-8 text, see `about_encoding`.
    """
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "is a pipe or a device, not a file", str(path))
    with path.open("rb") as file:
        content = file.read(MAX_INPUT_BYTES + 1)
    if content.startswith(HDF5):
        raise UnicodeDecodeError("utf-8", HDF5, 0, 1, "HDF5")
    if len(content) > MAX_INPUT_BYTES:
        raise OSError(errno.EFBIG, f"is larger than {MAX_INPUT_BYTES / 1e6:g} MB", str(path))
    if utf_16 and content.startswith(UTF_16):
        return content.decode("utf-16")
    if b"\0" in content:
        at = content.index(b"\0")
        raise UnicodeDecodeError("utf-8", content, at, at + 1, "zero byte")
    return content.decode("utf-8-sig")


def about_encoding(error: UnicodeDecodeError) -> tuple[str, str]:
    """Say what a file is that is not UTF-8 text, and the remedy."""
    content, remedy = error.object, "save it as UTF-8"
    head = content[:WIDE]
    if content == HDF5:
        return "is a result file (HDF5), and text is needed", "give the study (TOML), or whichever text is meant"
    if content.startswith(UTF_16) or abs(2 * head.count(0) - len(head)) < 2:
        return "is UTF-16 text, not UTF-8", remedy
    if b"\0" in content:
        return "is not UTF-8 text", "give a text file"
    line = content.count(b"\n", 0, error.start) + 1
    character = content[error.start : error.start + 1].decode("cp1252", "replace")
    return f"is not UTF-8 text: line {line} has another encoding, {character!r} of Windows perhaps", remedy


def check_target(path: Path, *inputs: Path) -> None:
    """Check that a result file can be written, before the work that produces the result.

    Raises
    ------
    InputError
        When `path` is a folder, or one of `inputs`, or lies in what is no folder. A missing folder is made by
        `atomic_write`.
    """
    shown = str(path)
    if path.is_dir():
        raise input_error(shown, "cannot be written: is a folder", "give the path of a file in it")
    above = next((folder for folder in path.parents if folder.exists()), path.parent)
    if not above.is_dir():
        raise input_error(shown, f"cannot be written: {above} is no folder", "give another folder")
    if not os.access(above, os.W_OK | os.X_OK):
        raise input_error(shown, f"cannot be written: {above} is read-only", "give another folder")
    if any(path.exists() and given.exists() and path.samefile(given) for given in inputs):
        raise input_error(shown, "cannot be written: it is the input", "give the output another name")


def make_parent(path: Path) -> None:
    """Make the folder of `path` if it is missing.

    Raises
    ------
    NotADirectoryError
        When a file is in the way.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise NotADirectoryError(errno.ENOTDIR, "not a folder", str(path.parent)) from error


@contextmanager
def atomic_write(path: Path, overwrite: bool = True) -> Iterator[Path]:
    """Yield a temporary path beside `path`, and rename the file written there to `path` if no exception occurs.

    A missing folder is made.

    Parameters
    ----------
    path : Path
        Final name of the file. A file of this name is always complete.
    overwrite : bool
        Whether a file of that name is replaced.

    Raises
    ------
    FileExistsError
        When `overwrite` is false and `path` exists, even if it was created in the meantime.
    InputError
        When `path` is open in another program, and the system does not replace such files.
    """
    make_parent(path)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        sync(temporary)
        if overwrite:
            _replace(temporary, path)
        else:
            _rename_new(temporary, path)
        if hasattr(os, "O_DIRECTORY"):  # a system that opens folders
            sync(path.parent)
    except OSError as error:
        if error.errno is not None and error.filename in (None, str(temporary)):
            error.filename = str(path)  # a full disk gives no name, others the temporary one
        raise
    finally:
        temporary.unlink(missing_ok=True)


def check_disk_space(path: Path, size: int) -> None:
    """Check that a file of `size` bytes can be written beside `path`, by allocating the space temporarily.

    HDF5 does not recover from a full disk: a file that cannot be closed stays open and reports errors until exit.

    Raises
    ------
    OSError
        When there is not enough space.
    """
    if not hasattr(os, "posix_fallocate"):
        if shutil.disk_usage(path.parent).free < size:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    handle = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
    try:
        os.posix_fallocate(handle, 0, size)
    finally:
        os.close(handle)
        temporary.unlink()


def sync(path: Path) -> None:
    """Flush a file, or the entries of a folder, to the disk."""
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_text(path: Path, text: str) -> None:
    """Write a text file as `atomic_write` does, in UTF-8, its lines ended alike on all systems."""
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _replace(source: Path, target: Path) -> None:
    try:
        os.replace(source, target)
    except PermissionError as error:
        found = f"cannot be replaced: {reason(error)}"
        raise input_error(target, found, "close it in other programs, and run the same command again") from error


def _rename_new(source: Path, target: Path) -> None:
    """Rename `source` to `target` and raise if `target` exists; ``os.rename`` would replace it silently."""
    try:
        os.link(source, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        if target.exists():
            raise FileExistsError(f"{target} exists") from None
        os.rename(source, target)
