"""Text of a study for another folder: the joint file and the measured data that it names stay the same files."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

from tolstat.common.errors import InputError
from tolstat.common.toml_lines import KeyPath, paths
from tolstat.joint import Joint, reading
from tolstat.study import rewriting
from tolstat.study.study import Study


def placed(text: str, source: Path, target: Path) -> str:
    """Text of a study as it runs from another folder.

    Parameters
    ----------
    text : str
        TOML.
    source, target : Path
        Study whose folder its relative paths start from, and the study that it becomes.

    Returns
    -------
    str
        TOML. Paths that were relative are relative to the folder of `target`, or absolute where there is no such path,
        as on another drive.

    Raises
    ------
    InputError
        See `rewriting.with_keys`.
    """
    changes: dict[KeyPath, dict[str, Any]] = {}
    for path, name in _files(tomllib.loads(text)):
        if not Path(name).is_absolute():
            changes.setdefault(path[:-1], {})[str(path[-1])] = _between(source.parent / name, target.parent)
    return rewriting.with_keys(text, changes, str(target)) if changes else text


def joints_beside(study: Study) -> dict[KeyPath, str]:
    """Joint files of a study whose own ones are not there, or are others by now, by the key path of their table.

    A result file has its joints, and the names of the joints' files, but not the folder of the study.
    """
    data: Any = tomllib.loads(study.text)
    written: dict[KeyPath, Joint] = {("joint",): study.joint}
    written |= {("shaft", "joint2"): joint2} if (joint2 := study.operation.joint2) else {}
    return {
        path: f"# The joint of {study.name}.toml, with the keys that this study sets.\n"
        + rewriting.as_text(joint.given("json"))
        for path, joint in written.items()
        if not _at_hand(study, reduce(getitem, path, data), joint)
    }


def _at_hand(study: Study, keys: Any, joint: Joint) -> bool:
    """Whether the keys of a table of a study still make a joint."""
    keys = keys if study.fit is None else {**keys, "contact": keys.get("contact", {}) | study.fit.diameters}
    try:
        return reading.load(keys["base"], keys, str(study.path), study.path.parent).given() == joint.given()
    except InputError:
        return False


def _between(path: Path, folder: Path) -> str:
    """Path from a folder to a file, with slashes."""
    try:
        return Path(os.path.relpath(path.absolute(), folder.absolute())).as_posix()
    except ValueError:  # on another drive
        return path.absolute().as_posix()


def _files(data: Any) -> Iterator[tuple[KeyPath, str]]:
    """Key path and name of each file that a study names: of joints, measured parts and measured signals."""
    for path in paths(data):
        value = reduce(getitem, path, data)
        if not isinstance(value, str):
            continue
        is_path = value.lower().endswith(".toml") or len(Path(value).parts) > 1
        if path[-1] == "file" or (path[-1] == "base" and path[-2] in ("joint", "joint2") and is_path):
            yield path, value
