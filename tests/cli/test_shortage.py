"""Machines without memory or disk space: one sentence, exit code 2, inputs as they were, no half file."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
from typer.testing import CliRunner

from tests.support import corruption, synthetic
from tests.support.environment import ROOT, environment
from tests.support.systems import needs_linux
from tolstat import cli
from tolstat.common.errors import InputError
from tolstat.common.files import check_target, reason

NO_SPACE = OSError(errno.ENOSPC, "No space left on device", "page.html")


@pytest.mark.parametrize(
    ("error", "found"),
    [
        (MemoryError("Unable to allocate 7.45 GiB for an array"), "error: memory: Unable to allocate 7.45 GiB"),
        (MemoryError(), "error: memory: no more could be allocated\n  hint: use fewer workers"),
        (NO_SPACE, "error: page.html: cannot be written: No space left on device\n  hint: check that the folder"),
    ],
)
def test_what_is_short_is_said_in_one_sentence(error: Exception, found: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("tolstat.study.load", fails)
    done = CliRunner().invoke(cli.app, ["run", str(ROOT / "studies" / "iso2768_f.toml"), "--out", "/tmp/x.h5"])
    assert done.exit_code == 2
    assert done.stderr.startswith(found)
    assert len(done.stderr.splitlines()) == 2


def test_errors_that_no_machine_would_mend_stay_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise OSError(errno.EBADF, "Bad file descriptor")

    monkeypatch.setattr("tolstat.study.load", fails)
    done = CliRunner().invoke(cli.app, ["run", str(ROOT / "studies" / "iso2768_f.toml")])
    assert isinstance(done.exception, OSError)


@needs_linux
@pytest.mark.slow
def test_a_process_that_may_use_too_little_memory_says_so(tmp_path: Path) -> None:
    limit = 400 * 10**6
    done = subprocess.run(
        [sys.executable, "-m", "tolstat", "run", str(ROOT / "studies" / "iso2768_f.toml"), "--out", "a.h5"],
        env=environment() | {"OPENBLAS_NUM_THREADS": "1"},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        preexec_fn=lambda: psutil.Process().rlimit(psutil.RLIMIT_AS, (limit, limit)),
    )
    assert done.returncode == 2
    assert "error: memory: " in done.stderr
    assert "may use 400 MB (ulimit -v) and needs 700 MB" in done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_told_before_the_first_joint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda _, mode: mode == os.R_OK)
    with pytest.raises(InputError, match=f"cannot be written: {tmp_path} is read-only"):
        check_target(tmp_path / "a.h5")
    done = CliRunner().invoke(
        cli.app, ["run", str(ROOT / "studies" / "iso2768_f.toml"), "--out", str(tmp_path / "a.h5")]
    )
    assert (done.exit_code, "is read-only" in done.stderr) == (2, True)


def test_of_what_hdf5_says_the_words_of_the_system_are_kept() -> None:
    said = "Unable to create file (write failed: time = now\n, errno = 28, error message = 'No space left', buf = 0x5)"
    assert reason(OSError(said)) == "No space left"
    assert reason(OSError("two\n lines")) == "two lines"
    assert reason(NO_SPACE) == "No space left on device"


def test_a_page_that_does_not_fit_the_disk_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tolstat.display import html

    (tmp_path / "page.html").write_text("the old one")
    template = SimpleNamespace(render=lambda **_: "the new one")
    monkeypatch.setattr(html, "environment", lambda _: SimpleNamespace(get_template=lambda _: template))

    def full(*_: object, **__: object) -> None:
        raise NO_SPACE

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match="No space"):
        html.write(SimpleNamespace(sections=[], wording=str), tmp_path / "page.html")
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]
    assert (tmp_path / "page.html").read_bytes() == b"the old one"


@needs_linux
@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("export", "--csv", "new.csv"),
        ("merge", "--out", "new.h5"),
        ("report", "--out", "new.html"),
    ],
    ids=lambda words: words[-1],
)
def test_a_full_disk_ends_in_one_message_and_leaves_no_half_file(words: tuple[str, str, str], tmp_path: Path) -> None:
    """No file may become longer than 20 kB: the system refuses what lies beyond, as on a full disk."""
    command, option, new = words
    path = synthetic.store(tmp_path)
    names, content = sorted(tmp_path.iterdir()), path.read_bytes()
    process = psutil.Process()
    _, hard = process.rlimit(psutil.RLIMIT_FSIZE)
    with tempfile.TemporaryDirectory() as folder:
        try:
            process.rlimit(psutil.RLIMIT_FSIZE, (20_000, hard))
            ended = corruption.call([command, path, option, tmp_path / new, "--quiet"], Path(folder))
        finally:
            process.rlimit(psutil.RLIMIT_FSIZE, (hard, hard))
    assert (ended.code, ended.err.splitlines()) == (
        2,
        [
            f"error: {tmp_path / new}: cannot be written: File too large",
            "  hint: check that the folder is writable and the disk has space",
        ],
    )
    assert sorted(tmp_path.iterdir()) == names
    assert path.read_bytes() == content
