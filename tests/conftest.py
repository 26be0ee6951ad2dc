"""Joints that many tests start from."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import tolstat
from tests.support.environment import ROOT
from tests.support.of_cardan import PARAM
from tolstat import joint as joints
from tolstat.campaign import pool
from tolstat.cli import app
from tolstat.common.cardan import CARDAN
from tolstat.joint import orders
from tolstat.store import metadata

REFERENCE = Path(__file__).parent / "reference"
REFERENCE_CASES = sorted(path.stem for path in REFERENCE.glob("*.toml"))

CHEAP = """histories = "harmonics+cycles"
harmonics = 6

[solver]
fidelity = "quasistatic"
steps_per_rev = 15

[sampling]"""
UNIFORM = 'upper = "0.030 mm", distribution = "uniform"'

Params = Callable[..., np.recarray]
Wave = tuple[int, float, float]
"""Number, amplitude and phase of an order."""
IN_WORKERS = pool.map_blocks


def with_orders(
    par: np.recarray[Any, Any], speed: Sequence[Wave] = (), torque: Sequence[Wave] = ()
) -> np.recarray[Any, Any]:
    """The joints `par` with orders (n, amplitude in rad or N m, phase in rad)."""
    waves = [
        [model.model_construct(n=n, amplitude=amplitude, phase=phase) for n, amplitude, phase in given]
        for model, given in ((orders.SpeedOrder, speed), (orders.TorqueOrder, torque))
    ]
    ones = np.ones(len(par))
    for name, value in orders.parameters(*waves, ones, ones).items():
        par[name] = value
    return par


def with_law(par: np.recarray, law: str) -> np.recarray:
    """Give joints of PARAM the contact stations that `law` names; returns them."""
    still = joints.Operation.model_construct(alpha=0, speed=1, torque=0)
    own = joints.perturb(joint_with_law(law), still, joints.nominal_errors(1, CARDAN))
    for name in (*(name for name in PARAM.names if name.startswith("station_")), "n_stations", "needle_b"):
        par[name] = own[name][0]
    return par


def sliding(par: np.recarray, k_a: float = 2e7, c_a: float = 2e3, F_a: float = 200.0) -> np.recarray:
    """Let the output shafts of joints of PARAM slide, with a mass of 5 kg; returns them."""
    for name, value in {"slides": 1.0, "m_s": 5.0, "k_a": k_a, "c_a": c_a, "F_a": F_a}.items():
        par[name] = value
    return par


def joint_with_law(law: str) -> joints.Joint:
    """Load the joint of Cirelli et al. with another contact law, and needle bearings for it."""
    bearing = {"needles": 32, "needle_length": "22 mm"}
    return joints.load("cirelli2021", {"contact": {"law": law}, "bearing": bearing}, "test", None)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes the golden files of tests/golden/output anew where they differ."""
    parser.addoption("--update-golden", action="store_true", help="write golden files anew where the output differs")


@pytest.fixture(scope="session")
def cirelli() -> joints.Joint:
    return joints.load("cirelli2021", {}, "test", None)


@pytest.fixture(scope="session")
def params(cirelli: joints.Joint) -> Params:
    """Make one row of PARAM: operating point, then errors by name with ``__`` for the dot."""

    def make(
        alpha: float = 0.0, speed: float = 500 * np.pi / 30, torque: float = 100.0, **errors: float
    ) -> np.recarray[Any, np.dtype[np.void]]:
        operation = joints.Operation.model_construct(alpha=alpha, speed=speed, torque=torque)
        table = joints.nominal_errors(1, CARDAN)
        for name, value in errors.items():
            table[name.replace("__", ".")] = value
        row = joints.perturb(cirelli, operation, table)
        assert row.dtype == PARAM
        return row.view(np.recarray)

    return make


@pytest.fixture(scope="session")
def random_errors() -> Callable[[int], dict[str, float]]:
    """Errors of some size on every pin and hole, by seed."""

    def draw(seed: int) -> dict[str, float]:
        rng = np.random.default_rng(seed)
        errors = {}
        for feature in [f"{kind}{i}" for kind in ("pin", "hole") for i in (1, 2, 3, 4)]:
            for axis in "etz":
                errors[f"{feature}__offset_{axis}"] = rng.normal(0, 2e-5)
            for axis in "tz":
                errors[f"{feature}__tilt_{axis}"] = rng.normal(0, 2e-3)
            errors[f"{feature}__diameter"] = rng.normal(0, 5e-6)
        for i in (1, 2, 3, 4):
            errors[f"pin{i}__clearance"] = rng.normal(0, 5e-6)
        return errors

    return draw


@pytest.fixture(scope="session", autouse=True)
def _small_campaigns_in_this_process() -> Iterator[None]:
    """One core, and campaigns of one worker simulate here: starting workers takes longer than few joints do.

    Tests of several workers say how many; those of what joints do to their process ask for the fixture `in_workers`.
    """

    def quick(
        work: pool.Work[Any, Any], blocks: Iterable[Any], workers: int, stop: Callable[[], bool] = lambda: False
    ) -> Iterator[tuple[Any, Any]]:
        if workers > 1:
            yield from IN_WORKERS(work, blocks, workers, stop)
            return
        for block in blocks:
            if stop():
                return
            yield block, work.function(block)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "sched_getaffinity", lambda _: {0}, raising=False)
        patch.setattr(pool, "map_blocks", quick)
        for name in ("git_commit", "source_hash"):  # neither changes meanwhile
            patch.setattr(metadata, name, cache(getattr(metadata, name)))
        yield


@pytest.fixture
def in_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulate all campaigns in worker processes, as users do."""
    monkeypatch.setattr(pool, "map_blocks", IN_WORKERS)


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write reports without pictures, and pages without sections below the verdict: they take most of the time."""
    monkeypatch.setattr("tolstat.display.style.save", lambda figure, stem, suffixes=(): [])
    monkeypatch.setattr("tolstat.questions.exceedance.curves.sheet", lambda view, notes: None)
    monkeypatch.setattr("tolstat.report.page.sections_of", lambda view, asked: [])


@pytest.fixture(scope="session")
def example_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the studies and files that examples name, of few joints at a cheap fidelity; tests copy it."""
    folder = tmp_path_factory.mktemp("examples")
    shutil.copytree(ROOT / "studies", folder / "studies")
    study, narrow = folder / "studies" / "iso2768_f.toml", folder / "narrow.toml"
    text = study.read_text(encoding="utf-8").replace("n = 1024", "n = 600").replace("[sampling]", f"[output]\n{CHEAP}")
    study.write_text(text, encoding="utf-8")
    narrow.write_text(text.replace('upper = "0.030 mm", distribution = "normal", cpk = 1.0', UNIFORM), encoding="utf-8")
    tolstat.run(tolstat.load(study), folder / "iso2768_f.h5", workers=1)
    tolstat.run(tolstat.load(narrow), folder / "narrow.h5", workers=1)
    bearings = folder / "studies" / "needle_bearings.toml"
    text = bearings.read_text(encoding="utf-8").replace("[sampling]", f"[output]\n{CHEAP}")
    bearings.write_text(text, encoding="utf-8")
    tolstat.run(tolstat.load(bearings, n=60), folder / "needle_bearings.h5", workers=1)
    done = CliRunner().invoke(app, ["export", str(folder / "iso2768_f.h5"), "--csv", str(folder / "joints.csv")])
    assert done.exit_code == 0, done.stderr
    return folder
