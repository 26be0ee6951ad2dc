"""Joints that do not settle, or repeat after several revolutions: what is told of them, and what results cover."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.of_cardan import KERNEL_RESULT
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import load_numbers
from tolstat.common.tables import Options, Status
from tolstat.kernel.mechanics.loads import OF_FORCES
from tolstat.kernel.revolution.outcome import check_settled
from tolstat.kernel.revolution.settle import ALL_LOADS, make_samples, summarise
from tolstat.kernel.revolution.trail import (
    Trail,
    closure_trend,
    combine,
    lag_closure,
    make_notes,
    make_trails,
    note_closure,
)
from tolstat.solver.simulation import simulate_rows

RPM = np.pi / 30
RATTLE = {"alpha": np.radians(30), "speed": 1000 * RPM, "torque": 5.0}


def make_trail(steps_per_rev: int, kept: int) -> Trail:
    """Trail of one joint."""
    modulus, revolution, notes = make_trails(1, steps_per_rev, kept)
    return Trail(modulus[0], revolution[0], notes[0])


def one(par, **options):
    return simulate_rows(par, Options(**options)).results[0]


def test_a_joint_that_settles_is_periodic(params):
    row = one(params(alpha=0.2))
    assert (row["status"], row["period"]) == (Status.OK, 1)
    assert row["failed_step"] == -1
    assert one(params(alpha=0.2), settle_tol=1e-9)["closure_trend"] < -0.5


def test_a_joint_whose_shafts_loads_still_change_has_not_settled(params):
    """All bushing loads repeat; a force on a shaft changes by more, then by less, than 1e-4 of the largest force."""
    samples, out = make_samples(1, 36)[0], np.zeros(1, KERNEL_RESULT).view(np.recarray)[0]
    samples.loads[:], samples.change[:] = 1000.0, 0.0
    for change, status in ((0.11, Status.NOT_SETTLED), (0.09, Status.OK)):
        samples.change[20, OF_FORCES, ALL_LOADS] = change
        row, notes = params()[0], make_notes(1)[0]
        assert check_settled(72, 0, row, Options(steps_per_rev=36), samples, notes, out) == status
        assert out.closure == pytest.approx(change / 1000.0)


def test_slow_decay_is_told_from_motion_that_goes_on(params):
    """E x 1e-3: little damping. The trend says when it will settle."""
    par = params(alpha=np.radians(15), material__E_factor=1e-3)
    row = one(par, max_revs=12, max_refinements=0)
    assert (row["status"], row["period"]) == (Status.NOT_SETTLED, 0)
    revs = row["revolutions"] + np.log10(row["closure"] / 1e-4) / -row["closure_trend"]
    longer = one(par, max_revs=60, max_refinements=0)
    assert longer["status"] == Status.OK
    assert longer["revolutions"] == pytest.approx(revs, rel=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("steps", [180, 360])
def test_rattle_at_low_torque_never_repeats_at_any_step(params, steps):
    """The motion is chaotic, and its two halves are compared as samples: one in twenty seems to differ."""
    joints = np.concatenate([params(**RATTLE)] * 6)
    joints["torque"] *= 1 + 1e-9 * np.arange(6)
    rows = simulate_rows(joints, Options(steps_per_rev=steps)).results
    assert np.isin(rows["status"], (Status.STATIONARY, Status.NOT_SETTLED)).all()
    assert (rows["status"] == Status.STATIONARY).sum() >= 4
    assert (rows["period"] == 0).all()
    assert (rows["closure_trend"][rows["status"] == Status.STATIONARY] == 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize(("point", "chaotic"), [(RATTLE, True), ({"alpha": np.radians(15)}, False)])
def test_two_joints_that_differ_by_nothing_to_speak_of(params, point, chaotic):
    """A torque changed by 1e-9 of itself moves the loads of chaotic joints alone."""
    par = params(**point)
    other = par.copy()
    other["torque"] *= 1 + 1e-9
    first, second = (
        simulate_rows(p, Options(max_revs=9, settle_tol=1e-12), "full").histories["loads"][0] for p in (par, other)
    )
    force = np.linalg.norm(first[..., :3], axis=-1).max()
    apart = np.abs(first - second)[..., :3].max() / force
    assert apart > 0.1 if chaotic else apart < 1e-3


def test_trend_is_the_line_through_the_logarithms():
    trail = make_trail(180, 10)
    rng = np.random.default_rng(1)
    revs = np.arange(24, 241) / 12
    logs = -0.3 * revs + rng.normal(0, 0.02, revs.size)
    for x, y in zip(revs, logs, strict=True):
        note_closure(x, 10**y, trail.notes)
    late = revs >= 10
    slope, offset = np.polyfit(revs[late], logs[late], 1)
    scatter = np.sqrt(np.mean((logs[late] - slope * revs[late] - offset) ** 2))
    assert closure_trend(10.0, trail.notes) == pytest.approx((slope, scatter), rel=1e-9)
    assert np.isnan(closure_trend(20.0, trail.notes)).all()


def test_closure_over_several_revolutions_finds_the_period(params):
    trail, par, numbers = make_trail(36, 10), params()[0], load_numbers(CARDAN)
    rng = np.random.default_rng(2)
    three = rng.uniform(1, 2, (3, 36, len(numbers["deciding"])))
    for r in range(20):
        trail.loads[r % 10] = three[r % 3]
    closures = [lag_closure(19, lag, par, trail) for lag in range(1, 9)]
    assert [c == 0 for c in closures] == [False, False, True, False, False, True, False, False]
    change = []
    for least, most in numbers["measured"]:
        own = np.isin(numbers["deciding"], np.arange(least, most))
        change.append(np.abs(three[1] - three[0])[:, own].max() / three[1][:, own].max())
    assert closures[0] == pytest.approx(max(change))
    trail.loads[19 % 10, 5, 3] = np.nan
    assert np.isnan(lag_closure(19, 3, par, trail))


def test_combined_statistics_are_those_of_all_revolutions():
    trail = make_trail(36, 10)
    rng = np.random.default_rng(3)
    samples = rng.uniform(1, 2, (5, 36, 16))
    for r, values in zip(range(15, 20), samples, strict=True):
        row = trail.revolution[r % 10]
        row.largest[:16], row.average[:], row.range[:] = values.max(0), values.mean(0), np.ptp(values, axis=0)
        row.largest[16:], row.mode_share[:], row.equivalent_load[:] = r, 0.25, r
    out = np.zeros(1, KERNEL_RESULT).view(np.recarray)[0]
    combine(19, 5, trail, out)
    whole = samples.reshape(-1, 16)
    np.testing.assert_allclose(out.largest[:16], whole.max(0))
    np.testing.assert_allclose(out.average, whole.mean(0))
    np.testing.assert_allclose(out.range, np.ptp(whole, axis=0))
    assert (out.largest[16:] == 19).all()
    np.testing.assert_allclose(out.mode_share, 0.25)
    np.testing.assert_allclose(out.equivalent_load, np.mean(np.arange(15.0, 20.0) ** (10 / 3)) ** 0.3)


def test_every_statistic_of_a_revolution_is_combined_over_several(params):
    """A field that `summarise` writes and `combine` forgets would keep, with finer steps, what was there before."""
    samples, trail = make_samples(1, 36)[0], make_trail(36, 10)
    for name in samples.dtype.names:
        samples[name] = 0
    samples.loads[:] = 1000.0
    marked = np.full(KERNEL_RESULT.itemsize, 111, "u1").view(KERNEL_RESULT).view(np.recarray)

    def written(by) -> set[str]:
        out = marked.copy()
        by(out[0])
        return {name for name in KERNEL_RESULT.names if not np.any(out[name] == marked[name])}

    of_one = written(lambda out: summarise(params(alpha=0.26)[0], samples, out))
    trail.revolution[:] = 1.0
    of_several = written(lambda out: combine(19, 5, trail, out))
    assert of_one == {"largest", "average", "range", "mode_share", "equivalent_load", "tilt", "line_load"}
    assert of_several == of_one
