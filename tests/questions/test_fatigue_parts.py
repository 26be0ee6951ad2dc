"""Stresses at points of the parts: from load components, starts, duty cycles, the command, the page."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

import tolstat
from tests.questions.test_fatigue_campaign import SCATTER
from tests.support.reports import call
from tests.support.synthetic import store as store_of
from tolstat.analysis import strength
from tolstat.analysis.cycles import Cycles
from tolstat.analysis.design import Independent
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.common.load_kinds import kinds
from tolstat.common.tables import Status
from tolstat.display import text
from tolstat.questions.fatigue import counting, parts
from tolstat.questions.fatigue.answer import _notes_on_parts, _verdict, life_verdicts
from tolstat.questions.fatigue.counting import ANY, Counted, Joints, settings_of
from tolstat.questions.fatigue.parts import load_stresses
from tolstat.solver import histories
from tolstat.store import ResultFile
from tolstat.study.fatigue import Fatigue, StressPoint, of_text

STUDY = (
    SCATTER
    + """[fatigue]
revolutions = 1e9
starts = 1e4
[fatigue.point.weld]
bushing = "fork[12]"
F_z = "2.5 MPa/kN"
T_e = "-0.2 MPa/Nm"
k = 3
N_D = 1e7
S_aD = "9 MPa"
T_N = 3.4
[fatigue.point."pin root"]
bushing = "cross3"
T_t = "0.2 MPa/Nm"
k = 5
N_D = 2e6
S_D = "36 MPa"
T_S = 1.25
M = 0.3
"""
)
POINT = """[[operation]]
name = "{name}"
share = {share}
alpha = "{alpha} deg"
speed = "500 rpm"
torque = "100 N*m"
"""
DUTY = POINT.format(name="steep", share=0.25, alpha=15) + POINT.format(name="flat", share=0.75, alpha=5)
NAMES = ("weld, fork1", "weld, fork2", "pin root")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Result file of the study with these histories, or with those in full at two points; run once."""
    folder = tmp_path_factory.mktemp("parts")

    def run(kind: str = "full") -> Path:
        source = folder / f"{kind}.toml"
        out = source.with_suffix(".h5")
        if not out.exists():
            text = STUDY.format(histories=kind.replace("duty", "full"), alpha=15, seed=1)
            head, _, rest = text.partition("[operation]")
            duty = head + DUTY + rest[rest.index("[tolerances]") :]
            source.write_text(duty if kind == "duty" else text, encoding="utf-8")
            tolstat.run(tolstat.load(source), out, workers=1, check=False)
        return out

    return run


def stresses(file, samples=None, starts="starts = 1e4", point=""):
    with ResultFile.open(file) as store:
        store.study_text = store.study_text.replace("starts = 1e4", starts)
        return load_stresses(store.view().at(point), samples)


def of_signals(signals, names=("a",)):
    """Stresses of joints at one point, Pa, from their signals over a revolution."""
    counted = [histories.periodic(signal) for signal in signals]
    table = np.zeros((2, len(signals), 1, max(1, *(len(ranges) for ranges, _ in counted))))
    for i, pair in enumerate(counted):
        for kind in (0, 1):
            table[kind, i, 0, : len(pair[kind])] = pair[kind]
    return Cycles.of_revolution(names, *table, np.array([[len(ranges)] for ranges, _ in counted], float))


def point(line, name="a"):
    return StressPoint(name, "fork1", ((0.0, 0.0, 1.0, 0.0, 0.0, 0.0),), line)


def test_stress_is_formed_before_cycles_are_counted(campaign):
    found = stresses(campaign())
    settings = of_text(campaign().with_suffix(".toml").read_text(encoding="utf-8"), "a.toml")
    assert found.settings == settings
    assert found.cycles.channels == NAMES
    assert found.valid.any()
    assert not found.valid.all()
    with ResultFile.open(campaign()) as store:
        loads = store.histories("loads", np.arange(store.n)).astype(float)
    for p, own in enumerate(settings.points):
        at = loads[:, :, kinds(CARDAN)["F"].places.index(own.bushing)]
        signal = {"weld": 2.5e3 * at[..., 2] - 2e5 * at[..., 3], "pin root": 2e5 * at[..., 4]}[own.name.split(",")[0]]
        for stressed, first in ((found.cycles, 1), (found.nominal, 0)):
            for i in range(len(stressed.low)):
                if np.isnan(stressed.low[i, p]):
                    assert not found.valid[i]
                    continue
                ranges, means = histories.periodic(signal[first + i], 0.1 * np.ptp(signal[first + i]))
                np.testing.assert_allclose(stressed.ranges[i, p, : len(ranges)], ranges, rtol=1e-9)
                np.testing.assert_allclose(stressed.means[i, p, : len(ranges)], means, rtol=1e-6, atol=1.0)
                assert stressed.high[i, p] == pytest.approx(signal[first + i].max())
    assert np.isnan(found.cycles.ranges[~found.valid]).all()


def test_joints_are_simulated_again_where_the_file_has_no_loads(campaign):
    stored, again = stresses(campaign()), stresses(campaign("none"))
    np.testing.assert_array_equal(stored.cycles.ranges, again.cycles.ranges)
    np.testing.assert_array_equal(stored.nominal.high, again.nominal.high)
    part = stresses(campaign("none"), samples=5)
    np.testing.assert_array_equal(part.cycles.low, again.cycles.low[:5])


@pytest.mark.slow
def test_a_duty_cycle_adds_damage_and_starts_reach_the_extremes_of_all_points(campaign):
    file = campaign("duty")
    both = stresses(file, starts="")
    single = [stresses(file, starts="", point=point) for point in ("steep", "flat")]
    started = stresses(file).cycles
    np.testing.assert_array_equal(both.valid, single[0].valid & single[1].valid)
    for p, own in enumerate(both.settings.points):
        damage = [strength.damage_at(*parts.evaluated(s.cycles, s.settings)[p])[both.valid] for s in (both, *single)]
        np.testing.assert_allclose(damage[0], 0.25 * damage[1] + 0.75 * damage[2], rtol=1e-9)
        highest = np.maximum(*(s.cycles.high[both.valid, p] for s in single))
        np.testing.assert_array_equal(both.cycles.high[both.valid, p], highest, own.name)
        reach = np.maximum(highest, 0.0) - np.minimum(both.cycles.low[both.valid, p], 0.0)
        np.testing.assert_allclose(started.ranges[both.valid, p, -1], reach)
        np.testing.assert_allclose(started.repeats[both.valid, p, -1], 1e-5)


@pytest.mark.parametrize("offset", [0.0, 7.0, -7.0, 1.5])
def test_starts_are_the_cycles_of_the_whole_course(offset):
    rng = np.random.default_rng(4)
    signal = rng.normal(size=40) + offset
    line = strength.SNLine(k=3.0, k_2=5.0, N_D=100.0, S_D=2.0, M=0.2)
    n, starts = 30, 3
    settings = Fatigue(revolutions=float(n), starts=float(starts), points=(point(line),))
    started = of_signals([signal]).with_starts(starts / n)
    found = strength.damage_at(*parts.evaluated(started, settings)[0])[0]
    course = np.concatenate([[0.0], *[np.roll(signal, -int(np.argmax(np.abs(signal))))] * (n // starts)])
    ranges, means = histories.periodic(np.tile(course, starts))
    whole = strength.sort_out(strength.at_ratio(ranges, means, line.M)[None], np.ones((1, len(ranges))), line)
    assert found == pytest.approx(strength.damage_at(whole, line)[0], rel=0.03)
    without = strength.damage_at(
        *parts.evaluated(of_signals([signal]), Fatigue(revolutions=30.0, points=(point(line),)))[0]
    )[0]
    assert (found > 1.1 * without) == (abs(offset) == 7.0)


def synthetic(n=400, seed=3, scatter=1.3, status=None):
    """Joints whose stress is one cycle of lognormal range at two points."""
    rng = np.random.default_rng(seed)
    line = strength.SNLine(k=5.0, k_2=9.0, N_D=1e6, S_D=200.0, T_S=scatter)
    size = 120.0 * np.exp(rng.normal(0.0, 0.3, (n, 2)))
    state = np.full(n, Status.OK, np.uint8) if status is None else np.asarray(status, np.uint8)
    size[state != Status.OK] = np.nan
    cycles = Cycles.of_revolution(
        ("a", "b"), size[..., None], 0.0 * size[..., None], np.where(np.isnan(size), size, 1.0)
    )
    settings = Fatigue(revolutions=1e6, points=(point(line), point(line, "b")))
    joints = Joints(state, Independent(), settings, CARDAN, n, (("", 1.0),))
    return Counted(**vars(joints), cycles=cycles, nominal=cycles.rows(slice(0)), apart=0.0), size, line


def test_failures_and_lives_of_one_cycle_in_closed_form():
    stressed, size, line = synthetic()
    table = pd.DataFrame(parts.part_failures(stressed)).set_index("point")
    factor = size / line.S_D  # N_D cycles: the critical strength is the range itself
    chances = strength.probability(factor, line.T_S)
    np.testing.assert_allclose(table["estimate"][["a", "b"]], chances.mean(axis=0))
    assert table["estimate"][ANY] == pytest.approx((1 - (1 - chances).prod(axis=1)).mean())
    assert table["median"]["a"] == pytest.approx(
        np.sort(factor[:, 0])[199] ** (9 if np.sort(factor[:, 0])[199] < 1 else 5)
    )
    assert np.isnan(table["nominal"]["a"])
    assert np.isnan(table["median"][ANY])
    for name, group in (("a", [0]), ("b", [1]), (ANY, [0, 1])):
        lives = table["life"][name] / 1e6
        slope = np.where(factor * lives ** (1 / 9) < 1, 9, 5)  # the part that fails just now, by the slope of its cycle
        critical = np.where(lives > 1, factor * lives ** (1 / 9), factor * lives ** (1 / 5))
        assert np.all(slope > 0)
        survive = (1 - strength.probability(critical[:, group], line.T_S)).prod(axis=1)
        assert 1 - survive.mean() == pytest.approx(parts.SHARE, rel=2e-3)
        assert table["life_lower"][name] < table["life"][name] < table["life_upper"][name]
        assert (table["estimate"] > 0.1)[name] == (table["life"][name] < 1e6)


def test_notes_of_a_duty_cycle_give_its_shares():
    stressed, _, _ = synthetic(n=40)
    table = parts.part_failures(stressed)
    assert not any("duty cycle" in note for note in _notes_on_parts(stressed, table))
    cycle = replace(stressed, duty=(("cruise", 0.95), ("start", 0.05)))
    said = "over a duty cycle: 95 % at cruise, 5 % at start, shares of the revolutions"
    assert said in list(_notes_on_parts(cycle, table))


def test_joints_without_stresses_count_both_ways_and_pending_ones_not_at_all():
    status = np.full(400, Status.OK)
    status[:10], status[10:30], status[30:40] = Status.NEWTON_FAILED, Status.STATIONARY, Status.PENDING
    stressed, size, line = synthetic(status=status)
    row = parts.part_failures(stressed)[0]
    assert (row["n"], row["n_failed"], row["n_unsettled"]) == (390, 10, 20)
    chances = strength.probability(size[40:, 0] / line.S_D, line.T_S)
    assert row["estimate"] == pytest.approx(chances.mean())
    assert row["outer_upper"] > (chances.sum() + 30) / 390 > row["upper"]
    assert row["outer_lower"] < row["lower"]
    nothing, *_ = synthetic(status=np.full(400, Status.NEWTON_FAILED))
    row = parts.part_failures(nothing)[0]
    assert np.isnan([row["estimate"], row["life"], row["median"], row["life_lower"]]).all()
    assert (row["outer_lower"], row["outer_upper"]) == (0.0, 1.0)


ROUND = """
[fatigue]
point.a = { bushing = "cross1", T_tz = "2 MPa/Nm", k = 5, N_D = 1e6, S_D = "200 MPa", T_S = 1 }
point.b = { bushing = "cross1", T_tz = "2 MPa/Nm", F_e = "1 MPa/kN", M = 0.3, k = 5, N_D = 1e6, S_D = "9 MPa", T_S = 1 }
"""
"""A round pin that is bent about t and z, and one that is pulled, too."""


def bent(monkeypatch, moments, force=0.0, number=0):
    """Damage in a revolution of a point of `ROUND`, at moments about t and z over it, N m, and a force along e, N."""
    loads = np.zeros((1, len(moments[0]), len(CARDAN.bushings), 6))
    loads[0, :, 0, 0], loads[0, :, 0, 4], loads[0, :, 0, 5] = force, *moments
    monkeypatch.setattr(counting.revolutions, "of_components", lambda *_: [(slice(0, 1), {"loads": loads}, 0.0)])
    settings = of_text(ROUND, "a.toml")
    settings = replace(settings, points=settings.points[number : number + 1], revolutions=1.0)
    found, _ = counting.of_slots(
        SimpleNamespace(mechanism=CARDAN), np.arange(1), parts.stresses_at(settings.points, CARDAN), kept=180
    )
    return strength.damage_at(*parts.evaluated(found, settings)[0])[0]


@pytest.mark.parametrize("degrees", [0.0, 15.0, 30.0, 22.5, 52.0, 97.0])
def test_bending_of_a_round_pin_in_one_plane_is_the_root_of_the_squares(monkeypatch, degrees):
    """A moment of 30 N m that keeps its direction, 60 MPa to and fro: one cycle of 120 MPa where it is largest."""
    wave, direction = 30.0 * np.cos(2 * np.pi * np.arange(360) / 360), np.radians(degrees)
    found = bent(monkeypatch, (wave * np.cos(direction), wave * np.sin(direction)))
    expected = 1e-6 * (120.0 / 200.0) ** 9
    assert found <= expected * (1.0 + 1e-9)
    assert found == pytest.approx(expected, rel=1e-9 if degrees % 15 == 0 else 9 * (1 - np.cos(np.radians(7.5))))


def test_a_moment_that_goes_round_a_pin_is_not_the_sum_of_its_components(monkeypatch):
    """Each place goes from +60 to -60 MPa once; T_t and T_z in one point would have 120 MPa times the root of 2."""
    angles = 2 * np.pi * np.arange(360) / 360
    found = bent(monkeypatch, (30.0 * np.cos(angles), 30.0 * np.sin(angles)))
    assert found == pytest.approx(1e-6 * (120.0 / 200.0) ** 9, rel=1e-9)


def test_a_pin_that_is_pulled_fails_on_the_side_that_bending_pulls_too(monkeypatch):
    """Bending swells from 0 to 20 N m about t: 40 MPa on one side, -40 on the other, and 10 MPa everywhere."""
    wave = 10.0 * (1.0 + np.cos(2 * np.pi * np.arange(360) / 360))
    found = bent(monkeypatch, (wave, 0.0 * wave), force=1e4, number=1)
    assert strength.at_ratio([40.0], [30.0], 0.3) > strength.at_ratio([40.0], [-10.0], 0.3)
    assert found == pytest.approx(1e-6 * (strength.at_ratio([40.0], [30.0], 0.3)[0] / 9.0) ** 5, rel=1e-6)


def judged(accepted, **kwargs):
    stressed, *_ = synthetic(**kwargs)
    row = parts.failures_over_life(stressed, [1e6])[0]._asdict()
    return _verdict("failures of parts", "have a failed part", row, stressed, accepted), row


def test_verdicts_on_failures_in_the_service_life():
    _, row = judged(np.nan)
    share, low, high = row["estimate"], row["outer_lower"], row["outer_upper"]
    what, interval = "of the joints have a failed part within 1e+06 revolutions", text.span(low, high)
    kept, _ = judged(high)
    assert kept.sentence == f"Kept: at most {text.percent(high)} {what} ({text.percent(share)}, {interval})"
    assert (kept.share, kept.lower, kept.upper) == (share, low, high)
    assert judged(0.01)[0].sentence == f"Not kept: {text.percent(share)} {what} ({interval}); 1 % is accepted"
    accepted = 0.5 * (share + high)
    wider = 1.0 + norm.ppf(0.9) / norm.ppf(0.975)
    joints = np.ceil(400 * (wider * (row["upper"] - share) / (accepted - share)) ** 2)
    assert judged(accepted)[0].sentence == (
        f"Open: {text.percent(share)} {what} ({interval}); {text.percent(accepted)} is accepted; "
        f"{text.number(joints)} joints decide it in 90 % of campaigns if {text.percent(share)} is the true share"
    )
    assert judged(np.nan)[0].sentence == f"{text.percent(share)} {what} ({interval})"


def test_an_open_verdict_is_decided_by_the_joints_that_it_asks_for():
    """With that many joints the interval is so narrow that nine campaigns of ten decide; a quarter is too few."""
    _, row = judged(np.nan, n=400)
    accepted = row["estimate"] + 0.4 * (row["upper"] - row["estimate"])
    open_, _ = judged(accepted, n=400)
    joints = int(float(re.search(r"; ([0-9.]+) joints decide it in", open_.sentence)[1]))
    shares = [judged(np.nan, n=number)[1] for number in (joints // 4, joints)]
    widths = [own["outer_upper"] - own["estimate"] for own in shares]
    assert widths[1] < accepted - row["estimate"] < widths[0]


def test_no_verdict_where_joints_without_a_load_decide():
    status = np.full(400, Status.OK)
    status[:200] = Status.NEWTON_FAILED
    found, _ = judged(0.4, status=status)
    assert found.sentence == "No verdict: 200 of 400 joints have no load that repeats"
    assert judged(0.99, status=status)[0].answer == "yes"


def test_a_verdict_is_on_points_whose_service_life_is_given(campaign):
    with ResultFile.open(campaign("none")) as store:
        (found,) = life_verdicts(store.view(), 0.99, samples=8)
        row = parts.failures_over_life(load_stresses(store.view(), samples=8), [1e9])[0]
        assert (found.lower, found.upper) == (row.outer_lower, row.outer_upper)
        assert found.sentence.startswith(
            "Kept: at most 99 % of the joints have a failed part within 1e+09 revolutions ("
        )
        assert found.notes == ("failures of parts: of the first 8 of 12 joints",)
        assert life_verdicts(store.view(), 0.5, samples=0) == []
        store.study_text = store.study_text.replace("revolutions = 1e9", "")
        assert life_verdicts(store.view(), 0.5) == []


def test_settings_are_those_of_the_study_given_in_place_of_the_stored_one(campaign, tmp_path):
    edited = tmp_path / "edited.toml"
    edited.write_text(campaign("none").with_suffix(".toml").read_text("utf-8").replace("1e9", "2e9"), encoding="utf-8")
    with ResultFile.open(campaign("none")) as store:
        stored, given = (load_stresses(store.view(path), samples=3) for path in (None, edited))
    assert (stored.settings.revolutions, given.settings.revolutions) == (1e9, 2e9)
    assert given.settings.points == stored.settings.points


def test_the_service_life_is_the_one_that_bearings_require(tmp_path):
    """20 000 h at 75 % of 1200 rpm and 25 % of 400 rpm are 20 000 * 60 * 1000 revolutions."""
    points = "".join(
        f'[[operation]]\nname = "{name}"\nshare = "{share} %"\nspeed = "{rpm} rpm"\nalpha = "9 deg"\ntorque = "9 N*m"\n'
        for name, share, rpm in (("drive", 75, 1200), ("climb", 25, 400))
    )
    head, _, rest = STUDY.format(histories="none", alpha=15, seed=1).partition("[operation]")
    bearing = '[joint.bearing]\nneedles = 32\nrequired_life = "20000 h"\n'
    text = head + bearing + points + "[tolerances]" + rest.partition("[tolerances]")[2]
    for given, expected, life in (
        ("revolutions = 1e9\n", 1e9, "1e+09 revolutions"),
        ("", 1.2e9, "20000 h (1.2e+09 revolutions)"),
    ):
        path = store_of(tmp_path, text.replace("revolutions = 1e9\n", given), f"a{len(given)}", 0)
        with ResultFile.open(path) as store:
            settings = settings_of(store.view())
            assert settings_of(store.view(path.with_suffix(".toml"))) == settings
        assert (settings.revolutions, settings.required) == (pytest.approx(expected), True)
        assert settings.service_life == life
    with pytest.raises(InputError, match=r"fatigue\.starts: 10000 starts in 1000 revolutions"):
        Fatigue(starts=1e4).within(1.0, 1000.0, "a.toml")


def test_every_fault_of_the_points_is_told():
    text = """
    [fatigue]
    revolutions = 1e4
    starts = 2e4
    point.a = { bushing = "forks", T_z = "1 MPa/Nm", k = 5, N_D = 2e6, S_aD = "180 MPa", T_N = 3 }
    point.b = { bushing = "fork1", k = 5, N_D = 2e6, S_aD = "180 MPa", T_N = 3 }
    point.c = { bushing = "fork1", T_e = "1 MPa/kN", k = 5, N_D = 2e6, S_aD = "180 MPa", T_N = 3 }
    point.d = { bushing = "fork1", T_e = "1 MPa/Nm", k = 5, N_D = 2e6, S_aD = "180 MPa", S_D = "3 MPa", T_N = 3 }
    point.e = { bushing = "fork1", T_e = "1 MPa/Nm", k = 5, N_D = 2e6, S_D = "180 MPa" }
    point.f = { bushing = "fork1", T_e = "1 MPa/Nm", N_D = 2e6, S_D = "180 N", T_S = 0.5, x = 1 }
    point.g = 3
    """
    with pytest.raises(InputError) as error:
        of_text(text, "a.toml")
    found = {fault.place.removeprefix("a.toml: fatigue"): fault.found for fault in error.value.faults}
    assert list(found) == [
        *(".starts", ".point.a.bushing", ".point.b", ".point.c.T_e", ".point.d", ".point.e"),
        *(".point.f.k", ".point.f.S_D", ".point.f.T_S", ".point.f.x", ".point.g"),
    ]
    assert "has both S_D and S_aD" in found[".point.d"]
    assert "has neither T_S nor T_N" in found[".point.e"]
    with pytest.raises(InputError, match=r"fatigue\.point: 3"):
        of_text("[fatigue]\npoint = 3", "a.toml")


@pytest.mark.slow
def test_the_command_prints_loads_below_the_parts(campaign):
    both = call("fatigue", campaign(), "--joints", 6)
    assert both.stdout.startswith("point")
    assert "\nDamage-equivalent loads\nchannel and exponent" in both.stdout
    again, stored = (call("fatigue", campaign(kind), "--by", "cross1.F_t", "--json") for kind in ("none", "full"))
    assert again.exit_code == 0
    tables = [json.loads(done.stdout)["tables"]["loads"] for done in (again, stored)]
    assert tables[0] == tables[1]


def test_a_study_without_points_says_so(campaign, tmp_path):
    with ResultFile.open(campaign("none")) as store:
        store.study_text = store.study_text.split("[fatigue]")[0]
        with pytest.raises(InputError, match="names no point of a part\n  hint: add"):
            load_stresses(store.view())
