"""Names of files in capitals: what they are is what their ending says."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support import synthetic
from tolstat import study
from tolstat.cli import app
from tolstat.display.answer import Answer, Document


def call(*arguments: object) -> None:
    done = CliRunner().invoke(app, [*map(str, arguments)])
    assert done.exit_code == 0, done.stderr


def test_studies_and_joints(tmp_path: Path) -> None:
    call("new", tmp_path / "A.TOML")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["A.TOML", "study.schema.json"]
    call("new", tmp_path / "b", "--joint", "own")
    (tmp_path / "b_joint.toml").rename(tmp_path / "JOINT.TOML")
    text = synthetic.STUDY.replace('base = "cirelli2021"', 'base = "JOINT.TOML"')
    (tmp_path / "B.TOML").write_text(text, encoding="utf-8")
    assert study.load(tmp_path / "B.TOML").joint.description
    call("show", tmp_path / "B.TOML", "--out", tmp_path / "C.SVG")
    assert (tmp_path / "C.SVG").read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.parametrize("name", ["next.toml", "NEXT.TOML", "next"])
def test_a_study_that_is_written_has_the_name_that_was_given(tmp_path: Path, name: str) -> None:
    answer = Answer("x", "X", [Document(".toml", lambda path: path.name), Document("_joint.toml", lambda _: "joint")])
    answer.write_documents(tmp_path / name)
    study, joint = (name if "." in name else "next.toml"), f"{Path(name).stem}_joint.toml"
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([study, joint])
    assert (tmp_path / study).read_text(encoding="utf-8") == study
