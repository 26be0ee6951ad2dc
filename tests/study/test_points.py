"""Operating points of a study: ``[operation]``, ``[[operation]]``, limits and errors at them."""

import json
import math

import numpy as np
import pytest

from tolstat import joint, sampling, study
from tolstat.common import strict
from tolstat.common.errors import Fault, InputError
from tolstat.joint import operating
from tolstat.study import points

HEAD = '[joint]\nbase = "cirelli2021"\n'
ONE = '[operation]\nalpha = "15 deg"\nspeed = "500 rpm"\ntorque = "100 N*m"\n'
TWO = (
    '[[operation]]\nname = "cruise"\nalpha = "10 deg"\nspeed = "500 rpm"\ntorque = "100 N*m"\nshare = "75 %"\n'
    '[[operation]]\nname = "start"\nalpha = "15 deg"\nspeed = "100 rpm"\ntorque = "200 N*m"\nshare = 0.25\n'
)
REST = (
    '[tolerances]\noperation.torque = { plus_minus = "5 N*m", distribution = "uniform" }\n'
    'pin1.offset_t = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }\n'
    '[sampling]\nn = 10\nmethod = "random"\n'
)


def load(tmp_path, operation=TWO, rest=REST, more=""):
    path = tmp_path / "study.toml"
    path.write_text(HEAD + operation + rest + more)
    return study.load(path)


def faults(tmp_path, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        load(tmp_path, *args, **kwargs)
    return str(caught.value)


def test_one_point_has_no_name(tmp_path):
    s = load(tmp_path, ONE)
    assert [(point.name, point.share) for point in s.points] == [("", 1.0)]
    assert s.identity()["operation.alpha"] == s.operation.alpha == s.points[0].operation.alpha


def test_several_points(tmp_path):
    s = load(tmp_path)
    assert [(point.name, point.share) for point in s.points] == [("cruise", 0.75), ("start", 0.25)]
    assert s.identity()["operation.start.torque"] == 200.0
    assert "2 operating points" in repr(s)
    start = s.at("start")
    assert start.operation.torque == 200.0
    assert start.identity() == load(tmp_path, TWO.split("[[operation]]")[2].join(
        ["[operation]", ""]).replace('name = "start"\n', "").replace("share = 0.25\n", "")).identity()  # fmt: skip


def test_errors_are_the_same_deviations_at_every_point(tmp_path):
    drawn = [sampling.draw(s) for s in (load(tmp_path), load(tmp_path, ONE))]
    assert drawn[0].tobytes() == drawn[1].tobytes()
    torque = drawn[0]["operation.torque"]
    assert torque[0] == 0.0
    assert -5 < torque.min() < torque.max() < 5
    s = load(tmp_path)
    np.testing.assert_array_equal(operating(s.at("start").operation, drawn[0])["torque"], 200.0 + torque)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "start"', 'name = "cruise"', "operation[1].name: a point 'cruise' exists already"),
        ('name = "start"', 'name = "../start"', "operation[1].name: ../start is not a name"),
        ('name = "start"\n', "", "hint: add operation[1].name"),
        ("share = 0.25", "", "operation[1].share: missing key"),
        ("share = 0.25", "share = 0.3", "operation: shares of the time sum to 1.05"),
        ("share = 0.25", "shares = 0.25", "did you mean 'share'"),
        ('"200 N*m"', '"200 mm"', "operation[1].torque"),
    ],
)
def test_faults_of_points(tmp_path, old, new, said):
    assert said in faults(tmp_path, TWO.replace(old, new))


def test_all_faults_of_points_at_once(tmp_path):
    said = faults(tmp_path, TWO.replace('"500 rpm"', '"0 rpm"').replace('"200 N*m"', "200"))
    assert "operation[0].speed" in said
    assert "operation[1].torque" in said


def test_shares_may_be_left_out(tmp_path):
    s = load(tmp_path, TWO.replace('share = "75 %"\n', "").replace("share = 0.25\n", ""))
    assert all(math.isnan(point.share) for point in s.points)


def test_limits_at_points(tmp_path):
    limits = '[limits]\n"cross*.F" = "900 N"\n"cross[12].F at start" = "1 kN"\n"psi at start + cruise" = 0.1\n'
    s = load(tmp_path, more=limits)
    assert {key: value for key, value in s.limits.items() if "cross1" in key} == {
        "cross1.F": 900.0,
        "cross1.F at start": 1000.0,
    }
    assert s.limits["psi"] == 0.1  # all points
    assert s.asked == ["cross1.F", "cross2.F", "cross3.F", "cross4.F", "psi"]
    assert s.at("start").limits["cross1.F"] == 900.0  # what holds at the worst holds everywhere
    more = '[limits]\n"cross1.F at start" = "900 N"\n'
    assert load(tmp_path, more=more).at("cruise").limits == {}


@pytest.mark.parametrize(
    ("operation", "key", "said"),
    [
        (TWO, "cross1.F at strat", "no operating point 'strat'\n  hint: did you mean 'start'"),
        (ONE, "cross1.F at start", "there is one, without a name"),
        (TWO, "cross1.G at start", "cross1.G"),
    ],
)
def test_faults_of_limits_at_points(tmp_path, operation, key, said):
    assert said in faults(tmp_path, operation, more=f'[limits]\n"{key}" = "900 N"\n')


def test_where_several_points_are_not_possible(tmp_path):
    cases = '[sampling]\nmethod = "cases"\n[[case]]\nname = "a"\nerrors = { "pin1.offset_t" = "0.1 mm" }\n'
    assert "several operating points are not possible with 'cases'" in faults(tmp_path, rest=cases)
    sweep = '[sampling]\nmethod = "sweep"\n[sweep]\n"operation.alpha" = { from = "0 deg", to = "9 deg", points = 3 }\n'
    assert "is given by several [[operation]] already" in faults(tmp_path, rest=sweep)


@pytest.mark.parametrize(
    "entry",
    [
        'mean = "100 N*m", std = "5 N*m", distribution = "normal"',
        'lower = "90 N*m", upper = "110 N*m", distribution = "uniform"',
    ],
)
def test_values_where_deviations_are_meant(tmp_path, entry):
    said = faults(tmp_path, rest=REST.replace('plus_minus = "5 N*m", distribution = "uniform"', entry))
    assert "leave out the operating point itself" in said
    assert "give deviations from [operation]" in said


def operation(**given):
    point = {"alpha": "15 deg", "speed": "500 rpm", "torque": "100 N*m"} | given
    return strict.validate(joint.Operation, point, "study.toml", prefix=("operation",))


def test_orders_of_speed_and_torque_are_read_and_kept():
    waves = [{"n": 2, "amplitude": "2 %", "phase": "30 deg"}, {"n": 4, "amplitude": "1 deg"}]
    read = operation(speed={"mean": "500 rpm", "orders": waves})
    assert [(order.n, order.amplitude) for order in read.speed_orders] == [(2, 0.01), (4, pytest.approx(np.pi / 180))]
    point = points.Point("", read)
    assert points.Point.of("", json.loads(json.dumps(point.values()))).operation == read
    assert point.in_words == "15 deg, 500 rpm, 100 N m, orders 2 and 4 of speed"


@pytest.mark.parametrize(
    ("given", "place", "found"),
    [
        (
            {"torque": {"mean": "1 N*m", "orders": [{"n": 0.5, "amplitude": "1 N*m"}]}},
            "torque.orders[0].n",
            "does not repeat",
        ),
        (
            {"torque": {"mean": "1 N*m", "orders": [{"n": 1, "amplitude": "-1 N*m"}]}},
            "torque.orders[0].amplitude",
            "positive",
        ),
        ({"torque": {"mean": "1 N*m", "orders": [{"n": 1, "amplitude": "1 N*m"}] * 2}}, "torque.orders", "given twice"),
        ({"torque": {"orders": []}}, "operation", "has no mean"),
        ({"torque": {"mean": "1 N*m", "order": []}}, "operation", "unknown key 'order'"),
        ({"torque": {"mean": "1 mm"}}, "torque", "cannot be a value in N*m"),
        (
            {"speed": {"mean": "1 rpm", "orders": [{"n": 3, "amplitude": "110 %"}]}},
            "speed.orders",
            "swings by up to 110 %",
        ),
        ({"alpha": "95 deg"}, "operation.alpha", "a Cardan joint cannot turn at 95 deg"),
    ],
)
def test_faults_of_angle_and_orders(given, place, found):
    with pytest.raises(InputError) as error:
        operation(**given)
    (fault,) = error.value.faults
    assert fault.place.endswith(place)
    assert found in fault.found
    assert fault.remedy


def test_a_partner_is_told_what_to_write():
    with pytest.raises(InputError) as error:
        operation(partner={"position": "after", "alpha": "12 deg", "inertia": "0.02 kg*m^2"})
    remedy = "a drive shaft of two joints is simulated as one: give its joint 2, tube and spline in [shaft]"
    assert error.value.faults == (Fault("study.toml: operation.partner", "unknown key", remedy),)


ORDERED = ONE.replace('torque = "100 N*m"', 'torque = { mean = "100 N*m", orders = [{ n = 2, amplitude = "40 N*m" }] }')
SWING = REST.replace(
    "[sampling]", 'operation.torque_swing = { plus_minus = "10 %", distribution = "normal" }\n[sampling]'
)


def test_a_swing_scales_the_orders_of_each_joint(tmp_path):
    s = load(tmp_path, ORDERED, SWING)
    errors = sampling.draw(s)
    assert errors["operation.torque_swing"][0] == 1.0
    assert 0.01 < np.std(errors["operation.torque_swing"][1:]) < 0.1
    params = joint.perturb(s.joint, s.operation, errors)
    np.testing.assert_allclose(params["torque_order"][:, 0, 0], 40 * errors["operation.torque_swing"])


def test_a_swing_without_orders_has_no_effect(tmp_path):
    with pytest.raises(InputError) as error:
        load(tmp_path, ONE, SWING)
    assert "tolerances.operation.torque_swing: has no effect: the torque has no orders" in str(error.value)
