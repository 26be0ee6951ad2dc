"""Typical force and stiffness of a joint, estimated from its parameters; weights of residuals relative to a force."""

import math

from tolstat.kernel.mechanics.dynamics import mass_of
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import pick

SMALLEST_FORCE = 1e-3
"""Smallest typical force (N), for a joint that neither rotates nor transmits torque."""


@njit
def typical_force(par):
    """Largest of the pins' tangential force T_r/(2R), a pin's centrifugal force, the given ones, N; of T_r a bound."""
    torque = abs(par.torque)
    for i in range(par.n_orders):
        torque += math.hypot(par.torque_order[i, 0], par.torque_order[i, 1])
    mass, _ = mass_of(par.pin[0], par)
    return max(torque / (2 * par.R), mass * par.omega**2 * par.R, given_forces(par), SMALLEST_FORCE)


@njit
def given_forces(par):
    """Weight of all lumps and given forces, N; 0 where members have no place, and so no ground."""
    if par.pivot.shape[0] == 0:
        return 0.0
    mass = 0.0
    for body in range(par.lump_kind.shape[0]):
        mass += mass_of(body, par)[0]
    total = mass * math.sqrt(par.weight[0] ** 2 + par.weight[1] ** 2 + par.weight[2] ** 2)
    for i in range(par.pull.shape[0]):
        total += math.sqrt(par.pull[i, 0] ** 2 + par.pull[i, 1] ** 2 + par.pull[i, 2] ** 2)
    return total


@njit
def stiffness(body, par):
    """Mean stiffness (N/m, N m/rad) of the bushing that holds a lump; of a hub, that of a bushing that it holds."""
    k = par.k[par.held_by[body]]
    return (k[0] + k[1] + k[2]) / 3, (k[3] + k[4] + k[5]) / 3


@njit
def mean_clearance(lane, par):
    """Mean radial clearance of the pins, m; at least the penetration over which contact damping rises."""
    total = 0.0
    pins = par.pin.shape[0]
    for pin in range(pins):
        total += pick(par.clearance[pin], lane)
    least = 0.0
    for kind in range(par.delta_d.shape[0]):
        least = max(least, pick(par.delta_d[kind], lane))
    return max(total / pins, least)


@njit
def centring_stiffness(lane, par):
    """Axial stiffness (N/m) by which loaded pins, centred in round holes, hold a shaft; 0 if it is rigid.

    A pin that a force presses across a clearance is centred in the hole by the force over the clearance; both pins of
    an axis act together, and the two axes one after the other: T_r / (2 (R + s_0) c), s_0 the outermost station's s, of
    the joint before the shaft.
    """
    last = par.pin.shape[0] - 1
    radius = pick(par.at[par.lump_kind[par.pin[last]], 0], lane) + pick(par.station_s[par.pair_kind[last], 0], lane)
    centring = abs(pick(par.torque, lane)) / (2 * radius * mean_clearance(lane, par))
    return centring if pick(par.slides, lane) > 0 else 0.0


@njit
def axial_decay(par):
    """Share of a deviation along the output shaft that is left after a revolution, estimated; 0 if it is rigid.

    Inertia plays no part in such a slow motion: its rate is the axial stiffness over the damping c_a.
    """
    if not (par.slides > 0 and par.c_a > 0):
        return 0.0
    return math.exp(-2 * math.pi / abs(par.omega) * (centring_stiffness(0, par) + par.k_a) / par.c_a)


@njit
def set_weight(force, par, weight):
    """Write the weights of residuals to `weight`, (n,): 1 / `force` (1/N), for torques 1 / (`force` R)."""
    lumps, rotations = par.lump_kind.shape[0], par.Js.shape[0]
    for body in range(lumps):
        for k in range(3):
            weight[6 * body + k] = 1 / force
            weight[6 * body + 3 + k] = 1 / force / par.R
    for i in range(6 * lumps, weight.shape[0]):
        weight[i] = 1 / force / par.R if i < 6 * lumps + rotations else 1 / force
