"""Selective assembly from TOML to page: yields by number of classes, unmatched parts, figure, same bytes."""

from functools import partial

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

import tolstat
from tests.support import fakes, synthetic
from tests.support.cells import body
from tolstat import sampling
from tolstat.campaign.extend import merge
from tolstat.cli import app
from tolstat.common.errors import InputError, NotApplicable
from tolstat.display.answer import Asked
from tolstat.display.table import fitted
from tolstat.questions import selective as question

STUDY = (
    synthetic.HEAD
    + """[tolerances]
"pin*.diameter" = { lower = "-0.030 mm", upper = "0 mm", distribution = "normal" }
"hole*.diameter" = { lower = "0 mm", upper = "0.030 mm", distribution = "normal" }
[sampling]
n = 150
seed = 3
selective = { classes = 2, gauge = "2 um" }
[limits]
"cross*.F" = "0.9 N"
"""
)


def _perturb(joint, operation, errors):
    """Parameters of fake joints, whose loads depend on the clearance of pin 1."""
    params = fakes.perturb(joint, operation, errors)
    params["R"] = (errors["hole4.diameter"] - errors["pin1.diameter"] - 30e-6) / 1e-5
    return params


RUN = partial(fakes.run, draw_blocks=sampling.draw_blocks, perturb=_perturb)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("selective")
    (made / "small.toml").write_text(STUDY, encoding="utf-8")
    for classes in (1, 3):
        RUN(question.study_of(tolstat.load(made / "small.toml"), classes), made / f"k{classes}.h5")
    return made


def test_table_has_yield_and_unmatched_parts_by_number_of_classes(folder):
    with tolstat.open(folder / "k1.h5") as plain, tolstat.open(folder / "k3.h5") as of_three:
        views = [of_three.view(), plain.view()]
        answer = tolstat.selective(*views)
        classes, load = question.classes_of(views[0]), views[0].load("any limit")
    pictures, table = answer.parts[:2]
    one, three = table.rows
    assert (one["classes"], one["unmatched"], three["classes"]) == (1, 0.0, 3)
    assert three["unmatched"] == classes.unmatched == 1.0 - classes.shares.min(axis=0).sum() > 0.3
    assert three["good"] == 1.0 - np.mean(load.values > 1.0)
    assert three["good_lower"] < three["good"] < three["good_upper"]
    assert three["of_all"] == (1.0 - three["unmatched"]) * three["good"]
    assert three["clearance"] < one["clearance"]
    assert "of all crosses" in fitted(table.columns, table.rows)[0]
    ax = Figure().add_subplot()
    pictures.panels[0].draw(ax)
    assert [line.get_ydata()[1] for line in ax.lines] == [100.0 * three[key] for key in ("good", "unmatched", "of_all")]


def test_page_has_the_classes_and_other_campaigns_have_no_section(folder):
    with tolstat.open(folder / "k3.h5") as store:
        words, table = question.selective_on_page(store.view(), Asked(store.path)).blocks()[:2]
    assert "of the crosses and forks have no partner" in words.text
    assert [row[0] for row in body(table)] == ["1", "2", "3"]
    with tolstat.open(folder / "k1.h5") as store, pytest.raises(NotApplicable):
        question.selective_on_page(store.view(), Asked(store.path))


@pytest.mark.slow
def test_same_bytes_in_slices_in_blocks_and_stopped(folder, tmp_path):
    plan = question.study_of(tolstat.load(folder / "small.toml"), 3)
    parts = [tmp_path / "a.h5", tmp_path / "b.h5"]
    for part, rows in zip(parts, (range(64), range(64, 151)), strict=True):
        RUN(plan, part, block=50, rows=rows)
    merge(parts, tmp_path / "merged.h5")
    RUN(plan, tmp_path / "stopped.h5", until_row=30)
    RUN(plan, tmp_path / "stopped.h5", block=70)
    found = []
    for path in (folder / "k3.h5", tmp_path / "merged.h5", tmp_path / "stopped.h5"):
        with tolstat.open(path) as store:
            found.append((store.errors().tobytes(), store.results().tobytes()))
    assert found[0] == found[1] == found[2]


def test_studies_without_classes_or_limits_are_refused(tmp_path):
    plain = tmp_path / "plain.toml"
    plain.write_text(STUDY.replace("selective", "# selective"), encoding="utf-8")
    with pytest.raises(InputError, match="missing key selective"):
        question.study_of(tolstat.load(plain), 2)
    bare = tmp_path / "bare.toml"
    bare.write_text(STUDY.partition("[limits]")[0], encoding="utf-8")
    RUN(tolstat.load(bare), tmp_path / "bare.h5")
    with tolstat.open(tmp_path / "bare.h5") as store, pytest.raises(NotApplicable, match="without"):
        tolstat.selective(store.view())


@pytest.mark.slow
def test_command_simulates_each_number_of_classes_and_writes_into_the_folder(folder, tmp_path, monkeypatch):
    fakes.replace_functions(monkeypatch, **fakes.FUNCTIONS | {"draw_blocks": sampling.draw_blocks, "perturb": _perturb})
    study = str(folder / "small.toml")
    words = ["selective", study, "--classes", "3", "--classes", "1", "--n", "40", "--workers", "1"]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["classes", "1", "3"]
    files = ["small_k1.h5", "small_k3.h5", *(f"small_selective_classes.{end}" for end in ("csv", "png", "svg"))]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == files
    with tolstat.open(tmp_path / "out" / "small_k3.h5") as store:
        assert store.view().n == 40
