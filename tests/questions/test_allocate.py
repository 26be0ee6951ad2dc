"""Tolerances allocated from a campaign's joints: known optima, a fresh campaign, and what is refused."""

import json

import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from tests.questions.test_reweight import campaign, load
from tests.support import synthetic
from tolstat import sampling, study
from tolstat.analysis import allocation
from tolstat.cli import app
from tolstat.common.errors import InputError
from tolstat.common.tables import Simulation
from tolstat.display.answer import Document
from tolstat.questions.allocate import DensityRatios, allocate
from tolstat.store import ResultFile, Writer
from tolstat.study import costs, scaling

TWO = synthetic.STUDY.replace("n = 60", "n = 12000").replace(
    '"pin*.offset_t" =', '"pin4.tilt_t" = { plus_minus = "1 deg", distribution = "uniform" }\n"pin[12].offset_t" ='
)
"""Two pins whose offsets make the load, and a tilt that does not."""
LIMIT = "P(cross1.F > 700 N) < 0.02"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return campaign(tmp_path_factory.mktemp("allocate"), TWO, "two")


def study_of(answer):
    """Text of the study proposed."""
    return next(part.text for part in answer.parts if isinstance(part, Document))


def share_of(factor):
    """Share of the joints above 700 N, where |offset_1 + offset_2| > 100 / 1.5e6 m."""
    sigma = factor * np.sqrt(2) * 1e-4 / 3
    return 2 * norm.sf(100 / 1.5e6 / sigma)


def test_a_proposal_keeps_its_limit_in_a_fresh_campaign(path, tmp_path):
    with ResultFile.open(path) as store:
        found = allocate(store.view(), [LIMIT])
    assert found.facts["aim"] == "interval"
    row, table = found.tables["limits"].rows[0], found.frame("tolerances").set_index("tolerance")
    factor = table.loc["pin[12].offset_t", "factor"]
    # between the exact factor for the limit and what the joints' interval asks for
    exact = 100 / 1.5e6 / norm.isf(0.01) / (np.sqrt(2) * 1e-4 / 3)
    assert 0.92 * exact < factor < exact
    assert row["lower"] < share_of(factor) < row["upper"]
    assert row["before"] == pytest.approx(share_of(1.0), abs=0.015)
    # a uniform band cannot be widened by its joints, and nothing is won by a narrower one
    assert table.loc["pin4.tilt_t", "factor"] == 1.0
    source = tmp_path / "new.toml"
    source.write_text(study_of(found), encoding="utf-8")
    fresh = study.load(source, n=20000)
    with ResultFile.open(path) as store:
        assert fresh.sampling.seed == store.view().study.sampling.seed + 1
    errors = sampling.draw(fresh)[1:]
    loads = 600.0 + 1.5e6 * np.abs(errors["pin1.offset_t"] + errors["pin2.offset_t"])
    assert np.mean(loads > 700.0) == pytest.approx(share_of(factor), abs=4e-3)


def test_where_a_limit_leaves_room_tolerances_become_wider(path):
    with ResultFile.open(path) as store:
        found = allocate(store.view(), ["P(cross1.F > 700 N) < 0.25"])
    table = found.frame("tolerances").set_index("tolerance")
    assert table.loc["pin[12].offset_t", "factor"] > 1.1
    assert table["cost"].sum() < table["cost_before"].sum()
    assert found.facts["holds"]


def test_what_the_joints_cannot_show_needs_new_runs(path):
    with ResultFile.open(path) as store:
        found = allocate(store.view(), ["P(cross1.F > 700 N) < 1e-6"])
    assert not found.facts["holds"]
    assert found.facts["verdict"].startswith("needs new runs")
    assert found.facts["aim"] == "step"
    assert found.frame("limits")["usable"].all()
    assert found.frame("tolerances").set_index("tolerance").loc["pin[12].offset_t", "factor"] < 1.0


def test_costs_decide_between_two_tolerances_with_the_same_effect(path, tmp_path):
    text = TWO.replace(
        '"pin[12].offset_t" =', '"pin1.offset_t" = { std = "0.033 mm", distribution = "normal" }\n"pin2.offset_t" ='
    )
    file = campaign(tmp_path, text, "each")
    table = tmp_path / "costs.csv"
    table.write_text("tolerance,cost,fixed,power,most\npin1.offset_t,10,2,1,\npin2.offset_t,1,,2,0.1 mm\n")
    with ResultFile.open(file) as store:
        found = allocate(store.view(), [LIMIT], table)
    rows = found.frame("tolerances").set_index("tolerance")
    assert list(rows.index) == ["pin1.offset_t", "pin2.offset_t"]  # the tilt has no cost, and is kept
    assert rows.loc["pin2.offset_t", "factor"] < rows.loc["pin1.offset_t", "factor"]
    new = rows.loc["pin1.offset_t", "factor"]
    assert rows.loc["pin1.offset_t", "cost"] == pytest.approx(2 + 8 / new)
    assert rows.loc["pin2.offset_t", "cost"] == pytest.approx(rows.loc["pin2.offset_t", "factor"] ** -2)


@pytest.mark.parametrize(
    ("bound", "limit"), [('least = "0.12 mm"', LIMIT), ('most = "0.08 mm"', "P(cross1.F > 700 N) < 0.25")]
)
def test_a_tolerance_that_its_own_bounds_exclude_may_stay_as_it_is(path, tmp_path, bound, limit):
    table = tmp_path / "costs.toml"
    table.write_text(f'"pin[12].offset_t" = {{ cost = 4.0, {bound} }}\n', encoding="utf-8")
    with ResultFile.open(path) as store:
        found = allocate(store.view(), [limit], table)
    assert found.frame("tolerances").set_index("tolerance").loc["pin[12].offset_t", "factor"] == pytest.approx(1.0)


def test_search_finds_the_optimum_of_a_problem_with_a_known_one():
    """Load x1 + x2: the optimum of c1 / f1 + c2 / f2 under f1² + f2² = r² has f1³ / f2³ = c1 / c2."""
    rng = np.random.default_rng(4)
    x = rng.standard_normal((40_000, 2))
    limit, target, prices = 2.5, 0.03, np.array([2.0, 1.0])
    problem = allocation.Problem(
        lambda f: (norm.logpdf(x, 0, f) - norm.logpdf(x)).sum(axis=1),
        lambda f: float(-np.log(f * np.sqrt(2 - f**2)).sum()),
        lambda f: True,
        (x.sum(axis=1) > limit)[:, None],
        np.array([target]),
        lambda f: float((prices / f).sum()),
        np.full(2, 0.5),
        np.full(2, 1.4),
        iid=False,
    )
    found = allocation.search(problem)
    radius = limit / norm.isf(target)
    f2 = radius / np.sqrt(1 + 2 ** (2 / 3))
    assert found.aim == "estimate"
    assert found.factors == pytest.approx([2 ** (1 / 3) * f2, f2], rel=0.03)


def test_a_mean_off_centre_moves_with_its_band(tmp_path):
    mean = '"pin*.offset_t" = { plus_minus = "0.1 mm", mean = "0.045 mm", distribution = "normal", cpk = 0.8 }\n#'
    text = TWO.replace('"pin[12].offset_t" =', mean)
    tolerance = next(t for t in scaling.tolerances(load(tmp_path, text)) if "offset" in t.pattern)
    for factor in (0.25, 0.8, 2.0):
        found = tolerance.distribution(tolerance.scaled(factor))
        assert (found.mean, found.sigma) == pytest.approx((factor * 4.5e-5, factor * 5.5e-5 / 2.4))
    with ResultFile.open(campaign(tmp_path, text, "off")) as store:
        found = allocate(store.view(), ["P(cross1.F > 700 N) < 0.5"])
    row = found.frame("tolerances").set_index("tolerance").loc["pin*.offset_t"]
    assert 0.5 < row["factor"] < 1.0
    new = load(tmp_path, study_of(found), "new").tolerances["pin1.offset_t"]
    assert new.mean / new.sigma == pytest.approx(4.5e-5 / (5.5e-5 / 2.4), rel=0.01)


def test_mean_square_is_of_the_scaled_distribution_where_the_mean_is_not_in_the_middle(tmp_path):
    mean = '"pin*.offset_t" = { lower = "-0.1 mm", upper = "0.2 mm", mean = "0.02 mm", distribution = "normal" }\n#'
    plan = load(tmp_path, synthetic.STUDY.replace('"pin*.offset_t" =', mean))
    ratios = DensityRatios(plan, scaling.tolerances(plan), sampling.draw(plan))
    # the mean, 0.75 sigma below the middle of the band, moves with the band: by a tenth of that
    shift, room = 0.1 * 0.03 / 0.04, 2.0 - 1.1**2
    found = ratios.exact(np.array([1.1])).mean_square
    assert found == pytest.approx(4 * (shift**2 / room - np.log(1.1 * np.sqrt(room))))
    exact = ratios.exact(np.array([1.1]))
    assert exact == (pytest.approx(found), pytest.approx(found), np.inf)
    bounded = ratios.exact(np.array([0.8]))
    assert bounded.largest == pytest.approx(4 * (0.5 * (0.2 * 0.75) ** 2 / (1 - 0.8**2) - np.log(0.8)))


def test_entries_are_scaled_about_the_middle_and_texts_keep_their_comments(tmp_path):
    text = synthetic.STUDY.replace(
        '"pin*.offset_t" =',
        '"pin*.tilt_t" = { iso2768 = "f", nominal = "20 mm", distribution = "normal" }\n'
        "# above nominal\n"
        '"hole*.diameter" = { lower = "0 mm", upper = "30 um", peak = "10 um", distribution = "triangular" }\n'
        'hole1.offset_radial = { sigma = "0.03 mm", distribution = "rayleigh" }\n'
        '"pin*.offset_t" =',
    ).replace("seed = 2021\n", "")
    plan = load(tmp_path, text)
    tilt, hole, radial, offset = scaling.tolerances(plan)
    assert tilt.scaled(0.5, 3)["plus_minus"] == "0.25 deg"
    # a limit at zero stays there, as that of H7
    assert hole.scaled(0.5) == hole.entry | {"upper": "15.0 um", "peak": "5.0 um"}
    hole = hole._replace(entry=hole.entry | {"lower": "-10 um"})
    assert hole.scaled(0.5) == hole.entry | {"lower": "0.0 um", "upper": "20.0 um"}
    hole = hole._replace(entry=hole.entry | {"lower": "0 mm"})
    assert radial.width == pytest.approx(9e-5)
    assert (radial.widens, hole.widens) == (True, False)
    new = scaling.rewritten(plan, {t.pattern: t.scaled(0.5) for t in (hole, radial)}, 7)
    assert "# above nominal" in new
    again = load(tmp_path, new, "again")
    assert again.sampling.seed == 7
    changed = {name for name, d in again.tolerances.items() if d.describe() != plan.tolerances[name].describe()}
    assert changed == {*hole.names, *radial.names}
    table = text.replace('"pin*.offset_t" = {', '[tolerances."pin*.offset_t"]\n')
    table = table.replace('", distribution = "normal", cpk = 1.0 }', '"\ndistribution = "normal"')
    new = scaling.rewritten(load(tmp_path, table, "table"), {offset.pattern: offset.scaled(0.5)}, 1)
    assert load(tmp_path, new, "new").tolerances["pin1.offset_t"].sigma == pytest.approx(0.5e-4 / 3)


def test_any_limit_covers_limits_at_an_operating_point(tmp_path):
    before, _, rest = synthetic.STUDY.partition("[operation]\n")
    keys, tolerances, others = rest.partition("[tolerances]")
    points = "".join(f'[[operation]]\nname = "{name}"\n{keys}' for name in ("low", "high"))
    source = tmp_path / "points.toml"
    others = others.replace("n = 60", "n = 600")
    limits = others.replace("[limits]\n", '[limits]\n"cross1.T at high" = "15 N*m"\n')
    assert limits != others
    source.write_text(before + points + tolerances + limits, encoding="utf-8")
    plan = study.load(source)
    with Writer.create(tmp_path / "points.h5", plan, [sampling.draw(plan)]) as store:
        for name in ("low", "high"):
            store.at(name).write(np.arange(plan.rows), Simulation(synthetic.results(plan.rows), {}))
    with ResultFile.open(tmp_path / "points.h5") as store:
        assert list(allocate(store.view(), ["P(any limit) < 0.9"]).frame("limits")["target"]) == [0.9]


def test_faults_of_limits_costs_and_names_are_told_together(path, tmp_path):
    table = tmp_path / "costs.toml"
    table.write_text('"pin[12].offset_t" = { cost = 1, fixed = 2 }\n"pin4.tilt_t" = { least = "1 mm" }\npin9.x = {}\n')
    bad = ["P(cros1.F > 7 N) < 0.1", "P(cross1.F > 700 mm) < 2", "often"]
    with ResultFile.open(path) as store, pytest.raises(InputError) as found:
        allocate(store.view(), bad, table, ["pin7.*"])
    for words in (
        "did you mean 'cross1.F'",
        "'700 mm' cannot be",
        "2 is not between",
        "not a rule",
        "fixed is larger",
        "1 mm",
        "pin9",
    ):
        assert words in str(found.value)
    assert "selects no error" in str(found.value)
    with ResultFile.open(path) as store, pytest.raises(InputError, match="no tolerance that may change"):
        allocate(store.view(), [LIMIT], keep=["pin*.offset_t", "pin*.tilt_t"])


def test_cost_model_is_a_reciprocal_power(tmp_path):
    tolerance = scaling.tolerances(load(tmp_path))[0]
    table = tmp_path / "costs.toml"
    table.write_text('"pin*.offset_t" = { cost = 3, fixed = 1, at = "0.2 mm", power = 2, least = "0.05 mm" }\n')
    cost = costs.of([tolerance], table)[0]
    assert cost.at(0.5) == pytest.approx(4 * (1 + 2 * (0.2 / 0.05) ** 2))
    assert cost.reach == (pytest.approx(0.5), costs.REACH[1])
    assert costs.of([tolerance])[0].at(0.5) == pytest.approx(8.0)


def test_command_writes_a_study(path, tmp_path):
    out = tmp_path / "next"
    done = CliRunner().invoke(app, ["allocate", str(path), "--target", LIMIT, "--out", str(out)])
    assert done.exit_code == 0
    assert '"pin[12].offset_t" = { plus_minus' in done.stdout
    assert "joints in the check" in done.stderr
    assert "next, with --out DIR: tolstat run DIR/two_allocate.toml" in done.stderr
    assert study.load(out / "two_allocate.toml").tolerances["pin1.offset_t"].sigma < 1e-4 / 3
    found = json.loads(CliRunner().invoke(app, ["allocate", str(path), "--target", LIMIT, "--json"]).stdout)
    row = found["tables"]["tolerances"]["rows"][1]
    assert row["cost"] > row["cost_before"]
    assert list(found["facts"]["entries"]) == ["pin[12].offset_t"]
    refused = CliRunner().invoke(app, ["allocate", str(path), "--target", "P(cross1.F > 700 N) = 1"])
    assert refused.exit_code == 2
    assert "write --target" in refused.stderr
