"""Progress of long work: one line a minute, a bar on a terminal, a bar in a notebook."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from tests.support import fakes
from tolstat.common.counts import Counts
from tolstat.display import progress


def test_progress_lines_once_a_minute() -> None:
    now, out, details = [0.0], [], []
    with progress.Lines(out.append, details.append, lambda: now[0]) as lines:
        lines.stage("drawing the errors")
        now[0] = 60
        lines.beat()
        lines.stage(progress.JOINTS)
        for second, done in ((60, 12), (80, 32), (121, 73)):
            now[0] = second
            lines(Counts(100, done, 1, 2))
        lines.beat()
        now[0] = 185
        lines(Counts(100, 100, 1, 3))
        lines.stage("report")
        now[0] = 190
        lines.beat()
    assert out == [
        "drawing the errors, 1:00",
        "73 of 100 joints, 1 joints/s, 0:27 left, 2 failed, 1 not settled",
        "100 of 100 joints, 0.704 joints/s, 0:00 left, 3 failed, 1 not settled",
        "report, 0:05",
    ]
    assert details == ["drawing the errors: 60.00 s", "joints: 125.00 s", "report: 5.00 s"]


def test_progress_text_before_the_first_joint() -> None:
    text = progress.text(Counts(513, 100, 0, 0), begun=100, seconds=0.0)
    assert text == "100 of 513 joints, 0 failed, 0 not settled"
    assert progress.text(Counts(513, 100, 4, 0, 3), 100, 0.0).endswith(", 0 failed, 1 not settled, 3 not resolved")
    assert "2:00:00 left" in progress.text(Counts(7201, 1, 0, 0), begun=0, seconds=1.0)
    assert "0:42 left" in progress.text(Counts(7201, 1, 0, 0), begun=0, seconds=1.0, budget=42.0)


def test_progress_bar_goes_to_stderr(capfd: pytest.CaptureFixture[str]) -> None:
    with progress.Bar() as bar:
        bar(Counts(10, 0, 0, 0))
        bar(Counts(10, 10, 1, 0))
    out, err = capfd.readouterr()
    assert out == ""
    assert "10 of 10 joints" in err
    assert isinstance(progress.display(), progress.Lines)
    assert type(progress.display(quiet=True)) is progress.Display


def test_progress_bar_fits_80_columns(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    with progress.Bar() as bar:
        bar(Counts(10_000_000, 1_000_000, 0, 0))
        bar(Counts(10_000_000, 9_999_999, 123_456, 654_321, 1000))
    lines = [line for line in capfd.readouterr().err.splitlines() if line.strip()]
    assert "9999999 of 10000000 joints" in lines[-1]
    assert 60 < max(map(len, lines)) <= 80


@pytest.fixture
def cells(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, str]]:
    """What a notebook's cell shows, as IPython is told."""
    shown: list[dict[str, str]] = []

    def display(data: dict[str, str], **_: Any) -> Any:
        shown.append(data)
        return SimpleNamespace(update=display)

    notebook, output = ModuleType("IPython"), ModuleType("IPython.display")
    notebook.get_ipython = lambda: SimpleNamespace(kernel=None)  # type: ignore[attr-defined]
    output.display = display  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", notebook)
    monkeypatch.setitem(sys.modules, "IPython.display", output)
    return shown


def test_progress_in_a_notebook(cells: list[dict[str, str]], tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Stages come and go; the bar of the joints stays, and nothing is printed."""
    fakes.run(fakes.Study(), tmp_path / "a.h5", 1, 10, check=True, progress=True)
    words = [cell["text/plain"] for cell in cells]
    assert any("drawing the errors" in text for text in words)
    assert any("check of the numerical error" in text for text in words)
    assert [text for text in words if text.strip().startswith("20 of 40 joints")]
    assert '<progress max="40" value="40"></progress> 40 of 40 joints' in cells[-1]["text/html"]
    assert cells[-1]["text/html"].count("<div>") == 1
    assert capfd.readouterr() == ("", "")


def test_a_shell_without_a_kernel_is_no_notebook(cells: list[dict[str, str]], monkeypatch: pytest.MonkeyPatch) -> None:
    assert isinstance(progress.display(), progress.Cell)
    assert type(progress.display(quiet=True)) is progress.Display
    monkeypatch.setattr(sys.modules["IPython"], "get_ipython", lambda: None)
    assert isinstance(progress.display(), progress.Lines)
