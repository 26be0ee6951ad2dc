"""Zones of position, direction and coaxiality: moments in closed form, geometry after `perturb`, what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tests.support.synthetic import HEAD
from tolstat import sampling, study
from tolstat.common.cardan import CARDAN, HOLE_OF_PIN
from tolstat.common.errors import InputError
from tolstat.common.mechanism import features
from tolstat.joint.bodies import ARM_TRIADS, PIN_TRIADS
from tolstat.joint.perturbation import perturb
from tolstat.study import Study, axes
from tolstat.study.tolerances.entry import meanings

PINS, HOLES = features(CARDAN)[:4], features(CARDAN)[4:]
OVER = 22e-3
POSITION = 'position" = { zone = "⌀0.1 mm", over = "22 mm", distribution = "%s" }\n'
DIRECTION = '%s" = { zone = "⌀0.04 mm", over = "20 mm", distribution = "%s" }\n'
COMMON = '"%s.position" = { zone = "⌀0.1 mm", over = "180 mm", distribution = "normal", truncate = false }\n'
COAXIAL = '"%s.coaxiality" = { zone = "⌀0.02 mm", over = "22 mm", distribution = "uniform" }\n'

Make = Callable[..., Study]


@pytest.fixture
def make(tmp_path: Path) -> Make:
    def made(*entries: str, n: int = 20_000, method: str = "random", more: str = "") -> Study:
        text = f'{HEAD}[tolerances]\n{"".join(entries)}[sampling]\nmethod = "{method}"\nn = {n}\n{more}'
        (tmp_path / "study.toml").write_text(text, encoding="utf-8")
        return study.load(tmp_path / "study.toml")

    return made


def _std(errors: np.ndarray, name: str) -> float:
    return float(np.sqrt(np.mean(errors[name][1:] ** 2)))


@pytest.mark.parametrize(
    ("kind", "sigma"),
    [
        ("uniform", 0.05e-3 / 2),  # of a coordinate of a point that is uniform by area in a circle: radius / 2
        ('normal", truncate = false, cp = "1.5', 0.1e-3 / 9),
        # truncated at 3 sigma: sigma^2 (1 - (9/2) / (e^(9/2) - 1))
        ("normal", 0.1e-3 / 6 * np.sqrt(1 - 4.5 / np.expm1(4.5))),
    ],
)
def test_moments_of_a_position(make: Make, kind: str, sigma: float) -> None:
    s = make('"pin1.' + POSITION.replace('"%s"', f'"{kind}"').replace('"1.5"', "1.5"))
    errors = sampling.draw(s)
    ends = sigma / np.sqrt(2), np.sqrt(2) * sigma / OVER
    for name, expected in zip(("offset_t", "offset_z", "tilt_t", "tilt_z"), np.repeat(ends, 2), strict=True):
        assert _std(errors, f"pin1.{name}") == pytest.approx(expected, rel=0.03)
    np.testing.assert_allclose(meanings(s.entries)["sigma"], ends, rtol=1e-4)
    moved = {name for name in errors.dtype.names if np.ptp(errors[name]) > 0}
    assert moved == {"pin1.offset_t", "pin1.offset_z", "pin1.tilt_t", "pin1.tilt_z"}


def _ends(point: np.ndarray, axis: np.ndarray, e: np.ndarray, half: float) -> np.ndarray:
    """Where an axis passes the planes at -half and +half along e, without the part along e; (2, n, 3)."""
    steps = np.multiply.outer([-half, half], np.ones(len(point))) - point @ e
    at = point + (steps / (axis @ e))[..., None] * axis
    return np.asarray(at - np.multiply.outer(at @ e, e))


@pytest.mark.parametrize("second", ["", '"*.' + DIRECTION % ("perpendicularity", "normal")])
@pytest.mark.parametrize("kind", ["normal", "uniform"])
def test_the_whole_axis_is_in_its_zone(make: Make, kind: str, second: str) -> None:
    s = make('"*.' + POSITION % kind, second, n=500)
    params = perturb(s.joint, s.operation, sampling.draw(s))
    for i in range(4):
        for name, triads in (("pin", PIN_TRIADS), ("hole", ARM_TRIADS)):
            row = i if name == "pin" else HOLE_OF_PIN.index(i + 1)
            point, axis = params[f"{name}_point"][1:, row], params[f"{name}_axis"][1:, row]
            far = np.linalg.norm(_ends(point, axis, triads[i, 0], OVER / 2), axis=2)
            assert 0.9 * 5e-5 < far.max() <= 5e-5 * (1 + 1e-9)
            tilt = np.arccos(np.minimum(axis @ triads[i, 0], 1.0)).max()
            assert tilt <= (0.04 / 20 if second else 0.1 / 22) * (1 + 1e-6)


def test_direction_bounds_the_tilt_or_one_component(make: Make) -> None:
    plane = '"hole1.angularity" = { zone = "0.04 mm", over = "20 mm", distribution = "uniform", about = "%s" }\n'
    errors = sampling.draw(make('"pin1.' + DIRECTION % ("perpendicularity", "uniform"), plane % "z"))
    tilt = np.tan(np.hypot(errors["pin1.tilt_t"], errors["pin1.tilt_z"]))[1:]
    assert stats.kstest((tilt / 2e-3) ** 2, stats.uniform.cdf).pvalue > 0.01
    assert not np.any(errors["hole1.tilt_t"])
    assert stats.kstest(np.tan(errors["hole1.tilt_z"][1:]), stats.uniform(-2e-3, 4e-3).cdf).pvalue > 0.01
    about_t = sampling.draw(make(plane % "t"))
    assert np.ptp(about_t["hole1.tilt_t"]) > 3e-3
    assert not np.any(about_t["hole1.tilt_z"])


def _features(params: np.ndarray, pair: str, reach: float) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Point, axis and e of both features of a pair in axes of their common frame."""
    found = []
    for feature in axes.PAIRS[pair]:
        kind, i = feature[:-1], int(feature[-1]) - 1
        e = (PIN_TRIADS if kind == "pin" else ARM_TRIADS)[i, 0]
        row = i if kind == "pin" else HOLE_OF_PIN.index(i + 1)
        found.append((params[f"{kind}_point"][1:, row] + reach * e, params[f"{kind}_axis"][1:, row], e))
    return found


def test_pairs_are_features_on_one_axis() -> None:
    for pair, own in axes.PAIRS.items():
        first, second = ((PIN_TRIADS if name in PINS else ARM_TRIADS)[int(name[-1]) - 1] for name in own)
        np.testing.assert_array_equal(second, first * [[-1], [-1], [1]], err_msg=pair)
        assert first[0].sum() == 1
    assert sorted(name for own in axes.PAIRS.values() for name in own) == sorted(PINS + HOLES)


@pytest.mark.parametrize("pair", list(axes.PAIRS))
@pytest.mark.parametrize("second", ["", "perpendicularity", "alone"])
def test_both_features_of_a_common_axis_are_collinear(make: Make, pair: str, second: str) -> None:
    direction = f'"{pair}.' + DIRECTION % ("perpendicularity", 'normal", truncate = false, cp = "1')
    direction = direction.replace('"1"', "1").replace("20 mm", "90 mm")
    s = make(COMMON % pair if second != "alone" else "", direction if second else "", n=300)
    params = perturb(s.joint, s.operation, sampling.draw(s))
    (p1, a1, _), (p2, a2, _) = _features(params, pair, s.joint.cross.R)
    line = (p1 - p2) / np.linalg.norm(p1 - p2, axis=1)[:, None]
    assert np.abs(np.cross(line, a1)).max() < 1e-15
    assert np.abs(np.cross(line, a2)).max() < 1e-15
    assert (np.einsum("ni,ni->n", a1, a2) < 0).all()
    assert np.linalg.norm(np.cross(line, [1.0, 0, 0] if pair.startswith("input") else [0, 1.0, 0]), axis=1).max() > 1e-4
    if second == "alone":  # the axis turns about the joint's centre
        assert np.abs(p1 + p2).max() < 1e-17


def test_coaxiality_turns_both_features_against_the_line_through_their_middles(make: Make) -> None:
    s = make(COMMON % "input_holes", COAXIAL % "input_holes", n=2000)
    errors = sampling.draw(s)
    (p1, a1, _), (p2, a2, _) = _features(perturb(s.joint, s.operation, errors), "input_holes", s.joint.cross.R)
    line = (p1 - p2) / np.linalg.norm(p1 - p2, axis=1)[:, None]
    angles = [np.linalg.norm(np.cross(line, axis), axis=1) for axis in (a1, a2)]
    for angle in angles:
        assert stats.kstest((angle / (0.02 / 22)) ** 2, stats.uniform.cdf).pvalue > 0.01
    assert abs(np.corrcoef(*angles)[0, 1]) < 0.08
    assert _std(errors, "hole2.tilt_z") == pytest.approx(
        float(np.sqrt((meanings(s.entries)["sigma"].iloc[[1, 2]] ** 2).sum())), rel=0.05
    )


MANY = (
    *('"pin[12].' + POSITION % "uniform", '"pin[34].' + POSITION % "normal"),
    '"pin[34].' + DIRECTION % ("perpendicularity", "uniform"),
    COMMON % "output_holes",
    COAXIAL % "output_holes",
    '"input_holes.'
    + (DIRECTION % ("angularity", "normal")).replace("⌀0.04 mm", "0.04 mm").replace(" }", ', about = "t" }'),
    '"pin1.offset_e" = { plus_minus = "0.1 mm", distribution = "normal" }\n',
)


def test_what_is_drawn_is_found_again_in_the_errors(make: Make) -> None:
    s = make(*MANY, n=1000)
    errors = sampling.draw(s)
    for name, distribution in s.tolerances.items():
        values = sampling.values(s, errors, name)[1:]
        u = np.array([distribution.ppf(np.linspace(0.0005, 0.9995, 1000))])[0]
        assert stats.ks_2samp(values, u).pvalue > 1e-3, name
    scores = sampling.normal_scores(s, errors[1:])
    assert len(scores) == len(sampling.streams(s)) == 26
    matrix = np.corrcoef(list(scores.values())) - np.eye(26)
    assert np.abs(matrix).max() < 0.15
    for name, own in scores.items():
        assert stats.kstest(own, stats.norm.cdf).pvalue > 1e-3, name


def test_zones_leave_other_draws_as_they_are(make: Make) -> None:
    one = sampling.draw(make(MANY[-1], n=100))["pin1.offset_e"]
    np.testing.assert_array_equal(sampling.draw(make(*MANY, n=100))["pin1.offset_e"], one)


def test_scores_give_the_same_errors(make: Make) -> None:
    s = make(*MANY, n=200)
    again = sampling.from_scores(s, sampling.scores(s, range(200)))
    for name in again.dtype.names:
        np.testing.assert_allclose(again[name], sampling.draw(s)[1:][name], rtol=1e-8, atol=1e-14)


PLACED, TURNED = '"pin1.' + POSITION % "normal", '"pin1.' + DIRECTION % ("perpendicularity", "normal")
TILTED = '"pin1.tilt_t" = { plus_minus = "1 deg", distribution = "normal" }\n'
TIED = '[[correlation]]\nbetween = ["pin*.position"]\nrho = 0.5\n'


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (PLACED.replace("⌀", ""), 'must say that it is a diameter.*write "⌀0.1 mm"'),
        (PLACED.replace('"normal"', '"uniform", cp = 1.0'), "no effect on a uniform distribution"),
        (TURNED.replace("⌀", ""), 'add about = "t" or "z"'),
        (TURNED.replace(" }", ', about = "t" }'), "about has no effect"),
        (PLACED + TILTED, "pin1.tilt_t is set by tolerances.pin1.position already"),
        ('"hole2.' + POSITION % "normal" + COMMON % "input_holes", "hole2.tilt_z is set by"),
        (TURNED + TURNED.replace("perpendicularity", "angularity"), "pin1.tilt_z is set by"),
        (PLACED + TURNED.replace("0.04", "0.2"), "⌀0.2 mm is larger than the position's zone, ⌀0.1 mm"),
        (PLACED + TURNED.replace("20 mm", "2 mm"), "allows a tilt of 1.15 deg, the position only 0.26 deg"),
        (PLACED + TURNED.replace(" }", ", truncate = false }"), "has parts outside its zone"),
        (PLACED + TURNED.replace("⌀", "").replace(" }", ', about = "t" }'), "is between planes beside a position"),
        (PLACED.replace("position", "coaxiality"), "selects nothing"),
        (PLACED.replace("pin1", "pin*") + TIED, "is a zone: it cannot"),
        ('"pin1.position" = "⌀0.1 mm"\n', "is not a tolerance.*over = "),
    ],
)
def test_zones_that_cannot_be(make: Make, text: str, found: str) -> None:
    with pytest.raises(InputError, match="(?s)" + found):
        make(text, n=10)


def test_a_pattern_selects_pairs_by_their_underscore_only(make: Make) -> None:
    s = make('"*.' + POSITION % "normal", n=1)
    assert [site.name for entry in s.entries for site, _ in entry.models] == [
        f"{name}.position" for name in PINS + HOLES
    ]
    s = make(COMMON % "*_holes", n=1)
    assert [site.name for entry in s.entries for site, _ in entry.models] == [
        "input_holes.position",
        "output_holes.position",
    ]


@pytest.mark.parametrize("bounded", ["", ", truncate = false"])
@pytest.mark.parametrize("name", ["pin2", "output_holes"])
def test_meaning_has_the_deviations_of_the_draws(make: Make, name: str, bounded: str) -> None:
    place = f'"{name}.position" = {{ zone = "⌀0.3 mm", over = "160 mm", distribution = "normal"{bounded} }}\n'
    turn = f'"{name}.angularity" = {{ zone = "⌀0.2 mm", over = "120 mm", distribution = "normal"{bounded} }}\n'
    for entries in ((place,), (turn,), (place, turn)):
        s = make(*entries)
        errors = sampling.draw(s)
        parts = [part for entry in s.entries for site, model in entry.models for part in model.meaning(site)]
        assert {own.partition("_")[0] for part in parts for own in part.errors} >= {f"{first_of(name)}.tilt"}
        for part in parts:
            for column in part.errors:
                assert _std(errors, column) == pytest.approx(part.sigma, rel=0.03), (entries, column)


@pytest.mark.parametrize("about", ["t", "z"])
@pytest.mark.parametrize("name", ["pin2", "output_holes"])
def test_meaning_of_two_planes_names_the_errors_that_are_drawn(make: Make, name: str, about: str) -> None:
    s = make(
        f'"{name}.angularity" = {{ zone = "0.2 mm", over = "120 mm", distribution = "normal", about = "{about}" }}\n'
    )
    errors = sampling.draw(s)
    parts = [part for entry in s.entries for site, model in entry.models for part in model.meaning(site)]
    told = {column: part.sigma for part in parts for column in part.errors}
    assert set(told) == {column for column in errors.dtype.names if np.ptp(errors[column]) > 0}
    for column, sigma in told.items():
        assert _std(errors, column) == pytest.approx(sigma, rel=0.03), column


def first_of(name: str) -> str:
    """First feature of a pair, or the feature."""
    return axes.PAIRS.get(name, (name,))[0]
