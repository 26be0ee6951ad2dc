"""Compilation in two processes."""

from __future__ import annotations

import subprocess
import time
from functools import partial
from typing import Any

import pytest

from tolstat.common.tables import Options
from tolstat.solver import compilation, simulation


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Kernels that this process compiles or loads, and code that another one runs; none is in the cache."""
    called: list[str] = []

    class Process:
        def __init__(self, command: list[str], **_: Any) -> None:
            called.append(command[-1])

        def wait(self) -> None:
            called.append("wait")

        def kill(self) -> None:
            pass

    def note(name: str, _: Options) -> None:
        called.append(name)

    noted = {name: one._replace(compile=partial(note, name)) for name, one in compilation.KERNELS.items()}
    monkeypatch.setattr(subprocess, "Popen", Process)
    monkeypatch.setattr(compilation, "missing", compilation.kernels)
    monkeypatch.setattr(simulation, "in_lanes", lambda _: True)
    monkeypatch.setattr(compilation, "available_cores", lambda: 2)
    monkeypatch.setattr(compilation, "KERNELS", noted)
    return called


def test_some_kernels_are_compiled_in_a_second_process(calls: list[str]) -> None:
    compilation.warm_up()
    said, *own = calls
    assert own[: own.index("wait")] == ["lockstep.lockstep", "rainflow.count_joint"]
    others = "['simulate.simulate_joint', 'starts.write_starts']"
    assert f"compile_kernels({others}, Options(" in said
    compile(said, "said", "exec")
    assert own[own.index("wait") + 2 :] == compilation.kernels(Options())  # loaded


def test_explicit_steps_are_compiled_for_joints_that_need_them(calls: list[str], params: Any) -> None:
    compilation.warm_up(Options(), params())
    assert not {"explicit.explicit", "explicit.count_steps"} & set(calls)
    assert set(compilation.kernels(Options(), compilation._reversing())) == set(compilation.KERNELS)
    assert compilation.halves(list(compilation.KERNELS)) == (
        ["lockstep.lockstep", "starts.write_starts", "explicit.count_steps", "rainflow.count_joint"],
        ["simulate.simulate_joint", "explicit.explicit"],
    )


def test_each_kernel_is_told_when_it_lies_in_the_cache(calls: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def compile_slowly(name: str, _: Options) -> None:
        time.sleep(0.05)
        calls.append(name)

    noted = {name: one._replace(compile=partial(compile_slowly, name)) for name, one in compilation.KERNELS.items()}
    monkeypatch.setattr(compilation, "KERNELS", noted)
    monkeypatch.setattr(compilation, "available_cores", lambda: 1)
    monkeypatch.setattr(compilation, "POLL_S", 0.01)
    monkeypatch.setattr(compilation, "_is_held", lambda name: name in calls)
    said: list[str] = []
    monkeypatch.setattr(compilation.LOG, "info", lambda form, *values: said.append(form % values))
    compilation.warm_up()
    assert [line.split(",")[0] for line in said] == [
        "compiled: joints in lanes (48 %",
        "compiled: load cycles (52 %",
        "compiled: single joints (90 %",
        "compiled: starts of joints (100 %",
    ]


def test_one_core_compiles_alone(calls: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "available_cores", lambda: 1)
    compilation.warm_up(Options())
    assert "wait" not in calls
    assert set(calls) == set(compilation.KERNELS) - {"explicit.explicit", "explicit.count_steps"}
