"""Which kernels are compiled, and what is said of it."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core import config

from tests.support.environment import ROOT, environment
from tolstat import sampling, study
from tolstat.common.cardan import CARDAN, MECHANISMS
from tolstat.common.parameters import mark_of
from tolstat.common.tables import Fidelity, Options
from tolstat.kernel.simd.cache_folder import CACHE_DIRECTORY
from tolstat.kernel.simd.lane import WIDTH
from tolstat.solver import compilation
from tolstat.solver.simulation import simulate_rows
from tolstat.store.recorded import perturbed


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


def of_main_job(rows: range) -> tuple[np.ndarray, int]:
    """Results of joints of the main job, and the number of lanes that they were simulated in."""
    plan = study.load(ROOT / "studies" / "iso2768_f.toml")
    errors = np.concatenate(list(sampling.draw_blocks(plan, rows)))
    return simulate_rows(perturbed(plan, np.array(rows), errors), plan.solver.options()).results, WIDTH


IN_ANOTHER_PROCESS = """
import sys
CHANGE
import numpy as np
from tests.solver.test_compilation import of_main_job
found, width = of_main_job(range(20))
np.save(sys.argv[1], found)
print(width)
"""
ABSENT = "import numba.core.codegen; del numba.core.codegen.JITCodeLibrary"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("processor", "change", "width"),
    [("generic", "", 2), ("", ABSENT, WIDTH)],
    ids=["registers of 128 bits", "function by function"],
)
def test_results_have_the_same_bytes_however_kernels_are_compiled(
    tmp_path: Path, processor: str, change: str, width: int
) -> None:
    """Their arithmetic has no order to choose, and fused operations are written as such: LLVM changes no bit."""
    own = environment() | {"NUMBA_CACHE_DIR": str(tmp_path)} | ({"NUMBA_CPU_NAME": processor} if processor else {})
    code, file = IN_ANOTHER_PROCESS.replace("CHANGE", change), tmp_path / "found.npy"
    done = subprocess.run([sys.executable, "-c", code, file], env=own, stdout=subprocess.PIPE, text=True, check=True)
    assert int(done.stdout) == width
    assert np.load(file).tobytes() == of_main_job(range(20))[0].tobytes()


@pytest.mark.slow
def test_threads_do_not_disturb_each_other() -> None:
    """Their kernels run at the same time."""
    parts = [range(first, first + 32) for first in range(1, 257, 32)]
    alone = [of_main_job(rows)[0].tobytes() for rows in parts]
    with ThreadPoolExecutor(2) as threads:
        assert [found.tobytes() for found, _ in threads.map(of_main_job, parts)] == alone
