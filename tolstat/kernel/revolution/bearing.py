"""Equivalent loads of bearings over a recorded revolution: of pins (docs/model.md, Bearing life), and of shafts."""

import math

from tolstat.common.load_kinds import CONTACTS, RESULTANT
from tolstat.common.tables import LIFE_EXPONENT
from tolstat.kernel.mechanics.cardan import PINS_OF_JOINT, travel
from tolstat.kernel.mechanics.loads import CONTACT_FORCES, FAR, FAR_BALLS, FAR_ROLLERS, NEAR, NEAR_BALLS, NEAR_ROLLERS
from tolstat.kernel.mechanics.motion import drive_and_load
from tolstat.kernel.simd.jit import njit


@njit
def write_equivalent_loads(par, samples, out):
    """Write the equivalent load of each pin's bearing over the recorded revolution to a row of KERNEL_RESULT."""
    n, pins = samples.size, out.equivalent_load.shape[0]
    out.equivalent_load[:] = 0.0
    for first in range(0, pins, PINS_OF_JOINT):
        whole_output = whole_input = 0.0
        last = min(first + PINS_OF_JOINT, pins)
        for s in range(n):
            theta, slope, _, _ = drive_and_load(math.copysign(2 * math.pi * s / n, par.omega), par)
            at_output, at_input = travel(first // PINS_OF_JOINT, theta, slope, par)
            whole_output, whole_input = whole_output + at_output, whole_input + at_input
            for pin in range(first, last):
                force = samples[s].loads[par.begin[CONTACT_FORCES] + len(CONTACTS) * pin + RESULTANT]
                out.equivalent_load[pin] += (at_output if pin < first + 2 else at_input) * force**LIFE_EXPONENT
        for pin in range(first, last):
            whole = whole_output if pin < first + 2 else whole_input
            out.equivalent_load[pin] = (out.equivalent_load[pin] / whole) ** (1 / LIFE_EXPONENT)


@njit
def write_bearings(par, samples, out):
    """Write the equivalent loads of the shafts' bearings over the recorded revolution to a row of KERNEL_RESULT.

    They are means with the exponents of ball and roller bearings, as of a ring that turns with its shaft.
    """
    for kind, balls, rollers in ((NEAR, NEAR_BALLS, NEAR_ROLLERS), (FAR, FAR_BALLS, FAR_ROLLERS)):
        for i in range(par.borne.shape[0]):
            cubes = powers = 0.0
            for s in range(samples.size):
                load = samples[s].loads[par.begin[kind] + i]
                cubes, powers = cubes + load**3, powers + load**LIFE_EXPONENT
            out.largest[par.begin[balls] + i] = (cubes / samples.size) ** (1 / 3)
            out.largest[par.begin[rollers] + i] = (powers / samples.size) ** (1 / LIFE_EXPONENT)
