"""Closed forms of material and geometry against the paper's Tables 1 to 3 and against hand calculations."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tolstat import joint as joints
from tolstat.joint import material
from tolstat.joint.derived import DERIVED

TABLE_3_CROSS = {"k_x": 2.21e9, "k_y": 2.21e9, "k_z": 6.54e9, "k_bx": 5.90e5, "k_by": 5.90e5, "k_tz": 4.44e5}
TABLE_3_FORK = {"k_x": 2.14e9, "k_y": 2.14e9, "k_z": 6.82e9, "k_bx": 2.32e5, "k_by": 1.91e6, "k_tz": 8.08e5}
MM = 1e-3


@pytest.fixture(scope="module")
def joint():
    return joints.load("cirelli2021", {}, "case.toml")


def test_beam_formulas_give_table_3(joint):
    for side, table in (("cross", TABLE_3_CROSS), ("fork", TABLE_3_FORK)):
        for name, printed in table.items():
            assert DERIVED[f"bushing.{side}.{name}"].value(joint) == pytest.approx(printed, rel=4e-3)


def test_area_and_moments_of_the_pin_are_of_a_38_mm_circle(joint):
    assert_allclose(joint.pin.A, np.pi / 4 * joint.pin.d**2, rtol=1e-3)
    assert_allclose(joint.pin.J, np.pi / 64 * joint.pin.d**4, rtol=5e-3)
    assert joint.material.rho * joint.pin.A * joint.pin.l == pytest.approx(joint.pin.mass, rel=1e-2)


def test_factors_of_equation_3():
    assert material.diameter_factor(76.2 * MM, 76 * MM) == pytest.approx(28.956, rel=1e-9)
    assert material.compliance_factor(210e9, 0.28) == pytest.approx(8.78e-12, rel=1e-3)


def contact(load, E=210e9):
    return material.contact_displacement(np.asarray(load, float), 76.2 * MM, 76 * MM, E, 0.28)


def test_contact_displacement_by_hand():
    # F_c = 1e6 N/m: b = 1.6 sqrt(1e6 * 28.956 * 8.777143e-12) = 25.5074 mm
    delta = 2 * 1e6 * 0.9216 / (np.pi * 210e9) * (2 / 3 + np.log(152.4 / 25.5074) + np.log(152 / 25.5074))
    assert contact([1e6])[0] == pytest.approx(delta, rel=1e-5)
    assert delta == pytest.approx(1.18e-5, rel=5e-3)


def test_contact_stiffens_with_load_and_depends_on_load_over_modulus():
    load = np.linspace(1e3, 1e6, 50)
    delta = contact(load)
    assert (np.diff(delta) > 0).all()
    assert (np.diff(delta, 2) < 0).all()
    assert_allclose(contact(3 * load, E=3 * 210e9), delta, rtol=1e-12)
    assert contact([1e-9])[0] < 1e-18


def test_fit_to_20_kN_has_the_size_of_table_2(joint):
    k1u, k2u = material.fit_contact(20e3, 22 * MM, 76.2 * MM, 76 * MM, 210e9, 0.28)
    assert k1u == pytest.approx(6e7 * 1e6, rel=0.03)  # N/mm^2
    assert k2u == pytest.approx(1.2e6 * 1e3, rel=0.03)  # N/mm
    load = np.linspace(1e3, 20e3, 20)
    delta = contact(load / (22 * MM))
    assert_allclose(k1u * delta**2 + k2u * delta, load, atol=0.01 * 20e3)
    printed = joint.contact.coefficients()
    assert_allclose(printed, [7.5e13, 1.2e9, 1.6e12, 1.8e8], rtol=1e-12)


def test_point_contact_needs_H_times_the_displacement(joint):
    k1p, k2p = (DERIVED[f"contact.{key}"].value(joint) for key in ("k1p", "k2p"))
    assert joint.contact.H == 6.9
    delta = np.array([1e-6, 5e-6])
    assert_allclose(k1p * (6.9 * delta) ** 2 + k2p * 6.9 * delta, 7.5e13 * delta**2 + 1.2e9 * delta)
    assert_allclose([k1p, k2p], [joint.contact.k1p, joint.contact.k2p], rtol=0.04)


def test_contact_damping_and_its_misprint():
    pin = {"length": 36.41 * MM, "A": 11.34e-4, "J": 1.02e-7, "E": 210e9}
    right = material.contact_damping(0.05, 0.32, rho=7700.0, **pin)
    printed = material.contact_damping(0.05, 0.32, rho=7.70e-6, **pin)
    assert right == pytest.approx(1.18e4, rel=1e-3)
    assert printed == pytest.approx(3.71e8, rel=7e-3)
    assert printed / right == pytest.approx(np.sqrt(1e9), rel=1e-12)


def test_inertia_of_lumps_against_points():
    x, w = np.polynomial.legendre.leggauss(8)
    r, half = 0.5 * 38 * MM, 0.5 * 36.41 * MM
    radius, angle = 0.5 * r * (x + 1), np.linspace(0, 2 * np.pi, 16, endpoint=False)
    weight = (w * radius)[:, None, None] * w[None, :, None] * np.ones(16)
    weight *= 0.32 / weight.sum()
    e = half * x[None, :, None]
    t, z = radius[:, None, None] * np.cos(angle), radius[:, None, None] * np.sin(angle)
    expected = [(weight * m).sum() for m in (t**2 + z**2 + 0 * e, e**2 + z**2, e**2 + t**2)]
    assert_allclose(material.cylinder_inertia(0.32, 2 * r, 2 * half), expected, rtol=1e-12)

    # box of widths e, t and length z: area moments Jx = t e^3/12 (about t), Jy = e t^3/12 (about e)
    width_e, width_t, length, m = 0.02, 0.06, 0.04, 0.3
    A, Jx, Jy = width_e * width_t, width_t * width_e**3 / 12, width_e * width_t**3 / 12
    box = m / 12 * np.array([width_t**2 + length**2, width_e**2 + length**2, width_e**2 + width_t**2])
    assert_allclose(material.box_inertia(m, A, Jx, Jy, length), box, rtol=1e-12)


def test_bushing_damping_is_the_ratio_of_critical():
    k, J = np.array([1e9, 2e9, 3e9, 4e5, 5e5, 6e5]), np.array([1e-5, 2e-5, 3e-5])
    c = material.bushing_damping(k, 0.3, J, 0.04)
    assert_allclose(c[:3], 0.08 * np.sqrt(k[:3] * 0.3))
    assert_allclose(c[3:], 0.08 * np.sqrt(k[3:] * J))
