"""Dynamic equivalent load of the pins' bearings over a recorded revolution (docs/model.md, Bearing life)."""

import math

from tolstat.common.load_kinds import CONTACTS, RESULTANT
from tolstat.common.tables import LIFE_EXPONENT
from tolstat.kernel.mechanics.loads import CONTACT_FORCES
from tolstat.kernel.mechanics.motion import drive_and_load
from tolstat.kernel.mechanics.trigonometry import sine_cosine
from tolstat.kernel.simd.jit import njit


@njit
def travel(phase, par):
    """Speed of each pair of pins in its holes at a phase (rad), by the ideal motion.

    Returns
    -------
    at_output, at_input : float
        |d gamma/d phase| / sin(alpha) of pins 1 and 2, |d beta/d phase| / tan(alpha) of pins 3 and 4. Both have a
        limit at alpha = 0.
    """
    theta, slope, _, _ = drive_and_load(phase, par)
    sine, cosine = sine_cosine(theta)
    sine_alpha, cosine_alpha = sine_cosine(par.alpha)
    tan_beta = sine_alpha / cosine_alpha * sine
    at_output = abs(sine) / math.sqrt(1 - (sine_alpha * cosine) ** 2)
    return slope * at_output, slope * abs(cosine) / (1 + tan_beta * tan_beta)


@njit
def write_equivalent_loads(par, samples, out):
    """Write the equivalent load of each pin's bearing over the recorded revolution to a row of KERNEL_RESULT."""
    n = samples.size
    out.equivalent_load[:] = 0.0
    whole_output = whole_input = 0.0
    for s in range(n):
        at_output, at_input = travel(math.copysign(2 * math.pi * s / n, par.omega), par)
        whole_output, whole_input = whole_output + at_output, whole_input + at_input
        for pin in range(4):
            force = samples[s].loads[CONTACT_FORCES + len(CONTACTS) * pin + RESULTANT]
            out.equivalent_load[pin] += (at_output if pin < 2 else at_input) * force**LIFE_EXPONENT
    for pin in range(4):
        whole = whole_output if pin < 2 else whole_input
        out.equivalent_load[pin] = (out.equivalent_load[pin] / whole) ** (1 / LIFE_EXPONENT)
