"""Studies that list their joints: which rows they make, what joint each row is, and what their faults say."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from tests.campaign.test_campaign import datasets
from tests.support import fakes
from tests.support.environment import ROOT
from tests.support.mechanisms import lump_kind
from tolstat import joint, sampling, study
from tolstat.campaign import run as campaign
from tolstat.common.errors import InputError, StoreError
from tolstat.solver import simulation
from tolstat.store import ResultFile, Writer, recorded
from tolstat.study import Study

PAPER = ROOT / "studies" / "cirelli2021" / "cirelli2021.toml"

TEXT = """
[joint]
base = "cirelli2021"
contact.z = "20 mm"
[operation]
alpha = "5 deg"
speed = "500 rpm"
torque = "100 N*m"
[solver]
steps_per_rev = 60
[sampling]
method = "cases"
[grid]
"operation.alpha" = ["0 deg", "15 deg"]
"pin*.diameter" = ["0 mm", "-0.02 mm", "-0.04 mm"]
[[case]]
name = "a"
errors.hole4.offset_t = "0.1 mm"
[[case]]
name = "b"
errors = { "pin[12].tilt_z" = "-0.5 deg", pin1.offset_z = "20 um" }
[[variant]]
name = "plain"
[[variant]]
name = "clearance"
points = 3
vary.contact.D_P = { from = "76.0 mm", to = "75.6 mm" }
cases = ["b"]
[[variant]]
name = "search"
joint.contact.law = "point"
design = "sobol"
points = 8
seed = 5
vary."contact.D_P" = { from = "75.8 mm", to = "76.1 mm" }
vary.cross.R = { from = "60 mm", to = "90 mm" }
cases = []
"""


def load(folder: Path, *changes: tuple[str, str], text: str = TEXT) -> Study:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return study.load(folder / "study.toml")


def test_rows_are_variants_by_points_by_cases(tmp_path: Path) -> None:
    s = load(tmp_path)
    assert s.case_names == ("ideal", "a", "b")
    assert [v.family for v in s.variants] == ["plain"] + 3 * ["clearance"] + 8 * ["search"]
    assert s.rows == 6 * (3 + 3 * 2 + 8 * 1)
    design = s.design
    assert design["variant"].tolist() == 18 * [0] + 12 * [1] + 12 * [2] + 12 * [3] + [4 + i // 6 for i in range(48)]
    assert design["case"].tolist() == 6 * [0, 1, 2] + 18 * [0, 2] + 48 * [0]
    groups, first = np.unique(design["group"], return_index=True)
    assert groups.tolist() == list(range(72))
    assert (design["case"][first] == 0).all()


def test_errors_of_a_row_are_its_case_at_its_point_of_the_grid(tmp_path: Path) -> None:
    s = load(tmp_path)
    errors = sampling.draw(s)
    assert len(errors) == s.rows
    alpha = joint.operating(s.operation, errors)["alpha"]
    np.testing.assert_allclose(np.degrees(alpha[:18]), 9 * [0.0] + 9 * [15.0])
    np.testing.assert_allclose(errors["pin3.diameter"][:9], 3 * [0.0] + 3 * [-2e-5] + 3 * [-4e-5])
    np.testing.assert_allclose(errors["hole4.offset_t"][:3], [0, 1e-4, 0])
    np.testing.assert_allclose(np.degrees(errors["pin2.tilt_z"][18:22]), [0, -0.5, 0, -0.5])
    np.testing.assert_allclose(errors["pin1.offset_z"][18:20], [0, 2e-5])
    assert (errors["operation.torque"] == 0.0).all()
    assert (errors["pin3.tilt_z"] == 0.0).all()


def test_a_family_is_a_line_that_meets_written_values_exactly(tmp_path: Path) -> None:
    s = load(tmp_path)
    assert [v.values for v in s.variants[:4]] == [
        {},
        {"contact.D_P": 0.076},
        {"contact.D_P": 0.0758},
        {"contact.D_P": 0.0756},
    ]
    assert [j.contact.D_P for j in s.joints[:4]] == [0.076, 0.076, 0.0758, 0.0756]
    assert s.joints[0] == s.joint
    assert {j.contact.z for j in s.joints} == {0.02}


def test_a_sobol_family_fills_its_box(tmp_path: Path) -> None:
    s = load(tmp_path)
    boxes = [{key: value for key, value in v.values.items() if value is not None} for v in s.variants[4:]]
    assert all(box["contact.law"] == "point" and len(box) == 3 for box in boxes)
    for key, low, high in (("contact.D_P", 0.0758, 0.0761), ("cross.R", 0.06, 0.09)):
        share = (np.array([box[key] for box in boxes]) - low) / (high - low)
        # a scrambled Sobol' sequence has one of its first eight points in each eighth of every axis
        assert sorted(np.floor(8 * share)) == list(range(8))
    assert [(j.contact.D_P, j.cross.R) for j in s.joints[4:]] == [(b["contact.D_P"], b["cross.R"]) for b in boxes]
    more = load(tmp_path, ("points = 8", "points = 11"))
    assert more.variants[4:12] == s.variants[4:]
    other = load(tmp_path, ("seed = 5", "seed = 6"))
    assert all(a != b for a, b in zip(s.variants[4:], other.variants[4:], strict=True))


def test_a_variant_may_be_another_joint_file(tmp_path: Path) -> None:
    source = (ROOT / "data" / "joints" / "cirelli2021.toml").read_text(encoding="utf-8")
    (tmp_path / "light.toml").write_text(source.replace('mass = "1.0 kg"', 'mass = "0.5 kg"'), encoding="utf-8")
    s = load(tmp_path, ('name = "plain"', 'name = "light"\njoint.base = "light.toml"\njoint.cross.r_b = "36.41 mm"'))
    assert s.variants[0].values == {"hub.mass": 0.5, "cross.r_b": 0.03641}
    assert s.joints[0].contact.z == 0.02


def test_without_grid_and_variants_the_joint_as_it_is(tmp_path: Path) -> None:
    s = load(tmp_path, text=TEXT[: TEXT.index("[grid]")] + '[[case]]\nname = "a"\nerrors.pin1.tilt_t = "1 deg"\n')
    assert s.joints == (s.joint,)
    assert s.variants == (("joint", {}, ""),)
    assert s.design.tolist() == [(0, 0, 0), (0, 1, 0)]
    assert sampling.draw(s)["operation.alpha"].tolist() == [0.0, 0.0]
    assert s.operations[0].alpha == np.radians(5)


def test_other_methods_have_one_joint(tmp_path: Path) -> None:
    s = study.load(ROOT / "studies" / "iso2768_f.toml")
    assert s.joints == (s.joint,)
    assert (s.variants, s.case_names) == ((), ())
    assert s.design.tolist() == s.rows * [(0, 0, 0)]
    with Writer.create(tmp_path / "a.h5", s, [sampling.draw(s)]) as store:
        assert (store.variants, store.case_names) == ((), ())
        with pytest.raises(StoreError, match="has no list of variants"):
            _ = store.design


def test_identity_tells_what_decides_the_numbers(tmp_path: Path) -> None:
    same = load(tmp_path).identity()
    assert load(tmp_path, ('"0.1 mm"', '"1e-4 m"'), ("[sampling]", "# a comment\n[sampling]")).identity() == same
    for change in [
        ('"0.1 mm"', '"0.2 mm"'),
        ('name = "a"', 'name = "c"'),
        ('"15 deg"', '"16 deg"'),
        ("points = 3", "points = 4"),
        ("seed = 5", "seed = 6"),
        ('law = "point"', 'law = "uniform"'),
        ('cases = ["b"]', 'cases = ["a"]'),
        ('name = "clearance"', 'name = "gap"'),
    ]:
        assert load(tmp_path, change).identity() != same, change


def small(folder: Path, histories: str = "none") -> Study:
    text = (
        TEXT[: TEXT.index("[grid]")]
        + f"""
[[case]]
name = "a"
errors.hole4.tilt_z = "0.3 deg"
[[variant]]
name = "R"
points = 3
vary.cross.R = {{ from = "60 mm", to = "80 mm" }}
[output]
histories = "{histories}"
"""
    )
    return load(folder, ('alpha = "5 deg"', 'alpha = "0 deg"'), text=text)


@pytest.mark.slow
def test_variants_can_have_numbers_of_stations_of_their_own(tmp_path: Path) -> None:
    """Laws with more and with fewer stations than `mode`: replayed from the file."""
    head, _, rest = TEXT.partition("[grid]")
    cases = rest[rest.index("[[case]]") : rest.index("[[variant]]")]
    variants = "".join(
        f'[[variant]]\nname = "{name}"\n{own}\n'
        for name, own in (("mode", ""), *((law, f'joint.contact.law = "{law}"') for law in ("point", "sliced")))
    )
    s = load(tmp_path, text=head.replace('contact.z = "20 mm"\n', "") + cases + variants)
    assert campaign.run(s, tmp_path / "a.h5", workers=1, block=4).unsettled == 0
    with ResultFile.open(tmp_path / "a.h5") as store:
        results, variant = store.results(), store.design["variant"]
        params = recorded.parameters(store, np.arange(s.rows))
    assert params["n_stations"][:, 0].tolist() == [(3, 2, 5)[v] for v in variant]
    again = simulation.simulate_rows(params, s.solver.options()).results
    np.testing.assert_array_equal(again["F_max"], results["F_max"])


def test_each_row_runs_with_its_own_joint(tmp_path: Path) -> None:
    s = small(tmp_path)
    assert campaign.run(s, tmp_path / "a.h5", workers=1, block=4).unsettled == 0
    with ResultFile.open(tmp_path / "a.h5") as store:
        results, design, errors = store.results(), store.design, store.errors()
        assert store.variants == s.variants
        assert store.case_names == s.case_names
    assert design.tolist() == s.design.tolist()
    radius = np.array([v.values["cross.R"] for v in s.variants])
    ideal = results["contact_max"][design["case"] == 0]
    # statics: each of four pins carries T / (2 (R + z/2)) at its outer end; centrifugal load adds little
    np.testing.assert_allclose(ideal[:, :, 0], np.outer(100 / (2 * (radius + 0.01)), np.ones(4)), rtol=2e-3)
    for row in range(s.rows):
        variant = design["variant"][row]
        own = joint.perturb(s.joints[variant], s.operations[variant], errors[[row]])
        again = simulation.simulate_rows(own, s.solver.options())
        np.testing.assert_array_equal(again.results["T_max"][0], results["T_max"][row])


@pytest.mark.slow
def test_workers_blocks_and_interruptions_change_no_byte(tmp_path: Path) -> None:
    s = load(tmp_path)

    def perturb(of: joint.Joint, operation: joint.Operation, errors: np.ndarray) -> np.ndarray:
        params = fakes.perturb(of, operation, errors)
        params["alpha"] = of.contact.D_P * 100 + (of.contact.law == "point") * of.cross.R
        return params

    run = partial(fakes.run, check=True, draw_blocks=sampling.draw_blocks, perturb=perturb)
    run(s, tmp_path / "a.h5", 1, 5)
    expected = datasets(tmp_path / "a.h5")
    assert {"design/variant", "design/case", "design/group"} <= expected.keys()

    def interrupt(counts: object) -> None:
        if counts.done >= 40:
            raise KeyboardInterrupt

    with pytest.raises(campaign.Interrupted):
        run(s, tmp_path / "b.h5", 2, 7, progress=interrupt)
    run(s, tmp_path / "b.h5", 1, 100)
    assert datasets(tmp_path / "b.h5") == expected
    changed = load(tmp_path, ('"75.6 mm"', '"75.5 mm"'))
    with pytest.raises(StoreError, match=r"contact.D_P: 0.0756 in the file, 0.0755 in the study"):
        run(changed, tmp_path / "b.h5", 1)


FAULTS = {
    "unknown case": (('["b"]', '["c"]'), "variant[1].cases: no case 'c'"),
    "case of two names": (('name = "a"', 'name = "b"'), "case[1].name: a case 'b' exists already"),
    "ideal by hand": (('name = "a"', 'name = "ideal"'), "case[0].name: a case 'ideal' exists already"),
    "no errors": (('errors.hole4.offset_t = "0.1 mm"', "errors = {}"), "case[0]: has neither errors nor file"),
    "no unit": (('"0.1 mm"', "0.1"), "case[0].errors.hole4.offset_t: 0.1 has no unit"),
    "error of nothing": (("hole4.offset_t", "hole5.offset_t"), "case[0].errors.hole5.offset_t: selects nothing"),
    "operation as error": (("hole4.offset_t", "operation.alpha"), "operation.alpha: is not an error"),
    "case and grid": (
        ("pin1.offset_z", "pin1.diameter"),
        "case[1].errors.pin1.diameter: pin1.diameter is set by grid.pin*.diameter already",
    ),
    "grid value": (('"15 deg"]', '"15 mm"]'), "grid.operation.alpha[1]: '15 mm' cannot be a value in rad"),
    "grid is no list": (('["0 deg", "15 deg"]', '"0 deg"'), "grid.operation.alpha: '0 deg' is not a list"),
    "grid of nothing": (('"pin*.diameter"', '"pin*.diam"'), "grid.pin*.diam: selects nothing"),
    "unknown law": (('"point"', '"pointy"'), "variant[2].joint.contact.law: 'pointy' is not allowed"),
    "unknown key": (("vary.contact.D_P", "vary.contact.D_X"), "variant[1].vary.contact.D_X: unknown key"),
    "base that is no text": (
        ('name = "plain"', 'name = "p"\njoint.base = 3'),
        "variant[0].joint.base: 3 is not a text",
    ),
    "unknown base": (('name = "plain"', 'name = "p"\njoint.base = "x"'), "variant[0].joint.base: no joint is named"),
    "vary without unit": (('to = "75.6 mm"', "to = 75.6"), "variant[1].vary.contact.D_P: 75.6 has no unit"),
    "vary beyond": (('to = "75.6 mm"', 'to = "77 mm"'), "variant[1].vary.contact.D_P: a pin of 77 mm does not fit"),
    "vary a word": (
        (
            'vary.contact.D_P = { from = "76.0 mm", to = "75.6 mm" }',
            'vary.contact.law = { from = "mode", to = "point" }',
        ),
        "variant[1].vary.contact.law: 'mode' is not a quantity",
    ),
    "vary nothing": (('to = "75.6 mm"', 'to = "76 mm"'), "variant[1].vary.contact.D_P: from and to are equal"),
    "vary without end": ((', to = "75.6 mm"', ""), "variant[1].vary.contact.D_P.to: missing key"),
    "no points": (("points = 3", ""), "variant[1]: vary without points"),
    "points alone": (('name = "plain"', 'name = "plain"\npoints = 4'), "variant[0]: points without vary"),
    "seed of a line": (("points = 3", "points = 3\nseed = 1"), "variant[1]: seed without a random design"),
    "n": (('method = "cases"', 'method = "cases"\nn = 8'), "sampling: n is given with 'cases'"),
    "nominal": (('"cases"\n', '"cases"\nnominal_first = true\n'), "sampling: nominal_first is given with 'cases'"),
    "scatter": (
        ("[grid]", '[tolerances]\npin1.offset_t = { plus_minus = "1 mm" }\n[grid]'),
        "tolerances: has no effect with 'cases'",
    ),
    "fixed errors": (("[grid]", '[errors]\npin3.offset_t = "1 um"\n[grid]'), "errors: has no effect with 'cases'"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_told_with_its_place(name: str, tmp_path: Path) -> None:
    change, found = FAULTS[name]
    with pytest.raises(InputError) as caught:
        load(tmp_path, change)
    assert found in str(caught.value)
    own = [f for f in caught.value.faults if "tolerances" not in f.place]
    assert len(own) <= 1, caught.value.faults


def test_all_faults_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load(tmp_path, ('"0.1 mm"', "0.1"), ('"15 deg"]', '"15 mm"]'), ("seed = 5", "seed = -5"))
    places = {fault.place.split(": ")[1] for fault in caught.value.faults}
    assert places == {"case[0].errors.hole4.offset_t", "grid.operation.alpha[1]", "variant[2].seed"}


@pytest.mark.parametrize("section", ["grid", "case", "variant"])
def test_lists_need_the_method(section: str, tmp_path: Path) -> None:
    header = "[grid]" if section == "grid" else f"[[{section}]]"
    text = (ROOT / "studies" / "clearance.toml").read_text(encoding="utf-8") + header
    with pytest.raises(InputError, match=f"{section}: has no effect with 'sweep'"):
        load(tmp_path, text=text)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("case = 3", "case"),
        ("case = [3]", "case[0]"),
        ("variant = {}\n" + 'case = [{ name = "a", errors.pin1.tilt_t = "1 deg" }]', "variant"),
        ("grid = []\n" + 'case = [{ name = "a", errors.pin1.tilt_t = "1 deg" }]', "grid"),
    ],
)
def test_sections_of_another_kind(text: str, place: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load(tmp_path, text=text + TEXT[: TEXT.index("[grid]")])
    assert [fault.place.split(": ")[1] for fault in caught.value.faults] == [place]


def test_the_method_needs_cases(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        load(tmp_path, text=TEXT[: TEXT.index("[grid]")])
    assert [fault.place.split(": ")[1] for fault in caught.value.faults] == ["case"]
    assert "add [[case]]" in str(caught.value)


@pytest.mark.slow
def test_the_paper_as_printed() -> None:
    s = study.load(PAPER)
    (number,) = (i for i, v in enumerate(s.variants) if v.family == "as printed")
    printed = {"material.rho": 7.7e-6, "arm.mass": 0.3516, "contact.c_d": 3.71e8}
    absent = dict.fromkeys(("shaft.mass", "shaft.axial", "shaft.axial_damping", "friction.radius"))
    assert s.variants[number].values == printed | absent
    printed = s.joints[number]
    # eqs. (6)-(7) with the printed density in SI: 2 xi m (pi / l)^2 sqrt(E J / (rho A))
    c_d = 2 * 0.05 * 0.32 * (np.pi / 0.03641) ** 2 * np.sqrt(210e9 * 1.02e-7 / (7.70e-6 * 11.34e-4))
    assert c_d == pytest.approx(3.71e8, rel=0.01)
    assert printed.contact.c_d == 3.71e8
    assert joint.perturb(printed, s.operations[0], sampling.draw(s)[:1])["mass"][0, lump_kind("arm")] == 0.3516


@pytest.mark.slow
def test_the_paper_s_cases_and_choices() -> None:
    s = study.load(PAPER)
    errors = sampling.draw(s)
    assert set(np.degrees(errors["operation.alpha"]).round(9)) == {0.0, 15.0}
    first = errors[s.design["group"] == 0]
    assert len(first) == len(s.case_names) == 21
    moved = [name for name in errors.dtype.names if name[:3] in ("pin", "hol") and (errors[name] != 0).any()]
    assert moved == [
        f"{part}.{key}"
        for part in ("pin1", "hole4")
        for key in ("offset_e", "offset_t", "offset_z", "tilt_t", "tilt_z")
    ]
    for name in moved:
        size = 1e-4 if "offset" in name else np.radians(0.5)
        np.testing.assert_allclose(np.sort(first[name]), [-size] + 19 * [0.0] + [size])
    clearance = [
        j.contact.D_H - j.contact.D_P for j, v in zip(s.joints, s.variants, strict=True) if v.family == "clearance"
    ]
    for diametral in (0.0, 0.2e-3, 0.02 * 38e-3, 0.8e-3, 0.02 * 76e-3):
        assert np.abs(np.array(clearance) - diametral).min() < 1e-12
    laws = [
        j.contact.law for j, v in zip(s.joints, s.variants, strict=True) if v.family in ("mode", "point", "uniform")
    ]
    assert laws == ["mode", "point", "uniform"]
