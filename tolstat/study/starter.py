"""A new study with comments that runs as it stands, of a joint, a drive shaft or a linkage, schemas, and a joint."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from string import Template
from typing import Any

from tolstat.common import strict
from tolstat.common.errors import Fault, input_error, raise_all
from tolstat.common.files import data_dir, write_text
from tolstat.study import cross_sizes, rewriting
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
SHAFT_JOINT = ("pin25", 600.0, 107.0, 7.0)
"""Joint of a drive shaft without a size: its name, torque (N m), length over two cups (mm), force on a pin (kN)."""


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
    base = _beside(path) if joint == OWN else joint
    return _write(path, study_text(path, base, LIMITS.get(joint, LIMIT)), joint_text() if joint == OWN else None)


def write_shaft(path: Path, size: str | None) -> list[Path]:
    """Write the study of a drive shaft, and the file of its joints if their size is given, with the schemas of both.

    Parameters
    ----------
    path : Path
        The study; its folder is made.
    size : str, optional
        Size of the crosses in the table of `cross_sizes`; without it the joints are `SHAFT_JOINT`.

    Returns
    -------
    list of Path
        The files, the study first.

    Raises
    ------
    InputError
        When there is no such size, a file exists, or cannot be written.
    """
    if size is None:
        return _write(path, _shaft_text(path, *SHAFT_JOINT), None)
    row = cross_sizes.cross(size)
    study = _shaft_text(path, _beside(path), row.torque_Nm, row.length_mm, row.pin_force_kN)
    return _write(path, study, joint_text("cross.toml", row.words()))


def write_linkage(path: Path, kind: str) -> list[Path]:
    """Write the study of a linkage of a kind, the name of its template, with its schema; as `write`."""
    return _write(path, _filled(f"{kind}.toml", path), None)


def _beside(path: Path) -> str:
    """Name of the joint file that is written with a study."""
    return f"{path.stem}_joint.toml"


def _write(path: Path, study: str, joint: str | None) -> list[Path]:
    """Write a study, a joint file beside it if there is one, and their schemas; returns the files."""
    files = {path: HEADER.format("study") + study}
    if joint is not None:
        files[path.with_name(_beside(path))] = HEADER.format("joint") + joint
    for kind in ("study", "joint")[: len(files)]:
        files[path.with_name(f"{kind}.schema.json")] = json.dumps(schema(kind), indent=1, ensure_ascii=False) + "\n"
    taken = [file for file in files if file.exists() and not _made(file)]
    raise_all(Fault(str(file), "exists", "give the study another name") for file in taken)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        for file, text in files.items():
            write_text(file, text)
    except OSError as error:
        found = f"cannot be written: {error.strerror or error}"
        raise input_error(path, found, "give a folder that is writable") from error
    return list(files)


def study_text(path: Path, base: str, limits: tuple[str, str] = LIMIT) -> str:
    """Study with comments, of a name, on the joint `base`, with limits on force and torque of cross bushings."""
    return _filled("study.toml", path, joint=base, force=limits[0], torque=limits[1])


def _shaft_text(path: Path, base: str, torque: float, length: float, pin_force: float) -> str:
    """Study of a drive shaft of a rated torque (N m), which presses on a pin (kN), and length over two cups (mm)."""
    numbers = {
        "cruise": 0.3 * torque,
        "climb": 0.6 * torque,
        "start": torque,
        "tube": 0.9 * length,
        "spline": 0.45 * length,
        "bearing": 1.5 * torque + 200.0,  # limits that a few per cent of the shafts exceed
        "pin_force": 1.05 * pin_force,
    }
    return _filled("shaft.toml", path, joint=base, **{name: f"{float(f'{x:.3g}'):g}" for name, x in numbers.items()})


def _filled(template: str, path: Path, **words: str) -> str:
    """Text of the template of a study of a name, with words put in."""
    text = Template((TEMPLATES / template).read_text(encoding="utf-8"))
    return text.substitute(words, study=path.name, results=f"{path.stem}.h5")


def _made(path: Path) -> bool:
    """Whether a file is a schema of tolstat, which may be replaced by that of this version."""
    try:
        title = json.loads(path.read_text(encoding="utf-8"))["title"]
    except (OSError, ValueError, TypeError, KeyError):
        return False
    return title in [schema(kind)["title"] for kind in KINDS]


def joint_text(template: str = "joint.toml", words: Mapping[str, str] | None = None) -> str:
    """Joint file of a template: all keys, those that are optional as comments, and what each means; what is assumed.

    `words` are put into the template; its comments before the first key are kept.
    """
    path = TEMPLATES / template
    head, first, rest = Template(strict.read_text(path)).substitute(words or {}).partition("description = ")
    keys, *assumed = (first + rest).partition("# What is assumed")
    return head + "\n".join(_table(schema("joint"), strict.read_toml(path, keys))) + "\n\n" + "".join(assumed)


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
