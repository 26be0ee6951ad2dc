"""``tolstat new --kind``: studies of linkages that run as they stand."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import jsonschema
import pytest

import tolstat
from tests.support.reports import call
from tolstat.common.strict import read_toml
from tolstat.study import axes, schema
from tolstat.study.tolerances import fits

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
    assert re.search(r"^mobility +1 ", shown.stdout, flags=re.MULTILINE)
    assert re.search(rf"^redundant constraints +{redundant} ", shown.stdout, flags=re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_new_study_of_a_linkage_runs(tmp_path: Path, kind: str) -> None:
    call("new", tmp_path / "mechanism", "--kind", kind)
    done = call("run", tmp_path / "mechanism.toml", "--n", 4, "--workers", 1, "--out", tmp_path / "x.h5", "--no-report")
    assert done.exit_code == 0
    assert "x.h5: 5 mechanisms, 0 failed, 0 not settled" in done.stdout + done.stderr
    planned = call("plan", tmp_path / "mechanism.toml", "--pilot", 2, "--workers", 1).stdout
    assert f"mobility 1, redundant constraints {KINDS[kind]}\n" in planned
    assert "hole" not in planned


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


BROKEN = [
    ("[mechanism.pair.B]", "[mechanism.pairs.B]"),
    ('eye = "coupler"\npoint', 'eyes = "coupler"\npoint'),
    ('"80 mm"', "80"),
    ("axis = [4, 3, 0]", "axis = [4, 3]"),
    ('speed = "60 rpm"', 'speed = "60 rpm"\nalpha = "5 deg"'),
    ('"*_eye.T" = ', '"B_eye.G" = '),
    ('"*_eye.T" = ', '"B_ear.T" = '),
    ('"*_pin.clearance" = ', '"B_pin.clearence" = '),
    ('"*.offset_e" = ', "B_pin.ofset_e = "),
]
NAMED = [
    ('"*_eye.T" = ', '"B_eye.T" = '),
    ('"*_eye.T" = "10 N*m"', 'crank.drive = "10 N*m"\n"crank.drive_1x" = "9 N*m"\nC_pin.loss = "2 W"'),
    ('"*_eye.T" = "10 N*m"', '"B_outer.F" = "10 N"\nC_inner.F = "9 N"\n"flap_drive.T" = "1 N*m"'),
    ('"*.offset_e" = ', "B_pin.offset_e = "),
    ('"*.offset_e" = ', '"C_pin.end_play" = '),
    ("[sampling]", '[errors]\nB_eye.tilt_z = "0.1 deg"\n"C_eye.offset_t" = "0.1 mm"\n[sampling]'),
]


def faults(old: str, new: str) -> list[str]:
    """What an editor marks in the study of a four-bar with a change."""
    path = Path(tolstat.__file__).parent / "study" / "templates" / "fourbar.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    validator = jsonschema.Draft7Validator(schema.schema("study"))
    return [fault.message for fault in validator.iter_errors(tomllib.loads(text.replace(old, new, 1)))]


@pytest.mark.parametrize(("old", "new"), BROKEN)
def test_editors_mark_what_no_linkage_has(old: str, new: str) -> None:
    assert faults(old, new) != []


@pytest.mark.parametrize(("old", "new"), NAMED)
def test_editors_know_names_of_errors_and_loads_of_linkages(old: str, new: str) -> None:
    assert faults(old, new) == []


def test_pins_and_eyes_of_all_pairs_are_alike(tmp_path: Path) -> None:
    call("new", tmp_path / "mechanism", "--kind", "fourbar")
    mechanism = tolstat.load(tmp_path / "mechanism.toml").mechanism
    assert fits.patterns(mechanism) == ("*_eye.diameter", "*_pin.diameter")
    assert axes.is_pin("B_pin.diameter")
    assert not axes.is_pin("B_eye.diameter")
    zones = axes.zone_units(mechanism)
    assert "B_pin.position" in zones
    assert "input_pins.coaxiality" not in zones
