"""``tolstat new --kind``: studies of linkages that run as they stand."""

from __future__ import annotations

from pathlib import Path

import pytest

import tolstat
from tests.support.reports import call
from tolstat.common.strict import read_toml

KINDS = {"hinge": 10, "cranks": 7, "fourbar": 3}
"""Kind, and number of redundant constraints: 5 for each pair beyond those that a tree of members needs, less the rank
of the loops, 5 for parallel axes that coincide, 3 for those in a plane."""


@pytest.mark.parametrize(("kind", "redundant"), KINDS.items())
def test_a_new_study_of_a_linkage_is_read_and_shown(tmp_path: Path, kind: str, redundant: int) -> None:
    path = tmp_path / "mechanism.toml"
    done = call("new", tmp_path / "mechanism", "--kind", kind)
    assert (done.exit_code, done.stdout) == (0, "")
    assert {file.name for file in tmp_path.iterdir()} == {"mechanism.toml", "study.schema.json"}
    study = tolstat.load(path)
    assert (study.rows, study.mechanism.name) == (257, "linkage+thrust+friction")
    assert study.limits
    shown = call("show", path, "--out", tmp_path / "drawn.svg")
    assert shown.exit_code == 0
    words = {line.split("  ")[0]: line.split("  ")[1:] for line in shown.stdout.splitlines()}
    assert "1" in words["mobility"]
    assert str(redundant) in words["redundant constraints"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_new_study_of_a_linkage_runs(tmp_path: Path, kind: str) -> None:
    call("new", tmp_path / "mechanism", "--kind", kind)
    done = call("run", tmp_path / "mechanism.toml", "--n", 4, "--workers", 1, "--out", tmp_path / "x.h5", "--no-report")
    assert done.exit_code == 0
    assert "x.h5: 5 mechanisms, 0 failed, 0 not settled" in done.stdout + done.stderr


def test_a_kind_stands_alone(tmp_path: Path) -> None:
    done = call("new", tmp_path / "mechanism", "--kind", "hinge", "--joint", "own", "--shaft")
    assert done.exit_code == 2
    assert "--kind: cannot be used together with --shaft and --joint" in done.stderr
    assert call("new", tmp_path / "mechanism", "--kind", "slider").exit_code == 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", KINDS)
def test_sections_have_comments_and_quantities_units(kind: str) -> None:
    path = Path(tolstat.__file__).parent / "study" / "templates" / f"{kind}.toml"
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# Question: ")
    assert max(map(len, text.splitlines())) <= 130
    data = read_toml(path, text)
    for pair in data["mechanism"]["pair"].values():
        assert all(place.endswith(" mm") for place in pair["point"])
