"""Maximum material requirement of a position: both rules against closed forms and against rejection part by part."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.special import ndtr

from tests.support.synthetic import HEAD
from tolstat import joint, sampling, study
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.common.mechanism import features
from tolstat.study import scaling
from tolstat.study.axes import Bonus
from tolstat.study.tolerances.distributions import Array, Distribution, Normal, Uniform
from tolstat.study.tolerances.entry import meanings
from tolstat.study.tolerances.zone_laws import Accepted

PINS, HOLES = features(CARDAN)[:4], features(CARDAN)[4:]

N = 4096
ZONE, OVER, HALF = 0.1e-3, 22e-3, 30e-6
"""Zone of the position and its length, and half the tolerance of the diameters, m."""
RADIUS = 0.5 * ZONE
SIZES = '"{}*.diameter" = {{ plus_minus = "0.03 mm", distribution = "{}" }}\n'
SINGLE = '"{}*.position" = {{ zone = "⌀0.1 mm{}", over = "22 mm", distribution = "{}"{} }}\n'


def load(rule: str, scatter: str = "normal", size: str = "normal", kind: str = "pin", rest: str = "") -> study.Study:
    text = SIZES.format(kind, size) + SINGLE.format(
        kind, "", scatter, f', material_condition = "{rule}"' if rule else ""
    )
    return read(text, rest)


def read(tolerances: str, rest: str = "") -> study.Study:
    sampled = f"[sampling]\nn = {N}\nseed = 4\n"
    return study.load(Path("x.toml"), text=f"{HEAD}\n[tolerances]\n{tolerances}\n{sampled}\n{rest}")


def faults(tolerances: str, rest: str = "") -> str:
    with pytest.raises(InputError) as caught:
        read(tolerances, rest)
    return str(caught.value)


def ends(loaded: study.Study, feature: str) -> tuple[Array, Array, Array]:
    """Error of the diameter, and both ends of the axis over the toleranced length, of all samples."""
    errors = sampling.draw(loaded)[1:]
    slope = np.array([np.tan(errors[f"{feature}.tilt_z"]), -np.tan(errors[f"{feature}.tilt_t"])])
    middle = np.array([errors[f"{feature}.offset_t"], errors[f"{feature}.offset_z"]])
    return errors[f"{feature}.diameter"], middle - 0.5 * OVER * slope, middle + 0.5 * OVER * slope


def bonus(kind: str, deviation: Array) -> Array:
    return HALF - deviation if kind == "pin" else deviation + HALF


@pytest.mark.parametrize("kind", ["pin", "hole"])
@pytest.mark.parametrize("rule", ["reject", "fills"])
@pytest.mark.parametrize("scatter", ["normal", "uniform"])
def test_all_parts_are_within_the_virtual_condition(kind: str, rule: str, scatter: str) -> None:
    loaded = load(rule, scatter, kind=kind)
    beyond = 0
    for feature in PINS if kind == "pin" else HOLES:
        deviation, *both = ends(loaded, feature)
        for end in both:
            radius = np.hypot(*end)
            assert (2.0 * radius <= ZONE + bonus(kind, deviation) + 1e-9).all()  # the slope is tan of a finite rotation
            beyond += int((radius > RADIUS).sum())
    if rule == "reject" and scatter == "uniform":
        assert beyond == 0
    else:
        assert beyond > 10


def test_offsets_that_fill_the_zone_grow_with_it() -> None:
    deviation, inner, outer = ends(load("fills", "uniform"), "pin1")
    # mean square of a coordinate in a circle of radius R is R^2/4; R = (zone + bonus)/2, bonus of mean HALF
    mean_square = 0.25 * 0.25 * ((ZONE + HALF) ** 2 + (HALF / 3.0) ** 2)
    for squares in (inner**2, outer**2):
        error = squares.std(axis=1) / math.sqrt(N)
        assert (np.abs(squares.mean(axis=1) - mean_square) < 4.0 * error).all()
    standard = np.hypot(*inner) / (0.5 * (ZONE + bonus("pin", deviation)))
    assert stats.kstest(standard**2, "uniform").pvalue > 1e-3
    assert abs(stats.spearmanr(standard, deviation).statistic) < 4.0 / math.sqrt(N)


def test_rejection_is_that_of_part_by_part() -> None:
    """Draw parts of the process, reject those outside, compare diameters and offsets with those of the study."""
    rng, many, cp = np.random.default_rng(5), 400_000, 0.5
    sigma = ZONE / (6.0 * cp)
    deviation = rng.normal(0.0, HALF / 3.0, many)
    radii = sigma * np.hypot(rng.standard_normal((2, many)), rng.standard_normal((2, many)))
    kept = (2.0 * radii <= ZONE + bonus("pin", deviation)).all(axis=0)
    text = SIZES.format("pin", "normal") + SINGLE.format("pin", " Ⓜ", "normal", f", cp = {cp}")
    loaded = read(text)
    drawn = [ends(loaded, pin) for pin in PINS]
    own = np.concatenate([d for d, _, _ in drawn])
    size = np.concatenate([np.hypot(*inner) for _, inner, _ in drawn])
    assert stats.ks_2samp(own, deviation[kept]).pvalue > 1e-3
    assert stats.ks_2samp(size, radii[0, kept]).pvalue > 1e-3
    assert stats.ks_2samp(own, deviation).pvalue < 1e-6  # accepted pins are thinner
    assert np.corrcoef(own, size)[0, 1] == pytest.approx(np.corrcoef(deviation[kept], radii[0, kept])[0, 1], abs=0.03)
    shares = {
        one.number: one for entry in loaded.entries for site, model in entry.models for one in model.meaning(site)
    }
    told = next(text for text in shares if "Ⓜ" in text)
    assert told == f"⌀0.1 mm Ⓜ, {100 * (1 - kept.mean()):.2g} % rejected"
    offset = next(one for one in shares.values() if one.number == told)
    middle = np.concatenate([0.5 * (inner + outer)[0] for _, inner, outer in drawn])
    found = meanings(loaded.entries).set_index("errors")["sigma"]
    assert found["offset_[tz]"] == pytest.approx(middle.std(), rel=0.03)
    assert offset.outside == 0.0


def test_share_of_rejected_parts_in_closed_form() -> None:
    sigma = RADIUS / 1.5
    own = Bonus("reject", "pin1.diameter", HALF, RADIUS, sigma)
    uniform = Accepted(Uniform(-HALF, HALF), own)
    # ends outside: exp(-(R + b/2)^2 / (2 sigma^2)) for a bonus b that is uniform from 0 to 2 HALF; both ends inside

    def mean_of(power: int) -> float:
        width = sigma / math.sqrt(power)
        reach = ndtr((RADIUS + HALF) / width) - ndtr(RADIUS / width)
        return float(math.sqrt(2.0 * math.pi) * width * reach / HALF)

    assert uniform.share == pytest.approx(1.0 - 2.0 * mean_of(1) + mean_of(2), rel=1e-6)


@pytest.mark.parametrize("every", [Normal(0.0, HALF / 3.0), Uniform(-HALF, HALF)])
def test_accepted_diameters_have_an_inverse(every: Distribution) -> None:
    own = Accepted(every, Bonus("reject", "hole1.diameter", -HALF, RADIUS, RADIUS / 1.5))
    u = np.linspace(0.01, 0.99, 981)
    x = own.ppf(u)
    np.testing.assert_allclose(own.cdf(x), u, rtol=1e-5)
    everything = Accepted(every, Bonus("reject", "hole1.diameter", -HALF, RADIUS, math.inf))
    tails = np.array([0.0, 1e-14, 1e-6, 0.3, 1 - 1e-6, 1.0])
    if isinstance(every, Uniform):  # no zone is smaller than that without bonus
        np.testing.assert_allclose(everything.ppf(tails), every.ppf(tails), rtol=0, atol=1e-10)
    assert (np.diff(own.ppf(tails)) > 0).all()


def test_a_process_within_the_zone_loses_no_part() -> None:
    bounded, free = load("reject", "uniform", "uniform"), load("", "uniform", "uniform")
    a, b = sampling.draw(bounded), sampling.draw(free)
    for name in a.dtype.names:
        np.testing.assert_allclose(a[name], b[name], rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize("rule", ["reject", "fills"])
def test_what_was_drawn_follows_from_the_errors(rule: str) -> None:
    loaded = load(rule)
    numbers = range(50)
    table = sampling.draw(loaded)[1:51]
    scores = sampling.normal_scores(loaded, table)
    plain = load("")
    expected = sampling.normal_scores(plain, sampling.draw(plain)[1:51])
    for end in ("inner", "outer"):
        for along in "tz":
            name = f"pin2.position_{end}_{along}"
            np.testing.assert_allclose(scores[name], expected[name], atol=1e-6)
    drawn = sampling.scores(loaded, numbers)[:, sampling.streams(loaded).index("pin2.diameter")]
    np.testing.assert_allclose(scores["pin2.diameter"], drawn, atol=1e-6)


def test_a_joint_does_not_depend_on_the_others() -> None:
    loaded = read(SIZES.format("pin", "normal") + SINGLE.format("pin", "(M)", "normal", ""))
    whole = sampling.draw(loaded)
    np.testing.assert_array_equal(whole[100:103], sampling.draw(loaded, range(100, 103)))
    assert joint.perturb(loaded.joint, loaded.operation, whole)["clearance"].min() > 0.0


def test_a_bonus_belongs_to_the_identity() -> None:
    kinds = [load(rule).identity() for rule in ("", "reject", "fills")]
    assert kinds[0] != kinds[1] != kinds[2] != kinds[0]
    short = SIZES.format("pin", "normal") + SINGLE.format("pin", "Ⓜ", "normal", "")
    assert read(short).identity() == kinds[1]


CORRELATED = '[[correlation]]\nbetween = ["pin*.diameter"]\nrho = 0.5\n'


@pytest.mark.parametrize(
    ("text", "rest", "words"),
    [
        (SINGLE.format("pin", "Ⓜ", "normal", ""), "", "the bonus needs the limits of pin1.diameter"),
        (
            '"pin*.diameter" = { std = "5 um", distribution = "normal" }\n' + SINGLE.format("pin", "Ⓜ", "normal", ""),
            "",
            "the bonus needs the limits of pin1.diameter",
        ),
        (SIZES.format("pin", "normal") + SINGLE.format("pin", "Ⓜ", "normal", ", truncate = false"), "", "truncate"),
        (SIZES.format("pin", "normal") + SINGLE.format("pin", "Ⓜ", "normal", ""), CORRELATED, "cannot be corr"),
        (
            '"input_holes.position" = { zone = "⌀0.1 mm Ⓜ", over = "22 mm", distribution = "normal" }',
            "",
            "the common axis of a pair has no diameter",
        ),
        (
            '"pin1.perpendicularity" = { zone = "⌀0.1 mm Ⓜ", over = "22 mm", distribution = "normal" }',
            "",
            "a bonus is modelled for the position of a pin or hole only",
        ),
    ],
)  # fmt: skip
def test_faults_of_a_bonus(text: str, rest: str, words: str) -> None:
    assert words in faults(text, rest)


def test_correlated_diameters_may_fill_their_zones() -> None:
    loaded = load("fills", rest=CORRELATED)
    assert loaded.copula.names == tuple(f"{pin}.diameter" for pin in PINS)


def test_scaling_leaves_position_and_diameter_out() -> None:
    assert scaling.tolerances(load("reject")) == []
