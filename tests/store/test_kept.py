"""Results that a study does not select are not stored, and everything else works as with all of them."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

from tests.campaign.test_campaign import datasets
from tests.campaign.test_extend import run, slices, small
from tests.report.test_report import texts
from tests.support import damage, fakes, reports, synthetic
from tests.support.of_cardan import OPTIONAL_FIELDS, RESULT_COLUMNS, blank_others, kept_columns
from tests.support.views import swept, view
from tolstat import study
from tolstat.analysis import accuracy
from tolstat.campaign import extend, replay, stop_rule, verify
from tolstat.campaign import run as campaign
from tolstat.campaign.verify import QUICK_CHECKS
from tolstat.common.cardan import CARDAN
from tolstat.common.columns import KEPT
from tolstat.common.errors import InputError, StoreError
from tolstat.questions import accuracy as question
from tolstat.questions import sweep
from tolstat.questions.causes.worst import joint_rows
from tolstat.questions.exceedance import curves, rows
from tolstat.store import ResultFile, layout, metadata, verification

CROSS_F = [f"cross{i}.F_max" for i in (1, 2, 3, 4)]
COURSE = [c.name for c in RESULT_COLUMNS if c.field not in OPTIONAL_FIELDS]
PLAIN = synthetic.WHOLE.partition("[limits]")[0]


def text(*patterns: str, body: str = PLAIN, more: str = "") -> str:
    return f"{body}\n[output]\nresults = {json.dumps(patterns)}\n{more}"


def loaded(folder: Path, content: str) -> study.Study:
    (folder / "s.toml").write_text(content, encoding="utf-8")
    return study.load(folder / "s.toml")


def columns(*names: str) -> tuple[object, ...]:
    return kept_columns({KEPT: list(names)})


def fake(**kwargs: object) -> fakes.Study:
    return fakes.Study(output=fakes.Output(results=tuple(CROSS_F)), **kwargs)


def test_how_the_simulation_went_is_always_kept() -> None:
    assert COURSE[0] == "status"
    assert {"settled", "closure", "period", "newton_iterations", "failed_theta"} <= set(COURSE)
    assert not [name for name in COURSE if "." in name or name == "psi_max"]
    left_out = [c for c in RESULT_COLUMNS if c.name not in COURSE]
    assert {c.dtype for c in left_out} == {"f8"}  # so that NaN can stand for them


def test_patterns_select_columns(tmp_path: Path) -> None:
    made = loaded(tmp_path, text("psi_max", "cross[12].F_max", "status"))
    names = {*COURSE, "cross1.F_max", "cross2.F_max", "psi_max"}
    assert [c.name for c in made.columns] == [c.name for c in RESULT_COLUMNS if c.name in names]
    assert made.identity()[KEPT] == ["cross1.F_max", "cross2.F_max", "psi_max"]
    assert made.asked == ["cross1.F", "cross2.F", "psi"]
    only_course = loaded(tmp_path, text("status"))
    assert [c.name for c in only_course.columns] == COURSE
    assert only_course.asked == []


def test_the_same_columns_are_the_same_campaign(tmp_path: Path) -> None:
    identity = loaded(tmp_path, text("cross*.F_max", "psi_max")).identity()
    assert loaded(tmp_path, text("psi_max", *reversed(CROSS_F))).identity() == identity
    assert loaded(tmp_path, text("*.*")).identity() == loaded(tmp_path, PLAIN).identity()
    assert KEPT not in loaded(tmp_path, PLAIN).identity()


def test_faults_are_told_together(tmp_path: Path) -> None:
    body = synthetic.WHOLE  # its limits ask for more
    with pytest.raises(InputError) as caught:
        loaded(tmp_path, text("kross*.F_max", "cross1.F_mx", "F_max", "cross1.F", body=PLAIN))
    said = str(caught.value)
    assert "output.results[0]: 'kross*.F_max' selects nothing" in said
    assert "did you mean 'cross1.F_max'?" in said
    assert "did you mean '*.F_max'?" in said
    assert "allowed here: F_max, F_mean" in said
    with pytest.raises(InputError, match=r"at least"):
        loaded(tmp_path, text())
    contacts = ", ".join(rf"pin1\.contact_{name}_max" for name in ("outer", "inner", "resultant"))
    with pytest.raises(InputError, match=rf"fork4\.T_max, {contacts}, psi_max") as caught:
        loaded(tmp_path, text("cross*.F_max", body=body))
    assert "cross1.F_max" not in str(caught.value)
    assert loaded(tmp_path, text("cross1.F_max", "fork*.T_max", "pin1.contact*", "psi_max", body=body)).limits


def test_the_file_holds_what_is_asked_for_and_no_more(tmp_path: Path) -> None:
    everything, path = tmp_path / "all.h5", tmp_path / "a.h5"
    fakes.run(fakes.Study(), everything, 1, check=True)
    fakes.run(fake(), path, 1, 7, check=True)
    with h5py.File(path) as file:
        assert set(file["results"]) == {*COURSE, *CROSS_F, "row", "nominal"}
        assert set(file["verify/column"].asstr()) == {*COURSE, *CROSS_F}
        assert file["verify/finer"].shape == (len(file["verify/rows"]), len(file["verify/column"]))
    with ResultFile.open(path) as store, ResultFile.open(everything) as whole:
        found, expected = store.results(), whole.results()
        for c in RESULT_COLUMNS:
            if c.name in [*COURSE, *CROSS_F]:
                np.testing.assert_array_equal(c.of(found), c.of(expected))
            else:
                assert np.isnan(c.of(found)).all()
        left_out = {c.name for c in RESULT_COLUMNS} - {*COURSE, *CROSS_F}
        frame = whole.to_pandas()
        assert list(store.to_pandas().columns) == [name for name in frame.columns if name not in left_out]
        checked = verification.read(store)
        assert checked is not None
        assert np.isnan(checked.checks["finer"].results["T_max"]).all()
        assert np.isfinite(checked.checks["finer"].results["F_max"][:, :4]).all()
    assert path.stat().st_size < everything.stat().st_size - 60 * (layout.COLUMN_OVERHEAD // 2)


def test_the_checksum_covers_what_is_stored(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    fakes.run(fake(), path, 1)
    whole = datasets(path)
    for name in (*CROSS_F, "closure", "steps"):
        damage.flip_in(path, f"results/{name}", 5)
        with ResultFile.open(path) as store:
            assert not store.status().any()
        fakes.run(fake(), path, 1)
        assert datasets(path) == whole


def test_another_selection_is_another_campaign(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    fakes.run(fake(), path, 1, check=True)
    other = fakes.Study(output=fakes.Output(results=("psi_max",)))
    for wrong in (fakes.Study(), other):
        with pytest.raises(StoreError, match=r"output\.results: \['cross1\.F_max', .* in the file"):
            fakes.run(wrong, path, 1, check=True)


def test_lost_and_unknown_columns_are_damage(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    fakes.run(fake(), path, 1, check=True)
    with h5py.File(path, "r+") as file:
        held = file["results/cross2.F_max"][:]
        del file["results/cross2.F_max"]
    with ResultFile.open(path) as store, pytest.raises(StoreError, match=r"is damaged or no tolstat result file: .*"):
        store.results()
    with h5py.File(path, "r+") as file:
        file["results"].create_dataset("cross2.F_max", data=held)
        about = metadata.read(file)
        metadata.write(
            file, about.model_copy(update={"identity": about.identity | {KEPT: ["cross1.F_max", "psi_max"]}})
        )
    with ResultFile.open(path) as store, pytest.raises(StoreError, match=r"is damaged or no tolstat result file: .*"):
        store.results()


@pytest.mark.slow
def test_slices_and_extensions_are_one_run(tmp_path: Path) -> None:
    def selected(n: int) -> study.Study:
        made = small(tmp_path, n)
        source = made.text.replace(synthetic.KEPT, '["*.F_max", "fork*.T_*", "pin*.contact*", "psi_max"]')
        made.path.write_text(source.replace("[limits]", "[limits]\n#"), encoding="utf-8")
        return study.load(made.path)

    whole = run(selected(61), tmp_path / "whole.h5")
    assert "results/cross1.T_max" not in datasets(whole)
    parts = slices(selected(61), tmp_path, 0, 20, 62)
    extend.merge(parts, tmp_path / "merged.h5")
    assert datasets(tmp_path / "merged.h5") == datasets(whole)
    grown = run(selected(40), tmp_path / "grown.h5")
    run(extend.extend(grown, 61), grown)
    assert datasets(grown) == datasets(whole)


REAL = PLAIN.replace("n = 60", "n = 3") + "\n[solver]\nsteps_per_rev = 24\n"


def test_replay_and_verify_compare_what_is_stored(tmp_path: Path) -> None:
    path = tmp_path / "s.h5"
    campaign.run(loaded(tmp_path, text("cross*.F_max", body=REAL)), path, 1)
    with ResultFile.open(path) as store:
        assert replay.replay(store, 2).differences == []
    with damage.rewritten(path) as file:
        file["results/cross2.F_max"][2] += 1.0
    with ResultFile.open(path) as store:
        assert [d.name for d in replay.replay(store, 2).differences] == ["cross2.F_max"]
    found = verify.check_file(path, 2, make=partial(verify.run_checks, names=QUICK_CHECKS))
    with ResultFile.open(path) as store:
        held = verification.read(store)
    assert held is not None
    table = pd.DataFrame(question.error_rows(held, CARDAN))  # from the file as from the run
    pd.testing.assert_frame_equal(table, pd.DataFrame(question.error_rows(found, CARDAN)))
    assert set(table["load"]) == {"F"}
    assert table["worst"].max() > 0
    assert {row["load"] for row in question.joint_rows(held, CARDAN)} == {f"cross{i}.F" for i in (1, 2, 3, 4)}
    assert question.error_note(held, CARDAN).count("F ") == 1
    assert "T " not in question.error_note(held, CARDAN)


def test_errors_are_relative_to_the_largest_load_kept() -> None:
    base = synthetic.results(3)
    other = base.copy()
    other["F_max"][0, 0] *= 1.01
    for results in (base, other):
        blank_others(results, columns(*CROSS_F))
    found = accuracy.differences(base, other, CARDAN)
    assert found[0, 0] == pytest.approx(-0.01 * base["F_max"][0, 0] / other["F_max"][0, :4].max())
    assert np.isfinite(found[:, :4]).all()
    assert np.isnan(found[:, 4:]).all()
    assert np.isnan(accuracy.by_kind(found, CARDAN)[:, 1:]).all()
    other["F_max"][1, 2] = np.nan  # of one joint: kept, not passed over
    assert np.isnan(accuracy.by_kind(accuracy.differences(base, other, CARDAN), CARDAN)[1, 0])


def test_reports_show_what_there_is() -> None:
    held = columns(*CROSS_F, "fork2.T_max")
    made = view(columns=held, change=lambda results: blank_others(results, held))
    held = ["cross1.F", "cross2.F", "cross3.F", "cross4.F", "fork2.T"]
    assert list(dict.fromkeys(row["load"] for row in rows.quantile_rows(made))) == held
    assert list(dict.fromkeys(row["load"] for row in rows.curve_rows(made))) == held
    assert texts(curves.sheet(made, [])).count("not kept by the study") == 2
    assert "cross1.T, cross2.T" in rows.not_kept(made)
    assert all(0 <= row["estimate"] <= 1 for row in rows.limit_rows(made))


@pytest.mark.parametrize("second", [1, 3])
def test_sweeps_show_what_there_is(second: int) -> None:
    held = columns("cross1.F_max", "fork2.T_max", "psi_max")
    made = swept(second, columns=held, change=lambda results: blank_others(results, held))
    loads = [name for name in sweep.sweep(made).frame("sweep").columns if name.startswith(("cross", "fork", "psi"))]
    assert loads == ["cross1.F [N]", "fork2.T [N*m]", "psi"]
    short = sweep.sweep(made).tables["sweep"].for_people
    assert [row["cross.F [N]"] for row in short] == list(made.results["F_max"][:, 0])
    assert not {"cross.T [N*m]", "fork.F [N]"} & set(short[0])
    assert texts(sweep.sheet(made)).count("not kept by the study") == 2


def test_reports_without_any_force_or_torque(tmp_path: Path) -> None:
    psi = reports.build(synthetic.store(tmp_path, text("psi_max", body=PLAIN), "psi"))
    assert [file.name for file in psi.files] == ["psi_exceedance.csv", "psi_quantiles.csv"]
    assert psi.table.splitlines()[4].startswith("psi ")
    assert "not kept, see [output] results of the study: cross1.F" in psi.notes
    means = reports.build(synthetic.store(tmp_path, text("*.F_mean", body=PLAIN), "means"))
    assert means.files == []
    assert means.table.splitlines()[1].startswith("no largest load is kept")
    turned = reports.build(synthetic.store(tmp_path, text("psi_max", body=synthetic.SWEEP), "turned"))
    assert [file.name for file in turned.files] == ["turned_sweep.csv"]
    assert turned.table.splitlines()[3].split()[-1] == "psi"


def test_reports_of_cases(tmp_path: Path) -> None:
    cases = synthetic.SWEEP.partition("[errors]")[0] + (
        '[sampling]\nmethod = "cases"\n[[case]]\nname = "a"\nerrors.hole4.offset_t = "0.1 mm"\n'
        '[[variant]]\nname = "plain"\nnote = "as drawn"\n'
    )
    made = reports.build(synthetic.store(tmp_path, text("cross*.F_max", body=cases), "cases"))
    full = pd.read_csv(tmp_path / "cases_cases.csv")
    assert [name for name in full.columns if "[N*m]" in name or "fork" in name] == []
    assert "Gamma_F [%]" in made.table
    assert "Gamma_T" not in made.table
    bare = reports.build(synthetic.store(tmp_path, text("psi_max", body=cases), "bare"))
    assert "Gamma" not in bare.table


def test_what_is_not_kept_cannot_be_asked_for(tmp_path: Path) -> None:
    path = synthetic.store(tmp_path, text("cross*.F_max", body=PLAIN))
    with ResultFile.open(path) as store:
        assert len(joint_rows(store.view(), "cross1.F", 3)) == 3
        assert len(joint_rows(store.view(), "closure", 3)) == 3
        for by in ("fork1.T", "fork1.T_max", "psi"):
            with pytest.raises(InputError, match=r"is not kept in .*\n.*give one of: cross1\.F, "):
                joint_rows(store.view(), by)
    until = stop_rule.parse("P(pin1.contact > 1 N) width < 0.1", {}, CARDAN)
    with pytest.raises(InputError, match=r"leaves out pin1\.contact, .*--until.*\n.*add pin1\.contact_outer_max, pin1"):
        stop_rule.run_until(study.load(tmp_path / "small.toml"), tmp_path / "b.h5", until, lambda row: None)
