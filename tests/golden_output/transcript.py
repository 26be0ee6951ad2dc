"""Transcripts: commands with exit code, standard output, messages, and the files that they wrote, as text."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from typer.testing import CliRunner

from tests.golden_output import numbers, page
from tests.golden_output.stable import stable
from tests.support.environment import ROOT, environment
from tolstat.cli import app

PROCESS = "process: "
"""Before a command that is run as a process of its own; all others run in this one."""
ROUGH, SHAPE = "rough: ", "shape: "
"""Before a command whose numbers depend on the processor, by linear algebra in it: the first are compared roughly, of
the second words and tables alone."""
SHOWN_FILES = {".csv", ".json", ".toml", ".html"}
RESULT_FILES = {".h5", ".png", ".svg"}
ENVIRONMENT = {"COLUMNS": "80", "LINES": "40", "TERM": "dumb", "NO_COLOR": "1"}


def transcript(folder: Path, commands: list[str]) -> str:
    """Run `commands` in `folder` one after the other; returns what they said and wrote."""
    return "\n\n".join(_one(folder, command) for command in commands) + "\n"


def _one(folder: Path, command: str) -> str:
    if command.startswith("sed "):
        _, rule, *files = shlex.split(command)
        _, old, new, _ = rule.split("|")
        for name in files:
            _edit(folder / name, old, new.replace("\\n", "\n"))
        return f"$ {command}"
    if command.startswith("variants "):
        _, file, *names = shlex.split(command)
        _keep_variants(folder / file, names)
        return f"$ {command}"
    before = _files(folder)
    kind = next((prefix for prefix in (PROCESS, ROUGH, SHAPE) if command.startswith(prefix)), "")
    command = command.removeprefix(kind)
    words = shlex.split(command)
    code, out, err = _in_a_process(folder, words) if kind == PROCESS else _here(folder, words)
    assert "Traceback (most recent call last)" not in out + err, f"tolstat {command}\n{out}\n{err}"
    assert out.strip() or err.strip(), f"tolstat {command}: exit code {code}, and not a word"
    changed = [name for name, state in _files(folder).items() if before.get(name) != state]
    changed = [name for name in changed if name not in before or not name.endswith(".h5")]
    places = {str(folder): "FOLDER", str(ROOT): "ROOT"}
    blocks = [f"$ tolstat {command}", f"exit code {code}"]
    for head, text in (("stdout", out), ("stderr", err)):
        if text.strip():
            blocks += _block(head, text, places, kind)
    if changed:
        blocks.append("== wrote " + ", ".join(changed))
    for name in changed:
        if Path(name).suffix in SHOWN_FILES:
            blocks += _block(name, (folder / name).read_text(encoding="utf-8"), places, kind)
        else:
            assert Path(name).suffix in RESULT_FILES, name
            assert (folder / name).stat().st_size, name
    return "\n".join(blocks)


def _block(name: str, text: str, places: dict[str, str], kind: str) -> list[str]:
    """Head and text of one output, in the form of its kind."""
    how = ""
    if name.endswith(".html"):
        shown = page.as_text(text)
    elif name.endswith(".json") or (name == "stdout" and text[:1] in {"{", "["}):
        how, shown = numbers.CLOSE, numbers.json_text(text)
    elif name.endswith(".csv") or (name == "stdout" and text.count(",") > 60 * text.count("\n")):
        how, shown = numbers.CLOSE, numbers.csv_text(text)
    else:
        shown = text
    shown = stable(shown, places)
    if kind == SHAPE:
        how, shown = "", numbers.without_numbers(shown)
    return [f"== {name}{numbers.ROUGH if kind == ROUGH else how}", shown]


def _edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{path}: has no {old!r}"
    path.write_text(text.replace(old, new), encoding="utf-8")


def _keep_variants(path: Path, names: list[str]) -> None:
    """Leave only the variants of these names in a study."""
    head, *variants = path.read_text(encoding="utf-8").split("[[variant]]\n")
    kept = [text for text in variants if any(text.startswith(f'name = "{name}"\n') for name in names)]
    assert len(kept) == len(names), f"{path}: has {len(kept)} of {names}"
    path.write_text("[[variant]]\n".join([head, *kept]), encoding="utf-8")


def _files(folder: Path) -> dict[str, tuple[int, int]]:
    """Time of change and size of each file below a folder."""
    found = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): (path.stat().st_mtime_ns, path.stat().st_size) for path in found}


def _here(folder: Path, words: list[str]) -> tuple[int, str, str]:
    with _inside(folder):
        done = CliRunner().invoke(app, words, env=ENVIRONMENT, prog_name="tolstat")
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise AssertionError(shlex.join(words) + "\n" + "".join(traceback.format_exception(done.exception)))
    return done.exit_code, done.stdout, done.stderr


def _in_a_process(folder: Path, words: list[str]) -> tuple[int, str, str]:
    done = subprocess.run(
        [sys.executable, "-m", "tolstat", *words],
        cwd=folder,
        env=environment() | ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


@contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def studies(folder: Path) -> Path:
    """Copy the files of studies/ to `folder`; returns it."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in (ROOT / "studies").iterdir():
        if path.is_file():
            shutil.copy(path, folder)
    return folder
