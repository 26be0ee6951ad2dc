"""Measured signals: orders that are known come back, what does not repeat is told, and every fault of a file."""

from __future__ import annotations

import math
import tomllib

import jsonschema
import numpy as np
import pytest

from tests.study.test_points import HEAD, ONE, REST, load
from tolstat.campaign.extend import extend
from tolstat.campaign.run import run
from tolstat.common.errors import InputError
from tolstat.store import ResultFile
from tolstat.study import schema as schemas
from tolstat.study import signals

SPEED = 150.0
WAVES = {1: (0.002, 0.3), 2: (0.01, 1.2), 5: (0.003, -2.0)}
"""Amplitude and phase of the input angle's waves, rad."""
SIGNAL = 'torque = { file = "engine.csv" } # measured'


def made(turns=7.3, begin=0.7, half=0.0, samples=6000):
    """Time, input angle, speed and torque; the shaft begins at a mean angle that is no whole revolution."""
    phase = begin + 2 * np.pi * np.linspace(0.0, turns, samples)
    angle = phase + sum(a * np.sin(n * phase + p) for n, (a, p) in WAVES.items())
    speed = SPEED * (1 + sum(n * a * np.cos(n * phase + p) for n, (a, p) in WAVES.items()))
    torque = 180 + 40 * np.cos(2 * phase + 0.5) + 5 * np.cos(6 * phase - 1) + half * np.cos(0.5 * phase)
    return phase / SPEED, angle, speed, torque


def write(path, head, *columns):
    rows = (",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True))
    path.write_text("# made\n" + head + "\n" + "\n".join(rows) + "\n")


def test_orders_of_speed_and_torque_come_back():
    time, angle, speed, torque = made()
    found = signals.orders(angle, time)
    assert found.mean == pytest.approx(SPEED, rel=1e-6)
    assert found.numbers.tolist() == list(WAVES)
    np.testing.assert_allclose(found.amplitudes / SPEED, [n * a for n, (a, _) in WAVES.items()], rtol=1e-5)
    np.testing.assert_allclose(found.phases, [p for _, p in WAVES.values()], atol=1e-4)
    found = signals.orders(angle, time, torque)
    assert (found.turns, found.mean) == (6, pytest.approx(180.0, rel=1e-6))
    np.testing.assert_allclose(found.amplitudes, [40.0, 5.0], rtol=1e-5)
    np.testing.assert_allclose(found.phases, [0.5, -1.0], atol=1e-4)
    assert found.unrepeated < 1e-8
    np.testing.assert_allclose(signals.orders(angle, time, speed).amplitudes / SPEED, [0.002, 0.02, 0.015], rtol=1e-5)


def test_half_orders_do_not_repeat():
    time, angle, _, torque = made(half=10.0)
    found = signals.orders(angle, time, torque)
    assert found.numbers.tolist() == [2, 6]
    assert found.unrepeated == pytest.approx(50.0 / (800.0 + 12.5 + 50.0), rel=1e-4)


def test_small_orders_are_left_out_and_sixteen_kept():
    angle = np.radians(np.arange(360.0))  # the sample at 360 deg is missing
    one = signals.orders(angle, angle, 100 * np.cos(angle) + 0.9 * np.cos(3 * angle))
    assert one.numbers.tolist() == [1]
    assert one.left_out == pytest.approx(0.81 / 10000.81, rel=1e-3)
    assert math.isnan(one.unrepeated)
    many = signals.orders(angle, angle, sum((30 - n) * np.cos(n * angle) for n in range(1, 21)))
    assert many.numbers.tolist() == list(range(1, 17))


@pytest.mark.parametrize("head", ["time [s],speed [rpm],torque [N*m]", "angle [deg],speed [rpm],torque [kN*m]"])
def test_a_study_takes_orders_from_a_file_and_keeps_them(tmp_path, head):
    time, angle, speed, torque = made(begin=0.0)
    first = time if head.startswith("time") else np.degrees(angle) % 720.0
    write(tmp_path / "engine.csv", head, first, speed * 30 / np.pi, torque / (1000.0 if "kN" in head else 1.0))
    text = ONE.replace('torque = "100 N*m"', SIGNAL).replace('speed = "500 rpm"', 'speed = { file = "engine.csv" }')
    study = load(tmp_path, text, REST)
    own = study.operation
    assert [order.n for order in own.speed_orders] == list(WAVES)
    assert [order.amplitude for order in own.torque_orders] == pytest.approx([40.0, 5.0], rel=1e-4)
    if head.startswith("angle"):
        np.testing.assert_allclose([order.phase for order in own.torque_orders], [0.5, -1.0], atol=1e-3)
    assert "6 revolutions: < 1e-07 % of the variance does not repeat" in study.notes[1]
    (tmp_path / "engine.csv").unlink()
    again = load(tmp_path, study.text.split("\n", 2)[2].split("[tolerances]")[0], REST)
    assert again.identity() == study.identity()
    assert "# measured" in study.text
    schema = jsonschema.Draft7Validator(schemas.schema("study"))
    assert [schema.is_valid(tomllib.loads(HEAD + own + REST)) for own in (text, text.replace("file", "fil"))] == [
        True,
        False,
    ]


def test_a_result_file_needs_no_signal(tmp_path):
    time, _, speed, torque = made()
    write(tmp_path / "engine.csv", "time [s],speed [rpm],torque [N*m]", time, speed * 30 / np.pi, torque)
    solver = '[solver]\nfidelity = "ideal"\nsteps_per_rev = 24\n'
    study = load(tmp_path, ONE.replace('torque = "100 N*m"', SIGNAL), REST.replace("n = 10", "n = 2"), solver)
    run(study, tmp_path / "a.h5", workers=1, check=False)
    (tmp_path / "engine.csv").unlink()
    with ResultFile.open(tmp_path / "a.h5") as file:
        assert [order.n for order in file.operation.torque_orders] == [2, 6]
        assert file.view().study.identity() == study.identity()
    assert not extend(tmp_path / "a.h5", 4).notes


def test_faults_of_a_signal_come_together(tmp_path):
    (tmp_path / "engine.csv").write_text("time,speed [kg],torque [N*m]\n0,1,2\n0,x,3\n")
    with pytest.raises(InputError) as caught:
        load(tmp_path, ONE.replace('torque = "100 N*m"', SIGNAL), REST, "[grid]\n")
    text = str(caught.value)
    for found in ("csv:1: time: has no unit", "csv:1: speed: [kg] is no unit", "csv:3: speed: 'x'", "2 rows below it"):
        assert found in text
    assert "study.toml" in text  # and the study's own


@pytest.mark.parametrize(
    ("table", "found"),
    [
        ('{ file = "engine.csv", mean = "1 N*m" }', "torque.mean: is given beside a file"),
        ("{ file = 3 }", "torque.file: is not a text"),
        ('{ file = "none.csv" }', "none.csv: cannot be read"),
        ('{ file = "engine.csv" }', "engine.csv: covers 0.5"),
    ],
)
def test_what_is_no_signal_is_refused(tmp_path, table, found):
    angle = np.linspace(0.0, 180.0, 91)
    write(tmp_path / "engine.csv", "angle [deg],torque [N*m]", angle, angle)
    with pytest.raises(InputError, match=found.replace("[", r"\[")):
        load(tmp_path, ONE.replace('torque = "100 N*m"', f"torque = {table}"), REST)


def test_signals_need_an_angle_and_a_speed_that_turns(tmp_path):
    path, n = tmp_path / "a.csv", np.arange(20.0)
    write(path, "time [s],torque [N*m]", n, n)
    with pytest.raises(InputError, match="has no angle"):
        signals.orders_of(path, "torque")
    write(path, "angle [deg],torque [N*m]", 30 * n, n)
    with pytest.raises(InputError, match="has no speed"):
        signals.orders_of(path, "speed")
    write(path, "time [s],speed [rpm]", n, n)
    with pytest.raises(InputError, match="above zero"):
        signals.orders_of(path, "speed")


def test_time_and_angle_must_rise(tmp_path):
    path = tmp_path / "a.csv"
    write(path, "time [s],angle [deg]", [0, 1, 1, 2, 1.5, 3, 4, 5, 6], [0, 10, 20, 20, 30, 40, 50, 60, 70])
    with pytest.raises(InputError) as caught:
        signals.read(path)
    found = [str(fault).removeprefix(f"{path}:").split("\n")[0] for fault in caught.value.faults]
    assert found == ["5: time: does not rise", "6: angle: does not rise", "7: time: does not rise"]


def test_a_gap_is_named_and_orders_are_of_the_longest_part(tmp_path):
    time, _, speed, torque = made()
    part = slice(0, 900)
    write(
        tmp_path / "engine.csv",
        "time [s],speed [rpm],torque [N*m]",
        np.append(time[part], time + 5.0),
        np.append(speed[part], speed) * 30 / np.pi,
        np.append(torque[part], torque),
    )
    text = ONE.replace('torque = "100 N*m"', SIGNAL).replace('speed = "500 rpm"', 'speed = { file = "engine.csv" }')
    study = load(tmp_path, text, REST)
    assert [order.n for order in study.operation.torque_orders] == [2, 6]
    assert [order.amplitude for order in study.operation.torque_orders] == pytest.approx([40.0, 5.0], rel=1e-3)
    (note,) = [note for note in study.notes if "gap" in note]
    assert "engine.csv:903: gap of 4.95" in note
    assert "orders are of the longest part without a gap" in note
