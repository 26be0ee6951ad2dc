"""Numerical error near a limit: coverage with corrected loads; joints that are chosen, checked and stored."""

import numpy as np
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

from tests.support import exceedance, synthetic
from tolstat.analysis import accuracy, binomial, prediction
from tolstat.campaign import verify
from tolstat.cli import app
from tolstat.common.errors import InputError
from tolstat.common.tables import Status
from tolstat.questions.capability import capability
from tolstat.questions.exceedance import answer as exceeded
from tolstat.store import ResultFile, error_budget
from tolstat.store.verification import Check, Verification

LIMIT, SEEDS, JOINTS = 1.3, 300, 2000


def test_the_interval_of_corrected_loads_covers_and_that_of_the_loads_does_not():
    """Loads are simulated too small by 0.1 sigma on average, and with scatter."""
    rng, truth, covered, plain = np.random.default_rng(4), norm.sf(LIMIT), [], []
    for _ in range(SEEDS):
        exact, lacking = rng.standard_normal(JOINTS), rng.normal(0.1, 0.1, JOINTS)
        loads = exact - lacking
        nearest = np.argsort(np.abs(loads - LIMIT))[: accuracy.LEAST_NEAR]
        ends = accuracy.corrected(loads, np.ones(JOINTS), lacking[nearest])
        found = [exceedance.exceedance(end, np.ones(JOINTS, int), LIMIT) for end in (loads, *ends)]
        covered.append(min(one.lower for one in found) <= truth <= max(one.upper for one in found))
        plain.append(found[0].lower <= truth <= found[0].upper)
    assert np.mean(covered) >= 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)
    assert np.mean(plain) < 0.6


@pytest.fixture
def path(tmp_path, monkeypatch):
    """File whose joints, verified, have 2 % larger forces."""

    def check_slots(store, slots, *_):
        base = store.results()[slots]
        other = base.copy()
        other["F_max"] *= 1.02
        made = {name: Check("", {}, base.copy()) for name in verify.QUICK_CHECKS} | {"reference": Check("", {}, other)}
        return Verification(0, store.row(slots), base, made)

    monkeypatch.setattr(verify, "check_slots", check_slots)
    text = synthetic.STUDY.replace("n = 60", "n = 400").partition("[limits]")[0]
    return synthetic.store(tmp_path, text + '[limits]\n"cross1.F" = "720 N"\n"fork3.T" = "26 N*m"\n')


@pytest.mark.slow
def test_the_joints_nearest_to_the_limits_are_verified_once(path):
    found = verify.check_near(path, "cross1.F > 720 N")
    with ResultFile.open(path) as store:
        view = store.view()
        load = view.load("cross1.F")
        distance = np.abs(load.values - 720.0)
        distance[load.status != Status.OK] = np.inf
        assert found.rows.tolist() == sorted(view.rows(np.argsort(distance)[:50]))
        low, high = error_budget.near(view, load)
        assert error_budget.near(view, view.load("fork3.T")) is None
        assert "not known" in error_budget.unknown(view)
    assert np.nanmedian(low.values / load.values) == pytest.approx(1.02, rel=1e-3)
    assert (low.values <= high.values)[load.is_valid].all()
    more = verify.check_near(path, "any limit")
    assert set(found.rows) < set(more.rows)
    assert (np.diff(more.rows) > 0).all()
    with ResultFile.open(path) as store:
        view = store.view()
        assert error_budget.near(view, view.together) is not None
        assert error_budget.unknown(view) == ""


@pytest.mark.slow
def test_a_check_that_fails_near_the_limit_does_not_hide_what_the_others_tell(path, monkeypatch):
    """Of 60 joints verified, the nearest one has no result in the checks: the 59 others give the correction."""
    whole = verify.check_slots

    def check_but_one(store, slots, *args):
        found = whole(store, slots, *args)
        nearest = np.argmin(np.abs(found.base["F_max"][:, 0] - 720.0))
        for check in found.checks.values():
            check.results["F_max"][nearest] = np.nan
        return found

    monkeypatch.setattr(verify, "check_slots", check_but_one)
    verify.check_near(path, "cross1.F > 720 N", joints=60)
    with ResultFile.open(path) as store:
        row = exceeded.exceedance(store.view()).frame("limits").set_index("load").loc["cross1.F"]
    assert row["numerical_lower"] > row["estimate"]  # all loads are 2 % too small
    assert row["total_lower"] <= row["numerical_lower"] <= row["numerical_upper"] <= row["total_upper"]


@pytest.mark.slow
def test_ppm_carry_it(path):
    def table():
        with ResultFile.open(path) as store:
            return capability(store.view()).frame("limits").set_index("load")

    before = table()
    verify.check_near(path, "any limit")
    after = table()
    assert after.loc["cross1.F", "ppm_upper"] > before.loc["cross1.F", "ppm_upper"]
    assert after.loc["any limit", "next_upper"] > before.loc["any limit", "next_upper"]


def test_fewer_than_fifty_joints_are_refused(path):
    with pytest.raises(InputError, match="49 joints do not tell"):
        verify.check_near(path, "any limit", 49)
    done = CliRunner().invoke(app, ["verify", str(path), "--near", "cross9.F > 1 N"])
    assert done.exit_code == 2
    assert "'cross9.F' is not a load" in done.stderr


@pytest.mark.parametrize("p", [0.002, 0.03, 0.4])
def test_deliveries_lie_in_their_prediction_interval(p):
    """Computed, not drawn: over all counts of 150 joints, and all of the 80 delivered."""
    from scipy.stats import binom

    n, number = 150, 80
    ends = [prediction.of_counts(k, k, n, number) for k in range(n + 1)]
    inside = [binom.cdf(high, number, p) - binom.cdf(low - 1, number, p) for low, high in ends]
    assert (binom.pmf(np.arange(n + 1), n, p) * inside).sum() >= 0.95
    naive = [binom.interval(0.95, number, k / n) for k in range(n + 1)]
    inside = [binom.cdf(high, number, p) - binom.cdf(low - 1, number, p) for low, high in naive]
    assert (binom.pmf(np.arange(n + 1), n, p) * inside).sum() < 0.95
    half = prediction.half(0.95)
    low, high = prediction.of_share(p, p, 1000)  # half of the allowed error is left for the share
    assert binom.cdf(high, 1000, p) - binom.cdf(low - 1, 1000, p) >= half
    for k, (low, high) in enumerate(ends[:20]):
        wide = prediction.of_share(*map(float, binomial.clopper_pearson(k, n, half)), number)
        assert wide[0] <= low <= high <= wide[1]
