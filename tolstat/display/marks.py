"""Generated part of a Markdown file: the text between two comments, which a command replaces."""

from __future__ import annotations

from pathlib import Path

from tolstat.common.errors import Fault, InputError
from tolstat.common.files import atomic_write


def split(path: Path, name: str) -> tuple[str, str]:
    """Return the text up to the opening comment of part `name`, and the text from its closing comment on.

    Raises
    ------
    InputError
        When the file cannot be read or lacks the two comments.
    """
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    try:
        content = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError([Fault(str(path), f"cannot be read: {error}", "name a Markdown file")]) from error
    head, opened, rest = content.partition(begin)
    _, closed, tail = rest.partition(end)
    if not (opened and closed):
        raise InputError([Fault(str(path), "has no place for the table", f"add the lines {begin} and {end}")])
    return head + begin, end + tail


def insert(path: Path, name: str, part: str) -> None:
    """Replace part `name` of a file by the text `part`; raises as `split` does."""
    head, tail = split(path, name)
    with atomic_write(path) as temporary:
        temporary.write_text(f"{head}\n\n{part}\n\n{tail}", encoding="utf-8")
