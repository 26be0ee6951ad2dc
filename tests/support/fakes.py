"""A study and functions that cost nothing, so that stores and campaigns can be tested without a kernel.

The numbers depend on the row's errors only, as those of the real simulation do. `main` runs a campaign, for
tests that kill it.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.environment import environment as environment
from tests.support.of_cardan import ERROR, ERROR_FIELDS, PARAM, RESULT, RESULT_FIELDS
from tolstat.campaign import blocks, verify
from tolstat.campaign import run as campaign
from tolstat.common.cardan import CARDAN
from tolstat.common.columns import KEPT, Column, kept_columns
from tolstat.common.counts import Counts
from tolstat.common.fields import HistorySpec
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import DESIGN, Options, Simulation, Status
from tolstat.joint import Operation
from tolstat.joint.model import leaves
from tolstat.solver import stationary
from tolstat.store import Reader, recorded
from tolstat.study.model import Sampling
from tolstat.study.points import Point

SPECS = {
    "loads": HistorySpec((30, 8, 6), "f4", "N, N*m", "bushing loads"),
    "mode": HistorySpec((30, 4), "u1", "1", "contact modes"),
    "error": HistorySpec((2,), "f8", "1", "error of the harmonics"),
}


class Dump(dict):
    """A mapping with the ways of pydantic and of a joint of writing itself."""

    def model_dump(self, mode: str = "json") -> dict[str, Any]:
        """Return the mapping itself."""
        return dict(self)

    given = model_dump


@dataclass(frozen=True)
class Output:
    """Table ``[output]`` of a study."""

    histories: str = "none"
    harmonics: int = 4
    results: tuple[str, ...] | None = None

    def columns(self, mechanism: Mechanism) -> tuple[Column, ...]:
        """Columns of the results that are kept."""
        return kept_columns(self.identity(mechanism), mechanism)

    def identity(self, mechanism: Mechanism) -> dict[str, Any]:
        """Return what decides the numbers."""
        return {"output": self.histories} | ({} if self.results is None else {KEPT: list(self.results)})


@dataclass(frozen=True)
class Solver:
    """Table ``[solver]`` of a study."""

    steps_per_rev: int = 30
    fidelity: str = "dynamic"
    error_budget: float = 0.005

    def options(self) -> Options:
        """Return the settings as the kernel takes them."""
        return Options(steps_per_rev=self.steps_per_rev)


@dataclass(frozen=True)
class Study:
    """What store and campaign ask of a study."""

    n: int = 40
    seed: int = 7
    solver: Solver = Solver()
    output: Output = Output()
    limits: dict[str, float] = field(default_factory=lambda: {"cross1.F": 700.0})
    name: str = "fake"
    text: str = "# a study\n[sampling]\nn = 40  # Größe\n"
    mechanism: Mechanism = CARDAN
    variants: tuple[()] = ()
    case_names: tuple[()] = ()
    joint: Dump = field(default_factory=lambda: Dump(material=Dump(E="2.1e11 Pa")))
    points: tuple[Point, ...] = (Point("", Operation.model_construct(alpha=0.0, speed=1.0, torque=1.0), 1.0),)

    @property
    def operation(self) -> Operation:
        """The first operating point."""
        return self.points[0].operation

    @property
    def operations(self) -> tuple[Operation, ...]:
        """Operating point of the only joint."""
        return (self.operation,)

    @property
    def no_closed_form(self) -> list[tuple[str, str]]:
        """Closed forms hold."""
        return []

    def at(self, name: str) -> Study:
        """Return the study at one of its points."""
        own = next(point for point in self.points if point.name == name)
        return replace(self, points=(own._replace(name=""),))

    @property
    def sampling(self) -> Sampling:
        """Table ``[sampling]`` of a study."""
        return Sampling(n=self.samples, seed=self.seed)

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of the results that are kept."""
        return self.output.columns(self.mechanism)

    @property
    def first_sample(self) -> int:
        """Row of the first random joint."""
        return self.sampling.first_sample

    @property
    def asked(self) -> tuple[str, ...]:
        """Loads that limits ask for."""
        return tuple(self.limits)

    @property
    def rows(self) -> int:
        """Number of rows of every table."""
        return self.n

    @property
    def samples(self) -> int:
        """Number of joints, the nominal one not counted."""
        return self.n - 1

    @property
    def joints(self) -> tuple[Dump, ...]:
        """One joint, of which all rows are variants without errors of their own."""
        return (self.joint,)

    @property
    def solvers(self) -> tuple[Solver, ...]:
        """Settings of the only joint."""
        return (self.solver,)

    @property
    def design(self) -> np.ndarray:
        """Row by row the only joint."""
        return np.zeros(self.n, DESIGN)

    def identity(self) -> dict[str, Any]:
        """Return what decides the numbers."""
        operations = {point.name: point.operation.model_dump() for point in self.points}
        parts = {"joint": self.joint, "operation": operations.get("", operations)}
        settings = {"solver.steps_per_rev": self.solver.steps_per_rev} | leaves(parts)
        return settings | {"sampling.n": self.n, "sampling.seed": self.seed} | self.output.identity(self.mechanism)


def draw(study: Study) -> np.ndarray:
    """Draw each error from a stream of its own: a longer campaign begins alike, further errors change no others."""
    errors = np.zeros(study.n, ERROR)
    for number, f in enumerate(ERROR_FIELDS):
        errors[f.name] = np.random.default_rng([900 + study.seed, number]).normal(size=study.n)
    return errors


def draw_blocks(study: Study, rows: range) -> Iterator[np.ndarray]:
    yield draw(study)[rows.start : rows.stop]


def perturb(joint: Any, operation: Operation, errors: np.ndarray) -> np.ndarray:
    params = np.zeros(len(errors), PARAM)
    params["alpha"][:, 0] = operation.alpha + errors["operation.alpha"]
    params["R"] = errors["pin1.offset_t"]
    return params


def parameters(store: Reader, slots: np.ndarray) -> np.ndarray:
    return perturb(None, store.operation, store.errors()[slots])


def history_specs(
    options: Options, histories: str, n_harmonics: int, mechanism: Mechanism = CARDAN
) -> dict[str, HistorySpec]:
    return SPECS if histories == "full" else {}


def simulate(
    params: np.ndarray,
    options: Options,
    histories: str = "none",
    n_harmonics: int = 0,
    mechanism: Mechanism = CARDAN,
    seconds: float = 0.0,
) -> Simulation:
    """Simulate joints by a formula, `seconds` each; one in ten fails, one in ten does not settle."""
    time.sleep(seconds * len(params))
    results = np.zeros(len(params), RESULT)
    x = params["R"] + 2 * params["alpha"][:, 0]
    results["status"] = np.where(x > 3, Status.NEWTON_FAILED, np.where(x < -3, Status.NOT_SETTLED, Status.OK))
    results["settled"] = results["status"] == Status.OK
    results["steps"] = options.steps_per_rev
    for i, name in enumerate(f.name for f in RESULT_FIELDS if f.dtype == "f8"):
        shape = (len(params),) + (1,) * len(RESULT[name].shape)
        results[name] = np.where(x > 3, np.nan, np.sin(x + i)).reshape(shape)
    stationary.fill_intervals(results)
    return Simulation(results, {name: history(spec, x) for name, spec in specs_of(histories).items()})


def specs_of(histories: str) -> dict[str, HistorySpec]:
    return history_specs(Options(), histories, 0)


def history(spec: HistorySpec, x: np.ndarray) -> np.ndarray:
    steps = np.arange(np.prod(spec.shape)).reshape(spec.shape)
    values = x.reshape((-1,) + (1,) * len(spec.shape)) * np.cos(steps)
    return (np.abs(values) * 50 % 4 if spec.dtype == "u1" else values).astype(spec.dtype)


def simulate_and_raise(params: np.ndarray, options: Options, **kept: Any) -> Simulation:
    raise ZeroDivisionError("a bug")


def simulate_badly(
    params: np.ndarray, options: Options, kills: float, raises: float = np.nan, **kept: Any
) -> Simulation:
    """Simulate, but the joint with one value of R kills its process, and another one is a bug."""
    if kills in params["R"]:
        os.kill(os.getpid(), signal.SIGKILL)
    if raises in params["R"]:
        raise ZeroDivisionError("a bug of this joint")
    return simulate(params, options, **kept)


def warm_up(options: Options, params: np.ndarray | None = None, mechanism: Mechanism = CARDAN) -> None:
    """Compile nothing."""


FUNCTIONS: dict[str, Callable[..., Any]] = {
    "draw_blocks": draw_blocks,
    "origin_blocks": lambda *_: None,
    "perturb": perturb,
    "parameters": parameters,
    "history_specs": history_specs,
    "simulate_rows": simulate,
    "warm_up": warm_up,
    "is_compiled": lambda *_, **__: False,
}
"""Functions that campaigns call, by the names under which they import them."""
SOLVER = {name: FUNCTIONS[name] for name in ("simulate_rows", "warm_up", "is_compiled")} | {
    "history_specs": lambda *_: {}
}
"""Those of the solver, without histories."""


def replace_functions(patch: pytest.MonkeyPatch, **functions: Callable[..., Any]) -> None:
    """Let campaigns call other functions; workers find `simulate_rows` and `warm_up` in the modules they are from."""
    for module in (campaign, blocks, verify, recorded):
        for name, function in functions.items():
            if hasattr(module, name):
                patch.setattr(module, name, function)


@contextmanager
def in_place(**functions: Callable[..., Any]) -> Iterator[None]:
    """Let campaigns call those of `FUNCTIONS` inside, or the ones given."""
    with pytest.MonkeyPatch.context() as patch:
        replace_functions(patch, **FUNCTIONS | functions)
        yield


def run(
    study: Any, path: Path, workers: int = 1, block: int | None = 1000, check: bool = False, **choices: Any
) -> Counts:
    """Run a campaign with the functions of this module, or those given, in one block, without checks."""
    functions = {name: choices.pop(name) for name in FUNCTIONS.keys() & choices.keys()}
    with in_place(**functions):
        return campaign.run(study, path, workers, block, check=check, **choices)


def main(out: str, workers: int, block: int, seconds: float, histories: str = "none", n: int = 40) -> None:
    """Run a campaign of `n` slow joints, as `tolstat run` does; says ``go`` after the first block."""
    said: list[int] = []

    def say(counts: Any) -> None:
        said.append(counts.done)
        if len(said) == 2:
            print("go", flush=True)

    study = Study(n=n, output=Output(histories))
    try:
        run(study, Path(out), workers, block, progress=say, simulate_rows=partial(simulate, seconds=seconds))
    except campaign.Interrupted as stop:
        print(stop, flush=True)
        raise SystemExit(stop.exit_code) from None
