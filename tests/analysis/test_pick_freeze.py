"""Pick-freeze designs: indices with known answers, scipy's on the same joints, and a campaign from study to table."""

import json

import numpy as np
import pytest
from scipy.stats import norm, sobol_indices
from typer.testing import CliRunner

from tests.analysis.test_sensitivity import ISHIGAMI_FIRST, ISHIGAMI_TOTAL
from tests.support import fakes, synthetic
from tolstat import cli, sampling, study
from tolstat.analysis import pick_freeze
from tolstat.campaign import extend
from tolstat.common.errors import InputError
from tolstat.common.tables import RESULT, Simulation, Status
from tolstat.questions.causes.errors import causes
from tolstat.store import ResultFile

SEEDS = 500
LEAST = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)


def test_indices_of_a_rare_event_cover_with_few_points_and_normal_intervals_do_not():
    rng, n, level = np.random.default_rng(4), 300, 1.6448536  # a share of 0.05
    x = np.linspace(-8.0, 8.0, 4001)
    density = norm.pdf(x) / norm.pdf(x).sum()
    truth = float(density @ (norm.sf((level - 0.6 * x) / 0.8) - 0.05) ** 2) / (0.05 * 0.95)
    missed = {pick_freeze.of_event: [], pick_freeze.indices: []}
    for _ in range(200):
        a, b = rng.standard_normal((2, n, 2))
        loads = [part @ [0.6, 0.8] > level for part in (a, b, np.stack([np.column_stack([b[:, 0], a[:, 1]])], axis=1))]
        for estimate, own in missed.items():
            found = estimate(*loads)
            own.append([found.first.lower[0] > truth, found.first.upper[0] < truth])
        np.testing.assert_allclose(pick_freeze.of_event(*loads)[0][0], pick_freeze.indices(*loads)[0][0], atol=1e-12)
        np.testing.assert_allclose(pick_freeze.of_event(*loads)[1][0], pick_freeze.indices(*loads)[1][0], atol=1e-12)
    counted, normal = (np.mean(own, axis=0).max() for own in missed.values())
    assert counted < 0.025 + 3.0 * np.sqrt(0.025 * 0.975 / 200)
    assert normal > 0.1


def test_an_error_without_effect_on_an_event_has_an_interval_that_is_no_point():
    a, b = np.random.default_rng(5).standard_normal((2, 200, 1))
    found = pick_freeze.of_event(a[:, 0] > 1.0, b[:, 0] > 1.0, (a > 1.0))
    assert found.first.estimate.tolist() == found.total.estimate.tolist() == [0.0]
    assert found.first.lower[0] < 0.0 < found.first.upper[0] < 0.3
    assert 0.0 < found.total.upper[0] < 0.1


def ishigami(x):
    return np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])


def design(n, rng):
    a, b = rng.uniform(-np.pi, np.pi, (2, n, 3))
    ab = np.stack([np.where(np.arange(3) == i, b, a) for i in range(3)], axis=1)
    return ishigami(a), ishigami(b), ishigami(ab)


def test_indices_of_ishigamis_function_cover_and_frozen_for_picked_does_not():
    rng, covered, wrong = np.random.default_rng(11), [], []
    for _ in range(SEEDS):
        a, b, ab = design(1000, rng)
        found = pick_freeze.indices(a, b, ab)
        for index, truth in ((found.first, ISHIGAMI_FIRST), (found.total, ISHIGAMI_TOTAL)):
            covered.append((index.lower <= truth) & (truth <= index.upper))
        swapped = pick_freeze.indices(b, a, ab).first  # A in B's place: everything but the group
        wrong.append((swapped.lower <= ISHIGAMI_FIRST) & (swapped.upper >= ISHIGAMI_FIRST))
    first, total = np.mean(covered[::2], axis=0), np.mean(covered[1::2], axis=0)
    assert min(*first, *total) >= LEAST
    assert max(*first, *total) < 0.995
    assert np.mean(wrong, axis=0).max() < LEAST


def test_estimates_are_scipys():
    a, b, ab = design(512, np.random.default_rng(3))
    theirs = sobol_indices(func={"f_A": a[None], "f_B": b[None], "f_AB": ab.T[:, None]}, n=512)
    found = pick_freeze.indices(a, b, ab)
    np.testing.assert_allclose(found.first.estimate, theirs.first_order, rtol=1e-9)
    np.testing.assert_allclose(found.total.estimate, theirs.total_order, rtol=1e-9)


def test_a_joint_without_a_load_costs_only_its_own_index():
    a, b, ab = design(200, np.random.default_rng(4))
    lost = ab.copy()
    lost[:20, 1] = np.nan
    found, whole = pick_freeze.indices(a, b, lost), pick_freeze.indices(a, b, ab)
    np.testing.assert_array_equal(found.first.estimate[[0, 2]], whole.first.estimate[[0, 2]])
    assert found.first.estimate[1] != whole.first.estimate[1]
    for loads, text in (
        ((a[:49], b[:49], ab[:49]), "too few"),
        ((a[:1].repeat(60),) * 2 + (ab[:1].repeat(60, 0) * 0 + a[0],), "scatter"),
    ):
        with pytest.raises(ValueError, match=text):
            pick_freeze.indices(*loads)


TEXT = synthetic.STUDY.replace(
    '"pin*.offset_t"', '"hole1.offset_t" = { std = "0.02 mm", distribution = "normal" }\n"pin*.offset_t"'
).replace("seed = 2021", 'seed = 2021\nmethod = "pick_freeze"')


def load(folder, text=TEXT, name="design"):
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return study.load(path)


def test_rows_are_a_b_and_a_with_one_group_of_b(tmp_path):
    plan = load(tmp_path)
    assert [group.label for group in plan.groups] == ["hole1.offset_t", "pin*.offset_t"]
    assert plan.rows == 1 + 60 * 4
    errors = sampling.draw(plan)
    pins, hole = (
        np.column_stack([errors[n][1:] for n in group.names]).reshape(60, 4, -1) for group in reversed(plan.groups)
    )
    a, b, hole_of_b, pins_of_b = range(4)
    for part, from_b in ((hole_of_b, hole), (pins_of_b, pins)):
        for values in (pins, hole):
            np.testing.assert_array_equal(values[:, part], values[:, b if values is from_b else a])
    assert not np.isin(pins[:, a], pins[:, b]).any()
    assert abs(np.corrcoef(pins[:, a].ravel(), pins[:, b].ravel())[0, 1]) < 0.2
    # the joints A are those of a random campaign, and any slice is as drawn with the others
    alone = sampling.draw(load(tmp_path, TEXT.replace("pick_freeze", "random"), "random"))
    np.testing.assert_array_equal(errors[1::4], alone[1:])
    np.testing.assert_array_equal(sampling.draw(plan, range(7, 30)), errors[7:30])
    assert "groups" in plan.sampling.model_dump()
    assert "groups" not in study.load(tmp_path / "random.toml").sampling.model_dump()


def test_correlated_errors_move_together_and_each_error_by_itself(tmp_path):
    text = TEXT.replace("seed = 2021", 'seed = 2021\ngroups = "error"')
    linked = '\n[[correlation]]\nbetween = ["pin1.offset_t", "pin3.offset_t"]\nrho = 0.5\n'
    assert [len(group.names) for group in load(tmp_path, text).groups] == [1] * 5
    found = load(tmp_path, text + linked, "linked").groups
    assert [group.label for group in found] == [
        "hole1.offset_t",
        "pin1.offset_t and 1 more",
        "pin2.offset_t",
        "pin4.offset_t",
    ]
    with pytest.raises(InputError, match="groups is given with 'random'"):
        load(tmp_path, text.replace("pick_freeze", "random"), "wrong")


def simulate(params, options, histories="none", n_harmonics=16):
    """Stand-in for the solver: a load of two tolerances, and of their product."""
    results = np.zeros(len(params), RESULT)
    results["status"], results["settled"] = Status.OK, 1
    pin = params["pin_point"][:, :, 1].sum(axis=1) * 1e5
    hole = params["hole_point"][:, 0, 1] * 1e5
    results["F_max"][:, 0] = 600.0 + pin + 2.0 * hole + 0.3 * pin * hole
    return Simulation(results, {})


@pytest.mark.slow
def test_a_command_runs_the_design_of_a_study_and_tells_the_indices(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fakes.replace_functions(monkeypatch, **fakes.SOLVER | {"simulate_rows": simulate})
    load(tmp_path, TEXT.replace('\nmethod = "pick_freeze"', ""))
    command = ["causes", "design.toml", "--points", "150", "--workers", "1"]
    done = CliRunner().invoke(cli.app, command)
    assert done.exit_code == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    assert "601 joints" in done.stderr
    assert "from a pick-freeze design" in done.stderr
    assert "in all" in done.stdout
    assert "rank" not in done.stdout
    with ResultFile.open("design_causes.h5") as store:
        table = causes(store.view(), "cross1.F").frame("errors").set_index("error")
    assert {row[0] for row in lines[1:]} == set(table.index)
    # pin and hole are normal with these deviations: y = pin + 2 hole + 0.3 pin hole
    pin = np.sqrt(4) * 1e-4 / 3 * 1e5
    hole = 2e-5 * 1e5
    parts = np.array([pin**2, 4 * hole**2, 0.09 * pin**2 * hole**2])
    shares = parts / parts.sum()
    for name, first, total in (
        ("pin*.offset_t", shares[0], shares[0] + shares[2]),
        ("hole1.offset_t", shares[1], shares[1] + shares[2]),
    ):
        row = table.loc[name]
        for index, truth in (("first", first), ("total", total)):  # within four standard errors
            assert abs(row[index] - truth) < row[f"{index}_upper"] - row[f"{index}_lower"]
        assert row["first_upper"] - row["first_lower"] < 0.6
    found = json.loads(CliRunner().invoke(cli.app, ["causes", "design_causes.h5", "--json"]).stdout)
    assert found["facts"]["r2"] is None
    assert len(found["tables"]["errors"]["rows"]) == 2
    wider = extend.extend(tmp_path / "design_causes.h5", 160)
    assert wider.rows == 1 + 160 * 4


def test_too_few_points_and_options_that_go_with_a_design_are_refused(tmp_path):
    path = synthetic.store(tmp_path, TEXT.replace("n = 60", "n = 20"), "few")
    for arguments, text in (
        ((path,), "run 50 points or more"),
        ((path, "--points", 100), "add --run, or give a study (TOML)"),
        ((path, "--run", "--points", 100), "is about the design of a study"),
        ((path.with_suffix(".toml"), "--each", "error"), "is about what --run simulates into FILE"),
        ((path.with_suffix(".toml"), "--budget", "1 min", "--most", 300), "--budget, --most: are about what --run"),
    ):
        done = CliRunner().invoke(cli.app, ["causes", *map(str, arguments)])
        assert done.exit_code == 2, text
        assert text in done.stderr
    done = CliRunner().invoke(cli.app, ["allocate", str(path), "--target", "P(cross1.F > 700 N) < 0.1"])
    assert done.exit_code == 2
    assert "share errors with" in done.stderr
