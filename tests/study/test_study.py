"""Study and case files: what they mean, and what their faults say."""

from __future__ import annotations

import copy
import json
import math
import re
import tomllib
from collections.abc import Callable
from datetime import date
from pathlib import Path

import pytest

from tests.support.environment import ROOT
from tests.support.synthetic import HEAD
from tolstat import study
from tolstat.common import tables
from tolstat.common.errors import Fault, InputError
from tolstat.study import Study, load_case, selection
from tolstat.study.model import Solver
from tolstat.study.tolerances.distributions import Normal
from tolstat.study.tolerances.zone_laws import Rayleigh

STUDIES = ROOT / "studies"

GOOD = """
[joint]
base = "cirelli2021"
contact.law = "point"

[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"

[solver]
steps_per_rev = 90

[errors]
pin3.tilt_z = "0.1 deg"

[tolerances]
"pin[12].offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }
"hole*.tilt_z" = { iso2768 = "f", nominal = "50 mm", distribution = "uniform" }
operation.torque = { mean = "1 N*m", std = "5 N*m", distribution = "normal" }

[[correlation]]
between = ["pin1.offset_t", "pin2.offset_t"]
rho = 0.6

[sampling]
n = 8
seed = 7

[limits]
"cross*.F" = "700 N"
pin1.contact = "650 N"
psi = 1e-3

[output]
histories = "harmonics"
harmonics = 12
"""

CASE = (
    HEAD
    + """[errors]
pin1.tilt_z = "0.5 deg"
"pin2.diameter" = "-0.01 mm"
"""
)


def write(folder: Path, *changes: tuple[str, str], text: str = GOOD) -> Path:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def read(folder: Path, *changes: tuple[str, str]) -> Study:
    return study.load(write(folder, *changes))


def faults(folder: Path, *changes: tuple[str, str]) -> list[str]:
    path = write(folder, *changes)
    with pytest.raises(InputError) as caught:
        study.load(path)
    assert list(folder.iterdir()) == [path]
    assert all("\n  hint: " in str(fault) for fault in caught.value.faults)
    return [str(fault).replace(f"{folder}/", "") for fault in caught.value.faults]


def test_a_study_is_read_whole(tmp_path: Path) -> None:
    s = read(tmp_path)
    assert (s.name, s.samples, s.rows, s.sampling.seed) == ("study", 8, 9, 7)
    assert s.text == GOOD
    assert s.joint.contact.law == "point"
    assert s.operation.alpha == pytest.approx(math.radians(15))
    assert s.errors == {"pin3.tilt_z": pytest.approx(math.radians(0.1))}
    assert list(s.tolerances) == [
        *("pin1.offset_t", "pin2.offset_t"),
        *("hole1.tilt_z", "hole2.tilt_z", "hole3.tilt_z", "hole4.tilt_z"),
        "operation.torque",
    ]
    assert s.tolerances["pin1.offset_t"] == Normal(0.0, pytest.approx(1e-4 / 3))
    assert s.tolerances["operation.torque"] == Normal(1.0, 5.0)
    assert s.copula.names == ("pin1.offset_t", "pin2.offset_t")
    assert s.copula.matrix.tolist() == [[1.0, 0.6], [0.6, 1.0]]
    assert s.limits == {
        **{f"cross{i}.F": 700.0 for i in (1, 2, 3, 4)},
        "pin1.contact": 650.0,
        "psi": 1e-3,
    }
    assert s.solver.options() == tables.Options(steps_per_rev=90)
    assert (s.output.histories, s.output.harmonics) == ("harmonics", 12)


def test_a_study_of_dictionaries_is_that_of_its_file(tmp_path: Path) -> None:
    path = ROOT / "studies" / "duty_cycle.toml"
    sections = tomllib.loads(path.read_text(encoding="utf-8"))
    made = study.load(sections, n=8)
    assert made.identity() == study.load(path, n=8).identity()
    assert (made.name, made.limits) == ("study", study.load(path).limits)
    sections["operation"][0]["speed"], sections["sampling"]["n"] = 500, 0
    with pytest.raises(InputError) as caught:
        study.load(sections)
    assert "operation[0].speed: 500 has no unit" in str(caught.value)
    assert "sampling.n" in str(caught.value)
    with pytest.raises(InputError, match="a value cannot be written to a study"):
        study.load(sections | {"sampling": {"n": object()}})


def test_solver_defaults_are_those_of_the_kernel() -> None:
    assert Solver().options() == tables.Options()
    changed = Solver(method="tr_bdf2", start="ramp", settle_tol=0.5).options()
    assert changed.method == tables.Method.TR_BDF2
    assert changed.start == tables.Start.RAMP
    # rtol is set by the refinement, not by the study
    assert set(Solver.model_fields) == set(tables.Options._fields) - {"rtol"} | {"error_budget"}


def test_number_of_joints_from_the_command_line(tmp_path: Path) -> None:
    path = write(tmp_path)
    assert study.load(path, n=3).samples == 3
    with pytest.raises(InputError, match=r"sampling\.n: 0: .*\n  hint: give a value of at least 1"):
        study.load(path, n=0)


def test_a_case_is_read(tmp_path: Path) -> None:
    case = study.load_case(write(tmp_path, text=CASE))
    assert case.errors == {
        "pin1.tilt_z": pytest.approx(math.radians(0.5)),
        "pin2.diameter": pytest.approx(-1e-5),
    }
    assert case.solver == Solver()
    assert study.load_case(write(tmp_path, text=CASE + "[limits]\npsi = 1e-3\n")).limits == {"psi": 1e-3}
    with pytest.raises(InputError, match="fatigue: unknown key"):
        study.load_case(write(tmp_path, text=CASE + "[fatigue]\n"))
    with pytest.raises(InputError, match=r"operation.*speed") as caught:
        study.load_case(write(tmp_path, text=CASE.replace("500 rpm", "x") + "[limits]\npsi = -1\n"))
    assert len(caught.value.faults) == 2


def test_a_joint_beside_the_study(tmp_path: Path) -> None:
    source = (STUDIES.parent / "data" / "joints" / "cirelli2021.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(source, encoding="utf-8")
    assert read(tmp_path, ('"cirelli2021"', '"mine.toml"')).joint == read(tmp_path).joint


def test_radial_offset(tmp_path: Path) -> None:
    radial = '"pin4.offset_radial" = { plus_minus = "0.3 mm", distribution = "rayleigh" }\n[[correlation]]'
    s = read(tmp_path, ("[[correlation]]", radial))
    assert s.tolerances["pin4.offset_radial"] == Rayleigh(pytest.approx(1e-4))
    (fault,) = faults(tmp_path, ("[[correlation]]", radial.replace("pin4", "pin1")))
    assert "tolerances.pin1.offset_radial: pin1.offset_t is set by tolerances.pin[12].offset_t already" in fault


def test_identity_holds_what_decides_the_numbers_and_nothing_else(tmp_path: Path) -> None:
    identity = read(tmp_path).identity()
    assert json.loads(json.dumps(identity, allow_nan=False)) == identity
    same = read(tmp_path, ('"700 N"', '"800 N"'), ("[solver]", "# a remark\n[solver]"))
    assert same.identity() == identity
    differing = {
        ('"point"', '"mode"'): "joint.contact.law",
        ("500 rpm", "501 rpm"): "operation.speed",
        ("steps_per_rev = 90", "steps_per_rev = 91"): "solver.steps_per_rev",
        ('"0.1 deg"', '"0.2 deg"'): "errors.pin3.tilt_z",
        ("5 N*m", "6 N*m"): "tolerances.operation.torque.sigma",
        ("rho = 0.6", "rho = 0.5"): "correlation.matrix",
        ("seed = 7", "seed = 8"): "sampling.seed",
        ("harmonics = 12", "harmonics = 13"): "output.harmonics",
    }
    for change, key in differing.items():
        other = read(tmp_path, change).identity()
        assert [k for k in identity if other.get(k) != identity[k]] == [key]


def test_identity_follows_measured_data(tmp_path: Path) -> None:
    entry = '{ distribution = "measured", file = "m.csv", column = "d", unit = "um" }\n[[correlation]]'
    change = ("[[correlation]]", f'"pin1.diameter" = {entry}')
    identities = []
    for last in (3, 4, 3):
        (tmp_path / "m.csv").write_text(f"d\n1\n2\n{last}\n", encoding="utf-8")
        identities.append(read(tmp_path, change).identity())
    assert identities[0] == identities[2] != identities[1]


MALFORMED = {
    "wrong unit": (
        ('"0.1 mm"', '"0.1 N"'),
        "tolerances.pin[12].offset_t.plus_minus: '0.1 N' cannot be a value in m",
    ),
    "no unit": (('"100 N*m"\n\n', "100\n\n"), "operation.torque: 100 has no unit"),
    "unknown key": (("steps_per_rev", "steps_per_rve"), "solver.steps_per_rve: unknown key"),
    "unknown table": (("[output]", "[ouput]"), "ouput: unknown key"),
    "missing key": (('speed = "500 rpm"', ""), 'hint: add operation.speed, for example speed = "500 rpm"'),
    "missing number": (("n = 8", ""), "sampling: missing key n"),
    "negative tolerance": (
        ('plus_minus = "0.1 mm"', 'plus_minus = "-0.1 mm"'),
        "plus_minus: '-0.1 mm' must be positive",
    ),
    "cpk 0": (("cpk = 1.0", "cpk = 0"), "tolerances.pin[12].offset_t.cpk: 0 must be positive"),
    "unknown feature": (('"hole*.tilt_z"', '"hloe*.tilt_z"'), "tolerances.hloe*.tilt_z: selects nothing"),
    "unknown error": (('"hole*.tilt_z"', '"hole*.tilt_x"'), "tolerances.hole*.tilt_x: selects nothing"),
    "not positive definite": (
        ("[sampling]", '[[correlation]]\nbetween = ["hole*.tilt_z"]\nrho = -0.5\n[sampling]'),
        "hole1.tilt_z, hole2.tilt_z, hole3.tilt_z, hole4.tilt_z contradict each other",
    ),
    "n = 0": (("n = 8", "n = 0"), "sampling.n: 0: should be greater than or equal to 1"),
    "unknown base joint": (('"cirelli2021"', '"cirelli2012"'), "joint.base: no joint is named 'cirelli2012'"),
    "unreadable base joint": (('"cirelli2021"', '"nowhere.toml"'), "nowhere.toml: cannot be read"),
    "NaN": (("rho = 0.6", "rho = nan"), "correlation[0].rho: nan is not a finite number"),
    "NaN with unit": (('"0.1 deg"', '"nan deg"'), "errors.pin3.tilt_z: 'nan deg' is not a finite number"),
    "rho of 1": (("rho = 0.6", "rho = 1"), "correlation[0].rho: 1: should be less than 1"),
    "pair without tolerance": (('"pin2.offset_t"]', '"pin3.offset_t"]'), "'pin3.offset_t' has no tolerance"),
    "one name": ((', "pin2.offset_t"]', "]"), "correlation[0].between: names only one error, pin1.offset_t"),
    "mixed kinds": (
        ('"hole*.tilt_z"', '"hole*.*"'),
        "tolerances.hole*.*: selects quantities of different kinds (m, rad)",
    ),
    "fixed operation": (
        ("[errors]", "[errors]\noperation.alpha = '1 deg'"),
        "errors.operation.alpha: is not an error",
    ),
    "fixed and scattering": (
        ("[errors]", "[errors]\npin1.offset_t = '1 mm'"),
        "tolerances.pin[12].offset_t: pin1.offset_t is set by errors.pin1.offset_t already",
    ),
    "limit without unit": (('"700 N"', "700"), "limits.cross*.F: 700 has no unit"),
    "limit of nothing": (("psi = 1e-3", "phi = 1e-3"), "limits.phi: selects nothing"),
    "negative limit": (("psi = 1e-3", "psi = -1e-3"), "limits.psi: -0.001 is not positive"),
    "no tolerances": (("[tolerances]", "[limits.tolerances]"), "tolerances: missing table"),
    "too many harmonics": (
        ("harmonics = 12", "harmonics = 46"),
        "output.harmonics: 90 steps per revolution do not resolve 46 harmonics",
    ),
    "number as text": (("n = 8", 'n = "8"'), "sampling.n: '8': should be a valid integer"),
    "sweep without method": (("[sampling]", "[sweep]\n[sampling]"), "sweep: has no effect with 'random'"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_a_malformed_file_gives_a_clear_message(name: str, tmp_path: Path) -> None:
    change, found = MALFORMED[name]
    messages = faults(tmp_path, change)
    assert any(found in message for message in messages), messages
    assert all(message.startswith(("study.toml", "nowhere.toml")) for message in messages)
    if name != "no tolerances":
        assert len(messages) == 1, messages


def test_a_fault_names_the_line_of_its_key(tmp_path: Path) -> None:
    changes = {
        ('speed = "500 rpm"', "speed = 1200"): "speed = 1200",
        ('"0.1 deg"', '"0.1 mm"'): '"0.1 mm"',
        ('plus_minus = "0.1 mm"', 'plus_minus = "⌀0.1 mm"'): "⌀",
        ("steps_per_rev", "steps_per_rve"): "steps_per_rve",
        ("rho = 0.6", "rho = nan"): "nan",
        ("n = 8", ""): "[sampling]",
    }
    for change, part in changes.items():
        (message,) = faults(tmp_path, change)
        line = int(re.match(r"study\.toml:(\d+): ", message)[1])
        assert part in (tmp_path / "study.toml").read_text(encoding="utf-8").splitlines()[line - 1]
        (tmp_path / "study.toml").unlink()
    assert [fault.place for fault in caught_by(lambda: study.load(write(tmp_path), n=0))] == [
        f"{tmp_path / 'study.toml'}: sampling.n"
    ]
    (tmp_path / "own.toml").write_text("[pin]\n\nl = 3\n", encoding="utf-8")
    places = [fault.place for fault in caught_by(lambda: read(tmp_path, ('"cirelli2021"', '"own.toml"')))]
    assert f"{tmp_path / 'own.toml'}:3: pin.l" in places
    assert f"{tmp_path / 'own.toml'}:1: pin.d" in places
    assert f"{tmp_path / 'own.toml'}: material" in places


def caught_by(act: Callable[[], object]) -> tuple[Fault, ...]:
    with pytest.raises(InputError) as caught:
        act()
    return caught.value.faults


def test_remedies_name_the_right_word(tmp_path: Path) -> None:
    for change, remedy in [
        (("steps_per_rev", "steps_per_rve"), "did you mean 'steps_per_rev'?"),
        (("[output]", "[ouput]"), "did you mean 'output'?"),
        (('"hole*.tilt_z"', '"hloe2.tilt_z"'), "did you mean 'hole2.tilt_z'?"),
        (('"hole*.tilt_z"', '"hole*.tilt_y"'), "did you mean 'hole*.tilt_"),
        (("rho = 0.6", "roh = 0.6"), "did you mean 'rho'?"),
        (("seed = 7", "Seed = 7"), "did you mean 'seed'?"),
        (('speed = "500 rpm"', "speed = 1200"), 'write "1200 rpm" or "1200 rad/s"'),
        (('"0.1 mm"', '"0,25 mm"'), 'write a decimal point: "0.25 mm"'),
        (('plus_minus = "0.1 mm"', 'plus_minus = "⌀0.25 mm"'), 'write half of it: "0.125 mm"'),
        (('"0.1 mm"', "0.1"), 'write "0.1 mm"'),
    ]:
        assert remedy in "\n".join(faults(tmp_path, change))


def test_all_faults_of_all_sections_at_once(tmp_path: Path) -> None:
    messages = faults(
        tmp_path,
        ('"point"', '"pointy"'),
        ('speed = "500 rpm"', 'speeed = "500 rpm"'),
        ("steps_per_rev = 90", "steps_per_rev = 3"),
        ('"0.1 deg"', '"0.1 mm"'),
        ("cpk = 1.0", 'cpk = 0, std = "x"'),
        ('"hole*.tilt_z"', '"hull.tilt_z"'),
        ("rho = 0.6", "rho = nan"),
        ("n = 8", "n = 0"),
        ("seed = 7", "seed = -1"),
        ('"650 N"', '"650 mm"'),
        ('"harmonics"', '"some"'),
        ("[output]", "[[extra]]\n[output]"),
    )
    places = {message.split(": ")[1] for message in messages}
    assert places == {
        *("extra", "joint.contact.law", "operation.speed", "operation.speeed", "solver.steps_per_rev"),
        *("errors.pin3.tilt_z", "tolerances.pin[12].offset_t.cpk", "tolerances.pin[12].offset_t.std"),
        *("tolerances.hull.tilt_z", "correlation[0].rho", "sampling.n", "sampling.seed"),
        *("limits.pin1.contact", "output.histories"),
    }
    assert len(messages) == len(places)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("[joint\n", "is not TOML"),
        ("", "joint.base: missing key"),
        ("joint = 3\nsampling = 3\nerrors = []\n", "joint: 3 is not a table"),
    ],
)
def test_files_that_are_no_studies(text: str, found: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        study.load(write(tmp_path, text=text))
    assert found in str(caught.value)


def test_a_missing_file_and_a_binary_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        study.load(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        study.load(tmp_path / "binary.toml")


def test_sweep_faults(tmp_path: Path) -> None:
    source = (STUDIES / "clearance.toml").read_text(encoding="utf-8")

    def messages(old: str, new: str) -> str:
        with pytest.raises(InputError) as caught:
            study.load(write(tmp_path, (old, new), text=source))
        return str(caught.value)

    assert "leave n out" in messages('method = "sweep"', 'method = "sweep"\nn = 4')
    assert "sweep.contact.clearance.points" in messages("points = 38", "points = 1")
    assert "sweep.contact.clearance.to: '0.40 deg' cannot" in messages('to = "0.40 mm"', 'to = "0.40 deg"')
    assert "from and to are equal" in messages('to = "0.40 mm"', 'to = "0.03 mm"')
    assert "add [sweep]" in messages("contact.clearance =", "# ")
    assert "pin1.tilt_z is set by errors.pin1.tilt_z already" in messages("contact.clearance =", '"pin*.tilt_z" =')


def test_the_studies_of_the_repository() -> None:
    main = study.load(STUDIES / "iso2768_f.toml")
    assert main.samples >= 512
    assert len(main.tolerances) == 48
    assert main.tolerances["hole3.offset_z"] == Normal(0.0, pytest.approx(5e-5))
    assert main.tolerances["pin2.tilt_t"] == Normal(0.0, pytest.approx(math.radians(0.5) / 3))
    clearance = study.load(STUDIES / "clearance.toml")
    assert clearance.rows == 39
    for path in STUDIES.rglob("*.toml"):
        opening = path.read_text(encoding="utf-8").split("[joint]")[0]
        assert all(word in opening for word in ("# Question: ", "# Expected answer: ", "# Run time: "))


def paths_of(data: object, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return [p for key, value in items for p in ((*path, key), *paths_of(value, (*path, key)))]


ODD = [[], {}, True, -1, math.inf, "", "{}", [[1]], {"": {"": 1}}, 10**400, date(2021, 1, 1)]


@pytest.mark.parametrize("odd", ODD, ids=lambda odd: str(odd)[:10])
def test_no_value_anywhere_gives_anything_but_faults(
    odd: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path)
    whole = tomllib.loads(GOOD)
    faults = []
    for keys in paths_of(whole):
        data = copy.deepcopy(whole)
        at = data
        for key in keys[:-1]:
            at = at[key]
        at[keys[-1]] = odd
        monkeypatch.setattr(selection, "read_toml", lambda *_, data=data: data)
        try:
            accepted = isinstance(study.load(path), Study)
        except InputError as error:
            faults += error.faults
        else:
            assert accepted, keys
    assert faults
    assert all(fault.place.startswith(str(path)) and fault.remedy for fault in faults)


def test_a_study_is_not_a_case_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(GOOD)
    with pytest.raises(InputError, match="is a study, not a case of one joint\n  hint: run it with: tolstat run"):
        load_case(path)
