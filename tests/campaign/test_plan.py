"""Planning a campaign, and stopping it when an exceedance is known well enough: coverage by simulation."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.campaign.test_campaign import datasets
from tests.support import exceedance, fakes, synthetic
from tests.support.of_cardan import LOADS, Limit
from tests.support.synthetic import HEAD
from tolstat import cli, study
from tolstat.analysis import binomial
from tolstat.analysis.design import Looked
from tolstat.campaign import extend, plan, stop_rule
from tolstat.campaign import run as campaign
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.common.tables import Options, Status
from tolstat.store import ResultFile, View, Writer

RULE = "P(cross1.F > 0.5 N) width < 0.4"
"""Nearly one in five of the fake joints is unresolved, and counts at both ends of the interval."""


def test_a_rule_is_read() -> None:
    single = Limit("cross1.F", ("cross1.F",), (700.0,))
    assert stop_rule.parse("P(cross1.F > 0.7 kN) width < 0.002", {}, CARDAN)[1:] == (single, 0.002)
    assert stop_rule.parse(" P( psi>1e-3 )width<0.5 ", {}, CARDAN)[1:] == (Limit("psi", ("psi",), (1e-3,)), 0.5)
    assert stop_rule.parse("P(psi>1e-3) < 5 %", {}, CARDAN, "").bound == 0.05
    several = stop_rule.parse("P(*.F > 700 N) width < 0.01", {}, CARDAN).limit
    assert several.loads == tuple(name for name in LOADS if name.endswith(".F"))
    assert (several.level, several.unit, str(several)) == (700.0, "N", "*.F > 700 N")
    limits = {"cross1.F": 700.0, "psi": 0.01}
    every = stop_rule.parse("P(any limit) width < 0.01", limits, CARDAN).limit
    assert (every.loads, every.levels, every.level, str(every)) == (
        *zip(*limits.items(), strict=True),
        1.0,
        "any limit",
    )


def test_a_joint_is_above_a_limit_of_several_loads_if_one_of_them_is() -> None:
    results = synthetic.results(50)
    for text, level in (("P(cross*.F > 700 N) width < 0.1", 700.0), ("P(any limit) width < 0.1", 1.0)):
        limit = stop_rule.parse(text, {"cross1.F": 700.0, "fork3.T": 30.0}, CARDAN).limit
        each = [LOADS[name].of(results) > own for name, own in zip(limit.loads, limit.levels, strict=True)]
        assert ((limit.of(results) > level) == np.any(each, axis=0)).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("often", ["'often' is not a rule", 'write --until "P(cross1.F > 700 N) width < 0.01"']),
        ("< 5 %", ["'< 5 %' is not a rule: it says no limit", 'write --until "P(any limit) width < 5 %"']),
        ("P(psi > 1e-3) width < 5 mm", ["width 5 mm is not between 0 and 1"]),
        ("P(cros1.F > 700 N) width < 2", ["did you mean 'cross1.F'?", "width 2 is not between 0 and 1"]),
        ("P(cross1.F > 700 mm) width < few", ["'700 mm' cannot be a value in N", "width few is not"]),
        ("P(fork1.T > 40) width < 0.1", ["'40' has no unit"]),
        ("P(cross1.* > 40 N) width < 0.1", ["selects quantities of different kinds"]),
        ("P(any limit) width < 0.1", ["the study has no limits"]),
    ],
)
def test_faults_of_a_rule_are_told_together(text: str, words: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        stop_rule.parse(text, {}, CARDAN)
    assert all(word in str(caught.value) for word in words), caught.value


def stopped(path: Path, workers: int = 1, block: int | None = None, n: int = 400) -> stop_rule.Outcome:
    made = fakes.Study(n=n)

    def run(row: int) -> None:
        fakes.run(made, path, workers, block, until_row=row)

    return stop_rule.run_until(made, path, stop_rule.parse(RULE, {}, CARDAN), run)


@pytest.fixture
def few_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Looks that are far apart: each one opens the file and starts a run."""
    monkeypatch.setattr(binomial, "GROWTH", 1.3)


@pytest.mark.slow
@pytest.mark.usefixtures("few_looks")
def test_a_campaign_stops_where_the_rule_holds(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    outcome = stopped(path)
    look = outcome.look
    assert outcome.reached
    assert outcome.looks == binomial.looks(399)
    assert look.joints in outcome.looks[:-1]
    with ResultFile.open(path) as store:
        status, loads = store.status(), store.results()["F_max"][:, 0]
        assert (status[: look.joints + 1] != Status.PENDING).all()
        assert (status[look.joints + 1 :] == Status.PENDING).all()
        assert store.stop["rule"] == RULE
        assert (store.stop["reached"], store.stop["joints"]) == (True, look.joints)
        assert store.stop["looks"] == [n for n in outcome.looks if n <= look.joints]
    assert look.n_unresolved == (status[1 : look.joints + 1] != Status.OK).sum()
    shares = [
        exceedance.exceedance(loads[1 : n + 1], status[1 : n + 1], 0.5, binomial.LOOK_CONFIDENCE)
        for n in outcome.looks
        if n <= look.joints
    ]
    narrow = [
        share.outer_upper - share.outer_lower < 0.4
        and 10 <= share.count <= share.n - share.n_failed - share.n_unsettled - 10
        for share in shares
    ]
    assert narrow == [*[False] * (len(shares) - 1), True]
    before = path.read_bytes()
    assert stopped(path) == outcome  # asked again, it does nothing
    assert path.read_bytes() == before


@pytest.mark.slow
@pytest.mark.usefixtures("few_looks")
def test_workers_and_blocks_do_not_move_the_stop(tmp_path: Path) -> None:
    outcomes = [stopped(tmp_path / "a.h5", 1, 7), stopped(tmp_path / "b.h5", 2, 50), stopped(tmp_path / "c.h5", 1, 999)]
    assert outcomes[0] == outcomes[1] == outcomes[2]
    assert datasets(tmp_path / "a.h5") == datasets(tmp_path / "b.h5") == datasets(tmp_path / "c.h5")


@pytest.mark.slow
def test_too_few_joints_are_all_simulated(tmp_path: Path) -> None:
    outcome = stopped(tmp_path / "a.h5", n=30)
    assert not outcome.reached
    assert outcome.look.joints == 29
    with ResultFile.open(tmp_path / "a.h5") as store:
        assert store.complete
        assert not store.stop["reached"]


@pytest.mark.slow
@pytest.mark.usefixtures("few_looks")
def test_a_file_has_the_interval_that_is_valid_after_any_number_of_looks(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    look = stopped(path).look
    with ResultFile.open(path) as store:
        share = View(store).load("cross1.F").above(0.5)
        assert (share.outer_lower, share.outer_upper) == pytest.approx((look.lower, look.upper))
        assert "valid after any number of looks" in View(store).design.interval


@pytest.mark.slow
@pytest.mark.parametrize("reached", [True, False])
def test_looks_go_with_a_file_that_is_extended_or_merged(tmp_path: Path, reached: bool) -> None:
    path = synthetic.store(tmp_path, name="a")
    with Writer.open(path) as store:
        store.change(stop={"reached": reached, "looks": [20, 30]})
    extend.merge([path], tmp_path / "b.h5")
    extend.extend(path, 90)
    for held in (path, tmp_path / "b.h5"):
        with ResultFile.open(held) as store:
            assert store.stop == {"reached": False, "looks": [20, 30]}
            assert isinstance(View(store).design, Looked)


def test_until_is_for_independent_samples(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(synthetic.SWEEP, encoding="utf-8")
    loaded = study.load(tmp_path / "s.toml")
    with pytest.raises(InputError, match=r"sampling\.method is 'sweep': .* independent samples"):
        stop_rule.run_until(loaded, tmp_path / "a.h5", stop_rule.parse(RULE, {}, CARDAN), lambda row: None)


@pytest.fixture
def small(tmp_path: Path) -> study.Study:
    path = tmp_path / "small.toml"
    text = synthetic.WHOLE.replace("[limits]", '[solver]\nsteps_per_rev = 45\n[output]\nhistories = "full"\n[limits]')
    path.write_text(text, encoding="utf-8")
    return study.load(path)


@pytest.mark.slow
def test_a_plan_is_what_the_campaign_takes(tmp_path: Path, small: study.Study) -> None:
    made = plan.plan(small, workers=2, pilot=20)
    assert (made.rows, made.dimensions, made.pilot, made.workers) == (61, 4, 20, 2)
    assert made.stages["joints"] == pytest.approx(made.seconds_per_joint * 61 / 2)
    assert list(made.stages) == ["start", "joints", "check", "report"]
    assert made.stages["check"] > 0
    assert made.seconds == pytest.approx(sum(made.stages.values()))
    assert made.process_bytes > 1e7
    assert made.wilks == {0.95: 59, 0.99: 299, 0.999: 2995}
    lower, upper = binomial.clopper_pearson(6, 60)
    assert made.widths[0.1] == upper - lower
    campaign.run(small, tmp_path / "a.h5", 1)
    assert made.file_bytes == pytest.approx((tmp_path / "a.h5").stat().st_size, rel=0.05)
    with ResultFile.open(tmp_path / "a.h5") as store:
        results = store.results()[1:]
    for limit in made.limits:
        found = exceedance.exceedance(LOADS[limit.load].of(results), results["status"], limit.level)
        assert found.upper - found.lower <= limit.width + 1e-12
    large = plan.plan(dataclasses.replace(small, sampling=small.sampling.model_copy(update={"n": 10**6})), pilot=2)
    assert large.rows == 10**6 + 1
    assert large.widths[0.1] == pytest.approx(2 * 1.96 * np.sqrt(0.09 / 1e6), rel=0.01)


def test_the_default_pilot_takes_few_joints_that_are_slow(small: study.Study, monkeypatch: pytest.MonkeyPatch) -> None:
    own, sizes = plan.simulate_timed, []

    def slow(loaded: study.Study, params: np.ndarray, options: list[Options]) -> tuple[np.ndarray, float]:
        sizes.append(len(params))
        return own(loaded, params, options)[0], 2.0 * len(params)

    monkeypatch.setattr(plan, "simulate_timed", slow)
    monkeypatch.setattr(plan, "PILOT", 40)
    assert plan.plan(small, pilot=40).pilot == 10
    assert sizes == [8, 10]
    assert plan.plan(small, pilot=12).pilot == 12  # as many as are asked for


def test_a_plan_tells_the_joints_that_decide_an_accepted_share(small: study.Study) -> None:
    assert plan.plan(small, pilot=2).deciding == {}
    assert plan.plan(small, pilot=2, accepted=0.01).deciding == {0.005: 3205.0, 0.008: 23599.0}
    lots = dataclasses.replace(small, sampling=small.sampling.model_copy(update={"joints_per_lot": 2}))
    with pytest.raises(InputError, match="--accept: numbers of joints are known for independent joints only"):
        plan.plan(lots, pilot=2, accepted=0.01)


def test_a_plan_counts_joints_that_do_not_go_together(tmp_path: Path, small: study.Study) -> None:
    assert plan.plan(small, pilot=2).assembly == plan.Assembly(0, 60, binomial.clopper_pearson(0, 60))
    head, tail = synthetic.STUDY.split("[tolerances]")[0], '[sampling]\nmethod = "random"\nn = 30000\nseed = 1\n'
    entry = '"pin*.diameter" = { lower = "0.1 mm", upper = "0.3 mm", distribution = "uniform" }\n'
    loaded = study.load(tmp_path / "tight.toml", text=f"{head}[tolerances]\n{entry}{tail}")
    found = plan._assembly(loaded, iid=True)
    assert found.of == plan.DRAWN
    assert found.interval[0] < 1 - 0.5**4 < found.interval[1]  # one pin in two is larger than the hole, 0.2 mm wider
    assert found.interval == binomial.clopper_pearson(found.misfits, found.of)
    (tmp_path / "few.toml").write_text(loaded.text.replace("30000", "12"), encoding="utf-8")
    done = CliRunner().invoke(cli.app, ["plan", str(tmp_path / "few.toml"), "--pilot", "2"])
    assert "of 12 joints have a pin larger than its hole and cannot be simulated; 95 % interval" in done.stdout.replace(
        "\n    ", " "
    )
    done = CliRunner().invoke(cli.app, ["plan", str(tmp_path / "few.toml"), "--pilot", "2", "--json"])
    assert json.loads(done.stdout)["assembly"]["of"] == 12


VARIANTS = (
    HEAD
    + """[solver]
steps_per_rev = 45
[sampling]
method = "cases"
[[case]]
name = "tilt"
errors.pin1.tilt_z = "0.2 deg"
[[variant]]
name = "as in the study"
[[variant]]
name = "finer"
solver = { steps_per_rev = 90 }
[[variant]]
name = "larger clearance"
joint.contact.D_P = "75.9 mm"
"""
)


def test_a_plan_simulates_variants_as_they_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "v.toml").write_text(VARIANTS, encoding="utf-8")
    loaded, own, made = study.load(tmp_path / "v.toml"), plan.simulate_timed, []

    def keep(*args: object) -> object:
        made.append(own(*args))
        return made[-1]

    monkeypatch.setattr(plan, "simulate_timed", keep)
    found = plan.plan(loaded, workers=1)
    assert (found.rows, found.pilot, found.failed, found.unsettled) == (6, 6, 0, 0)
    campaign.run(loaded, tmp_path / "v.h5", 1, check=False)
    with ResultFile.open(tmp_path / "v.h5") as store:
        np.testing.assert_array_equal(made[0][0]["F_max"], store.results()["F_max"])


@pytest.mark.slow
def test_a_plan_chooses_the_fidelity_that_the_campaign_chooses(tmp_path: Path) -> None:
    text = synthetic.STUDY.replace("n = 60", "n = 6").replace("[limits]", '[solver]\nfidelity = "auto"\n[limits]')
    (tmp_path / "a.toml").write_text(text, encoding="utf-8")
    loaded, told = study.load(tmp_path / "a.toml"), []
    made = plan.plan(loaded, workers=1)
    assert made.fidelity.startswith("auto: ")
    campaign.run(loaded, tmp_path / "a.h5", 1, tell=told.append)
    with ResultFile.open(tmp_path / "a.h5") as store:
        assert made.fidelity.startswith(store.fidelity["reason"])
    assert told[0] == made.fidelity


def test_start_and_report_take_longer_on_a_slower_machine(small: study.Study, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for slower in (1.0, 3.0):
        monkeypatch.setattr(plan, "_loop", lambda slower=slower: slower * plan.LOOP_S)
        found.append(plan.plan(small, workers=1, pilot=2).stages)
    for stage in ("start", "report"):
        assert found[1][stage] == pytest.approx(3.0 * found[0][stage])
    monkeypatch.undo()
    assert plan._loop() > 0.0
