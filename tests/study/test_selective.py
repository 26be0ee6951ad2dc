"""Selective assembly: shares of classes against closed forms, diameters against parts that are measured and sorted."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy import integrate, stats

from tests.support.synthetic import HEAD
from tolstat import sampling, study
from tolstat.common.errors import InputError
from tolstat.study import Study, subset_of
from tolstat.study.selective import DIAMETERS, Matching, matching

SIGMA, GAUGE = 5e-6, 2e-6
NORMAL = (
    '"pin*.diameter" = { lower = "-0.030 mm", upper = "0 mm", distribution = "normal" }\n'
    '"hole*.diameter" = { lower = "0 mm", upper = "0.030 mm", distribution = "normal" }\n'
)
UNIFORM = NORMAL.replace("normal", "uniform")
TILT = '"pin1.tilt_z" = { plus_minus = "0.1 deg", distribution = "normal" }\n'


def made(classes: int = 3, gauge: str = "2 um", split: str = "width", entries: str = NORMAL, more: str = "") -> Study:
    own = f'selective = {{ classes = {classes}, gauge = "{gauge}", split = "{split}" }}\n' if classes else ""
    text = f"{HEAD}[tolerances]\n{TILT}{entries}[sampling]\nn = 40000\nseed = 5\nnominal_first = false\n{own}{more}"
    return study.load(Path("study.toml"), text=text)


def classes_of(plan: Study) -> Matching:
    assert plan.sampling.selective is not None
    return matching(plan.sampling.selective, plan.entries, plan.tolerances)


@pytest.mark.parametrize(("gauge", "sigma"), [("0 um", SIGMA), ("2 um", float(np.hypot(SIGMA, GAUGE)))])
def test_shares_of_normal_diameters_are_those_of_the_largest_pin_and_the_smallest_hole(gauge, sigma):
    found = classes_of(made(gauge=gauge))
    below = stats.norm.cdf([-np.inf, -5e-6, 5e-6, np.inf], scale=sigma)
    np.testing.assert_allclose(found.shares[0], np.diff(below**4), atol=2e-6)
    for fork in (1, 2):
        np.testing.assert_allclose(found.shares[fork], -np.diff((1.0 - below) ** 2), atol=2e-6)
    assert found.unmatched == pytest.approx(1.0 - found.shares.min(axis=0).sum())
    np.testing.assert_allclose(found.edges[0, 1:-1], [-20e-6, -10e-6])


def test_shares_of_uniform_diameters_with_a_gauge_are_those_of_an_integral():
    found = classes_of(made(5, entries=UNIFORM))
    for c, edge in enumerate(found.edges[1, 1:-1]):
        below = integrate.quad(lambda d, e=edge: stats.norm.cdf((e - d) / GAUGE) / 30e-6, 0.0, 30e-6)[0]
        assert found.shares[1, : c + 1].sum() == pytest.approx(1.0 - (1.0 - below) ** 2, abs=2e-5)


@pytest.mark.parametrize("gauge", ["0 um", "2 um"])
def test_classes_of_equally_many_parts_leave_none_unmatched(gauge):
    found = classes_of(made(4, gauge, "count"))
    np.testing.assert_allclose(found.shares, 0.25, atol=1e-9)
    assert found.unmatched == 0.0


@pytest.mark.parametrize(("gauge", "split", "entries"), [("2 um", "width", NORMAL), ("0 um", "count", UNIFORM)])
def test_diameters_are_those_of_parts_that_are_measured_and_sorted(gauge, split, entries):
    plan = made(3, gauge, split, entries)
    found, errors, rng = classes_of(plan), sampling.draw(plan), np.random.default_rng(1)
    weights, error = found.matched / found.matched.sum(), GAUGE if gauge == "2 um" else 0.0
    for kind, (names, worst) in enumerate(((DIAMETERS[:4], np.max), (DIAMETERS[4:6], np.min))):
        parts = np.array([plan.tolerances[name].ppf(rng.random(200_000)) for name in names])
        measured = worst(parts + error * rng.standard_normal(parts.shape), axis=0)
        number = np.searchsorted(found.edges[kind, 1:-1], measured)
        drawn = np.array([errors[name] for name in names])
        for statistic in (lambda x: x[0], lambda x: x[-1], partial(worst, axis=0), lambda x: x[0] * x[-1] * 1e5):
            truth = sum(weights[c] * statistic(parts[:, number == c]).mean() for c in range(3))
            own = statistic(drawn)
            assert abs(own.mean() - truth) < 5.0 * own.std() / np.sqrt(own.size)


def test_joints_of_a_class_have_pins_and_holes_of_it():
    plain, sorted_ = (sampling.draw(made(k, "0 um", "count")) for k in (0, 5))
    largest, smallest = sorted_["pin1.diameter"], sorted_["hole1.diameter"]
    for name in DIAMETERS[1:4]:
        largest = np.maximum(largest, sorted_[name])
    smallest = np.minimum(smallest, sorted_["hole2.diameter"])
    found = classes_of(made(5, "0 um", "count"))
    of_cross, of_fork = (np.searchsorted(found.edges[k, 1:-1], x) for k, x in ((0, largest), (1, smallest)))
    np.testing.assert_array_equal(of_cross, of_fork)
    assert np.bincount(of_cross).min() > 7600
    np.testing.assert_array_equal(plain["pin1.tilt_z"], sorted_["pin1.tilt_z"])


def test_a_joint_depends_on_the_seed_and_its_number_alone():
    plan = made()
    whole = sampling.draw(plan)
    for rows in (range(11), range(11, 4097), range(39_000, 40_000)):
        np.testing.assert_array_equal(sampling.draw(plan, rows), whole[rows.start : rows.stop])


def test_one_class_is_no_sorting_and_no_part_of_the_identity():
    one, plain = made(1), made(0)
    assert sampling.draw(one).tobytes() == sampling.draw(plain).tobytes()
    assert one.identity() == plain.identity()
    assert made(3).identity()["sampling.selective.classes"] == 3


def test_faults():
    faults = {
        "have different tolerances": {"entries": NORMAL.replace("pin*", "pin[123]") + '"pin4.diameter" = '
                                      '{ plus_minus = "0.01 mm", distribution = "normal" }\n'},
        "hole1.diameter has no tolerance": {"entries": NORMAL.splitlines()[0] + "\n"},
        "has no band": {"entries": NORMAL.replace('lower = "-0.030 mm", upper = "0 mm"', 'std = "5 um"')},
        "depends on other parts": {"more": '[[correlation]]\nbetween = ["pin1.diameter", "pin1.tilt_z"]\nrho = 0.5\n'},
        "selective is given with 'sobol'": {"more": 'method = "sobol"\n'},
        "must not be negative": {"gauge": "-2 um"},
    }  # fmt: skip
    for said, given in faults.items():
        with pytest.raises(InputError, match=said):
            made(**given)
    with pytest.raises(InputError, match="free scores"):
        sampling.from_scores(made(), np.zeros((1, 9)))
    fields = {"load": "cross1.F", "levels": {"cross1.F": 700.0}, "per_level": 100, "p0": 0.1, "unresolved": "below"}
    with pytest.raises(InputError, match="does not draw"):
        subset_of(made(), fields)
