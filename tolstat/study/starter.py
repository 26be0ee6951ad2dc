"""A new study with comments that runs as it stands, its schema for editors, and a joint of one's own."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from tolstat.common import strict
from tolstat.common.errors import Fault, input_error, raise_all
from tolstat.common.files import atomic_write, data_dir
from tolstat.study import rewriting
from tolstat.study.schema import KINDS, schema

HEADER = "#:schema ./{}.schema.json\n"
OWN = "own"
"""Word for a joint file that is written with the study."""
TEMPLATES = Path(__file__).parent / "templates"
WIDTH = 100
"""Columns of a line with a comment."""
LIMITS = {OWN: ("2500 N", "60 N*m")}
"""Limits on force and torque of cross bushings that a few per cent of the joints exceed; `LIMIT` for others."""
LIMIT = ("850 N", "36 N*m")


def write(path: Path, joint: str) -> list[Path]:
    """Write a study, and a joint file if it is to have a joint of its own, with the schemas of both.

    Parameters
    ----------
    path : Path
        The study; its folder is made.
    joint : str
        Name of a joint in ``data/joints``, or `OWN`.

    Returns
    -------
    list of Path
        The files, the study first.

    Raises
    ------
    InputError
        When there is no such joint, a file exists, or cannot be written.
    """
    names = sorted(file.stem for file in (data_dir() / "joints").glob("*.toml"))
    if joint not in (*names, OWN):
        raise input_error("--joint", f"no joint is named {joint!r}", strict.did_you_mean(joint, [*names, OWN]))
    files = dict(_files(path, joint))
    taken = [file for file in files if file.exists() and not _made(file)]
    raise_all(Fault(str(file), "exists", "give the study another name") for file in taken)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for file, text in files.items():
            with atomic_write(file) as temporary:
                temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        found = f"cannot be written: {error.strerror or error}"
        raise input_error(path, found, "give a folder that is writable") from error
    return list(files)


def _files(path: Path, joint: str) -> Iterator[tuple[Path, str]]:
    base = f"{path.stem}_joint.toml" if joint == OWN else joint
    yield path, HEADER.format("study") + study_text(path, base, LIMITS.get(joint, LIMIT))
    if joint == OWN:
        text = "# The joint as designed. Keys behind a # may be left out; their values are those of another joint.\n"
        yield path.with_name(base), HEADER.format("joint") + text + joint_text()
    for kind in ("study", "joint") if joint == OWN else ("study",):
        yield path.with_name(f"{kind}.schema.json"), json.dumps(schema(kind), indent=1, ensure_ascii=False) + "\n"


def study_text(path: Path, base: str, limits: tuple[str, str] = LIMIT) -> str:
    """Study with comments, of a name, on the joint `base`, with limits on force and torque of cross bushings."""
    study = (TEMPLATES / "study.toml").read_text(encoding="utf-8")
    words = {"JOINT": base, "FORCE": limits[0], "TORQUE": limits[1]}
    for word, value in (words | {"STUDY.toml": path.name, "STUDY.h5": f"{path.stem}.h5"}).items():
        study = study.replace(word, value)
    return study


def _made(path: Path) -> bool:
    """Whether a file is a schema of tolstat, which may be replaced by that of this version."""
    try:
        title = json.loads(path.read_text(encoding="utf-8"))["title"]
    except (OSError, ValueError, TypeError, KeyError):
        return False
    return title in [schema(kind)["title"] for kind in KINDS]


def joint_text() -> str:
    """Joint file with all keys, those that are optional as comments, and what each means; then what is assumed."""
    template = TEMPLATES / "joint.toml"
    keys, *assumed = strict.read_text(template).partition("# What is assumed")
    return "\n".join(_table(schema("joint"), strict.read_toml(template, keys))) + "\n\n" + "".join(assumed)


def _table(part: Mapping[str, Any], values: Mapping[str, Any], name: str = "") -> Iterator[str]:
    """Lines of a table: its keys with their values, then the tables in it; of one without values as comments."""
    if name:
        yield ""
        yield from textwrap.wrap(part.get("description", ""), WIDTH, initial_indent="# ", subsequent_indent="# ")
        yield f"[{name}]" if values else f"# [{name}]"
    lines, inner = [], []
    for key, field in part["properties"].items():
        if key == "assumed":
            continue
        if field.get("type") == "object":
            inner.append(_table(field, values.get(key, {}), f"{name}.{key}" if name else key))
        elif key in values:
            lines.append((f"{key} = {rewriting.literal(values[key])}", field))
        else:
            lines.append((f"# {key} = {rewriting.literal(field['examples'][0])}", field))
    width = max((len(line) for line, _ in lines if len(line) < WIDTH // 2), default=0)
    for line, field in lines:
        yield from _commented(line, field["description"], width)
    for lines_of_table in inner:
        yield from lines_of_table


def _commented(line: str, text: str, width: int) -> Iterator[str]:
    if len(line) <= width and width + len(text) + 4 <= WIDTH:
        yield f"{line:{width}}  # {text}"
    else:
        yield from textwrap.wrap(text, WIDTH, initial_indent="# ", subsequent_indent="# ")
        yield line
