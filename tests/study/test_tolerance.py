"""ISO 2768 tables, and the entries of ``[tolerances]``."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tests.support.synthetic import HEAD
from tolstat import study
from tolstat.common.errors import InputError
from tolstat.study.assumptions import unselected
from tolstat.study.tolerances import correlation, distributions, iso, zones
from tolstat.study.tolerances.correlation import Copula
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import Site
from tolstat.study.tolerances.kinds import KINDS, ZONE_KINDS, entry
from tolstat.study.tolerances.zone_laws import Rayleigh


def build(data: dict[str, object], name: str = "pin1.offset_t", center: float = 0.0, unit: str = "m") -> Distribution:
    site = Site(name, unit, center, Path())
    return entry(data, site, "study.toml", ("tolerances", name)).quantities(site)[name]


def faults(data: object, name: str = "pin1.offset_t", folder: Path | None = None) -> str:
    with pytest.raises(InputError) as caught:
        entry(data, Site(name, "m", 0.0, folder or Path()), "study.toml", ("tolerances", name))
    return str(caught.value)


LINEAR = {
    "f": "0.5 .05, 3 .05, 6 .05, 6.01 .1, 30 .1, 30.01 .15, 120 .15, 400 .2, 1000 .3, 2000 .5",
    "m": "0.5 .1, 3 .1, 6 .1, 30 .2, 120 .3, 400 .5, 1000 .8, 2000 1.2, 4000 2",
}


@pytest.mark.parametrize("grade", ["f", "m"])
def test_iso2768_tables(grade: str) -> None:
    for size, deviation in (map(float, pair.split()) for pair in LINEAR[grade].split(",")):
        assert iso.deviation("linear", grade, size * 1e-3) == pytest.approx(deviation * 1e-3, rel=1e-12)
    for leg, minutes in [(0.1, 60), (10, 60), (10.1, 30), (50, 30), (120, 20), (400, 10), (401, 5), (9e4, 5)]:
        found = iso.deviation("angular", grade, leg * 1e-3)
        assert found == pytest.approx(math.radians(minutes / 60), rel=1e-12)


@pytest.mark.parametrize(("grade", "size"), [("f", 0.49), ("f", 2001), ("m", 4001)])
def test_iso2768_outside_the_table(grade: str, size: float) -> None:
    with pytest.raises(ValueError, match="outside the table"):
        iso.deviation("linear", grade, size * 1e-3)
    with pytest.raises(ValueError, match="no linear table for class 'c'"):
        iso.deviation("linear", "c", 0.01)


def test_normal_entries() -> None:
    normal = {"distribution": "normal"}
    assert build(normal | {"plus_minus": "0.1 mm", "cpk": 2.0}) == distributions.Normal(0.0, pytest.approx(1e-4 / 6))
    asymmetric = build(normal | {"lower": "-0.02 mm", "upper": "0 mm", "truncate": True})
    assert asymmetric == distributions.TruncatedNormal(
        pytest.approx(-1e-5), pytest.approx(1e-5 / 3), pytest.approx(-2e-5), 0.0
    )
    shifted = build(normal | {"lower": "-0.02 mm", "upper": "0 mm", "mean": "-0.005 mm", "cpk": 1.0})
    assert shifted == distributions.Normal(pytest.approx(-5e-6), pytest.approx(5e-6 / 3))
    assert build(normal | {"mean": "1 N*m", "std": "5 N*m"}, "operation.torque", 0.0, "N*m") == distributions.Normal(
        1, 5
    )
    about = build(normal | {"plus_minus": 0.3}, "material.E_factor", 0.9, "1")
    assert about == distributions.Normal(0.9, pytest.approx(0.1))


def test_other_entries() -> None:
    iso = build({"iso2768": "f", "nominal": "50 mm", "distribution": "uniform"}, "hole1.tilt_z", 0.0, "rad")
    assert iso == distributions.Uniform(pytest.approx(-math.radians(0.5)), pytest.approx(math.radians(0.5)))
    iso = build({"iso2768": "m", "nominal": "50 mm", "distribution": "uniform"})
    assert iso == distributions.Uniform(pytest.approx(-3e-4), pytest.approx(3e-4))
    peaked = build({"lower": "0 mm", "upper": "3 mm", "peak": "1 mm", "distribution": "triangular"})
    assert peaked == distributions.Triangular(0.0, pytest.approx(3e-3), pytest.approx(1e-3))
    assert build({"plus_minus": "1 mm", "a": 2, "b": 3, "distribution": "beta"}) == distributions.Beta(
        2, 3, pytest.approx(-1e-3), pytest.approx(1e-3)
    )
    radial = build({"plus_minus": "0.3 mm", "cpk": 2.0, "distribution": "rayleigh"}, "pin1.offset_radial")
    assert radial == Rayleigh(pytest.approx(5e-5))
    radial = build({"sigma": "0.3 mm", "distribution": "rayleigh"}, "pin1.offset_radial")
    assert radial == Rayleigh(pytest.approx(3e-4))


def test_laws_of_scipy() -> None:
    entry = {"distribution": "scipy:weibull_min(1.8, scale=0.012)", "unit": "mm", "upper": "20 um"}
    law = build(entry)
    assert law.describe() == {
        "distribution": "scipy:weibull_min",
        "c": 1.8,
        "scale": 0.012,
        "unit": pytest.approx(1e-3),
        "upper": pytest.approx(2e-5),
    }
    assert law.ppf(np.array([1.0])) == pytest.approx(2e-5)
    assert build(entry | {"unit": "um"}) != law
    pure = build({"distribution": "scipy:gumbel_r(loc=-0.01, scale=1e-3)"}, "material.E_factor", 1.0, "1")
    assert pure.moments.mean == pytest.approx(stats.gumbel_r.mean(-0.01, 1e-3))


@pytest.mark.parametrize(
    ("law", "found"),
    [
        ("scipy", "offset_t.distribution"),
        ("scipy:", "'' is no law with numbers"),
        ("scipy:norm", "'norm' is no law with numbers"),
        ("scipy:norm(scale=open('x'))", "is no law with numbers"),
        ("scipy:norm(scale=True)", "is no law with numbers"),
        ("scipy:norm(**{'scale': 1})", "is no law with numbers"),
        ("scipy:stats.norm()", "is no law with numbers"),
        ("scipy:" + "(" * 150 + ")" * 150, "is no law with numbers"),
        ("scipy:norms(scale=1)", "did you mean 'norm'?"),
        ("scipy:poisson(3)", "no continuous law 'poisson'"),
        ("scipy:weibull_min(scale=1)", "weibull_min has c, loc, scale"),
        ("scipy:norm(0, loc=1)", "does not give each parameter once"),
        ("scipy:norm(0, 1, 2)", "does not give each parameter once"),
        ("scipy:norm(scale=-1)", "a parameter that the law does not allow"),
        ("scipy:cauchy(scale=1)", "no finite standard deviation"),
    ],
)
def test_faults_of_laws_of_scipy(law: str, found: str) -> None:
    message = faults({"distribution": law, "unit": "mm"})
    assert found in message
    assert "hint: " in message


def test_lognormal_entries_have_the_moments_and_limits_asked_for() -> None:
    by_moments = build({"mean": "0.2 mm", "std": "0.1 mm", "distribution": "lognormal"})
    middle = (np.arange(200_000) + 0.5) / 200_000
    values = by_moments.ppf(middle)
    assert values.mean() == pytest.approx(2e-4, rel=1e-4)
    assert values.std() == pytest.approx(1e-4, rel=1e-3)
    band = {"lower": "0.1 mm", "upper": "0.4 mm", "distribution": "lognormal"}
    limits = build(band | {"cpk": 1.0}).ppf(stats.norm.cdf([-3.0, 0.0, 3.0]))
    np.testing.assert_allclose(limits, [1e-4, 2e-4, 4e-4], rtol=1e-9)
    cut = build(band | {"cpk": 0.5, "truncate": True}).ppf(np.linspace(0.0, 1.0, 101))
    assert cut.min() >= 1e-4 * (1 - 1e-12)
    assert cut.max() <= 4e-4 * (1 + 1e-12)


def test_measured_entry_reads_a_column(tmp_path: Path) -> None:
    (tmp_path / "parts.csv").write_text("# station 3\npart,dev\nA,-10\nB,5\nC,15\n", encoding="utf-8")
    parts = {"distribution": "measured", "file": "parts.csv", "column": "dev", "unit": "um"}
    site = Site("pin1.offset_t", "m", 0.0, tmp_path)
    dist = entry(parts, site, "study.toml", ("tolerances",)).quantities(site)[site.name]
    np.testing.assert_allclose(dist.ppf(np.array([0.1, 0.5, 0.9])), [-1e-5, 5e-6, 1.5e-5], rtol=1e-12)
    lacking = faults(parts | {"column": "dv"}, folder=tmp_path)
    assert "parts.csv:2: has no column 'dv'" in lacking
    assert "there are part, dev" in lacking
    assert "cannot be read" in faults(parts | {"file": "nowhere.csv"}, folder=tmp_path)
    assert "'1 deg' cannot be a value in m" in faults(parts | {"unit": "deg"}, folder=tmp_path)
    (tmp_path / "parts.csv").write_text("dev\n1\nnan\n", encoding="utf-8")
    assert "parts.csv:3: dev: 'nan' is no finite number" in faults(parts, folder=tmp_path)
    (tmp_path / "parts.csv").write_text("dev\n1\n", encoding="utf-8")
    assert "give at least 2" in faults(parts, folder=tmp_path)
    (tmp_path / "parts.csv").write_text("dev [mm]\n1\n2\n", encoding="utf-8")
    assert "unit is 'um', but" in faults(parts, folder=tmp_path)
    del parts["unit"]
    dist = entry(parts, site, "study.toml", ("tolerances",)).quantities(site)[site.name]
    assert dist.values.tolist() == [0.001, 0.002]
    (tmp_path / "parts.csv").write_text("dev\n1\n2\n", encoding="utf-8")
    assert "parts.csv:1: dev: has no unit" in faults(parts, folder=tmp_path)


@pytest.mark.parametrize(
    ("entry", "found"),
    [
        ("0.1 mm", "'0.1 mm' is not a tolerance"),
        ({"plus_minus": "0.1 mm"}, "pin1.offset_t.distribution: missing key"),
        ({"distribution": "norml"}, "did you mean 'normal'?"),
        ({"distribution": "rayleigh", "sigma": "1 mm"}, "rayleigh is for offset_radial"),
        ({"distribution": "normal"}, "no band"),
        (
            {"distribution": "normal", "plus_minus": "0.1 mm", "cpk": 0},
            "pin1.offset_t.cpk: 0 must be positive",
        ),
        ({"distribution": "normal", "plus_minus": "0.1 mm", "std": "1 mm", "cpk": 1}, "std and cpk"),
        ({"distribution": "normal", "plus_minus": "0.1 mm", "std": "1 mm"}, "band and truncate"),
        ({"distribution": "normal", "plus_minus": "0.1 mm", "mean": "0.1 mm"}, "mean is outside the band"),
        (
            {"distribution": "normal", "plus_minus": "0.1 mm", "lower": "0 mm", "upper": "1 mm"},
            "remove one of them",
        ),
        ({"distribution": "normal", "plus_minus": "0.1 mm", "truncate": "yes"}, "offset_t.truncate"),
        ({"distribution": "normal", "lower": "0 mm"}, "lower without upper"),
        ({"distribution": "normal", "lower": "1 mm", "upper": "0 mm"}, "lower is not below upper"),
        ({"distribution": "uniform", "plus_minus": "0.1 mm", "cpk": 1.0}, "offset_t.cpk: unknown key"),
        ({"distribution": "uniform", "iso2768": "f"}, "iso2768 without nominal"),
        (
            {"distribution": "uniform", "iso2768": "f", "nominal": "3 m"},
            "nominal = 3 m: outside the table (0.5 mm to 2000 mm)",
        ),
        ({"distribution": "uniform", "iso2768": "v", "nominal": "3 mm"}, "write one of 'f' or 'm'"),
        ({"distribution": "triangular", "plus_minus": "1 mm", "peak": "2 mm"}, "peak is outside"),
        ({"distribution": "lognormal", "plus_minus": "1 mm"}, "not above threshold"),
        ({"distribution": "lognormal", "mean": "1 mm"}, "mean without std"),
        ({"distribution": "beta", "plus_minus": "1 mm", "a": -1}, "offset_t.b: missing key"),
        ({"distribution": "scipy:norm(scale=1)"}, "missing key unit"),
        ({"distribution": "scipy:norm(scale=1)", "unit": "s"}, "offset_t"),
        ({"distribution": "scipy:norm(scale=1)", "unit": "mm", "cpk": 1.0}, "offset_t.cpk: unknown key"),
        ({"distribution": "scipy:expon(scale=1)", "unit": "mm", "upper": "0 mm"}, "no part lies between"),
        ({"distribution": "uniform", "plus_minus": "nan mm"}, "'nan mm' is not a finite number"),
    ],
)
def test_faults_of_entries(entry: object, found: str) -> None:
    message = faults(entry)
    assert found in message
    assert message.startswith("study.toml: tolerances.pin1.offset_t")
    assert "hint: " in message


def test_every_kind_is_reachable() -> None:
    assert set(KINDS) | {kind for kinds in ZONE_KINDS.values() for kind in kinds} == {
        *("normal", "uniform", "triangular", "lognormal", "beta", "rayleigh", "measured", "scipy"),
    }


def test_pearson_of_correlated_errors_is_that_of_the_errors_themselves():
    rng, n = np.random.default_rng(1), 400_000
    z = rng.multivariate_normal([0, 0], [[1, 0.7], [0.7, 1]], n)
    kinds = (distributions.Uniform(-1.0, 2.0), distributions.LogNormal(0.0, distributions.Normal(0.0, 0.6)))
    x, y = (own.ppf(stats.norm.cdf(column)) for own, column in zip(kinds, z.T, strict=True))
    found = correlation.pearson(*kinds, 0.7)
    assert found == pytest.approx(np.corrcoef(x, y)[0, 1], abs=0.005)
    assert found < 0.69
    copula = Copula(("a", "b"), np.array([[1.0, 0.7], [0.7, 1.0]]))
    row = correlation.correlations(copula, dict(zip("ab", kinds, strict=True))).iloc[0]
    assert (row["errors"], row["pairs"], row["rho"]) == ("a, b", 1, 0.7)
    assert row["spearman"] == pytest.approx(stats.spearmanr(x, y).statistic, abs=0.005)


ZONES = """
"pin*.position" = { zone = "⌀0.1 mm", over = "36.4 mm", distribution = "normal" }
"output_holes.position" = { zone = "⌀0.1 mm", over = "22 mm", distribution = "normal" }
"input_holes.position" = { zone = "⌀0.1 mm", over = "168 mm", distribution = "normal" }
"*_holes.coaxiality" = { zone = "⌀0.02 mm", over = "22 mm", distribution = "normal" }
"hole[12].offset_e" = { plus_minus = "0.1 mm", distribution = "uniform" }
"""


def test_a_common_axis_shorter_than_between_its_bearings_is_told():
    head = f'{HEAD}\n[tolerances]\n{ZONES}\n[sampling]\nmethod = "random"\nn = 8\nseed = 1\n'
    plan = study.load(Path("x.toml"), text=head)
    ((key, found, remedy),) = zones.short_axes(plan.entries, lambda _: plan.joint.contact.z)
    assert key == "tolerances.output_holes.position.over"
    assert found == "22 mm is shorter than the 146 mm between the bearings"
    assert remedy.endswith("2 (R + z/2) = 168 mm")


def test_errors_without_tolerance_are_listed():
    head = f'{HEAD}\n[sampling]\nmethod = "random"\nn = 8\nseed = 1\n[tolerances]\n'
    diameters = ("pin diameters", "hole diameters")
    along = ("pin positions along the pin axes", "positions of hole3 and hole4 along their axes")
    plan = study.load(Path("x.toml"), text=head + ZONES)
    assert unselected(plan) == (along[0], diameters[0], along[1], diameters[1])
    fixed = study.load(Path("x.toml"), text=f'[errors]\nhole4.offset_e = "0.1 mm"\n{head}{ZONES}')
    assert "positions of hole3 along its axis" in unselected(fixed)
    plan = study.load(Path("x.toml"), text=head + '"pin*.tilt_t" = { plus_minus = "1 deg", distribution = "uniform" }')
    holes = ("hole positions", "hole angles", "hole diameters")
    assert unselected(plan) == ("pin positions", "pin angles about z", "pin diameters", *holes)
