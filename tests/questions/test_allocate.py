"""Tolerances allocated by simulated joints: the path, the check, what is refused, and what is written."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.questions.test_change import TEXT, made, share_of
from tests.questions.test_change import quick as quick
from tests.questions.test_lines import TWO, written
from tests.support import synthetic
from tests.support.two_errors import stand_in
from tolstat import study
from tolstat.campaign import blocks
from tolstat.campaign.work import Work
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError, NotApplicable
from tolstat.display.answer import Listing
from tolstat.questions import allocate as question
from tolstat.store import ResultFile
from tolstat.study import costs, ladder, scaling

TARGET = "P(cross1.F > 700 N) < 0.1"
WHOLE = TEXT.replace(
    "[sampling]", '"hole*.diameter" = { lower = "0 mm", upper = "0.030 mm", distribution = "uniform" }\n[sampling]'
)
"""Tilts matter much, offsets little, diameters not at all."""


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Campaign with a finished search; not to be written."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "simulate_rows", stand_in)
        patch.setattr("tolstat.questions.shares.warm_up", lambda **_: None)
        path = made(tmp_path_factory.mktemp("allocate"), WHOLE)
        simulated(path)
    return path


def simulated(path: Path, targets: tuple[str, ...] = (TARGET,), **options: Any) -> str:
    told = [""]
    question.simulate(path, Work(workers=1, tell=told.append), list(targets), **options)
    return told[-1]


def answer(path: Path, targets: tuple[str, ...] = (TARGET,), **options: Any) -> Any:
    with ResultFile.open(path) as store:
        return question.allocate(store.view(), list(targets), **options)


def scales(plan: study.Study) -> tuple[float, float]:
    """Deviations of tilt and offset relative to those as drawn."""
    drawn = study.load(Path("drawn.toml"), text=TEXT)
    names = "pin1.tilt_t", "pin2.offset_z"
    of = [plan.tolerances[name].moments.deviation / drawn.tolerances[name].moments.deviation for name in names]
    return of[0], of[1]


def test_the_study_written_keeps_the_target_by_the_law(done: Path, tmp_path: Path) -> None:
    found = answer(done)
    found.write_documents(tmp_path / "next")
    plan = study.load(tmp_path / "next.toml")
    assert share_of(1.0, 1.0) > 0.1 > share_of(*scales(plan))
    assert (found.facts["state"], found.facts["holds"]) == ("holds", True)
    assert found.facts["misses_by"] < 0.0
    assert plan.sampling.seed not in {3, 4, 5, 6}
    rows = {row["tolerance"]: row for row in found.tables["tolerances"].rows}
    assert rows["hole*.diameter"]["proposed"] == "±0.05 mm"  # does nothing, and is as wide as it may be
    assert found.facts["cost"] == pytest.approx(sum(row["cost"] for row in rows.values()))
    assert rows["pin*.tilt_t"]["features"] == 4


def test_the_entries_printed_are_those_of_the_study_written(tmp_path: Path) -> None:
    fit = '[tolerances]\nfit = { basic = "76 mm", code = "H7/f7", distribution = "normal" }\n'
    path = made(tmp_path, TEXT.replace("[tolerances]\n", fit))
    simulated(path)
    found = answer(path)
    found.write_documents(tmp_path / "next")
    (printed,) = (tomllib.loads(part.text) for part in found.parts if isinstance(part, Listing))
    written = tomllib.loads((tmp_path / "next.toml").read_text())["tolerances"]
    drawn = tomllib.loads(study.load(tmp_path / "made.toml").text)["tolerances"]
    assert printed == {key: entry for key, entry in written.items() if entry != drawn[key]}
    assert printed["fit"]["code"] == "H10/f10"  # diameters do nothing


def test_the_path_has_a_row_for_each_step_and_the_check(done: Path) -> None:
    rows = answer(done).tables["path"].rows
    assert [row["step"] for row in rows] == list(range(len(rows)))
    assert [row["what"] for row in rows[:3]] == ["as drawn", "all exact", "narrower"]
    assert rows[-1]["what"] == "check"
    assert rows[-1]["share_upper"] < 0.1
    assert rows[2]["line"] == "pin*.tilt_t"
    assert (rows[2]["before"], rows[2]["after"]) == ("±0.5 deg", "±0.4 deg")
    assert rows[1]["share"] == 0.0
    assert np.isinf(rows[1]["cost"])


def test_asking_again_reads_the_file_and_an_end_of_time_is_gone_on_from(done: Path, tmp_path: Path) -> None:
    assert simulated(done).startswith("simulated 0 joints")
    path = made(tmp_path, WHOLE)
    with pytest.raises(NotApplicable, match="simulate them: tolstat allocate"):
        answer(path)
    assert simulated(path, budget=1e-9).startswith("simulated 0 joints")
    calls = []

    def stopping(params: Any, *options: Any, **named: Any) -> Any:
        calls.append(len(params))
        if len(calls) > 60:
            raise KeyboardInterrupt
        return stand_in(params, *options, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(blocks, "simulate_rows", stopping)
        with pytest.raises(KeyboardInterrupt):
            simulated(path)
    part = answer(path)
    assert part.facts["state"] == "open"
    assert "the same command goes on" in part.facts["verdict"]
    simulated(path)
    assert answer(path).values() == answer(done).values()


def test_costs_decide_between_lines_and_what_they_do_not_name_is_kept(tmp_path: Path) -> None:
    table = tmp_path / "costs.csv"
    table.write_text("tolerance,cost,fixed,power,most\npin*.tilt_t,2,1,1,\npin*.offset_z,1,,2,0.2 mm\n")
    path = made(tmp_path, WHOLE)
    simulated(path, costs=table)
    rows = {row["tolerance"]: row for row in answer(path, costs=table).tables["tolerances"].rows}
    assert list(rows) == ["pin*.tilt_t", "pin*.offset_z"]
    assert rows["pin*.tilt_t"]["cost_before"] == pytest.approx(8.0)  # four pins


def test_a_target_that_no_tolerance_meets_is_told_first(tmp_path: Path) -> None:
    path = made(
        tmp_path, WHOLE.replace('"hole*', '"operation.torque" = { std = "10 N*m", distribution = "normal" }\n"hole*')
    )
    told = simulated(path)
    found = answer(path)
    assert found.facts["state"] == "impossible"
    assert found.facts["verdict"].startswith("No tolerance suffices: with all other lines exact ")
    assert found.facts["kept"] == ["operation.torque"]
    assert found.values()["sentences"][2]["text"] == "Kept as drawn: operation.torque."
    assert "tolstat assumptions" in found.facts["verdict"]
    assert told.startswith("simulated 1648 joints")  # 624 more as drawn, and 1024 of exact lines
    assert [row["what"] for row in found.tables["path"].rows] == ["as drawn", "all exact"]


def test_lines_with_a_common_lot_and_correlated_ones_are_varied_too(tmp_path: Path) -> None:
    lot = 'cpk = 1.0, lot = { share = 0.3, shared = true } }\n"pin*.offset_z"'
    text = WHOLE.replace('cpk = 1.0 }\n"pin*.offset_z"', lot)
    path = made(tmp_path, text + '[[correlation]]\nbetween = ["pin*.offset_z"]\nrho = 0.5\n')
    simulated(path)
    found = answer(path)
    assert found.facts["state"] == "holds"
    assert found.facts["kept"] == []
    assert {row["tolerance"] for row in found.tables["tolerances"].rows} >= {"pin*.tilt_t", "pin*.offset_z"}
    assert found.tables["path"].rows[1]["share"] == 0.0  # all lines exact
    found.write_documents(tmp_path / "next")
    drawn, written = (study.load(tmp_path / f"{name}.toml") for name in ("made", "next"))
    assert np.array_equal(drawn.copula.matrix, written.copula.matrix)
    assert "pin*.tilt_t" in found.facts["entries"]


def test_two_targets_have_a_share_each(tmp_path: Path) -> None:
    path, targets = made(tmp_path, WHOLE), (TARGET, "P(cross*.F > 720 N) < 0.05")
    simulated(path, targets)
    found = answer(path, targets)
    check = found.tables["path"].rows[-1]
    assert check["share_upper"] < 0.1
    assert check["share_2_upper"] < 0.05


def test_faults_of_targets_costs_and_names_are_told_together(done: Path, tmp_path: Path) -> None:
    table = tmp_path / "costs.toml"
    table.write_text('"pin*.tilt_t" = { cost = 1, fixed = 2 }\n"pin*.offset_z" = { least = "1 deg" }\npin9.x = {}\n')
    bad = ("P(cros1.F > 7 N) < 0.1", "P(cross1.F > 700 mm) < 2", "often", "P(psi > 1) < 0.1")
    with pytest.raises(InputError) as told:
        answer(done, bad, costs=table, keep=["pin7.*"])
    for words in (
        "did you mean 'cross1.F'",
        "'700 mm' cannot be",
        "2 is not between",
        "not a rule",
        "fixed is larger",
        "pin9",
    ):
        assert words in str(told.value)
    assert "selects no error" in str(told.value)
    with pytest.raises(InputError, match="no tolerance that may change"):
        answer(done, keep=["pin*.offset_z", "pin*.tilt_t", "hole*.diameter"])
    table.write_text('"pin1.tilt_t" = { cost = 1 }\n', encoding="utf-8")
    with pytest.raises(InputError, match="no tolerance that may change"):  # the other pins have no cost
        answer(done, costs=table)


def test_cost_is_of_a_feature_and_a_reciprocal_power(tmp_path: Path) -> None:
    plan = study.load(Path("made.toml"), text=TEXT.replace('"pin*.tilt_t"', '"pin*.tilt_[tz]"'))
    tilt, offset = scaling.tolerances(plan)
    assert costs.of([tilt], CARDAN)[0].at(0.5) == pytest.approx(8.0)  # four pins, not eight errors
    table = tmp_path / "costs.toml"
    table.write_text('"pin*.offset_z" = { cost = 3, fixed = 1, at = "0.3 mm", power = 2, least = "0.05 mm" }\n')
    cost = costs.of([offset], CARDAN, table)[0]
    assert cost.at(0.5) == pytest.approx(4 * (1 + 2 * (0.3 / 0.075) ** 2))
    assert cost.reach == (pytest.approx(1.0 / 3.0), costs.REACH[1])
    table.write_text('"pin*.tilt_t" = { cost = 3 }\n"pin*.tilt_z" = { cost = 4 }\n', encoding="utf-8")
    with pytest.raises(InputError, match="has two costs for pin1"):
        costs.of([tilt], CARDAN, table)


def test_widths_in_the_costs_may_have_the_sign_of_the_drawing(tmp_path: Path) -> None:
    zone = '"*_pins.position" = { zone = "⌀0.3 mm", over = "145.64 mm", distribution = "normal", cp = 1.0 }\n'
    plan = study.load(Path("made.toml"), text=f"{synthetic.HEAD}[tolerances]\n{zone}[sampling]\nn = 400\n")
    (position,) = scaling.tolerances(plan)
    table = tmp_path / "costs.toml"
    table.write_text('"*_pins.position" = { at = "⌀0.15 mm", most = "0.6 mm" }\n', encoding="utf-8")
    (cost,) = costs.of([position], CARDAN, table)
    assert (cost.at(1.0), cost.reach[1]) == (pytest.approx(2 * 0.5), pytest.approx(2.0))  # of two pairs of pins
    table.write_text('"*_pins.position" = { at = "±0.15 mm" }\n', encoding="utf-8")
    with pytest.raises(InputError, match="is a band where another quantity is meant"):
        costs.of([position], CARDAN, table)


def test_steps_are_those_of_a_drawing() -> None:
    fit = '[tolerances]\nfit = { basic = "76 mm", code = "H8/e8", distribution = "normal", cpk = 1.0 }\n'
    plan = study.load(Path("made.toml"), text=TEXT.replace("[tolerances]\n", fit))
    tolerances = scaling.tolerances(plan)
    by_line = {own.line.label: own for own in ladder.ladders(plan, tolerances, costs.of(tolerances, CARDAN))}
    offset, fitted = by_line["pin*.offset_z"], by_line["fit H8/e8"]
    near = [offset.rungs[offset.drawn + k].words for k in (-2, -1, 0, 1, 2)]
    assert near == ["±0.1 mm", "±0.125 mm", "±0.15 mm", "class m (±0.3 mm)", "±0.4 mm"]
    assert [fitted.rungs[fitted.drawn + k].words for k in (-1, 0, 1)] == ["H7/e7", "H8/e8", "H9/e9"]
    assert fitted.features == 8
    text = ladder.text_of(plan, [(offset, offset.drawn + 1), (fitted, fitted.drawn - 1)], 9)
    written = study.load(Path("made.toml"), text=text)
    assert written.fit is not None
    assert (written.fit.entry.code, written.sampling.seed) == ("H7/e7", 9)
    assert '"pin*.offset_z" = { iso2768 = "m", nominal = "72.8 mm"' in text
    costs_of_steps = [offset.cost(k) for k in range(len(offset.rungs))]
    assert costs_of_steps == sorted(costs_of_steps, reverse=True)


@pytest.mark.parametrize(
    ("value", "finer", "coarser"), [(0.5, 0.4, 0.63), (0.15, 0.125, 0.2), (1.0, 0.8, 1.25), (30, 25, 40)]
)
def test_preferred_numbers(value: float, finer: float, coarser: float) -> None:
    assert ladder.preferred(value, -1) == pytest.approx(finer)
    assert ladder.preferred(value, 1) == pytest.approx(coarser)


@pytest.mark.usefixtures("quick")
def test_one_operating_point_is_searched_and_simulated_alone(tmp_path: Path) -> None:
    path = written(tmp_path, TWO)
    question.simulate(path, Work(workers=1, point="cruise"), [TARGET])
    with ResultFile.open(path) as store:
        view = store.view()
        assert {name.partition(" at ")[2] for one in view.altered.values() for name in one.names} == {"cruise"}
        assert question.allocate(view.at("cruise"), [TARGET]).facts["verdict"].startswith("Holds")
