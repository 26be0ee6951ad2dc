"""The paper's tables and statics: printed values, Gamma, distances and the bound, each against a hand calculation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import stats

from studies.cirelli2021 import choices as paper_choices
from studies.cirelli2021 import distances as paper_distances
from studies.cirelli2021 import spectra as paper_spectra
from studies.cirelli2021 import statics as paper_statics
from studies.cirelli2021 import tables as paper
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Status, tables
from tolstat.joint import ideal
from tolstat.questions.sweep import relative_errors


def test_printed_tables_have_128_entries_in_the_paper_s_order():
    table = paper.printed()
    assert table.cases == ("Pos fork", "Ang fork", "Pos cross", "Ang cross")
    assert_allclose(np.degrees(table.alpha), [0.0, 15.0])
    assert table.gamma.shape == (4, 2, 8, 2)
    assert np.isfinite(table.gamma).all()
    assert table.tables.tolist() == [[4, 6], [5, 7]]
    lines = [n for n in Path(paper.__file__).with_name("tables.csv").read_text().splitlines() if n[:1].isdigit()]
    assert len(set(lines)) == 64


@pytest.mark.parametrize(
    ("number", "totals"),  # column sums of each printed table, added up by hand: F and T of its four bushings
    [
        (4, [57.4, 57.9, 33.9, 64.6, 1.8, 2.7, 2.4, 0.6]),
        (5, [47.5, 53.5, 30.3, 55.3, 1.3, 0.2, 1.2, 0.3]),
        (6, [2.0, 0.1, 2.4, 0.8, 33.4, 61.7, 57.5, 60.0]),
        (7, [1.1, 3.7, 1.6, 3.6, 30.3, 54.1, 47.5, 52.7]),
    ],
)
def test_printed_values_by_their_column_sums(number, totals):
    table = paper.printed()
    (a,), (group,) = np.where(table.tables == number)
    part = table.gamma[:, a, 4 * group : 4 * group + 4]
    assert_allclose(part.sum(axis=0).ravel(), totals, atol=1e-9)


def test_the_same_force_passes_pin_and_hole_in_the_printed_tables():
    """Cross bushing 1 and fork bushing 4 carry one contact, 2 and 3 the other: their Gamma_F agree."""
    gamma = paper.printed().gamma[..., 0]
    for cross, fork in (("cross1", "fork4"), ("cross2", "fork3")):
        apart = np.abs(gamma[:, :, paper.BUSHINGS.index(cross)] - gamma[:, :, paper.BUSHINGS.index(fork)])
        assert apart[:, 1].max() <= 0.01
        assert apart[:, 0].max() <= 0.5


def test_speed_ratio_of_equation_2():
    alpha = np.radians(15.0)
    assert_allclose(ideal.speed_ratio([0.0, np.pi / 2], alpha), [1.0 / np.cos(alpha), np.cos(alpha)], rtol=1e-15)
    theta = np.linspace(0.0, 2.0 * np.pi, 2001)
    slope = np.gradient(ideal.output_angle(theta, alpha), theta)
    assert_allclose(ideal.speed_ratio(theta, alpha)[1:-1], slope[1:-1], atol=1e-5)
    assert ideal.speed_ratio(theta, alpha).mean() == pytest.approx(1.0, abs=1e-4)


def results(force, torque):
    table = np.zeros(len(force), tables(CARDAN).RESULT)
    table["F_max"], table["T_max"] = np.asarray(force)[:, None], np.asarray(torque)[:, None]
    table["status"] = Status.OK
    return table


def test_gamma_is_relative_to_the_first_row_of_its_group():
    table = results([100.0, 110.0, 200.0, 150.0], [10.0, 8.0, 20.0, 20.0])
    gamma = relative_errors(table, np.array([0, 0, 7, 7], "i4"))
    assert_allclose(gamma[:, 3], [[0.0, 0.0], [10.0, -20.0], [0.0, 0.0], [-25.0, 0.0]])


def test_gamma_of_joints_that_did_not_settle_is_unknown():
    table = results([100.0, 110.0, 200.0, 150.0], [10.0, 8.0, 20.0, 20.0])
    table["status"][[1, 2]] = Status.NOT_SETTLED, Status.NEWTON_FAILED
    gamma = relative_errors(table, np.array([0, 0, 1, 1], "i4"))
    assert np.isnan(gamma[1:]).all()
    assert (gamma[0] == 0.0).all()


def test_directions_of_a_printed_case():
    cases = ("ideal", "Pos fork +e", "Pos fork -z", "Pos forked", "Ang fork +t", "Pos cross")
    assert paper.directions("Pos fork", cases) == [1, 2]
    assert paper.directions("Pos cross", cases) == [5]
    assert not paper.covers(cases, np.radians([0.0, 15.0]))
    all_four = ("ideal", *(f"{name} +t" for name in paper.printed().cases))
    assert paper.covers(all_four, np.radians([0.0, 15.0]))
    assert not paper.covers(all_four, np.radians([0.0, 10.0]))


def test_the_nearest_direction_is_found_and_a_perfect_model_has_no_distance():
    table = paper.printed()
    cases = ("ideal", *(f"{name} {sign}t" for name in table.cases for sign in "+-"))
    right = np.array([1, -1, -1, 1]).reshape(4, 1, 1, 1) * table.gamma  # signs are not printed
    rows = [(2 * c + 1 + (c % 2), a, right[c, a]) for a in (0, 1) for c in range(4)]
    rows += [(2 * c + 2 - (c % 2), a, right[c, a] + 1.0 * np.sign(right[c, a])) for a in (0, 1) for c in range(4)]
    case, where = np.array([r[0] for r in rows], "i4"), table.alpha[[r[1] for r in rows]]
    value = np.array([r[2] for r in rows])
    matches = paper.nearest(value, case, where, cases)
    assert [m.case for m in matches] == ["Pos fork +t", "Ang fork -t", "Pos cross +t", "Ang cross -t"] * 2
    assert [m.row for m in matches] == list(range(8))
    found = paper_distances.distances(paper.tabulated(value, matches))
    assert [d.table for d in found] == [4, 5, 6, 7, 0, -1]
    for d in found:
        assert (d.median, d.mean, d.worst) == (0.0, 0.0, 0.0)
        assert d.correlation == pytest.approx(1.0)
    assert all(m.ties == () for m in matches)
    fit = paper_choices.fits(value, np.zeros(len(case), "i4"), case, where, cases)[0]
    assert fit.objective == 0.0
    assert fit.cases == tuple(m.case for m in matches[:4])


def test_with_the_sign_a_decrease_is_no_increase_and_ties_are_named():
    table = paper.printed()
    cases = ("ideal", *(f"{name} {direction}" for name in table.cases for direction in ("-t", "+t", "+z")))
    rows = [(3 * c + 1 + k, a) for a in (0, 1) for c in range(4) for k in range(3)]
    factor = (-1.0, 0.5, 0.5)  # the right size with the wrong sign; half of it with the right sign, twice
    value = np.array([factor[(number - 1) % 3] * table.gamma[(number - 1) // 3, a] for number, a in rows])
    case, where = np.array([number for number, _ in rows], "i4"), table.alpha[[a for _, a in rows]]
    by_modulus = paper.nearest(value, case, where, cases)
    by_sign = paper.nearest(value, case, where, cases, signed=True)
    assert [m.case for m in by_modulus] == [f"{name} -t" for name in table.cases] * 2
    assert [m.case for m in by_sign] == [f"{name} +t" for name in table.cases] * 2
    assert [m.ties for m in by_sign] == [(f"{name} +z",) for name in table.cases] * 2
    assert by_sign[0].distance == pytest.approx(0.5 * table.gamma[0, 0].mean())
    whole = paper_distances.distances(paper.tabulated(value, by_modulus), signed=True)[4]
    assert whole.mean == pytest.approx(2.0 * table.gamma.mean())
    assert whole.correlation == pytest.approx(-1.0)


def test_distances_against_numpy_and_scipy():
    rng = np.random.default_rng(5)
    table = paper.printed()
    made = table.gamma + rng.normal(0.0, 3.0, table.gamma.shape)
    four = paper_distances.distances(made)[0]
    x, y = np.abs(made[:, 0, :4]).ravel(), table.gamma[:, 0, :4].ravel()
    assert four.median == np.median(np.abs(x - y))
    assert four.worst == np.abs(x - y).max()
    assert four.correlation == pytest.approx(np.corrcoef(stats.rankdata(x), stats.rankdata(y))[0, 1])
    *_, nothing, output = paper_distances.distances(np.zeros_like(made))
    assert nothing.mean == pytest.approx(paper_choices.no_effect()) == pytest.approx(table.gamma.sum() / 128)
    assert np.isnan(nothing.correlation)
    side = [paper.BUSHINGS.index(name) for name in ("cross1", "cross2", "fork3", "fork4")]
    assert output.mean == pytest.approx(table.gamma[:, :, side].mean())
    assert [d.label for d in (four, nothing, output)] == ["Table 4", "all four", "output side only"]


def test_sweeps_and_searches_are_told_apart():
    families = ("mode", "gap", "gap", "gap", "all", "all", "all")
    values = (
        {},
        {"a": 3.0},
        {"a": 1.0},
        {"a": 2.0},
        *({"a": x, "b": y, "law": "m"} for x, y in ((1.0, 2.0), (2.0, 1.0), (3.0, 3.0))),
    )
    (sweep,) = paper_choices.sweeps(families, values)
    assert (sweep.family, sweep.key) == ("gap", "a")
    assert sweep.values.tolist() == [1.0, 2.0, 3.0]
    assert sweep.variants.tolist() == [2, 3, 1]
    assert paper_choices.searched(families, values) == ([4, 5, 6], ["a", "b"])


def test_amplitudes_of_known_waves():
    theta = np.arange(48) * 2.0 * np.pi / 48
    wave = 5.0 + 3.0 * np.cos(2 * theta + 0.4) + 0.5 * np.sin(theta)
    assert_allclose(paper_spectra.amplitudes(wave[None], 4)[0], [5.0, 0.5, 3.0, 0.0, 0.0], atol=1e-12)
    nyquist = np.cos(24 * theta)
    assert paper_spectra.amplitudes(nyquist[None], 24)[0, 24] == pytest.approx(1.0)


def test_moduli_of_a_load():
    loads = np.zeros((1, 2, 8, 6))
    loads[0, 1, 4] = 2.0, 3.0, 6.0, 0.0, 3.0, 4.0
    assert_allclose(paper_spectra.moduli(loads)[0, 1, 4], [7.0, 5.0])
    assert paper_spectra.moduli(loads).sum() == 12.0


IDEAL = paper_statics.Loads(force=600.0, torque=28.3, resisting=100.0, arm=0.0364)
parts = st.floats(-1.0, 1.0)


@settings(max_examples=300, deadline=None)
@given(t=st.floats(0.5, 1.6), s=st.floats(0.9, 1.1), axial=st.tuples(parts, parts, parts), bend=st.tuples(*[parts] * 4))
def test_the_bound_holds_for_every_cross_in_equilibrium(t, s, axial, bend):
    """Forces that balance by construction, with couples that make up T_r: their F1, F2 must never break the bound."""
    tangential = IDEAL.tangential * np.array([t, t, s, s])
    a = np.array([axial[0], axial[1], 0.2 * axial[2], 0.0]) * 300.0
    a[3] = -a[:3].sum()
    radial = IDEAL.force**2 - IDEAL.tangential**2
    force = np.sqrt(tangential**2 + a**2 + radial)
    about_z = 0.5 * IDEAL.resisting - IDEAL.arm * tangential  # each pin's couple, so that two of them give T_r
    torque = np.hypot(about_z, 10.0 * np.array(bend))
    gamma = 100.0 * np.column_stack([force / IDEAL.force - 1.0, torque / IDEAL.torque - 1.0])
    found = paper_statics._test("made up", gamma, IDEAL)
    assert found.high <= found.allowed + 1e-6
    assert found.possible


def test_position_errors_of_table_4_contradict_statics():
    found = {c.case: c for c in paper_statics.contradictions(IDEAL)}
    assert [name for name, c in found.items() if not c.possible] == ["Pos fork", "Pos cross"]
    assert found["Pos fork"].axial == pytest.approx(np.sqrt(1.178**2 - 1.002**2))
    assert (found["Pos cross"].low, found["Pos cross"].high) == (0.6, 17.0)


def test_exclusions_over_joints_name_the_ranges_of_each_verdict():
    """A bushing marker further out sees less torque: less is left to trade for axial force."""
    arms = np.array([0.0164, 0.0364, 0.0564])
    force, lever = 600.0, 0.0838
    ideals = [paper_statics.Loads(force, 50.0 - arm * 50.0 / lever, 100.0, arm) for arm in arms]
    single = [paper_statics.contradictions(ideal) for ideal in ideals]
    for c, line in enumerate(paper_statics.exclusions(ideals, arms / 0.0728)):
        out = [not joint[c].possible for joint in single]
        assert line.excluded == sum(out)
        assert line.joints == 3
        assert line.allowed == (min(j[c].allowed for j in single), max(j[c].allowed for j in single))
        ends = [float(f(arms[out])) / 0.0728 if any(out) else np.nan for f in (np.min, np.max) if any(out)]
        assert_allclose(line.out, ends or [np.nan] * 2)
        assert np.isnan(line.room).all() == all(out)
    assert {line.case: line.excluded for line in paper_statics.exclusions(ideals, arms)}["Ang fork"] == 0
