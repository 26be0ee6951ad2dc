"""Tolerance zones of ISO 286; the fit of a study: diameters, tolerances, share of joints that do not go together."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tests.support.synthetic import HEAD
from tolstat import joint, sampling, study
from tolstat.campaign import plan
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.study import scaling
from tolstat.study.starter import joint_text
from tolstat.study.tolerances import distributions, fits, iso

SAMPLING = '[sampling]\nmethod = "random"\nn = 8\nseed = 1\n'
H7_F7 = 'fit = { basic = "76 mm", code = "H7/f7", distribution = "normal", cpk = 1.0 }'
OTHER = 'pin1.offset_e = { plus_minus = "1 mm", distribution = "uniform" }'


def load(tolerances: str, contact: str = "", method: str = "random") -> study.Study:
    text = HEAD.replace('"cirelli2021"\n', f'"cirelli2021"\n{contact}\n', 1)
    return study.load(Path("x.toml"), text=f"{text}\n[tolerances]\n{tolerances}\n{SAMPLING.replace('random', method)}")


def faults(tolerances: str, contact: str = "") -> str:
    with pytest.raises(InputError) as caught:
        load(tolerances, contact)
    return str(caught.value)


def test_values_of_the_joint_file_that_a_fit_replaces_are_told(tmp_path: Path) -> None:
    held = {"contact.D_H": "76.2 mm", "contact.D_P": "76.0 mm"}
    assert load(H7_F7).joint.replaced_bearing == held
    assert load(OTHER, 'contact.clearance = "0.1 mm"').joint.replaced_bearing == {"contact.D_P": "76.0 mm"}
    own = tmp_path / "own.toml"
    own.write_text(joint_text(), encoding="utf-8")
    text = f"{HEAD}[tolerances]\n{H7_F7}\n{SAMPLING}".replace('"cirelli2021"', '"./own.toml"')
    loaded = study.load(tmp_path / "x.toml", text=text)
    assert plan.fit_in_words(loaded)[-1] == "fit: replaces contact.clearance = 0.03 mm of the joint file"
    assert plan.fit_in_words(load(OTHER)) == []


PUBLISHED = """
76 H7 0 30, 76 f7 -60 -30, 25 H7 0 21, 25 g6 -20 -7, 25 k6 2 15, 25 n6 15 28, 25 p6 22 35, 25 s6 35 48, 50 H11 0 160,
50 c11 -290 -130, 51 c11 -330 -140, 120 E8 72 126, 315 f9 -186 -56, 400 F8 62 151, 18 js5 -4 4, 40 k8 0 39, 3 h6 -6 0,
500 IT18 0 9700, 500 D10 230 480, 80 r6 43 62, 65 r6 41 60, 10 m6 6 15, 30 JS7 -10.5 10.5, 1 H01 0 0.3
"""
"""Limit deviations (um) of diameters (mm), from tables of ISO 286-2; E8 and f9 from its corrigendum of 2006."""


@pytest.mark.parametrize("row", [row.strip() for row in PUBLISHED.replace("IT", "H").split(",")])
def test_zones_are_those_of_published_tables(row: str) -> None:
    size, name, lower, upper = row.split()
    code = f"{name}/h6" if name[0].isupper() else f"H6/{name}"
    found = iso.zones(iso.parse(code), float(size))
    assert (found.hole if name[0].isupper() else found.shaft) == (float(lower), float(upper))


FACTORS = {5: 7, 6: 10, 7: 16, 8: 25, 9: 40, 10: 64, 11: 100, 12: 160, 13: 250, 14: 400, 15: 640, 16: 1000, 17: 1600}
"""Width of a zone over the standard tolerance factor i, by grade."""


def test_tables_follow_the_formulas_that_they_were_rounded_from() -> None:
    for row in iso.table(iso.GRADES)[1:]:
        mean = math.sqrt(row["over_mm"] * row["up_to_mm"])
        factor = 0.45 * mean ** (1 / 3) + 0.001 * mean
        for grade, times in FACTORS.items():
            assert row[f"IT{grade}"] == pytest.approx(times * factor, rel=0.06, abs=0.7)
        widths = list(row.values())[2:]
        assert widths == sorted(widths)
    forms = {"d": (-16, 0.44), "e": (-11, 0.41), "f": (-5.5, 0.41), "g": (-2.5, 0.34), "n": (5, 0.34)}
    for row in iso.table(iso.DEVIATIONS)[1:]:
        mean = math.sqrt(row["over_mm"] * row["up_to_mm"])
        for letter, (size, power) in forms.items():
            assert row[letter] == pytest.approx(size * mean**power, rel=0.08)
        values = list(row.values())[2:]
        assert values == sorted(values)


def test_ranges_follow_each_other() -> None:
    for name in (iso.GRADES, iso.DEVIATIONS):
        rows = iso.table(name)
        assert [row["over_mm"] for row in rows] == [0.0, *(row["up_to_mm"] for row in rows[:-1])]
        assert rows[-1]["up_to_mm"] == iso.LARGEST


def test_a_fit_sets_nominal_diameters_and_their_tolerances() -> None:
    loaded = load(H7_F7)
    diameters = [loaded.joint.contact.D_H, loaded.joint.contact.D_P]
    assert diameters == pytest.approx([76.015e-3, 75.955e-3], rel=1e-15)
    assert loaded.tolerances == {
        f"{kind}{i}.diameter": distributions.Normal(0.0, 5e-6) for kind in ("hole", "pin") for i in (1, 2, 3, 4)
    }
    # the same study, written without the fit
    keys = 'contact.D_H = "76.015 mm"\ncontact.D_P = "75.955 mm"'
    both = (
        '"hole*.diameter" = { plus_minus = "0.015 mm", distribution = "normal" }\n'
        + '"pin*.diameter" = { plus_minus = "0.015 mm", distribution = "normal" }'
    )
    assert loaded.identity() == load(both, keys).identity()


def test_drawn_clearances_lie_within_the_zones() -> None:
    loaded = load(H7_F7.replace('"normal", cpk = 1.0', '"uniform"'))
    errors = sampling.draw(loaded)
    clearance = joint.perturb(loaded.joint, loaded.operation, errors)["clearance"]
    assert clearance[0] == pytest.approx(30e-6, rel=1e-9)
    assert ((clearance > 15e-6) & (clearance < 45e-6)).all()
    assert np.ptp(clearance) > 5e-6


@pytest.mark.parametrize("contact", ["", 'contact.law = "uniform"', '[joint.contact]\nlaw = "uniform"'])
def test_a_scaled_fit_becomes_diameters(contact: str) -> None:
    loaded = load(H7_F7, contact)
    entries = {t.pattern: t.scaled(0.5) for t in scaling.tolerances(loaded) if t.pattern == fits.patterns(CARDAN)[0]}
    again = study.load(Path("x.toml"), text=scaling.rewritten(loaded, entries, 7))
    assert again.joint == loaded.joint
    assert again.tolerances["hole1.diameter"] == distributions.Normal(0.0, 2.5e-6)
    assert again.tolerances["pin1.diameter"] == distributions.Normal(0.0, 5e-6)
    assert scaling.rewritten(loaded, {}, 1) == loaded.text


@pytest.mark.parametrize(
    ("code", "scatter", "share"),
    [
        ("H7/k6", '"uniform"', (11.5) / 30),  # mean of the pin's deviation over the hole's width: pins stay within it
        ("H7/p6", '"uniform"', 1.0),
        ("H7/n6", '"normal"', stats.norm.cdf(14.5 / math.hypot(5.0, 19 / 6))),
        ("H7/js6", '"normal"', stats.norm.cdf(-15 / math.hypot(5.0, 19 / 6))),
    ],
)
def test_fits_that_do_not_go_together_are_refused_with_their_share(code: str, scatter: str, share: float) -> None:
    text = faults(f'fit = {{ basic = "76 mm", code = "{code}", distribution = {scatter} }}')
    kind = "an interference" if share == 1.0 else "a transition"
    assert f"x.toml: tolerances.fit.code: {code} is {kind} fit" in text
    assert (
        f"{100 * (1 - (1 - share) ** 4):.3g} % of the joints do not go together ({100 * share:.3g} % of the pairs)"
        in text
    )


def test_share_of_pins_that_are_larger_than_their_holes() -> None:
    hole, pin = distributions.Uniform(-1.0, 1.0), distributions.Uniform(-1.0, 1.0)
    for clearance, share in ((-2.0, 1.0), (-1.0, 0.875), (0.0, 0.5), (1.0, 0.125), (2.0, 0.0)):
        assert fits.larger(pin, hole, clearance) == pytest.approx(share, abs=3e-4)
    normal = distributions.Normal(0.1, 0.3)
    almost = distributions.TruncatedNormal(0.1, 0.3, -9.0, 9.0)
    assert fits.larger(normal, normal, 0.4) == pytest.approx(stats.norm.sf(0.4 / math.hypot(0.3, 0.3)), rel=1e-12)
    assert fits.larger(almost, almost, 0.4) == pytest.approx(fits.larger(normal, normal, 0.4), rel=1e-3)


def test_a_clearance_fit_may_reach_beyond_its_zones() -> None:
    text = 'basic = "76 mm", code = "H7/h6", distribution = '
    found = fits.of({"basic": "76 mm", "code": "H7/h6", "distribution": "normal"}, "x", CARDAN)
    assert found is not None
    assert found.misfit == pytest.approx(stats.norm.sf(24.5 / math.hypot(5.0, 19 / 6)), rel=1e-9)
    assert fits.any_pair(found.misfit, 4) == pytest.approx(4 * found.misfit, rel=1e-4)
    assert found.meaning == [
        "fit H7/h6 at 76 mm: hole 0 to +30 um, pin -19 to 0 um",
        "fit: hole less pin 0 to 49 um, radial clearance 0 to 24.5 um",
        f"fit: {400 * found.misfit:.3g} % of the joints do not go together",
    ]
    bounded = fits.of({"basic": "76 mm", "code": "H7/h6", "distribution": "uniform"}, "x", CARDAN)
    assert bounded is not None
    assert bounded.misfit == 0.0
    assert len(bounded.meaning) == 2
    assert load(f"fit = {{ {text}'uniform' }}").joint.contact.D_P < 76e-3


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ('fit = "H7/f7"', ["tolerances.fit: 'H7/f7' is not a fit", 'fit = { basic = "76 mm"']),
        ('fit = { basic = "760 mm", code = "H7/f7", distribution = "uniform" }', ["fit.basic", "'760 mm' is outside"]),
        (H7_F7.replace("H7/f7", "f7/H7"), ["fit.code", "'f7/H7' is not the class of a hole"]),
        (H7_F7.replace("H7", "K7"), ["fit.code", "no hole K, only C, D, E, F, G, H, JS"]),
        (H7_F7.replace("f7", "zz7"), ["fit.code", "no shaft zz, only c, d"]),
        (H7_F7.replace("f7", "f19"), ["fit.code", "no grade IT19"]),
        (H7_F7.replace("normal", "uniform"), ['fit.cpk: has no effect with distribution = "uniform"']),
        (H7_F7.replace("cpk = 1.0", 'plus_minus = "1 mm"'), ["fit.plus_minus: unknown key"]),
        ('fit = { basic = "76 mm", code = "H7/f7", distribution = "beta" }', ["fit.a: missing", "fit.b: missing"]),
        (
            H7_F7 + '\n"pin*.diameter" = { plus_minus = "1 um", distribution = "normal" }',
            ["tolerances.pin*.diameter: pin4.diameter is set by tolerances.fit already"],
        ),
    ],
)  # fmt: skip
def test_faults_of_a_fit(entry: str, words: list[str]) -> None:
    text = faults(entry)
    for word in words:
        assert word in text


def test_a_fit_and_diameters_of_the_joint_are_a_fault() -> None:
    text = faults(H7_F7, 'contact.D_H = "76.3 mm"\ncontact.D_P = "76 mm"')
    assert "joint.contact.D_H: is set by tolerances.fit already" in text
    assert "joint.contact.D_P: is set by tolerances.fit already" in text


def test_a_clearance_beside_a_fit_is_one_fault() -> None:
    text = faults(H7_F7, 'contact.clearance = "0.05 mm"')
    assert text.count("hint:") == 1
    assert "joint.contact.clearance: is set by tolerances.fit already" in text
