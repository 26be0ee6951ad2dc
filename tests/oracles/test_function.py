"""The function of a study in OpenTURNS and SALib: same marginals, copula and loads; their methods run on it."""

import numpy as np
import pytest

import tolstat
from tests.campaign.test_function import MAIN, TEXT, study_of
from tests.study.test_tolerance import build
from tests.support.environment import ROOT
from tests.test_docs import blocks
from tolstat.study import load

ot = pytest.importorskip("openturns", reason="pip install .[oracles]")
ot.Log.Show(ot.Log.NONE)

BAND = {"lower": "-0.03 mm", "upper": "0.01 mm"}
ENTRIES = [
    {"distribution": "normal", **BAND, "mean": "-0.02 mm"},
    {"distribution": "normal", **BAND, "mean": "-0.02 mm", "truncate": True},
    {"distribution": "uniform", **BAND},
    {"distribution": "triangular", **BAND, "peak": "0 mm"},
    {"distribution": "beta", **BAND, "a": 2.0, "b": 5.0},
    {"distribution": "lognormal", "threshold": "-0.04 mm", **BAND},
    {"distribution": "lognormal", "threshold": "-0.04 mm", **BAND, "truncate": True},
    {"distribution": "scipy:weibull_min(c=1.8, scale=0.012)", "unit": "mm"},
    {"distribution": "scipy:weibull_min(c=1.8, scale=0.012)", "unit": "mm", "lower": "1 um", "upper": "20 um"},
    {"distribution": "measured", "file": "rattle.csv", "column": "speed_rpm", "unit": "um"},
]


@pytest.mark.parametrize("entry", ENTRIES, ids=str)
def test_marginals_are_ours(entry, monkeypatch):
    monkeypatch.chdir(MAIN.parent)
    own = build(entry)
    theirs, x = own.openturns(ot), own.ppf(np.linspace(0.001, 0.999, 41))
    np.testing.assert_allclose(np.array(theirs.computeCDF(ot.Sample(x[:, None])))[:, 0], own.cdf(x), atol=1e-7)


def test_copula_is_ours():
    """Spearman's correlation of errors with rho = 0.6 of their scores, and none of the others."""
    text = "\n".join(line for line in TEXT.splitlines() if "position" not in line and "radial" not in line)
    f = tolstat.function(study_of(text))
    _, errors = f.openturns()
    matrix = np.array(errors.getSpearmanCorrelation())
    at = [i for i, name in enumerate(f.names) if name.endswith("diameter")]
    expected = np.eye(len(f.names))
    expected[np.ix_(at, at)] = np.where(np.eye(4), 1.0, 6 / np.pi * np.arcsin(0.3))
    np.testing.assert_allclose(matrix, expected, atol=1e-6)
    assert list(errors.getDescription()) == f.names


@pytest.mark.slow
@pytest.mark.parametrize("cube", [False, True])
def test_function_and_gradient(cube):
    f = tolstat.function(load(MAIN), ["cross1.F", "psi"], workers=1)
    function, inputs = f.openturns(cube)
    ot.RandomGenerator.SetSeed(1)
    sample = inputs.getSample(4)
    x = np.array(sample)
    expected = f(f.uniform(x) if cube else x)
    np.testing.assert_array_equal(np.array(function(sample)), expected)
    gradient = np.array(function.gradient(sample[0]))
    assert gradient.shape == (48, 2)
    assert np.isfinite(gradient).all()
    assert np.abs(gradient).min(axis=0).max() > 0.0


@pytest.mark.slow
def test_examples_of_the_page_run(monkeypatch):
    pytest.importorskip("SALib", reason="pip install .[oracles]")
    monkeypatch.chdir(ROOT)
    names = {"__name__": "__main__"}
    for code in blocks(ROOT / "docs" / "functions.md", "python"):
        exec(code, names)
    assert names["indices"]["ST"].shape == (48,)


@pytest.mark.slow
def test_sobol_indices_by_groups():
    """SALib's design over the six tolerances of the main job: the tilts are the cause, offsets are not."""
    pytest.importorskip("SALib", reason="pip install .[oracles]")
    from SALib.analyze import sobol
    from SALib.sample import sobol as saltelli

    f = tolstat.function(load(MAIN), ["cross1.F"])
    problem = f.salib() | {"groups": [name[:3] + name.partition(".")[2][:4] for name in f.cube_names]}
    loads = np.log(f(f.uniform(saltelli.sample(problem, 64, calc_second_order=False, seed=1)))[:, 0])
    assert f.simulated == len(loads) == 64 * 8
    found = sobol.analyze(problem, loads, calc_second_order=False, seed=1)
    total = dict(zip(dict.fromkeys(problem["groups"]), found["ST"], strict=True))
    assert min(total["pintilt"], total["holtilt"]) > 3 * max(total["pinoffs"], total["pindiam"], total["holdiam"])
