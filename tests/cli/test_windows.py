"""The main job's commands in a Python without what Windows lacks, see `tests.support.windows.sitecustomize`."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path, PureWindowsPath

import pytest

from tests.campaign.test_campaign import datasets
from tests.conftest import CHEAP
from tests.support.environment import ROOT, environment
from tests.support.systems import needs_linux
from tolstat import run, study
from tolstat.common.shell import quote
from tolstat.store import ResultFile, Writer

REFUSED = re.compile(r'[<>:"/\\|?*\x00-\x1f]|[. ]$')
"""What Windows refuses in the name of a file."""
NOT_EVERYWHERE = re.compile(r"^\s*(?:import|from) (?:os|signal|fcntl|grp|pty|pwd|resource|syslog|termios|tty)\b", re.M)
"""Imports of what Windows lacks, or lacks names of."""


def process(folder: Path, *words: str, module: str = "tolstat") -> subprocess.Popen[str]:
    """Start a command in a folder."""
    paths = os.pathsep.join([str(ROOT / "tests" / "support" / "windows"), str(ROOT)])
    own = environment() | {"PYTHONPATH": paths, "PYTHONIOENCODING": "cp1252"}
    python = [sys.executable, *([] if "dask" in words else ["-W", "error"]), "-m", module, *words]
    pipe = subprocess.PIPE
    return subprocess.Popen(python, env=own, cwd=folder, stdout=pipe, stderr=pipe, encoding="cp1252")


def command(folder: Path, *words: str, code: int = 0, module: str = "tolstat") -> str:
    """Run a command in a folder; gives what it prints and says."""
    with process(folder, *words, module=module) as running:
        printed, said = running.communicate()
    assert running.returncode == code, printed + said
    return printed + said


def done(path: Path) -> int:
    with ResultFile.open(path) as store:
        return store.counts().done


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a space and an umlaut in its name; in it the main job, and one of few joints, cheaper."""
    path = tmp_path_factory.mktemp("windows") / "eine Prüfung"
    path.mkdir()
    text = (ROOT / "studies" / "iso2768_f.toml").read_text(encoding="utf-8")
    few = text.replace("n = 1024", "n = 200").replace("[sampling]", f"[output]\n{CHEAP}")
    for name, content in {"main.toml": text.replace("n = 1024", "n = 4000"), "few.toml": few}.items():
        (path / name).write_text(content, encoding="utf-8", newline="\n")
    return path


@pytest.fixture(scope="module")
def whole(folder: Path) -> Path:
    """File of the few joints, run in one go."""
    command(folder, "run", "few.toml")
    return folder / "few.h5"


@needs_linux
@pytest.mark.slow
def test_a_campaign_is_interrupted_and_resumed(folder: Path, tmp_path: Path) -> None:
    """Meanwhile others may read its file; in the end it has the bytes of any other run."""
    path = folder / "main.h5"
    with process(folder, "run", "main.toml", "--workers", "2") as running:
        while not (path.exists() and done(path)):
            assert running.poll() is None, running.communicate()
            time.sleep(0.02)
        running.send_signal(signal.SIGINT)
        said = running.communicate()[1]
    assert running.returncode == 130
    assert "to resume, run the same command again" in said
    assert 0 < done(path) < 4001
    command(folder, "run", "main.toml", "--workers", "2")
    run(study.load(folder / "main.toml"), tmp_path / "a.h5")
    assert datasets(path) == datasets(tmp_path / "a.h5")


@needs_linux
@pytest.mark.slow
def test_slices_are_merged(folder: Path, whole: Path) -> None:
    for name, rows in {"a.h5": "0:20", "b.h5": "20:201"}.items():
        command(folder, "run", "few.toml", "--rows", rows, "--out", name)
    command(folder, "merge", "a.h5", "b.h5", "--out", "merged.h5")
    merged, expected = datasets(folder / "merged.h5"), datasets(whole)  # which has checks of the numerical error, too
    assert merged == {name: expected[name] for name in merged}
    assert {name.partition("/")[0] for name in merged} >= {"errors", "results", "histories"}


@needs_linux
@pytest.mark.slow
def test_a_campaign_grows(folder: Path) -> None:
    for number, name in ((20, "grown.h5"), (40, "forty.h5")):
        command(folder, "run", "few.toml", "--n", str(number), "--out", name)
    command(folder, "extend", "grown.h5", "--n", "40")
    grown, expected = datasets(folder / "grown.h5"), datasets(folder / "forty.h5")
    assert {name for name in expected if grown[name] != expected[name]} <= {"metadata"}
    assert done(folder / "grown.h5") == 41


@needs_linux
@pytest.mark.slow
@pytest.mark.skipif(find_spec("distributed") is None, reason="needs Dask")
def test_a_cluster_gives_the_same_bytes(folder: Path, whole: Path) -> None:
    command(folder, "run", "few.toml", "--out", "cluster.h5", "--executor", "dask", "--workers", "2")
    assert datasets(folder / "cluster.h5") == datasets(whole)


@needs_linux
@pytest.mark.slow
def test_files_are_those_of_any_system(folder: Path, whole: Path) -> None:
    """Written in UTF-8, with the same line ends, under names that Windows takes."""
    command(folder, "new", "own")
    command(folder, "report", "few.h5", "--out", "few.html")
    command(folder, "causes", "few.h5", "--run", "--out", "causes")
    command(folder, "export", "few.h5", "--csv", "few.csv")
    written = [path for path in folder.rglob("*") if path.is_file()]
    assert len(written) > 10
    assert not [path.name for path in written if REFUSED.search(path.name)]
    for path in written:
        if path.suffix in (".toml", ".csv", ".json", ".html", ".svg"):
            assert b"\r" not in path.read_bytes(), path.name
            path.read_text(encoding="utf-8")


@needs_linux
@pytest.mark.slow
def test_one_process_writes_a_file(folder: Path, whole: Path) -> None:
    with Writer.open(whole) as store:
        store.begin_session(0)
        assert "is being written by another process" in command(folder, "run", "few.toml", code=2)
        assert "running: no" not in command(folder, "status", "few.h5")
    assert "running: no" in command(folder, "status", "few.h5")


@needs_linux
@pytest.mark.slow
def test_a_file_that_another_program_has_open_is_told(folder: Path, whole: Path) -> None:
    content = whole.read_bytes()
    with whole.open("rb"):
        said = command(folder, "run", "few.toml", "--retry", "ok", code=2)
    assert "few.h5: cannot be replaced: " in said
    assert "close it in other programs" in said
    assert whole.read_bytes() == content


def collected(*paths: Path, code: int = 0) -> str:
    """Let pytest import test modules; gives what it prints."""
    words = ("--collect-only", "-q", "-m", "", "-p", "no:cacheprovider", "--rootdir", str(ROOT))
    return command(ROOT, *words, *map(str, paths), code=code, module="pytest")


@needs_linux
@pytest.mark.slow
def test_all_test_modules_are_imported() -> None:
    """Those without such imports are imported everywhere."""
    tests = (ROOT / "tests").rglob("test_*.py")
    assert "test_all_test_modules_are_imported" in collected(
        *(path for path in tests if NOT_EVERYWHERE.search(path.read_text(encoding="utf-8")))
    )


@needs_linux
@pytest.mark.slow
@pytest.mark.parametrize("line", ["import resource", "from signal import SIGKILL", "import os\nos.killpg"])
def test_a_test_module_that_needs_more_is_not_imported(tmp_path: Path, line: str) -> None:
    path = tmp_path / "tests_of_one_system.py"  # a name like those of this folder's modules
    path.write_text(f"{line}\n\n\ndef test_nothing():\n    pass\n", encoding="utf-8")
    assert NOT_EVERYWHERE.search(line)
    assert "error" in collected(path, code=2)


@pytest.mark.parametrize(
    ("word", "quoted"),
    [
        (str(PureWindowsPath(r"C:\studies\a.toml")), r"C:\studies\a.toml"),
        (str(PureWindowsPath(r"C:\my studies", "a.toml")), r'"C:\my studies\a.toml"'),
        (str(PureWindowsPath(r"\\server\share", "a&b.h5")), r'"\\server\share\a&b.h5"'),
        ('joint.base="x y"', r'"joint.base=\"x y\""'),
    ],
)
def test_words_of_commands_are_quoted_as_on_windows(word: str, quoted: str) -> None:
    assert quote(word, windows=True) == quoted
    assert subprocess.list2cmdline([word]) in (quoted, quoted.strip('"'))
