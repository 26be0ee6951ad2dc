"""Joints that many tests start from."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tolstat import joint as joints
from tolstat.common.tables import PARAM

REFERENCE = Path(__file__).parent / "reference"
REFERENCE_CASES = sorted(path.stem for path in REFERENCE.glob("*.toml"))

Params = Callable[..., np.recarray]


def with_law(par: np.recarray, law: str) -> np.recarray:
    """Give joints of PARAM the contact stations that `law` names; returns them."""
    stations = joints.load("cirelli2021", {"contact": {"law": law}}, "test", None)
    own = joints.perturb(
        stations, joints.nominal_errors(1, joints.Operation.model_construct(alpha=0, speed=1, torque=0))
    )
    for name in ("n_stations", "station_s", "station_k1", "station_k2", "station_weight"):
        par[name] = own[name][0]
    return par


@pytest.fixture(scope="session")
def cirelli() -> joints.Joint:
    return joints.load("cirelli2021", {}, "test", None)


@pytest.fixture(scope="session")
def params(cirelli: joints.Joint) -> Params:
    """Make one row of PARAM: operating point, then errors by name with ``__`` for the dot."""

    def make(
        alpha: float = 0.0, speed: float = 500 * np.pi / 30, torque: float = 100.0, **errors: float
    ) -> np.recarray[Any, np.dtype[np.void]]:
        table = joints.nominal_errors(1, joints.Operation.model_construct(alpha=alpha, speed=speed, torque=torque))
        for name, value in errors.items():
            table[name.replace("__", ".")] = value
        row = joints.perturb(cirelli, table)
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
