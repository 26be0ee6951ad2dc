"""The function of a study: a campaign's loads for its errors, its errors for its random numbers, to the last bit."""

import multiprocessing

import numpy as np
import pandas as pd
import pytest

import tolstat
from tests.support.environment import ROOT
from tolstat import sampling
from tolstat.campaign import function as functions
from tolstat.common.errors import InputError
from tolstat.common.tables import Status
from tolstat.study import load

STUDIES = ROOT / "studies"
MAIN = STUDIES / "iso2768_f.toml"
TEXT = """
[joint]
base = "cirelli2021"
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
[errors]
"pin3.offset_e" = "0.05 mm"
[tolerances]
"pin1.position" = { zone = "⌀0.1 mm", over = "22 mm", distribution = "normal", cp = 1.0 }
"hole1.offset_radial" = { plus_minus = "0.05 mm", distribution = "rayleigh", cpk = 1.0 }
"pin[234].tilt_t" = { plus_minus = "0.2 deg", distribution = "uniform" }
"pin*.diameter" = { lower = "-0.030 mm", upper = "0 mm", distribution = "normal", truncate = true }
[[correlation]]
between = ["pin*.diameter"]
rho = 0.6
[sampling]
n = 64
seed = 3
"""


def study_of(text):
    return load(ROOT / "f.toml", text=text)


@pytest.mark.parametrize("text", [TEXT, MAIN.read_text("utf-8").replace('method = "random"\n', "")])
def test_errors_of_the_cube_are_those_of_a_campaign(text):
    study = study_of(text.replace("seed = 2021", "seed = 3").replace("n = 1024", "n = 64"))
    f = tolstat.function(study)
    u = np.column_stack(list(sampling._uniforms(f.cube_names, range(64), study).values()))
    drawn = sampling.draw(study)[study.first_sample :]
    assert f.uniform(u).tobytes() == np.column_stack([drawn[name] for name in f.names]).tobytes()
    assert f.uniform(u[5:9]).tobytes() == f.uniform(u)[5:9].tobytes()
    assert np.isfinite(f.uniform(np.array([[0.0], [1.0]]) * np.ones(len(f.cube_names)))).all()


def test_what_is_drawn_alone_has_a_distribution():
    f = tolstat.function(load(MAIN))
    assert (list(f.distributions), f.reason) == (f.names, "")
    assert f.names == f.cube_names
    assert f.loads == list(f.limits)
    assert f.limits["cross1.F"] == 1000.0
    zones = tolstat.function(study_of(TEXT), ["cross*.F", "psi"])
    assert zones.distributions is None
    assert "pin1.position_inner is drawn as a vector" in zones.reason
    assert zones.loads == ["cross1.F", "cross2.F", "cross3.F", "cross4.F", "psi"]
    assert len(zones.salib()["groups"]) == len(zones.cube_names) == 13
    assert "groups" not in f.salib()


def test_a_study_may_be_given_by_its_path():
    for path in (MAIN, str(MAIN)):
        assert tolstat.function(path, ["psi"]).names == tolstat.function(load(MAIN), ["psi"]).names
    with pytest.raises(InputError, match=r"absent\.toml"):
        tolstat.function("absent.toml")


def test_faults():
    with pytest.raises(InputError, match=r"(?s)did you mean 'cross1.F'.*is no load") as caught:
        tolstat.function(load(MAIN), ["cros1.F", "cross1.G"])
    assert len(caught.value.faults) == 2


def test_listed_joints_are_given_by_their_errors_and_number():
    swept, listed = (tolstat.function(load(STUDIES / f"{name}.toml"), ["psi"]) for name in ("clearance", "hard_cases"))
    assert swept.names == ["variant"]
    assert swept.units["pin1.tilt_z"] == "rad"
    assert listed.names[-1] == "variant"
    assert "pin1.tilt_z" in listed.names
    assert swept.distributions is None
    for f in (swept, listed):
        with pytest.raises(InputError, match=r"sampling.*: is '(sweep|cases)': joints are listed, not drawn"):
            f.uniform(np.zeros((1, 1)))
    for wrong in (-1, 39, 1.5, np.nan):
        with pytest.raises(InputError, match=r"variant: .* is no joint of the study\n.*from 0 to 38"):
            swept({"variant": [0, wrong]})


def test_joints_of_a_lot_have_no_cube():
    """The refusal names the key and another way, which works."""
    text = TEXT.replace("n = 64", "n = 128").replace('[[correlation]]\nbetween = ["pin*.diameter"]\nrho = 0.6\n', "")
    study = study_of(text.replace('"uniform" }', '"uniform", lot = { share = 0.3 } }') + "joints_per_lot = 4\n")
    words = r"sampling\.joints_per_lot.*\n.*remove sampling\.joints_per_lot, or give errors"
    f = tolstat.function(study, ["psi"])
    for use in (lambda: f.uniform(np.full((2, len(f.cube_names)), 0.5)), f.salib):
        with pytest.raises(InputError, match=words) as caught:
            use()
        assert "depend on each other" in str(caught.value)
    assert f.distributions is None
    drawn = tolstat.draw(study, range(1, 4))
    assert np.column_stack([drawn[name] for name in f.names]).shape == (3, len(f.names))


@pytest.mark.parametrize(
    ("x", "words"),
    [
        (np.zeros((2, 3)), r"^an array of shape \(n, 13\), a row .* each of f\.names is needed, not \(2, 3\)$"),
        (np.zeros(13), r"not \(13,\); give \[x\] for one joint"),
        (0.0, r"not \(\)"),
    ],
)
def test_an_array_of_another_shape(x, words):
    f = tolstat.function(study_of(TEXT), ["psi"])
    with pytest.raises(ValueError, match=words):
        f(x)
    with pytest.raises(ValueError, match=r"each of f\.cube_names is needed"):
        f.uniform(np.zeros((1, 1)))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"workers": 0}, ["workers: 0 is no number of processes"]),
        ({"workers": -1, "loads": ["cros1.F"]}, ["workers: -1 is no number", "'cros1.F' is no load"]),
        ({"loads": []}, ["loads: is empty"]),
        ({"study": 7}, ["study: an object of type int is none"]),
        ({"study": ROOT / "tests/golden/schema.h5"}, ["schema.h5: is a result file (HDF5), and text is needed"]),
    ],
)
def test_arguments_that_cannot_be_used_are_named(arguments, words):
    with pytest.raises(InputError) as caught:
        tolstat.function(**({"study": MAIN} | arguments))
    assert len(caught.value.faults) == len(words)
    for word, fault in zip(words, caught.value.faults, strict=True):
        assert word in str(fault)


def test_values_that_are_no_real_numbers_are_refused():
    f = tolstat.function(study_of(TEXT), ["psi"])
    x = np.zeros((2, len(f.names)))
    for wrong in (x + 1j, x.astype(str).astype(object) + "x", pd.DataFrame(x + 1j, columns=f.names)):
        with pytest.raises(InputError, match="has values that are no real numbers"):
            f(wrong)


@pytest.mark.parametrize("value", [1.5, -0.1, np.nan])
def test_points_outside_the_unit_cube_are_refused(value):
    f = tolstat.function(study_of(TEXT), "psi")
    points = np.full((2, len(f.cube_names)), 0.5)
    points[1, 0] = value
    with pytest.raises(InputError, match=rf"{f.cube_names[0]} = {value:g} of point 1 is outside the unit cube"):
        f.uniform(points)


def test_kernels_that_some_joints_need_are_compiled_before_threads_start(monkeypatch):
    compiled = []
    monkeypatch.setattr(functions, "compile_missing", lambda mechanism, options, params=None: compiled.append(params))
    monkeypatch.setattr(functions.ThreadPoolExecutor, "map", lambda self, simulated, parts: ())
    f = tolstat.function(study_of(TEXT), ["psi"], workers=2)
    f(np.zeros((256, len(f.names))))
    assert compiled[0] is None
    assert len(compiled[1]) == 64


@pytest.mark.slow
def test_names_go_before_positions():
    """A table with names in any order, and one with all errors, gives the loads of its joints; others are refused."""
    study = study_of(TEXT)
    f = tolstat.function(study, ["cross1.F", "psi"], workers=1)
    drawn = tolstat.draw(study, range(1, 4))
    expected = f(np.column_stack([drawn[name] for name in f.names]))
    assert len(np.unique(expected[:, 0])) == 3
    frame = pd.DataFrame({name: drawn[name] for name in f.names[::-1]})
    assert f(frame).tobytes() == f(drawn).tobytes() == f({name: frame[name] for name in frame}).tobytes()
    assert f(frame).tobytes() == expected.tobytes()
    u = np.linspace(0.1, 0.9, 2 * len(f.cube_names)).reshape(2, -1)
    cube = pd.DataFrame(u, columns=f.cube_names)
    assert f.uniform(cube[f.cube_names[::-1]]).tobytes() == f.uniform(u).tobytes()
    with pytest.raises(
        InputError, match=r"(?s)lack pin1.offset_t\n.*f.names.*'pin1.offset_x' is unknown\n.*did you mean"
    ):
        f(frame.rename(columns={"pin1.offset_t": "pin1.offset_x"}))
    with pytest.raises(InputError, match=r"lack pin1.offset_t, pin2.tilt_t\n.*f.cube_names"):
        f.uniform(cube.drop(columns=["pin1.offset_t", "pin2.tilt_t"]))
    assert study.errors == {"pin3.offset_e": 5e-5}
    assert f(frame.assign(**{"pin3.offset_e": 5e-5})).tobytes() == expected.tobytes()
    assert f(frame.assign(**{"pin3.offset_e": 0.0})).tobytes() != expected.tobytes()


@pytest.mark.slow
def test_arrays_in_other_units_are_outside_the_model():
    """Degrees taken for rad and mm taken for m have no loads, whichever error they are."""
    f = tolstat.function(load(MAIN), ["cross1.F"], workers=1)
    x = np.zeros((6, len(f.names)))
    wrong = {"pin1.tilt_t": 172.0, "hole3.tilt_z": 6.28, "hole2.offset_e": 0.1, "pin2.diameter": -0.03}
    for row, (name, value) in enumerate(wrong.items()):
        x[row, f.names.index(name)] = value
    x[4, f.names.index("pin1.tilt_t")] = np.radians(0.5)
    y = f(x)
    assert f.status.tolist() == [Status.OUTSIDE_MODEL] * 4 + [Status.OK] * 2
    assert np.isnan(y[:4]).all()
    assert np.isfinite(y[4:]).all()


@pytest.mark.slow
def test_loads_are_those_of_a_campaign(tmp_path):
    """For one and two workers, in any order; a joint that cannot be assembled has no loads, and a status."""
    study = load(MAIN, n=24)
    tolstat.run(study, tmp_path / "a.h5", workers=1, check=False)
    f = tolstat.function(study, ["cross*.F", "fork1.T", "psi"], workers=1)
    with tolstat.open(tmp_path / "a.h5") as store:
        errors = store.errors()[store.first_sample :]
        expected = np.column_stack([store.loads[name].to_numpy() for name in f.loads])
        assert f.nominal.tolist() == [store.nominal[name] for name in f.loads]
    x = np.column_stack([errors[name] for name in f.names])
    assert f(x).tobytes() == expected.tobytes()
    assert (f.status == Status.OK).all()
    x[3, f.names.index("pin1.diameter")] = 1e-3
    x[4, 0] = np.nan
    alone = f(x)
    assert f.status[[3, 4, 5]].tolist() == [Status.OUTSIDE_MODEL, Status.INVALID_INPUT, Status.OK]
    assert np.isnan(alone[3:5]).all()
    both = tolstat.function(study, f.loads, workers=2)
    assert both(x[::-1])[::-1].tobytes() == alone.tobytes()
    assert not multiprocessing.active_children()
