"""Compilation in two processes."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from tolstat.common.tables import Options
from tolstat.solver import compilation


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

    noted: dict[str, Callable[[Options], None]] = {name: partial(note, name) for name in compilation.KERNELS}
    monkeypatch.setattr(subprocess, "Popen", Process)
    monkeypatch.setattr(compilation, "missing", compilation.kernels)
    monkeypatch.setattr(compilation, "available_cores", lambda: 2)
    monkeypatch.setattr(compilation, "KERNELS", noted)
    return called


def test_every_other_kernel_is_compiled_in_a_second_process(calls: list[str]) -> None:
    compilation.warm_up()
    said, *own = calls
    assert own[: own.index("wait")] == ["lockstep.lockstep", "explicit.count_steps", "rainflow.count_joint"]
    assert "compile_kernels(['explicit.explicit', 'simulate.simulate_joint'], Options(" in said
    compile(said, "said", "exec")
    assert own[own.index("wait") + 2 :] == compilation.kernels(Options())  # loaded


def test_one_core_compiles_alone(calls: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "available_cores", lambda: 1)
    compilation.warm_up(Options(max_refinements=0))
    assert "wait" not in calls
    assert set(calls) == set(compilation.KERNELS) - {"explicit.explicit", "explicit.count_steps"}
