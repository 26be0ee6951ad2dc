"""Duty cycles from measured signals: damage against the Miner sum of the samples, visits, the study, its fatigue."""

from __future__ import annotations

import math
import runpy

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.conftest import ROOT
from tests.study.test_signals import write
from tolstat import study
from tolstat.cli import app
from tolstat.study import spectrum as spectra

SIGNAL = ROOT / "studies" / "drive_cycle.csv"
RPM = np.pi / 30


def steps(*each, rate=100.0):
    """Signal of steps: seconds, torque (N m), speed (rpm), misalignment (deg)."""
    rows = np.repeat(np.array([own[1:] for own in each], float), [round(own[0] * rate) for own in each], axis=0)
    return np.arange(len(rows)) / rate, rows[:, 0], rows[:, 1] * RPM, np.radians(rows[:, 2])


def test_steps_become_points_with_their_shares_and_visits():
    low, high, back = (30, 100, 600, 10), (10, 400, 300, 15), (10, -200, 600, 10)
    found = spectra.duty_cycle(*steps(low, high, low, (20, 50, 0, 10), back, high, (1, 0, 600, 10)), 3.0)
    turns = {100: 600, 400: 100, -200: 100}
    total = sum(abs(torque) ** 3 * n for torque, n in turns.items())
    assert dict(zip(found.torque.round(6).tolist(), found.damage, strict=True)) == pytest.approx(
        {torque: abs(torque) ** 3 * n / total for torque, n in turns.items()}, rel=2e-3
    )
    order = np.argsort(found.torque)
    assert np.degrees(found.alpha[order]).round(6).tolist() == [10, 10, 15]
    np.testing.assert_allclose(found.speed[order] / RPM, [600, 600, 300])
    np.testing.assert_allclose(found.time[order], [10 / 91, 60 / 91, 20 / 91], rtol=2e-3)
    # the signal goes from 400 to -200 and to 0, the visits from 400 to -200 and to 100
    assert found.changes == pytest.approx((600**3 + 300**3) / (600**3 + 400**3))
    assert found.standing == pytest.approx(20 / 111, rel=2e-3)
    assert [found.torque[visit].round() for visit in found.visits] == [100, 400, 100, -200, 400]
    assert found.turns == pytest.approx(800, rel=2e-3)


@pytest.mark.parametrize("m", [3.0, 5.0])
def test_damage_is_the_miner_sum_of_the_samples(m):
    rng = np.random.default_rng(1)
    n = 20_000
    time, torque = np.cumsum(rng.uniform(0.05, 0.15, n)), np.cumsum(rng.normal(size=n)) + 100.0
    speed, alpha = rng.uniform(20.0, 200.0, n), rng.uniform(0.1, 0.3, n)
    found = spectra.duty_cycle(time, torque, speed, alpha, m)
    weight = 0.5 * (np.append(np.diff(time), 0) + np.append(0, np.diff(time)))
    whole = np.sum(np.abs(torque) ** m * weight * speed)
    points = np.abs(found.torque) ** m * found.time * weight.sum() * found.speed
    assert len(points) <= spectra.MOST
    np.testing.assert_allclose(points / whole, found.damage)
    assert spectra.COVERED <= found.damage.sum() <= 1.0 + 1e-12


def test_of_many_visits_those_with_the_largest_changes_of_the_torque_stay():
    small, large = [(2, 100, 600, 10), (2, 140, 600, 10)], (2, 400, 600, 10)
    found = spectra.duty_cycle(*steps(*[*small * 300, large] * 3, rate=20.0), 3.0)
    assert len(found.visits) <= spectra.VISITS
    assert found.torque[found.visits].round().tolist().count(400) == 3
    assert found.left_out > 1000


def test_short_visits_are_none():
    found = spectra.duty_cycle(*steps((10, 100, 600, 10), (0.05, 300, 600, 10), (10, 100, 600, 10)), 3.0)
    assert len(found.torque) == 2
    assert len(set(found.visits.tolist())) == 1


def test_a_signal_without_torque_has_no_duty_cycle():
    with pytest.raises(ValueError, match="no torque"):
        spectra.duty_cycle(*steps((10, 0, 600, 10), (10, 90, 0, 10)), 3.0)


def new(*args):
    return CliRunner().invoke(app, ["new", *map(str, args)])


def test_the_study_runs_as_it_stands_and_keeps_what_its_base_says(tmp_path):
    path, base = tmp_path / "cycle.toml", ROOT / "studies" / "duty_cycle.toml"
    done = new(path, "--signal", SIGNAL)
    assert done.exit_code == 0
    assert "damage by revolutions (exponent 3)" in done.stderr.replace("\n    ", " ")
    made = study.load(path)
    assert len(made.points) == len(done.stdout.splitlines()) - 1 <= 12
    assert sum(point.share for point in made.points) == pytest.approx(1.0, abs=1e-8)
    assert set(made.fatigue.visits) <= {point.name for point in made.points}
    assert made.output.histories == "cycles"
    text = base.read_text().replace('"cross*.F at drive" = "2.5 kN"\n', "")
    (tmp_path / "base.toml").write_text(text)
    again = tmp_path / "again.toml"
    assert new(again, "--signal", SIGNAL, "--base", tmp_path / "base.toml", "--exponent", 5).exit_code == 0
    again = study.load(again)
    assert (again.fatigue.starts, again.sampling.n, again.fatigue.points[0].name) == (2e4, 512, "weld corner, fork1")
    assert again.fatigue.visits


def test_nothing_is_written_of_a_signal_or_a_base_with_faults(tmp_path):
    path, signal = tmp_path / "cycle.toml", tmp_path / "signal.csv"
    n = np.arange(20.0)
    write(signal, "time [s],torque [N*m]", n, n)
    done = new(path, "--signal", signal)
    assert done.exit_code == 2
    assert "signal.csv:2: has no column 'speed', 'alpha'" in done.stderr
    assert "add the headers speed [rpm], alpha [deg]" in done.stderr
    base = ROOT / "studies" / "duty_cycle.toml"  # has limits at a point of its own
    done = new(path, "--signal", SIGNAL, "--base", base)
    assert done.exit_code == 2
    assert "no operating point 'drive'" in done.stderr
    assert not path.exists()


def test_the_signal_of_studies_is_made_by_the_script(tmp_path, monkeypatch):
    made = runpy.run_path(str(ROOT / "data" / "drive_cycle.py"))
    monkeypatch.setattr("sys.argv", ["drive_cycle.py", str(tmp_path / "a.csv"), "--minutes", "10", "--rate", "5"])
    made["main"]()
    assert (tmp_path / "a.csv").read_text() == SIGNAL.read_text()
    assert "not measured" in SIGNAL.read_text().partition("\n")[0]


def test_a_pause_of_the_logger_is_no_driven_time(tmp_path):
    time, torque, speed, alpha = steps((60, 100, 600, 10), (1, 400, 300, 10), (60, 100, 600, 10), rate=10.0)
    paused = time + np.where(np.arange(len(time)) > 605, 8 * 3600.0, 0.0)
    without, found = (spectra.duty_cycle(t, torque, speed, alpha, 3.0) for t in (time, paused))
    # the samples beside the pause, of 0.1 s each, have half of their time
    np.testing.assert_allclose(found.time, without.time, atol=0.1 / 121)
    assert found.time.min() < 0.01
    path = tmp_path / "signal.csv"
    write(path, "time [s],torque [N*m],speed [rpm]", paused, torque, speed / RPM)
    done = new(tmp_path / "cycle.toml", "--signal", path, "--alpha", "10 deg")
    assert done.exit_code == 0
    told = " ".join(done.stderr.split())
    assert "signal.csv:609: gap of 28800.1 s after the time 60.5 s, which is not counted" in told
    made = study.load(tmp_path / "cycle.toml")
    assert min(point.share for point in made.points) < 0.01
    assert {round(math.degrees(point.operation.alpha), 6) for point in made.points} == {10.0}


def test_a_misalignment_is_given_once(tmp_path):
    path, signal = tmp_path / "cycle.toml", tmp_path / "signal.csv"
    n = np.arange(20.0)
    write(signal, "time [s],torque [N*m],speed [rpm]", n, n, n)
    done = new(path, "--signal", signal)
    assert 'add the headers alpha [deg], or give --alpha "9 deg"; there are time, torque, speed' in done.stderr
    for angle in ("9", "90 deg", "9 mm"):
        done = new(path, "--signal", signal, "--alpha", angle)
        assert done.exit_code == 2
        assert "--alpha" in done.stderr
    done = new(path, "--signal", SIGNAL, "--alpha", "9 deg")
    assert "alpha: is there and given, too" in done.stderr
    assert new(path, "--alpha", "9 deg").exit_code == 2
    assert not path.exists()
