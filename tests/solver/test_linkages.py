"""Linkages from a study, simulated, against the reference: all loads within a thousandth, the loss as well.

Where pins change sides at the dead centres, members ring: `cranks` at 80 to 130 Hz, about and along the pins, `bennett`
with its contacts. The reference's 360 angles do not resolve it, and its phase is the integrator's; what does not depend
on it is compared instead.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.support import linkages
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Options, Status
from tolstat.solver.simulation import simulate_rows

pytestmark = pytest.mark.slow  # compiles the kernels for another mechanism


def in_reference(name: str, mechanism: Mechanism) -> tuple[list[int], list[int]]:
    """Numbers of the bushings of pins and eyes here and in the reference."""
    names = list(linkages.reference(name)["names"])
    bushings = [i for i, bushing in enumerate(mechanism.bushings) if bushing.group != "drive"]
    return bushings, [names.index(linkages.name_in_reference(mechanism.bushings[i].name)) for i in bushings]


@pytest.mark.parametrize("name", ["hinge", "hinge_middle", "fourbar", "fourbar_tilt"])
def test_largest_loads_and_loss_are_those_of_the_reference(name: str) -> None:
    mechanism, of = linkages.mechanism_of(name), linkages.reference(name)
    result = simulate_rows(linkages.parameters(name, mechanism), Options(), mechanism=mechanism).results[0]
    assert result["status"] == Status.OK
    bushings, order = in_reference(name, mechanism)
    for kind in ("F", "T"):
        expected = of[f"{kind}_max"][order]
        np.testing.assert_allclose(result[f"{kind}_max"][bushings], expected, rtol=0, atol=1e-3 * expected.max())
    # peaks of thrust faces lie between the reference's angles
    np.testing.assert_allclose(result["thrust_max"], of["thrust_max"].ravel(), rtol=0, atol=1e-2 * of["F_max"].max())
    if mechanism.friction:
        assert result["loss_max"][-1] == pytest.approx(of["loss"], rel=1e-3)


def test_cranks_ring_about_the_loads_of_the_reference() -> None:
    """Orders 0 to 64 of all loads; torques of 3.5 N m ring by 0.05 N m."""
    mechanism, of = linkages.mechanism_of("cranks"), linkages.reference("cranks")
    found = simulate_rows(linkages.parameters("cranks", mechanism), Options(), "full", mechanism=mechanism)
    result, loads = found.results[0], found.histories["loads"][0]
    assert result["status"] == Status.OK
    bushings, order = in_reference("cranks", mechanism)
    for kind, tolerance in (("F", 1e-3), ("T", 0.02)):
        expected = of[f"{kind}_max"][order]
        np.testing.assert_allclose(result[f"{kind}_max"][bushings], expected, rtol=0, atol=tolerance * expected.max())
    off = np.abs(np.fft.rfft(loads, axis=0)[:65] / len(loads) - of["orders"][:, order])
    off[1:] *= 2.0
    assert off[..., :3].max() < 2e-4 * of["F_max"].max()
    assert off[..., 3:].max() < 1e-3 * of["T_max"].max()
    assert result["loss_max"][-1] == pytest.approx(of["loss"], rel=1e-4)


def test_bennett_has_means_low_orders_and_peaks_of_the_reference() -> None:
    """Peaks are those at 3600 angles. Default steps call the linkage stationary; 11520 a revolution settle."""
    mechanism, of = linkages.mechanism_of("bennett"), linkages.reference("bennett")
    options = Options(steps_per_rev=11520, max_refinements=0)
    found = simulate_rows(linkages.parameters("bennett", mechanism), options, "full", mechanism=mechanism)
    result, loads = found.results[0], found.histories["loads"][0]
    assert result["status"] == Status.OK
    bushings, order = in_reference("bennett", mechanism)
    off = np.abs(np.fft.rfft(loads[:, bushings], axis=0)[:5] / len(loads) - of["orders"][:, order])
    off[1:] *= 2.0
    for k, kind in ((0, "F"), (3, "T")):
        assert off[0, :, k : k + 3].max() < 1e-3 * of[f"{kind}_max"].max()
        assert off[..., k : k + 3].max() < 2e-3 * of[f"{kind}_max"].max()
    of_pins = [i for i in bushings if mechanism.bushings[i].name.endswith("_pin")]
    np.testing.assert_allclose(result["F_max"][of_pins], [3872.0, 3824.0, 3842.0], rtol=0.01)
    assert result["loss_max"][-1] == pytest.approx(of["loss"], rel=1e-3)
