"""Mounting and contact law in what `run`, `report`, the page and JSON say, and the note on rigid shafts."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.support import fakes, reports, synthetic
from tolstat.cli import app
from tolstat.common.tables import Simulation
from tolstat.display.text import capital
from tolstat.report import page
from tolstat.report.answer import statistics
from tolstat.store import ResultFile
from tolstat.store.recorded import mountings, note_on_mounting, swept

RIGID = "shafts rigid along their axes; contact law mode"
FREE = "output shaft free along its axis; contact law mode"
ALONG = synthetic.STUDY.replace("offset_t", "offset_[tz]").partition("[limits]")[0] + '[limits]\n"cross1.F" = "700 N"\n'
LOOSE = ALONG.replace('base = "cirelli2021"', 'base = "cirelli2021"\nshaft.axial = "free"')
COMMAND = "tolstat run small.toml --set joint.shaft.axial=free --out small_free.h5"
SWEPT = synthetic.SWEEP.replace('"pin*.diameter" = { from = "-0.1 mm", to = "0.1 mm", points = 11 }', "")
SWEPT += 'shaft.axial = { from = "1e6 N/m", to = "1e8 N/m", points = 4 }\n'
pytestmark = pytest.mark.usefixtures("without_pictures")


def simulate(params, options, **given):
    return Simulation(synthetic.results(len(params)), {})


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in an empty folder on one core, with a solver that invents its results."""
    monkeypatch.chdir(tmp_path)
    fakes.replace_functions(monkeypatch, **fakes.SOLVER | {"simulate_rows": simulate})


def call(*args: str):
    done = CliRunner().invoke(app, list(args))
    assert done.exit_code == 0, done.output
    return done


def unwrapped(text: str) -> str:
    return " ".join(text.split())


@pytest.mark.parametrize(("text", "said"), [(ALONG, RIGID), (LOOSE, FREE)])
def test_run_report_page_and_json_begin_with_it(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "small.toml").write_text(text, encoding="utf-8")
    ran = call("run", "small.toml", "--no-verify")
    assert ran.stderr.startswith(f"small: {said}\n")
    verdict, mounted = ran.stdout.split("\n\n")[0].rsplit("\n", 1)
    assert "of the joints keep the limit" in verdict
    assert mounted == f"{said[0].upper()}{said[1:]}."
    assert f"\n{mounted}\n\nJoints above each limit\nload" in call("report", "small.h5").stdout
    html = page.write_page("small.h5", "small.html", replay=0).read_text(encoding="utf-8")
    header = re.search(r"<header>.*?</header>", html, flags=re.DOTALL)
    assert header is not None
    shafts, law = (capital(part) for part in said.split("; "))
    assert re.search(rf"<br>{shafts} \((given|assumed)\); {law.lower()} \(assumed\)\.</p>", header[0])
    assert "60 joints (random sampling), 0 failed, 0 not settled." in html
    with ResultFile.open(Path("small.h5")) as store:
        assert json.loads(json.dumps(statistics(store.view())))["joint"] == said


def test_a_note_where_rigid_shafts_meet_errors_along_them(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(ALONG, encoding="utf-8")
    for done in (call("run", "small.toml", "--no-verify"), call("report", "small.h5")):
        assert unwrapped(done.stderr).count("note: errors along the shafts (offset_z) scatter") == 1
        assert unwrapped(done.stderr).count(COMMAND) == 1
        assert "note" not in done.stdout
    html = page.write_page("small.h5", "small.html", replay=0).read_text(encoding="utf-8")
    assert html.count(COMMAND) == 1
    for text in (LOOSE, synthetic.STUDY):
        path = synthetic.store(tmp_path, text, name="other")
        assert "note:" not in call("report", str(path)).stderr
        with ResultFile.open(path) as store:
            assert note_on_mounting(store) == ""
        path.unlink()


def test_the_command_of_the_note_does_what_it_says(tmp_path: Path) -> None:
    """Also for a joint that lacks what a free shaft needs; the same command resumes, and another one is refused."""
    (tmp_path / "small.toml").write_text(ALONG, encoding="utf-8")
    stderr = call("run", "small.toml", "--no-verify").stderr
    printed = re.search(r"tolstat (run .*)", stderr)
    assert printed is not None
    again = [*printed[1].split(), "--no-verify"]
    assert unwrapped(call(*again).stdout).find("Output shaft free along its axis") > 0
    call(*again)
    with ResultFile.open(Path("small_free.h5")) as free, ResultFile.open(Path("small.h5")) as rigid:
        assert mountings(free) == (["free"], ["mode"])
        assert free.errors().tobytes() == rigid.errors().tobytes()
        assert 'axial = "free"' in free.study_text
    refused = CliRunner().invoke(app, ["run", "small.toml", "--set", "joint.shaft.axial=free"])
    assert refused.exit_code == 2
    assert "joint.shaft.axial" in refused.stderr
    own = ALONG.replace("cirelli2021", "cirelli2021_as_printed")
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")
    stderr = call("run", "own.toml", "--no-verify").stderr
    assert '"joint.shaft.mass=5 kg" --set "joint.shaft.axial_damping=2e4 N*s/m" --out own_free.h5' in stderr


def test_set_without_retry_leaves_the_solver_alone(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(ALONG, encoding="utf-8")
    done = CliRunner().invoke(app, ["run", "small.toml", "--set", "solver.steps_per_rev=90"])
    assert done.exit_code == 2
    assert "sets the solver, which --retry alone can" in unwrapped(done.stderr)
    done = CliRunner().invoke(app, ["run", "small.toml", "--set", "joint.shaft.axial=loose"])
    assert "small.toml: joint.shaft.axial: 'loose' is neither a word" in done.stderr


def test_several_variants_are_counted(tmp_path: Path) -> None:
    path = synthetic.store(tmp_path, SWEPT, name="swept")
    said = "Shafts rigid along their axes in 1 of 5 variants, output shaft held with 1e+06 to 1e+08 N/m along its axis "
    assert unwrapped(reports.build(path).table).startswith(
        f"{said}in 4 of 5 variants; contact law mode. Worst bushing shaft.axial"
    )
    with ResultFile.open(path) as store:
        np.testing.assert_array_equal(swept(store)["shaft.axial"], [np.nan, 1e6, 3.4e7, 6.7e7, 1e8])
