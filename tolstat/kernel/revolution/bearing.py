"""Equivalent loads of bearings over a recorded revolution: of pins (docs/model.md, Bearing life), and of shafts."""

import math

import numpy as np

from tolstat.common.load_kinds import CONTACTS, RESULTANT
from tolstat.common.parameters import LAMINAE
from tolstat.common.tables import LIFE_EXPONENT
from tolstat.kernel.mechanics.cardan import PINS_OF_JOINT, travel
from tolstat.kernel.mechanics.loads import CONTACT_FORCES, FAR, FAR_BALLS, FAR_ROLLERS, NEAR, NEAR_BALLS, NEAR_ROLLERS
from tolstat.kernel.mechanics.motion import drive_and_load
from tolstat.kernel.mechanics.vector import larger
from tolstat.kernel.mechanics.work import NORMAL, RHO
from tolstat.kernel.revolution.laminae import lamina_load
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import pick

STRIDE = 12
"""Samples of the grid from one to the next at which needles under tilt are looked at: equivalent loads vary slowly."""
TO_OUTER, TO_BOTH, TO_INNER = range(3)
"""Products of the displacements of a pin's end stations in ``ends`` of a sample: outer, both, inner; m^2."""


@njit
def record_ends(pin, lane, par, work, ends):
    """Write the products of the displacements of the end stations of `pin` to `ends`, (3,)."""
    outer, inner = work.station[pin, 0], work.station[pin, par.n_stations[par.pair_kind[pin]] - 1]
    cosine = 0.0
    for k in range(3):
        cosine += pick(outer[NORMAL + k], lane) * pick(inner[NORMAL + k], lane)
    at_outer, at_inner = pick(outer[RHO], lane), pick(inner[RHO], lane)
    ends[TO_OUTER], ends[TO_BOTH], ends[TO_INNER] = at_outer**2, at_outer * at_inner * cosine, at_inner**2


@njit
def tilt_of(pin, ends, par):
    """Tilt of `pin` in its bearing, rad, and displacements r, along and across of `laminae.lamina_load`.

    `ends` as `record_ends` writes them; the displacement is NaN where a joint is ideal.
    """
    kind = par.pair_kind[pin]
    apart = par.station_s[kind, 0] - par.station_s[kind, par.n_stations[kind] - 1]
    if not (apart > 0 and ends[TO_OUTER] >= 0):
        return 0.0, (math.sqrt(ends[TO_OUTER]), 0.0, 0.0)
    r = 0.5 * math.sqrt(max(ends[TO_OUTER] + 2 * ends[TO_BOTH] + ends[TO_INNER], 0.0))
    tilt = math.sqrt(max(ends[TO_OUTER] - 2 * ends[TO_BOTH] + ends[TO_INNER], 0.0)) / apart
    beyond = tilt * par.needle_half[kind]
    turned = par.needle_half[kind] / apart * (ends[TO_OUTER] - ends[TO_INNER])
    along = min(max(0.5 * turned / r, -beyond), beyond) if r > 0 else beyond
    return tilt, (r, along, math.sqrt(beyond * beyond - along * along))


@njit
def write_equivalent_loads(par, samples, out):
    """Write equivalent load, largest tilt and largest line load of each pin's bearing to a row of KERNEL_RESULT."""
    n, pins = samples.size, out.equivalent_load.shape[0]
    more, work = np.zeros(pins), np.empty((6, LAMINAE))
    for first in range(0, pins, PINS_OF_JOINT):
        whole_output = whole_input = 0.0
        last, known = min(first + PINS_OF_JOINT, pins), par.needle_k[par.pair_kind[first]] > 0
        for pin in range(first, last):
            out.equivalent_load[pin] = out.tilt[pin] = 0.0
            out.line_load[pin] = 0.0 if known else np.nan
        for s in range(0, n, STRIDE if known else 1):
            theta, slope, _, _ = drive_and_load(math.copysign(2 * math.pi * s / n, par.omega), par)
            at_output, at_input = travel(first // PINS_OF_JOINT, theta, slope, par)
            whole_output, whole_input = whole_output + at_output, whole_input + at_input
            for pin in range(first, last):
                load = samples[s].loads[par.begin[CONTACT_FORCES] + len(CONTACTS) * pin + RESULTANT]
                if s % STRIDE == 0:
                    tilt, ends = tilt_of(pin, samples[s].ends[pin], par)
                    if load > 0:
                        out.tilt[pin] = max(out.tilt[pin], tilt)
                    if known:
                        kind, c = par.pair_kind[pin], par.clearance[pin]
                        load, line, more[pin] = lamina_load(load, ends, more[pin], c, kind, par, work)
                        out.line_load[pin] = larger(out.line_load[pin], line)
                out.equivalent_load[pin] += (at_output if pin < first + 2 else at_input) * load**LIFE_EXPONENT
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
