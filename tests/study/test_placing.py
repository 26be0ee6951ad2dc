"""Studies for another folder: each runs from where it lies, with a joint file and measured data beside the first."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

import tolstat
from tests.support import synthetic
from tests.support.environment import ROOT
from tolstat import study
from tolstat.cli import app
from tolstat.study import placing

PARTS = """"pin1.tilt_t" = { distribution = "measured", file = "parts/tilts.csv", column = "tilt", unit = "deg" }
"""
TEXT = synthetic.REAL.replace('base = "cirelli2021"', 'base = "own_joint.toml"').replace(
    "[tolerances]\n", f"[tolerances]\n{PARTS}"
)


def call(*args: object) -> None:
    done = CliRunner().invoke(app, [str(arg) for arg in args])
    assert done.exit_code == 0, done.stderr


@pytest.fixture
def first(tmp_path: Path) -> Path:
    """A study with a joint file of its own and measured parts beside it, in a folder of its own."""
    folder = tmp_path / "first"
    (folder / "parts").mkdir(parents=True)
    shutil.copy(ROOT / "data" / "joints" / "cirelli2021.toml", folder / "own_joint.toml")
    (folder / "parts" / "tilts.csv").write_text("tilt\n0.1\n-0.2\n0.05\n", encoding="utf-8")
    (folder / "own.toml").write_text(TEXT.replace("n = 60", "n = 24"), encoding="utf-8")
    return folder / "own.toml"


def test_paths_are_relative_to_the_new_folder(tmp_path: Path) -> None:
    source, target = tmp_path / "a" / "old.toml", tmp_path / "b" / "c" / "new.toml"
    moved = placing.placed(TEXT, source, target)
    assert 'base = "../../a/own_joint.toml"' in moved
    assert 'file = "../../a/parts/tilts.csv"' in moved
    assert placing.placed(TEXT, source, source.with_name("new.toml")) == TEXT
    named = TEXT.replace("own_joint.toml", "cirelli2021").replace("parts/", "/data/parts/")
    assert placing.placed(named, source, target) == named
    listed = '[joint]\nbase = "a/b.toml"\n\n[[variant]]\njoint.base = "c.toml"\n\n[[operation]]\nspeed.file = "d.csv"\n'
    assert placing.placed(listed, source, tmp_path / "a" / "x" / "new.toml") == (
        listed.replace("a/b.toml", "../a/b.toml").replace("c.toml", "../c.toml").replace("d.csv", "../d.csv")
    )


def test_every_study_that_is_written_runs_from_another_folder(
    first: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, far = first.with_suffix(".h5"), tmp_path / "far" / "away"
    tolstat.run(tolstat.load(first), file, workers=1)
    call("change", file, "--set", "pin*.offset_t.cpk=1.2", "--most", 128, "--workers", 1, "--out", far)
    call("change", file, "--set", "pin*.offset_t.cpk=1.2", "--most", 128, "--workers", 1, "--out", far / "named.toml")
    allocate = ("allocate", file, "--target", "P(any limit) < 0.9", "--most", 1024, "--workers", 1)
    call(*allocate, "--out", far / "allocated.toml")
    call("new", far / "cycle", "--signal", ROOT / "studies" / "drive_cycle.csv", "--base", first)
    call("new", far / "fresh", "--joint", "own")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    written = sorted(path.name for path in far.glob("*.toml"))
    studies = ["allocated.toml", "cycle.toml", "fresh.toml", "fresh_joint.toml", "named.toml", "own_change.toml"]
    assert written == studies
    for name in written:
        if not name.endswith("joint.toml"):
            study.load(far / name)
    call("run", far / "named.toml", "--n", 4, "--workers", 1, "--no-report")
    assert study.load(far / "named.toml").joint == study.load(first).joint


def test_a_result_file_elsewhere_names_its_study(first: Path, tmp_path: Path) -> None:
    file, out = tmp_path / "results" / "own.h5", tmp_path / "far" / "changed.toml"
    tolstat.run(tolstat.load(first), file, workers=1)
    call("change", file, "--study", first, "--set", "pin1.tilt_t=none", "--most", 128, "--workers", 1, "--out", out)
    assert not list(out.parent.glob("*_joint.toml"))
    assert study.load(out).joint == study.load(first).joint


@pytest.mark.parametrize("lost", ["gone", "edited"])
def test_a_joint_file_that_is_not_there_is_written_beside_the_study(first: Path, tmp_path: Path, lost: str) -> None:
    plan, joint = study.load(first), first.with_name("own_joint.toml")
    assert placing.joints_beside(plan) == {}
    joint.unlink() if lost == "gone" else joint.write_text(joint.read_text().replace("37.49 mm", "37.5 mm"))
    text = placing.joints_beside(plan)[("joint",)]
    (tmp_path / "other.toml").write_text(text, encoding="utf-8")
    again = study.load(first, text=TEXT.replace('"own_joint.toml"', '"../other.toml"'))
    assert again.identity() == plan.identity() | {"sampling.n": 60}
