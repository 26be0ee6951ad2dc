"""Drive shafts of two joints: shares of pairs, their intervals, and how the output turns."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.conftest import ROOT
from tolstat import study
from tolstat.analysis.sensitivity import first_order
from tolstat.campaign.run import run
from tolstat.common.errors import InputError, NotApplicable, StoreError
from tolstat.questions.shafts import interval, shares_of_variance
from tolstat.store import ResultFile

STUDY = ROOT / "studies" / "drive_shaft.toml"
CHEAP = ("[sampling]\nn = 1024", '[solver]\nfidelity = "quasistatic"\nsteps_per_rev = 24\n[sampling]\nn = 60')


@pytest.fixture(scope="module")
def view(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shafts")
    text = STUDY.read_text().replace(*CHEAP)
    (folder / "shaft.toml").write_text(text)
    run(study.load(folder / "shaft.toml"), folder / "shaft.h5", workers=1, check=False)
    with ResultFile.open(folder / "shaft.h5") as file:
        yield file.view()


def test_a_shaft_is_joint_i_first_and_the_next_joint_second(view):
    first, second = (view.at(name).load("any limit").values > 1 for name in ("first", "second"))
    rows = {row["load"]: row for row in tolstat.shafts(view).frame("shafts").to_dict("records")}
    pairs = [first[i] or second[(i + 1) % 60] for i in range(60)]
    row = rows["any limit"]
    assert (row["n"], row["count"]) == (60, sum(pairs))
    assert 0 < row["count"] < 60
    assert row["first"] == first.mean()
    assert row["second"] == second.mean()
    assert row["lower"] < row["estimate"] < row["upper"]


def test_causes_of_shafts_name_each_line(view):
    table = tolstat.shafts(view).frame("causes")
    assert set(table["line"]) == {entry.pattern for entry in view.study.entries}
    assert (table["first"] + table["second"]).to_numpy() == pytest.approx(table["estimate"].to_numpy())
    assert (table["lower"] <= table["upper"]).all()
    assert table["estimate"].is_monotonic_decreasing


def test_an_error_of_either_joint_explains_its_share_of_the_shafts():
    """Oracle: indices of the indicator of the pair itself."""
    rng = np.random.default_rng(5)
    x, y = rng.normal(size=(2, 100_000, 2))
    above = [joint @ [1.0, 0.5] > level for joint, level in ((x, 0.7), (y, 1.4))]
    pair = first_order(np.hstack([x, y]), (above[0] | above[1]).astype(float)).estimate
    weights = shares_of_variance(*(own.mean() for own in above))
    own = [w * first_order(j, a.astype(float)).estimate for w, j, a in zip(weights, (x, y), above, strict=True)]
    np.testing.assert_allclose(np.concatenate(own), pair, atol=0.005)
    assert shares_of_variance(0.0, 0.0) == shares_of_variance(1.0, 0.2) == (0.0, 0.0)
    assert shares_of_variance(0.3, 0.0) == pytest.approx((1.0, 0.0))


def test_output_of_the_shaft_against_differences_of_its_angle(view):
    """The swing of 1 % at 2 per revolution passes two joints that cancel each other."""
    rows = {row["quantity"]: row for row in tolstat.shafts(view).frame("output").to_dict("records")}
    speed = rows["unevenness of the speed"]
    assert speed["ideal"] == pytest.approx(0.02, rel=1e-3)
    assert speed["ideal"] < speed["at_most_50"] < speed["at_most_95"]
    assert rows["angular acceleration"]["ideal"] == pytest.approx(0.01 * 2 * (1500 * np.pi / 30) ** 2, rel=1e-3)


def test_other_studies_hold_no_drive_shaft(tmp_path):
    text = (ROOT / "studies" / "duty_cycle.toml").read_text().replace("n = 512", "n = 2")
    (tmp_path / "a.toml").write_text(text.replace("[sampling]", '[solver]\nfidelity = "ideal"\n[sampling]'))
    run(study.load(tmp_path / "a.toml"), tmp_path / "a.h5", workers=1, check=False)
    with ResultFile.open(tmp_path / "a.h5") as file, pytest.raises(NotApplicable):
        tolstat.shafts(file.view())


@pytest.mark.parametrize(("alike", "width"), [(0.0, 1.45), (1.0, 1.05)])
def test_intervals_contain_the_share_of_shafts(alike, width):
    """Also of joints that exceed it at both places alike; n shafts counted as independent miss the share too often."""
    rng, n, p, seeds = np.random.default_rng(4), 400, 0.05, 2000
    first = rng.random((seeds, n)) < p
    second = np.where(rng.random((seeds, n)) < alike, first, rng.random((seeds, n)) < p)
    counts = (first | np.roll(second, -1, axis=1)).sum(axis=1)
    truth = 1 - (1 - p) ** 2
    ends = {k: interval(k, k, n) for k in np.unique(counts).tolist()}
    inside = np.mean([ends[k][0] <= truth <= ends[k][1] for k in counts.tolist()])
    assert inside > 0.95
    spread = np.std(counts / n)
    mean_width = np.mean([ends[k][1] - ends[k][0] for k in counts.tolist()])
    assert mean_width < width * 1.15 * 2 * 1.96 * spread
    if alike:
        from tolstat.analysis.binomial import clopper_pearson

        low, high = clopper_pearson(counts, n)
        assert np.mean((low <= truth) & (truth <= high)) < 0.9


def test_a_duty_cycle_of_a_shaft_is_looked_at_point_by_point(tmp_path):
    """Of several pairs of points none is taken silently."""
    head, *points = STUDY.read_text().replace(*CHEAP).replace("n = 60", "n = 4").split("[[operation]]")
    points[1], sep, tail = points[1].partition("[tolerances]")
    slow = [point.replace('name = "', 'name = "slow-').replace("1500 rpm", "500 rpm") for point in points]
    (tmp_path / "a.toml").write_text("[[operation]]".join([head, *points, *slow]) + sep + tail)
    run(study.load(tmp_path / "a.toml"), tmp_path / "a.h5", workers=1, check=False)
    with ResultFile.open(tmp_path / "a.h5") as file:
        with pytest.raises(StoreError, match=r"has 4 operating points with a partner\n.*--point FIRST\+SECOND"):
            tolstat.shafts(file.view())
        slow_shaft = tolstat.shafts(file.view().at("slow-first+slow-second"))
    ideal = {row["quantity"]: row["ideal"] for row in slow_shaft.frame("output").to_dict("records")}
    assert ideal["angular acceleration"] == pytest.approx(0.01 * 2 * (500 * np.pi / 30) ** 2, rel=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "keys"),
    [
        ('"before", alpha = "12 deg"', '"before", alpha = "10 deg"', "alpha"),
        ('"before", alpha', '"before", offset = "90 deg", alpha', "partner.offset"),
        ('"after", alpha = "12 deg", inertia = "0.02', '"after", alpha = "12 deg", inertia = "0.03', "partner.inertia"),
    ],
)
def test_a_shaft_entered_twice_must_not_contradict_itself(tmp_path, old, new, keys):
    text = STUDY.read_text()
    first, second = text.split('name = "second"')
    unlike = first.replace('"after", alpha = "12', '"after", alpha = "8'), second.replace("12 deg", "8 deg", 1)
    (tmp_path / "a.toml").write_text('name = "second"'.join(unlike))
    assert study.load(tmp_path / "a.toml").points[1].operation.alpha == np.radians(8.0)
    assert old in text
    (tmp_path / "a.toml").write_text(text.replace(old, new))
    with pytest.raises(InputError) as caught:
        study.load(tmp_path / "a.toml")
    assert (
        f"operation: 'first' and 'second' are the two joints of a shaft, and contradict each other in {keys}\n"
        "  hint: give both the same, each alpha as the other's partner.alpha"
    ) in str(caught.value)
    assert len(caught.value.faults) == 1
