"""Which kernels are compiled, and what is said of it."""

from __future__ import annotations

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
    """Kernels that are compiled or loaded; none is in the cache."""
    called: list[str] = []

    def note(name: str, *_: Any) -> None:
        called.append(name)

    monkeypatch.setattr(compilation, "missing", compilation.kernels)
    monkeypatch.setattr(compilation, "KERNELS", {name: partial(note, name) for name in compilation.KERNELS})
    return called


def test_joints_of_a_campaign_need_their_kernels_alone(calls: list[str]) -> None:
    compilation.warm_up()
    assert calls == ["lockstep.lockstep", "starts.write_starts", "rainflow.count_joint"]


def test_explicit_steps_are_compiled_for_joints_that_need_them(calls: list[str], params: Any) -> None:
    compilation.warm_up(Options(), params())
    assert not {"explicit.explicit", "explicit.count_steps"} & set(calls)
    reversing = compilation._outside_model(CARDAN, torque_reverses=True)
    assert set(compilation.kernels(Options(), reversing)) == set(compilation.KERNELS) - {"ideal.ideal_revolution"}


def test_closed_forms_compile_no_equations_of_motion(calls: list[str]) -> None:
    compilation.warm_up(Options(fidelity=int(Fidelity.IDEAL)))
    assert set(calls) == {"ideal.ideal_revolution", "rainflow.count_joint"}


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
