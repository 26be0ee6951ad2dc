"""Kernels as units: what kernels call becomes machine code with what Python calls. Fails where Numba has changed."""

from __future__ import annotations

import math
import subprocess
import sys

import numba
import numpy as np
import pytest
from numba import float64

from tests.support.environment import environment
from tests.support.linkages import mechanism_of
from tolstat.common.cardan import CARDAN, MECHANISMS
from tolstat.common.mechanism import GENERAL, numbering
from tolstat.common.tables import blank_params
from tolstat.kernel.simd.jit import njit_inner


@numba.njit
def users(x):
    return math.exp(x)


@njit_inner
def square(x):
    return x * x


@njit_inner
def sum_of_squares(x):
    total = 0.0
    for k in range(x.size):
        total += square(x[k])
    return total


@njit_inner
def top(x):
    return sum_of_squares(x) + square(x[0]) + users(x[1])


X = np.array([1.0, 2.0, 3.0])
TOP = 14 + 1 + math.exp(2)


def emitted(kernel):
    """Whether each version of a kernel that other kernels call has been turned into machine code."""
    return [version.library._finalized for version in kernel.callee.overloads.values()]


def test_what_kernels_call_is_emitted_with_what_python_calls():
    assert top(X) == pytest.approx(TOP, rel=1e-15)
    assert len(top.signatures) == 1
    for kernel in (sum_of_squares, square):
        assert emitted(kernel) == [False]
        assert not kernel.signatures


def test_a_kernel_that_kernels_call_can_be_called_from_python_too():
    assert top(X) == pytest.approx(TOP, rel=1e-15)
    assert (sum_of_squares(X), square(3.0)) == (14.0, 9.0)
    assert square.signatures == [(float64,)]


def test_functions_that_are_no_kernels_call_kernels():
    @numba.njit
    def ordinary(x):
        return top(x) + square(x[2])

    assert ordinary(X) == pytest.approx(TOP + 9, rel=1e-15)
    assert top(X) == pytest.approx(TOP, rel=1e-15)

    @njit_inner
    def above(x):
        return ordinary(x) + square(x[2])

    assert above(X) == pytest.approx(TOP + 18, rel=1e-15)


def test_two_kernels_of_one_factory_are_told_apart():
    def build(inner):
        @njit_inner
        def kernel(x):
            return inner(x) + 1

        return kernel

    @njit_inner
    def cube(x):
        return x * x * x

    of_square, of_cube = build(square), build(cube)

    @njit_inner
    def both(x):
        return of_square(x), of_cube(x)

    assert both(3.0) == (10.0, 28.0)
    assert (of_square(2.0), of_cube(2.0)) == (5.0, 9.0)


@njit_inner
def of_general_hinges(par, hinge):
    if par.hinge_axis[hinge] == GENERAL:
        return par.omega.no_such_field
    return par.omega


@njit_inner
def of_faces(par):
    total = 0.0
    for face in range(par.face_pair.shape[0]):
        total += par.omega.no_such_field[face]
    return total


@njit_inner
def shafts_that_slide(par):
    count = 0
    for shaft in range(par.slide.shape[0]):
        if par.slide[shaft] >= 0:
            count += 1
    return count


def first_joint(mechanism):
    return blank_params(1, mechanism).view(np.recarray)[0]


def test_code_for_parts_that_a_mechanism_does_not_have_is_left_out():
    assert of_general_hinges(first_joint(CARDAN), 0) == 0.0
    assert of_faces(first_joint(CARDAN)) == 0.0


def test_code_for_parts_that_a_mechanism_has_stays():
    with pytest.raises(numba.TypingError, match="no_such_field"):
        of_general_hinges(first_joint(mechanism_of("bennett")), 0)
    with pytest.raises(numba.TypingError, match="no_such_field"):
        of_faces(first_joint(MECHANISMS["cardan+thrust"]))


def test_conditions_with_two_outcomes_stay():
    slides = numbering(CARDAN)["slide"] >= 0
    assert 0 < slides.sum() < slides.size
    assert shafts_that_slide(first_joint(CARDAN)) == slides.sum()


def test_an_error_in_a_part_names_it():
    @njit_inner
    def wrong(x):
        return x.no_such_thing

    @njit_inner
    def caller(x):
        return wrong(x)

    with pytest.raises(numba.TypingError, match="no_such_thing"):
        caller(1.0)


def test_scipy_is_loaded_only_by_code_that_calls_blas():
    script = (
        "import sys, numba, numpy as np\n"
        "from tolstat.kernel.simd.jit import njit_inner\n"
        "X = np.ones((3, 3))\n"
        "assert njit_inner(lambda x: x.sum())(X) == 9.0\n"
        "assert 'scipy.linalg' not in sys.modules\n"
        "assert numba.njit(lambda x: (x @ x)[0, 0])(X) == 3.0\n"
        "assert 'scipy.linalg' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


@pytest.mark.parametrize(
    "internal",
    [
        "numba.core.codegen.JITCodeLibrary",
        "numba.core.compiler_machinery.LoweringPass",
        "numba.core.runtime.rtsys",
        "numba.core.typed_passes.AnnotateTypes",
    ],
)
def test_without_an_internal_of_numba_functions_are_compiled_one_by_one(tmp_path, internal):
    """And kept: the second process compiles nothing. Each says once what it does."""
    module = internal.rpartition(".")[0]
    script = (
        f"import numba, {module}\n"
        f"del {internal}\n"
        "from tests.kernel import test_cache, test_compilation\n"
        "print(test_compilation.top(test_compilation.X), test_cache.compiled())\n"
    )
    for expected in (True, False):
        own, python = environment() | {"NUMBA_CACHE_DIR": str(tmp_path)}, [sys.executable, "-c", script]
        done = subprocess.run(python, capture_output=True, text=True, check=True, env=own)
        value, compiled = done.stdout.split()
        assert float(value) == pytest.approx(TOP, rel=1e-15)
        assert compiled == str(expected)
        assert done.stderr.count("\n") == 1
        assert "kernels are compiled function by function" in done.stderr
