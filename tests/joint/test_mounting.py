"""What holds the output shaft along its axis: keys of a joint file, parameters, words, and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat import joint as joints
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.common.strict import validate
from tolstat.common.tables import Fidelity, Options
from tolstat.joint import Joint, Operation, ideal
from tolstat.joint.sections import mounting_and_law
from tolstat.solver.simulation import simulate_rows

AXIAL = ("slides", "m_s", "k_a", "c_a", "F_a")


def made(**shaft: str) -> Joint:
    return joints.load("cirelli2021", {"shaft": shaft}, "case.toml")


def parameters(joint: Joint, force: float = 300.0, error: float = 0.0) -> np.ndarray:
    errors = joints.nominal_errors(1, CARDAN)
    errors["operation.axial_force"] = error
    return joints.perturb(joint, Operation.model_construct(alpha=0.1, speed=1.0, torque=1.0, axial_force=force), errors)


def axial(params: np.ndarray) -> list[float]:
    return [float(params[name][0]) for name in AXIAL]


def fault(shaft: dict[str, str], base: str = "cirelli2021") -> str:
    with pytest.raises(InputError) as caught:
        joints.load(base, {"shaft": shaft}, "case.toml")
    return str(caught.value)


def test_parameters_of_each_mounting() -> None:
    assert axial(parameters(made(), error=-20.0)) == [0.0] * 5
    assert axial(parameters(made(axial="free"), error=-20.0)) == [1.0, 5.0, 0.0, 2e4, 280.0]
    own = made(axial="20 kN/mm", mass="2 kg", axial_damping="0 N*s/m")
    assert axial(parameters(own, force=0.0)) == [1.0, 2.0, 2e7, 0.0, 0.0]


def test_a_rigid_shaft_has_the_parameters_that_it_had_without_the_keys() -> None:
    plain = parameters(made(), force=0.0)
    assert parameters(made(axial="rigid", mass="9 kg", axial_damping="1 N*s/m")).tobytes() == plain.tobytes()
    for name in plain.dtype.names:
        if name not in AXIAL:
            np.testing.assert_array_equal(parameters(made(axial="free"))[name], plain[name])


def test_the_modulus_of_the_parts_does_not_change_the_bearings() -> None:
    errors = joints.nominal_errors(1, CARDAN)
    errors["material.E_factor"] = 1.2
    operation = Operation.model_construct(alpha=0.1, speed=1.0, torque=1.0)
    assert joints.perturb(made(axial="2e7 N/m"), operation, errors)["k_a"][0] == 2e7


@pytest.mark.parametrize(
    ("shaft", "said"),
    [
        ({"axial": "loose"}, 'write "rigid", "free" or a quantity such as "1.2e6 N/mm"'),
        ({"axial": "2e7"}, "'2e7' has no unit"),
        ({"axial": "0 N/m"}, "'0 N/m' must be positive"),
        ({"axial": "2e7 N"}, "'2e7 N' cannot be a value in N/m"),
        ({"axial": "free", "mass": "0 kg"}, "'0 kg' must be positive"),
        ({"axial_damping": "-1 N*s/m"}, "must not be negative"),
    ],
)
def test_wrong_values(shaft: dict[str, str], said: str) -> None:
    assert said in fault(shaft)


def test_a_shaft_that_moves_needs_mass_and_damping() -> None:
    base = "cirelli2021_as_printed"
    found = fault({"axial": "free"}, base)
    assert "case.toml: joint.shaft.axial: a shaft that is not rigid" in found
    assert "along its axis needs mass and axial_damping\n" in found
    assert 'hint: give mass = "5 kg", axial_damping = "2e4 N*s/m" with your values, or axial = "rigid"' in found
    assert "needs axial_damping\n" in fault({"axial": "2e7 N/m", "mass": "1 kg"}, base)
    assert "needs mass\n" in fault({"axial": "2e7 N/m", "axial_damping": "0 N*s/m"}, base)
    assert not joints.load(base, {"shaft": {"axial": "rigid"}}, "case.toml").shaft.slides


@pytest.mark.parametrize("written", ["free", "rigid", "2e7 N/m"])
def test_a_joint_is_read_back_from_its_values(written: str) -> None:
    joint = made(axial=written)
    assert validate(Joint, joint.given("json"), "a.h5") == joint
    values = {"shaft.axial": joint.shaft.axial}
    assert joints.varied(made(), values).shaft == joint.shaft


def test_words() -> None:
    assert mounting_and_law(["rigid"], ["mode"]) == "shafts rigid along their axes; contact law mode"
    assert mounting_and_law(["free"] * 3, ["mode"] * 3) == "output shaft free along its axis; contact law mode"
    assert mounting_and_law([2e7], ["sliced"]) == "output shaft held with 2e+07 N/m along its axis; contact law sliced"
    said = mounting_and_law(["rigid", 1e6, "rigid", 3e6], ["mode", "point", "mode", "mode"])
    assert said == (
        "shafts rigid along their axes in 2 of 4 variants, output shaft held with 1e+06 to 3e+06 N/m along its axis in "
        "2 of 4 variants; contact laws mode, point"
    )


def test_closed_forms_are_refused_where_an_axial_force_moves_the_shaft() -> None:
    ideal.check(np.concatenate([parameters(made()), parameters(made(axial="free"), force=0.0)]))
    moved = np.concatenate([parameters(made()), parameters(made(axial="2e7 N/m"))])
    for call in (
        lambda: ideal.check(moved),
        lambda: ideal.loads(0.3, moved[1:]),
        lambda: simulate_rows(moved, Options(fidelity=int(Fidelity.IDEAL))),
    ):
        with pytest.raises(InputError, match=r'does not hold with an axial force.*\n.*fidelity = "quasistatic"'):
            call()
