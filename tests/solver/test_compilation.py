"""Compilation in two processes."""

from __future__ import annotations

import subprocess
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from numba.core import config

from tolstat.common.cardan import CARDAN, MECHANISMS
from tolstat.common.parameters import mark_of
from tolstat.common.tables import Fidelity, Options
from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY
from tolstat.solver import compilation


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Kernels that this process compiles or loads, and code that another one runs; none is in the cache."""
    called: list[str] = []

    class Process:
        def __init__(self, command: list[str], **_: Any) -> None:
            called.append(command[-1])

        def __enter__(self) -> Process:
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def wait(self) -> None:
            called.append("wait")

        def kill(self) -> None:
            pass

    def note(name: str, *_: Any) -> None:
        called.append(name)

    noted = {name: partial(note, name) for name in compilation.KERNELS}
    monkeypatch.setattr(subprocess, "Popen", Process)
    monkeypatch.setattr(compilation, "missing", compilation.kernels)
    monkeypatch.setattr(compilation, "available_cores", lambda: 2)
    monkeypatch.setattr(compilation, "KERNELS", noted)
    return called


def test_some_kernels_are_compiled_in_a_second_process(calls: list[str]) -> None:
    compilation.warm_up()
    said, *own = calls
    assert own[: own.index("wait")] == ["lockstep.lockstep", "starts.write_starts", "rainflow.count_joint"]
    others = "['lockstep.one_at_a_time']"
    assert f"compile_kernels({others}, Options(" in said
    compile(said, "said", "exec")
    assert own[own.index("wait") + 1 :] == compilation.kernels(Options())  # loaded


def test_explicit_steps_are_compiled_for_joints_that_need_them(calls: list[str], params: Any) -> None:
    compilation.warm_up(Options(), params())
    assert not {"explicit.explicit", "explicit.count_steps"} & set(calls)
    reversing = compilation._outside_model(CARDAN, torque_reverses=True)
    assert set(compilation.kernels(Options(), reversing)) == set(compilation.KERNELS) - {"ideal.ideal_revolution"}


def test_closed_forms_compile_no_equations_of_motion(calls: list[str]) -> None:
    compilation.warm_up(Options(fidelity=int(Fidelity.IDEAL)))
    assert set(calls) == {"ideal.ideal_revolution", "rainflow.count_joint"}


def test_one_core_compiles_alone(calls: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compilation, "available_cores", lambda: 1)
    compilation.warm_up(Options())
    assert "wait" not in calls
    assert set(calls) == {name for name in compilation.KERNELS if not name.startswith(("explicit.", "ideal."))}


def test_code_of_another_mechanism_does_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tolstat.kernel.simd.cache_folder.CACHE_DIRECTORY", tmp_path)
    faces = MECHANISMS["cardan+thrust"]
    assert compilation.missing(Options()) == compilation.kernels(Options())
    for name in compilation.kernels(Options()):
        types = "" if name == "rainflow.count_joint" else mark_of(CARDAN)
        (tmp_path / f"{name}-1.py311.abc.nbc").write_bytes(b"checksum" + types.encode() + bytes(20000))
    assert compilation.is_compiled()
    assert compilation.missing(Options(), mechanism=faces) == compilation.kernels(Options())[:-1]
    assert compilation.stage_name() == "loading the kernels"
    assert compilation.stage_name(faces).startswith("compiling the kernels")


def test_types_of_arguments_are_in_the_head_of_compiled_code(params: Any) -> None:
    """What `missing` reads: it sees that the kernels of a simulated joint are in the cache."""
    if not config.DISABLE_JIT:
        compilation.warm_up(Options(), params())
        assert compilation.is_compiled(Options(), params())
        heads = [path.read_bytes()[: compilation.HEAD] for path in CACHE_DIRECTORY.rglob("lockstep.*.nbc")]
        assert all(b"numbers_" in head for head in heads)


def test_compilation_is_told_once(calls: list[str], monkeypatch: pytest.MonkeyPatch, caplog: Any) -> None:
    caplog.set_level("INFO", logger="tolstat")
    compilation.warm_up()
    assert [record.message[:21] for record in caplog.records] == ["compiling the kernels"]
    monkeypatch.setattr(compilation, "missing", lambda *_: [])
    compilation.warm_up()
    assert len(caplog.records) == 1
