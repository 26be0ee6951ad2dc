"""Compiled code on disk: what is damaged is compiled anew, what others may write is not used, versions do not meet."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.environment import environment
from tests.support.systems import needs_posix
from tolstat import cli
from tolstat.kernel.simd import cache_folder, jit


def polynomial(x):
    return x * x + 3 * x + 1


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(jit, "CACHE_DIRECTORY", tmp_path)
    cache_folder.tell.cache_clear()
    return tmp_path


def compiled(x: float = 2.0) -> bool:
    """Whether a new kernel had to be compiled; its value must be right."""
    kernel = jit.njit(polynomial)
    assert kernel(x) == x * x + 3 * x + 1
    return not kernel.stats.cache_hits


def files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def test_code_is_compiled_once(folder: Path) -> None:
    assert [compiled(), compiled(), compiled(2), compiled(2), compiled()] == [True, False, True, False, False]
    assert len(files(folder)) == 2  # a version for numbers with a point, one for those without


LOADS = """
from numba.core.registry import cpu_target
from tests.kernel import test_cache
test_cache.jit.CACHE_DIRECTORY = test_cache.Path(FOLDER)
assert not test_cache.compiled()
assert not cpu_target.typing_context._functions
assert test_cache.compiled(3)
assert cpu_target.typing_context._functions
"""


def test_code_that_is_loaded_needs_nothing_that_numba_can_compile(folder: Path) -> None:
    """Numba registers all of it before it looks into its cache: 0.13 s in each process."""
    assert compiled()
    subprocess.run([sys.executable, "-c", LOADS.replace("FOLDER", repr(str(folder)))], check=True, env=environment())


def test_damaged_code_is_compiled_anew_with_one_line_of_notice(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Numba's own cache maps what it finds: flipped bits crash the process, or change what it computes."""
    chance = random.Random(1)
    assert compiled()
    (path,) = files(folder)
    whole = path.read_bytes()
    for trial in range(12):
        hurt = bytearray(whole)
        hurt[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        path.write_bytes([hurt, hurt[: chance.randrange(len(whole))], b""][trial % 3])
        assert compiled(), trial
        assert not compiled(), trial
    said = capfd.readouterr().err
    assert said.count("\n") == 1
    assert "is damaged: it is compiled anew" in said


def test_a_file_of_another_version_of_a_kernel_is_not_used(folder: Path) -> None:
    assert compiled(2.0)
    (one,) = files(folder)
    assert compiled(2)
    (other,) = set(files(folder)) - {one}
    other.write_bytes(one.read_bytes())
    assert compiled(2)


@pytest.mark.slow
def test_processes_that_compile_at_the_same_time_lose_nothing(tmp_path: Path) -> None:
    """Numba's own index knows what the last of them has written."""
    code = (
        "import sys; from pathlib import Path; from tests.kernel.test_cache import jit, polynomial\n"
        "kernel = jit.njit(polynomial)\n"
        "sys.stdin.readline(); print(kernel(float(sys.argv[1]) if sys.argv[1] != '2' else 2))"
    )
    own = environment() | {"NUMBA_CACHE_DIR": str(tmp_path)}
    start = {"env": own, "stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    both = [subprocess.Popen([sys.executable, "-c", code, x], **start) for x in ("2", "2.0")]
    assert [process.communicate("go\n")[0] for process in both] == ["11\n", "11.0\n"]
    (made,) = tmp_path.iterdir()
    assert made.name == f"kernel-{cache_folder.source_hash()}"
    assert len(files(tmp_path)) == 2


@needs_posix
def test_a_folder_that_others_may_write_to_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    cache_folder.tell.cache_clear()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    path = cache_folder.cache_directory()
    assert path.parent == tmp_path
    assert path.stat().st_mode & 0o077 == 0
    assert capfd.readouterr().err == ""
    path.chmod(0o770)
    assert cache_folder.cache_directory().parent != tmp_path
    assert path.stat().st_mode & 0o777 == 0o770
    assert "others than you and root may write" in capfd.readouterr().err
    path.rmdir()
    (tmp_path / "elsewhere").mkdir()
    path.symlink_to(tmp_path / "elsewhere")
    assert cache_folder.cache_directory().parent != tmp_path


@needs_posix
def test_a_folder_that_can_only_be_read_is_used_if_it_has_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    path = cache_folder.cache_directory()
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert cache_folder.cache_directory() != path
    (path / "some.nbc").touch()
    assert cache_folder.cache_directory() == path


def test_code_that_cannot_be_saved_is_compiled_at_each_start(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    assert compiled()
    assert compiled()
    assert not files(folder)
    assert capfd.readouterr().err.count("cannot be kept") == 1


def test_the_command_shows_and_clears_the_folders(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    own, old = folder / f"kernel-{cache_folder.source_hash()}", folder / "kernel-0123456789abcdef"
    monkeypatch.setattr(cache_folder, "CACHE_DIRECTORY", own)
    for path in (own, old):
        (path / "kernel").mkdir(parents=True)
        (path / "kernel" / "one.nbc").write_bytes(bytes(3_000_000))
    (folder / "mine.txt").touch()
    shown = CliRunner().invoke(cli.app, ["cache"])
    assert shown.exit_code == 0
    assert shown.stdout.splitlines() == [f"{path}: 1 kernels, 3.0 MB" for path in (own, old)]
    cleared = CliRunner().invoke(cli.app, ["cache", "--clear"])
    assert "removed 6.0 MB" in cleared.stderr
    assert [path.name for path in folder.iterdir()] == ["mine.txt"]
