"""A change on the same joints: what is simulated, what the file keeps, what is told."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import tolstat
from tests.support import synthetic
from tests.support.reports import call
from tests.support.two_errors import stand_in
from tolstat.campaign import blocks
from tolstat.campaign.work import Work
from tolstat.common.errors import InputError, NotApplicable, StoreError
from tolstat.questions import change as question
from tolstat.store import ResultFile, what_if

TEXT = synthetic.TILTS
NARROW = ["pin*.tilt_t.cpk=2", "pin*.offset_z.plus_minus=0.05 mm"]
NOTHING = "hole1.tilt_t={ plus_minus = '0.1 deg', distribution = 'normal' }"


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """The stand-in takes the place of the solver, in this process."""
    monkeypatch.setattr(blocks, "simulate_rows", stand_in)
    monkeypatch.setattr("tolstat.questions.shares.warm_up", lambda **_: None)


def made(folder: Path, text: str = TEXT, name: str = "made", solver: Callable[..., Any] = stand_in) -> Path:
    """Campaign of the stand-in."""
    return synthetic.simulated_by(solver, folder, text, name)


def simulated(path: Path, settings: list[str] = NARROW, **options: Any) -> str:
    """Simulate a change; returns what is told at the end."""
    told = [""]
    assert question.simulate(path, Work(workers=1, tell=told.append), settings, **options) == [path]
    return told[-1]


def answer(path: Path, settings: list[str] = NARROW, accepted: float = np.nan) -> Any:
    with ResultFile.open(path) as store:
        return tolstat.change(store.view(), settings, accepted)


def share_of(tilt: float, offset: float) -> float:
    """Share of the joints of the stand-in above 700 N, with errors of `tilt` and `offset` of its sigmas."""
    x = np.linspace(-8.0, 8.0, 4001)
    beyond = np.clip((60.0 - 15.0 * offset * np.abs(x)) / (40.0 * tilt), 0.0, None)
    return float(np.sum(norm.pdf(x) * 2.0 * norm.sf(beyond)) * (x[1] - x[0]))


@pytest.mark.parametrize(
    "settings",
    [
        NARROW,
        ["operation.torque=110 N*m", "joint.contact.clearance=0.15 mm"],
        ["pin1.tilt_t=none", "errors.pin1.tilt_t=0.1 deg"],
    ],
)
def test_the_joints_are_those_of_a_campaign_of_the_changed_study(tmp_path: Path, settings: list[str]) -> None:
    path = made(tmp_path)
    simulated(path, settings, most=400)
    assert (
        call(
            "change",
            path,
            *(word for setting in settings for word in ("--set", setting)),
            "--most",
            400,
            "--out",
            tmp_path / "other.toml",
        ).exit_code
        == 0
    )
    own = made(tmp_path, (tmp_path / "other.toml").read_text(), "own")
    with ResultFile.open(path) as store, ResultFile.open(own) as other:
        (held,) = what_if.read(store).values()
        for name in held.names:
            assert held.valid([name]).tobytes() == other.view().load(name).values.tobytes()
        assert held.valid(["cross1.F"]).tobytes() != store.view().load("cross1.F").values.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings", [["pin*.offset_t.cpk=1.3"], ["joint.contact.law=sliced", "operation.alpha=12 deg"]]
)
def test_the_solver_gives_them_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, settings: list[str]
) -> None:
    monkeypatch.undo()
    source = tmp_path / "made.toml"
    source.write_text(synthetic.REAL.replace("n = 60", "n = 24"), encoding="utf-8")
    tolstat.run(tolstat.load(source), tmp_path / "made.h5", workers=1)
    words = [word for setting in settings for word in ("--set", setting)]
    done = call("change", tmp_path / "made.h5", *words, "--most", 128, "--workers", 1, "--out", tmp_path / "other.toml")
    assert done.exit_code == 0, done.stderr
    tolstat.run(tolstat.load(tmp_path / "other.toml"), tmp_path / "other.h5", workers=1)
    with ResultFile.open(tmp_path / "made.h5") as store, ResultFile.open(tmp_path / "other.h5") as other:
        held = next(one for one in what_if.read(store).values() if one.about["kind"] == "study")
        loads = {name: other.view().load(name).values for name in held.names}
        assert all(held.valid([name])[:24].tobytes() == values.tobytes() for name, values in loads.items())


def test_shares_before_and_after_are_those_of_the_law(tmp_path: Path) -> None:
    path = made(tmp_path)
    simulated(path, most=1600)
    found = answer(path)
    (row,) = found.tables["limits"].rows
    for when, scale in (("before", (1.0, 1.0)), ("after", (0.5, 1.0 / 3.0))):
        assert row[f"{when}_lower"] < share_of(*scale) < row[f"{when}_upper"]
    assert row["change_lower"] < share_of(0.5, 1.0 / 3.0) - share_of(1.0, 1.0) < row["change_upper"] < 0.0
    assert row["change"] == pytest.approx(row["after"] - row["before"])
    assert found.facts["yield_after"] == 1.0 - row["after"]
    assert "largest loads: " not in str(found.parts)
    median = next(each for each in found.tables["loads"].rows if each["share"] == 0.5)
    assert median["change_lower"] < median["after"] - median["before"] < median["change_upper"] < 0.0


def test_it_looks_until_the_difference_is_settled(tmp_path: Path) -> None:
    path = made(tmp_path)
    assert simulated(path).startswith("simulated 400 joints in ")  # a large effect: the joints of the campaign suffice
    assert answer(path).facts["settled"]
    slight = ["pin*.tilt_t.cpk=1.02"]
    assert simulated(path, slight, most=1600).startswith("simulated 1200 joints")  # 800, and 400 more as drawn
    assert answer(path, slight).facts["n"] == 800
    assert simulated(path, [NOTHING]).startswith("simulated 400 joints in ")  # no effect: settled at once


def test_with_an_accepted_share_it_looks_until_the_verdict_is_known(tmp_path: Path) -> None:
    path = made(tmp_path)
    near = 0.8 * share_of(0.5, 1.0 / 3.0)
    simulated(path, accepted=near, most=1600)
    assert answer(path).facts["n"] > 400
    with ResultFile.open(path) as store:
        facts = tolstat.change(store.view(), NARROW, 0.05).facts
    assert (facts["verdict_before"], facts["verdict_after"], facts["turns"]) == ("not kept", "kept", True)
    lead = [part["text"] for part in answer(path, accepted=0.05).values()["sentences"] if part["place"] == "lead"]
    assert lead[-1] == "The verdict turns: not kept before, kept after (5 % accepted)."
    stays = answer(path, accepted=0.5).values()["sentences"][2]["text"]
    assert stays == "The verdict does not turn: kept before, kept after (50 % accepted)."
    with ResultFile.open(path) as store:
        at = tolstat.change(store.view(), NARROW).facts["yield_before"]
    known = answer(path, accepted=1.0 - at).values()["sentences"][2]["text"]
    assert known.startswith("Kept with the change, open as drawn (")
    assert known.endswith(" accepted): the joints do not tell whether the verdict turns.")


def test_asking_again_reads_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = made(tmp_path)
    command = [
        "change",
        path,
        "--set",
        "pin*.tilt_t.cpk=2",
        "--set",
        "pin*.offset_z.plus_minus = 0.05 mm",
        "--workers",
        1,
    ]
    first = call(*command)
    assert first.exit_code == 0, first.stderr
    before = path.read_bytes()
    monkeypatch.setattr(blocks, "simulate_rows", None)
    assert call(*command).stdout == first.stdout
    assert path.read_bytes() == before
    values = json.loads(call(*command, "--json").stdout)
    assert values["facts"]["n"] == 400
    assert re.search(r"^cross1\.F > 700 N ", first.stdout, flags=re.MULTILINE)


def test_a_value_in_another_unit_is_not_simulated_again(tmp_path: Path) -> None:
    path = made(tmp_path)
    assert simulated(path, ["pin*.offset_z.plus_minus=0.08 mm"], most=400).startswith("simulated 400 joints")
    again = ["pin*.offset_z.plus_minus=80 um"]
    assert simulated(path, again, most=400) == ""
    assert answer(path, again).facts["n"] == 400


def test_files_are_written_before_the_answer_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def ended(*_: Any) -> None:
        raise BrokenPipeError

    monkeypatch.setattr("tolstat.cli._shared._print_parts", ended)
    done = call("change", made(tmp_path), "--set", "pin*.tilt_t.cpk=2", "--workers", 1, "--out", tmp_path / "x.toml")
    assert isinstance(done.exception, BrokenPipeError)
    assert "cpk = 2" in (tmp_path / "x.toml").read_text()


def test_an_interrupted_change_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, calls = made(tmp_path), list[int]()

    def stopping(params: Any, *options: Any, **named: Any) -> Any:
        calls.append(len(params))
        if len(calls) == 3:
            raise KeyboardInterrupt
        return stand_in(params, *options, **named)

    monkeypatch.setattr(blocks, "simulate_rows", stopping)
    with pytest.raises(KeyboardInterrupt):
        simulated(path, most=400)
    monkeypatch.setattr(blocks, "simulate_rows", stand_in)
    assert simulated(path, most=400).startswith("simulated ")
    whole = tmp_path / "whole"
    whole.mkdir()
    other = made(whole)
    simulated(other, most=400)
    assert answer(path).values() == answer(other).values()


def test_a_study_without_limits_has_quantiles(tmp_path: Path) -> None:
    path = made(tmp_path, TEXT.partition("[limits]")[0])
    simulated(path)
    found = answer(path)
    assert "limits" not in found.tables
    assert {row["load"] for row in found.tables["loads"].rows} == {
        f"{b}{i}.F" for b in ("cross", "fork") for i in range(1, 5)
    }


def test_a_campaign_of_lots_is_compared_with_joints_drawn_at_random(tmp_path: Path) -> None:
    text = TEXT.replace("seed = 3", "seed = 3\njoints_per_lot = 8")
    path = made(tmp_path, text.replace('"normal"', '"normal", lot = { share = 0.5 }', 1))
    assert simulated(path, most=1024).startswith("simulated 2048 joints")
    assert answer(path).facts["n"] == 1024


def test_what_cannot_be_changed_is_refused(tmp_path: Path) -> None:
    path = made(tmp_path)
    with pytest.raises(NotApplicable, match=r"simulate them: tolstat change .*--set 'pin\*.tilt_t.cpk=2'"):
        answer(path)
    with pytest.raises(InputError, match="changes nothing"):
        answer(path, ["operation.alpha=15 deg"])
    with pytest.raises(InputError, match="changes no joint"):
        simulated(path, ["sampling.seed=4"])
    with pytest.raises(InputError, match=r"--budget: 0 s were over before a joint with the change was simulated"):
        simulated(path, budget=0.0)
    for text, words in (("5", "'5' has no unit"), ("5 parsecs", "cannot be a value in s"), ("-1 s", "is not a time")):
        told = call("change", path, "--set", NARROW[0], "--budget", text).stderr
        assert words in told
        assert 'hint: write --budget "5 min", "90 s" or "2 h"' in told
    swept = synthetic.store(tmp_path, synthetic.SWEEP, "swept")
    with pytest.raises(StoreError):
        simulated(swept)
    refused = call("change", path, "--set", "pin1.tilt_t.cpk=2", "--out", path.with_suffix(".toml") / "x.toml")
    assert refused.exit_code == 2
