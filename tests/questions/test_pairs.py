"""Combinations of errors of pins and holes: known ones are found, and motions of the cross use no clearance."""

from __future__ import annotations

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import tolstat
from tests.support import synthetic
from tests.support.views import OPERATION
from tolstat import sampling, study
from tolstat.cli import app
from tolstat.common.errors import NotApplicable, StoreError
from tolstat.common.load_kinds import PINS
from tolstat.common.tables import ERROR, Simulation
from tolstat.display.answer import Asked, Panels, Sentence, Table
from tolstat.joint import HOLE_OF_PIN, load, perturb
from tolstat.questions.causes.pairs import MISSED, combinations, pairs_on_page
from tolstat.store import ResultFile, Writer

TEXT = (
    synthetic.HEAD
    + """[tolerances]
"pin*.offset_z" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }
"hole*.offset_z" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }
"pin*.tilt_t" = { plus_minus = "0.2 deg", distribution = "normal", cpk = 1.0 }

[sampling]
n = 600
seed = 5

[limits]
"cross1.F" = "900 N"
"""
)


@pytest.fixture
def path(tmp_path):
    """Campaign whose load grows with how far the axes miss each other."""
    source = tmp_path / "made.toml"
    source.write_text(TEXT, encoding="utf-8")
    plan = study.load(source)
    errors = sampling.draw(plan)
    results = synthetic.results(plan.rows)
    use = combinations(errors, perturb(plan.joint, plan.operation, errors))[MISSED]
    results["F_max"][:, 0] = 640.0 + 800.0 * use + np.random.default_rng(1).normal(0.0, 5.0, plan.rows)
    with Writer.create(tmp_path / "made.h5", plan, [errors]) as store:
        store.write(np.arange(plan.rows), Simulation(results, {}))
    return tmp_path / "made.h5"


def test_the_cause_is_found_on_one_half_and_shown_on_the_other(path):
    with ResultFile.open(path) as store:
        found = tolstat.pairs(store.view(), "cross1.F")
    assert found.facts["name"] == MISSED
    assert found.facts["correlation"] > 0.95 > 0.5 > found.facts["single"]
    assert len(found.frame("joints")) == 300
    assert found.frame("combinations")["name"][0] == MISSED
    assert found.frame("combinations")["correlation"][0] == found.facts["correlation"]


def test_command_prints_the_combinations_and_json_has_all_of_them(path):
    done = CliRunner().invoke(app, ["pairs", str(path)])
    assert done.exit_code == 0
    assert f"What tells most is {MISSED}" in " ".join(done.stdout.split())
    assert done.stdout.splitlines()[-5].endswith(MISSED)
    found = json.loads(CliRunner().invoke(app, ["pairs", str(path), "--json"]).stdout)
    assert len(found["tables"]["combinations"]["rows"]) == 14
    assert {row["unit"] for row in found["tables"]["joints"]["rows"]} == {"N"}


def test_where_a_single_error_tells_more_the_command_says_so_and_the_page_is_silent(tmp_path):
    file = synthetic.store(tmp_path, synthetic.STUDY.replace("n = 60", "n = 300"))
    with ResultFile.open(file) as store, pytest.raises(NotApplicable):
        pairs_on_page(store.view(), Asked(file))
    done = CliRunner().invoke(app, ["pairs", str(file), "--by", "cross2.F"])
    assert done.stdout.startswith("A single error tells more of cross2.F than any combination")
    assert "limit" not in done.stdout


def test_motions_of_the_cross_use_no_clearance():
    """A cross that moves along z and turns about its axes: pins 1 and 2 move apart along z, as do 3 and 4."""
    errors = np.zeros(3, ERROR)
    errors["material.E_factor"] = 1.0
    shifts = {"pin1": (1.0, 1.0, 0.0), "pin2": (1.0, -1.0, 0.0), "pin3": (1.0, 0.0, 1.0), "pin4": (1.0, 0.0, -1.0)}
    for pin, own in shifts.items():
        errors[f"{pin}.offset_z"] = 1e-5 * np.array(own)
    joint = load("cirelli2021", {}, "test")
    np.testing.assert_allclose(combinations(errors, perturb(joint, OPERATION, errors))[MISSED], 0.0, atol=1e-12)
    errors["pin1.offset_z"] += 4e-5
    np.testing.assert_allclose(combinations(errors, perturb(joint, OPERATION, errors))[MISSED], 4e-5 / 4e-4, rtol=1e-9)


def test_equal_tilts_of_pin_and_hole_use_no_clearance():
    errors = np.zeros(2, ERROR)
    errors["material.E_factor"] = 1.0
    for pin in PINS:
        errors[f"{pin}.tilt_t"] = errors[f"{HOLE_OF_PIN[pin]}.tilt_t"] = 1e-3
    errors["pin2.tilt_t"][1] = -1e-3
    joint = load("cirelli2021", {}, "test")
    found = combinations(errors, perturb(joint, OPERATION, errors))
    reach = np.abs(joint.contact.springs(None).s).max()
    np.testing.assert_allclose(found["tilt of pin2 against hole3 about t"], [0.0, 2e-3 * reach / 1e-4], rtol=1e-9)
    assert found["largest tilt of a pin against its hole about t"][0] == 0.0


def test_the_page_shows_the_scatter_with_the_limit(path):
    with ResultFile.open(path) as store:
        blocks = pairs_on_page(store.view(), Asked(path)).blocks()
    assert [type(block) for block in blocks] == [Sentence, Panels, Table, Sentence]
    assert MISSED in blocks[0].text
    assert "of the others" in blocks[0].text


def test_of_several_points_the_load_is_that_of_the_worst_and_the_page_names_it(tmp_path):
    _, _, rest = TEXT.partition("[operation]\n")
    keys, tolerances, others = rest.partition("[tolerances]")
    points = "".join(f'[[operation]]\nname = "{name}"\n{keys}' for name in ("low", "high"))
    source = tmp_path / "points.toml"
    source.write_text(TEXT.partition("[operation]")[0] + points + tolerances + others, encoding="utf-8")
    plan = study.load(source)
    errors, tables = sampling.draw(plan), {name: synthetic.results(plan.rows) for name in ("low", "high")}
    use = combinations(errors, perturb(plan.joint, plan.at("low").operation, errors))[MISSED]
    tables["low"]["F_max"][:, 0], tables["high"]["F_max"][:, 0] = 640.0, 640.0 + 800.0 * use
    with Writer.create(tmp_path / "points.h5", plan, [errors]) as store:
        for name, table in tables.items():
            store.at(name).write(np.arange(plan.rows), Simulation(table, {}))
    with ResultFile.open(tmp_path / "points.h5") as store:
        found = tolstat.pairs(store.view(), "cross1.F")
        at_one = tolstat.pairs(store.view(), "cross1.F at high")
        blocks = pairs_on_page(store.view(), Asked(tmp_path / "points.h5")).blocks()
    assert [found.facts[key] for key in ("points", "worst", "name")] == [["low", "high"], "high", MISSED]
    assert [at_one.facts[key] for key in ("points", "worst")] == [["high"], "high"]
    np.testing.assert_array_equal(found.frame("joints")["value"], at_one.frame("joints")["value"])
    assert "cross1.F is the largest over low, high; it is most severe at high" in blocks[0].text


def test_too_few_joints_are_refused(tmp_path):
    file = synthetic.store(tmp_path)
    with ResultFile.open(file) as store, pytest.raises(StoreError, match="60 joints"):
        tolstat.pairs(store.view(), "cross1.F")
