"""Rotation vectors against scipy and against differences in time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support import mechanisms
from tests.support.of_cardan import blank_params
from tolstat.kernel.mechanics import rotation
from tolstat.kernel.mechanics.triad import from_triad, to_triad
from tolstat.kernel.mechanics.trigonometry import sine_cosine

SIZES = [0.0, 1e-9, 1e-3, 0.04999, 0.05001, 0.3, 1.0, 2.5]
"""Angles on both sides of the change from series to closed form at 0.05 rad."""


def vectors(size):
    rng = np.random.default_rng(3)
    for _ in range(5):
        direction = rng.normal(size=3)
        yield size * direction / np.linalg.norm(direction), rng.normal(size=3)


def coefficients(phi):
    return rotation.coefficients(phi @ phi)


def spin(phi, rate):
    return rotation.spin(tuple(phi), coefficients(phi), tuple(rate))


def matrix(phi):
    out = np.full((1, 3, 3), np.nan)
    rotation.exponential(tuple(phi), coefficients(phi), out, 0)
    return out[0]


@pytest.mark.parametrize("size", SIZES)
def test_exponential_is_scipys(size):
    for phi, _ in vectors(size):
        np.testing.assert_allclose(matrix(phi), Rotation.from_rotvec(phi).as_matrix(), atol=1e-15)


@pytest.mark.parametrize("size", SIZES)
def test_spin_is_the_angular_velocity(size):
    h = 1e-5
    for phi, rate in vectors(size):
        step = matrix(phi + h * rate) @ matrix(phi - h * rate).T
        expected = Rotation.from_matrix(step).as_rotvec() / (2 * h)
        np.testing.assert_allclose(spin(phi, rate), expected, atol=2e-9)


@pytest.mark.parametrize("size", SIZES)
def test_unspin_inverts_spin(size):
    for phi, rate in vectors(size):
        there = spin(phi, rate)
        np.testing.assert_allclose(rotation.unspin(tuple(phi), there), rate, atol=1e-14)


@pytest.mark.parametrize("size", SIZES)
def test_bias_is_the_change_of_spin_at_constant_rate(size):
    h = 1e-5
    for phi, rate in vectors(size):
        ahead = np.array(spin(phi + h * rate, rate))
        behind = np.array(spin(phi - h * rate, rate))
        bias = rotation.spin_bias(tuple(phi), coefficients(phi), tuple(rate))
        np.testing.assert_allclose(bias, (ahead - behind) / (2 * h), atol=1e-9)


@pytest.mark.parametrize("size", [*SIZES, 3.0])
def test_relative_vector_is_scipys(size):
    for phi, other in vectors(size):
        first = Rotation.from_rotvec(other)
        pair = np.stack([first.as_matrix(), (first * Rotation.from_rotvec(phi)).as_matrix()])
        np.testing.assert_allclose(rotation.relative_vector(pair, 0, 1), phi, atol=3e-15)


@pytest.mark.parametrize("size", [*SIZES, 3.0])
def test_rotation_against_a_turned_shaft_is_scipys(size):
    for phi, other in vectors(size):
        pair = np.full((2, 3, 3), np.nan)
        rotation.about_z(size * np.sign(other[2]), pair, 0)
        shaft = Rotation.from_rotvec([0.0, 0.0, size * np.sign(other[2])])
        np.testing.assert_allclose(pair[0], shaft.as_matrix(), atol=1e-15)
        pair[1] = (shaft * Rotation.from_rotvec(phi)).as_matrix()
        np.testing.assert_allclose(rotation.relative_to_turned(pair, 0, 1), phi, atol=3e-15)


@pytest.mark.parametrize("size", [0.8, 7.0, 200.0, 1e6])
def test_sine_and_cosine_are_those_of_the_library(size):
    x = np.concatenate([np.random.default_rng(1).uniform(-size, size, 2000), np.arange(-9, 10) * np.pi / 4])
    found = np.array([sine_cosine(float(value)) for value in x])
    np.testing.assert_allclose(found, np.column_stack([np.sin(x), np.cos(x)]), rtol=0, atol=3e-16)
    assert np.isnan(sine_cosine(np.nan)).all()


def test_triads_are_quarter_turns():
    vector, par = (1.0, 2.0, 3.0), blank_params(1).view(np.recarray)[0]
    for body, triad in enumerate(mechanisms.triads()):
        np.testing.assert_array_equal(to_triad(body, vector, par), triad @ vector)
        np.testing.assert_array_equal(from_triad(body, vector, par), triad.T @ vector)
