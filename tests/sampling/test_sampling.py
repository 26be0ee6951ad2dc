"""Draws: what they depend on and what they do not, and that they follow the study's distributions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from tests.support.synthetic import HEAD
from tolstat import sampling, study
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.common.tables import tables
from tolstat.study import Study

BASE = (
    HEAD
    + """[errors]
hole2.tilt_t = "0.2 deg"
"""
)
OFFSET = '"pin1.offset_t" = { plus_minus = "0.1 mm", distribution = "normal" }\n'
DIAMETER = '"pin*.diameter" = { lower = "-0.02 mm", upper = "0 mm", distribution = "uniform" }\n'
TORQUE = '"operation.torque" = { plus_minus = "30 N*m", distribution = "triangular" }\n'
PAIR = '[[correlation]]\nbetween = ["pin1.offset_t", "pin1.diameter"]\nrho = 0.7\n'


Make = Callable[..., Study]


@pytest.fixture(scope="module")
def make(tmp_path_factory: pytest.TempPathFactory) -> Make:
    path = tmp_path_factory.mktemp("studies") / "study.toml"

    def made(*entries: str, n: int = 64, seed: int = 1, more: str = "") -> Study:
        table = "[tolerances]\n" + "".join(entries)
        text = f"{BASE}{table}[sampling]\nn = {n}\nseed = {seed}\n{more}"
        path.write_text(text, encoding="utf-8")
        return study.load(path)

    return made


def test_rows(make: Make) -> None:
    s = make(OFFSET, DIAMETER, n=5)
    errors = sampling.draw(s)
    assert errors.dtype == tables(CARDAN).ERROR
    assert errors.shape == (s.rows,) == (6,)
    nominal = errors[0]
    assert all(nominal[f.name] == 0 for f in tables(CARDAN).error_fields if f.name[:3] in ("pin", "hol"))
    assert nominal["operation.torque"] == 0.0
    assert nominal["material.E_factor"] == 1.0
    assert (errors["hole2.tilt_t"][1:] == np.radians(0.2)).all()
    assert (errors["pin1.offset_t"][1:] != 0).all()
    assert (errors["pin1.offset_e"] == 0).all()
    bare = make(OFFSET, DIAMETER, n=5, more="nominal_first = false")
    np.testing.assert_array_equal(sampling.draw(bare), errors[1:])


@settings(deadline=None, max_examples=15)
@given(st.integers(1, 70), st.integers(1, 70), st.integers(0, 2**63 - 1))
def test_joint_i_does_not_depend_on_n(make: Make, n: int, more: int, seed: int) -> None:
    few = sampling.draw(make(OFFSET, DIAMETER, n=n, seed=seed))
    many = sampling.draw(make(OFFSET, DIAMETER, n=n + more, seed=seed))
    np.testing.assert_array_equal(few, many[: n + 1])


def test_random_numbers_of_a_level_are_the_same_in_parts(make: Make) -> None:
    s = make(OFFSET, DIAMETER)
    whole, parts = sampling.noise(s, 2, 0, 30), [sampling.noise(s, 2, first, 10) for first in (0, 10, 20)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert len(np.unique(np.concatenate([whole, sampling.noise(s, 1, 0, 30)]))) == 2 * whole.size


@pytest.mark.parametrize("first", [True, False])
def test_an_added_error_moves_nothing(make: Make, first: bool) -> None:
    alone = sampling.draw(make(OFFSET))
    entries = (TORQUE, DIAMETER, OFFSET) if first else (OFFSET, DIAMETER, TORQUE)
    among = sampling.draw(make(*entries))
    np.testing.assert_array_equal(alone["pin1.offset_t"], among["pin1.offset_t"])
    assert np.ptp(among["operation.torque"]) > 10


def test_errors_correlated_later_in_the_file_leave_the_earlier_ones(make: Make) -> None:
    before = sampling.draw(make(OFFSET, DIAMETER, more=PAIR))
    later = PAIR + '[[correlation]]\nbetween = ["pin2.diameter", "pin3.diameter"]\nrho = -0.4\n'
    after = sampling.draw(make(OFFSET, DIAMETER, more=later))
    for name in ("pin1.offset_t", "pin1.diameter"):
        np.testing.assert_allclose(before[name], after[name], rtol=1e-12, atol=1e-18)


def test_seeds_and_names_have_their_own_draws(make: Make) -> None:
    one, two = (sampling.draw(make(DIAMETER, seed=seed))[1:] for seed in (1, 2))
    assert (one["pin1.diameter"] != two["pin1.diameter"]).all()
    assert (one["pin1.diameter"] != one["pin2.diameter"]).all()
    again = sampling.draw(make(DIAMETER, seed=1))[1:]
    np.testing.assert_array_equal(one, again)


def test_random_draws_are_pinned(make: Make) -> None:
    """A change of these values would make old result files impossible to extend."""
    errors = sampling.draw(make(DIAMETER, seed=2021, n=3))
    expected = [0.0, -1.7385323986316745e-05, -6.375044964378682e-07, -5.418785420661975e-07]
    np.testing.assert_allclose(errors["pin1.diameter"], expected, rtol=1e-13)


def test_draws_follow_the_distributions(make: Make) -> None:
    errors = sampling.draw(make(OFFSET, DIAMETER, TORQUE, n=4096))[1:]
    for name, dist in [
        ("pin1.offset_t", stats.norm(0, 1e-4 / 3)),
        ("pin3.diameter", stats.uniform(-2e-5, 2e-5)),
        ("operation.torque", stats.triang(0.5, -30, 60)),
    ]:
        assert stats.kstest(errors[name], dist.cdf).pvalue > 0.01, name
    independent = np.corrcoef([errors[name] for name in ("pin1.offset_t", "pin3.diameter", "operation.torque")])
    assert np.abs(independent - np.eye(3)).max() < 0.05


def test_correlation_is_reproduced_and_margins_kept(make: Make) -> None:
    errors = sampling.draw(make(OFFSET, DIAMETER, n=8192, more=PAIR))[1:]
    scores = stats.norm.ppf((errors["pin1.diameter"] + 2e-5) / 2e-5)
    rho = np.corrcoef(errors["pin1.offset_t"], scores)[0, 1]
    assert rho == pytest.approx(0.7, abs=0.02)
    assert stats.kstest(errors["pin1.diameter"], stats.uniform(-2e-5, 2e-5).cdf).pvalue > 0.01
    other = np.corrcoef(errors["pin1.offset_t"], errors["pin2.diameter"])[0, 1]
    assert abs(other) < 0.04


def test_radial_offset_has_rayleigh_radius_and_uniform_direction(make: Make) -> None:
    radial = '"pin2.offset_radial" = { plus_minus = "0.3 mm", distribution = "rayleigh", truncate = true }\n'
    errors = sampling.draw(make(radial, n=4096))[1:]
    t, z = errors["pin2.offset_t"], errors["pin2.offset_z"]
    assert stats.kstest(np.arctan2(z, t), stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > 0.01
    radius = np.hypot(t, z)
    assert radius.max() <= 3e-4 * (1 + 1e-12)
    inside = stats.rayleigh(scale=1e-4)
    assert stats.kstest(radius, lambda r: inside.cdf(r) / inside.cdf(3e-4)).pvalue > 0.01
    assert (errors["pin2.offset_e"] == 0).all()


def test_sweep_is_a_grid(make: Make, tmp_path: Path) -> None:
    text = (
        BASE + '[sampling]\nmethod = "sweep"\n[sweep]\n'
        '"pin*.diameter" = { from = "0.1 mm", to = "-0.1 mm", points = 3 }\n'
        '"operation.alpha" = { from = "0 deg", to = "10 deg", points = 2 }\n'
    )
    (tmp_path / "sweep.toml").write_text(text, encoding="utf-8")
    errors = sampling.draw(study.load(tmp_path / "sweep.toml"))
    assert errors.size == 7
    np.testing.assert_allclose(errors["pin3.diameter"], [0, 1e-4, 1e-4, 0, 0, -1e-4, -1e-4], atol=1e-19)
    np.testing.assert_array_equal(errors["pin3.diameter"], errors["pin1.diameter"])
    np.testing.assert_allclose(np.degrees(errors["operation.alpha"]), [0, -15, -5, -15, -5, -15, -5])
    assert (errors["hole2.tilt_t"][1:] > 0).all()
    assert errors["hole2.tilt_t"][0] == 0


KINDS = (
    '"pin1.offset_t" = { plus_minus = "0.1 mm", distribution = "normal" }\n'
    '"pin2.offset_t" = { plus_minus = "0.1 mm", distribution = "normal", truncate = true }\n'
    '"pin3.offset_t" = { plus_minus = "0.1 mm", distribution = "uniform" }\n'
    '"pin4.offset_t" = { plus_minus = "0.1 mm", distribution = "triangular" }\n'
    '"hole1.offset_radial" = { plus_minus = "0.1 mm", distribution = "rayleigh" }\n'
    '"hole2.offset_t" = { plus_minus = "0.1 mm", distribution = "beta", a = 2, b = 5 }\n'
    '"hole3.offset_t" = { lower = "0.01 mm", upper = "0.1 mm", distribution = "lognormal", cpk = 1.0 }\n'
)
TIED = '[[correlation]]\nbetween = ["pin*.offset_t", "hole2.offset_t"]\nrho = 0.4\n'


def test_any_rows_are_those_of_the_whole(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    """Slices of a campaign and its continuation draw the same bits as one draw."""
    s = make(KINDS, n=997, more=TIED)
    whole = sampling.draw(s)
    for rows in (range(1), range(998), range(1, 2), range(5, 18), range(400, 998), range(997, 998), range(7, 7)):
        assert sampling.draw(s, rows).tobytes() == whole[rows.start : rows.stop].tobytes(), rows
    monkeypatch.setattr(sampling, "BLOCK", 64)
    blocks = list(sampling.draw_blocks(s, range(3, 900)))
    assert b"".join(block.tobytes() for block in blocks) == whole[3:900].tobytes()
    assert max(len(block) for block in blocks) == 64


def test_any_rows_of_a_sweep_and_of_a_list(tmp_path: Path) -> None:
    sweep = '"pin*.diameter" = { from = "-0.1 mm", to = "0.1 mm", points = 5 }\n"pin1.tilt_t" = { from = "0.2 deg", '
    bodies = {
        "sweep": f'[sweep]\n{sweep}to = "1 deg", points = 7 }}\n',
        "cases": '[grid]\n"operation.alpha" = ["0 deg", "9 deg"]\n[[case]]\nname = "a"\nerrors = { "pin1.offset_e" = '
        '"0.1 mm" }\n[[case]]\nname = "b"\nerrors = { "pin2.tilt_t" = "1 deg" }\n',
    }
    for method, body in bodies.items():
        path = tmp_path / f"{method}.toml"
        path.write_text(f'{HEAD}[sampling]\nmethod = "{method}"\n{body}', encoding="utf-8")
        s = study.load(path)
        whole = sampling.draw(s)
        assert len(np.unique(whole)) == s.rows
        parts = [sampling.draw(s, range(a, min(a + 4, s.rows))) for a in range(0, s.rows, 4)]
        assert np.concatenate(parts).tobytes() == whole.tobytes()


def test_a_slice_of_a_thousand_million_joints(make: Make) -> None:
    s = make(OFFSET, DIAMETER, n=10**9)
    errors = sampling.draw(s, range(10**9 - 2, 10**9 + 1))
    assert len(np.unique(errors)) == 3
    assert s.design[10**9]["variant"] == 0


@pytest.mark.parametrize("key", ['method = "sobol"', 'method = "lhs"', "replicates = 4"])
def test_joints_of_a_production_are_drawn_at_random_only(make: Make, key: str) -> None:
    with pytest.raises(InputError, match=rf"sampling\.{key.split()[0]}"):
        make(OFFSET, more=f"{key}\n")
