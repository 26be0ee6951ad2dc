"""Typical force of a joint, estimated from its parameters, and weights that make residuals relative to a force."""

from tolstat.kernel.mechanics.topology import ARM, N_LUMPS, PSI
from tolstat.kernel.simd.jit import njit

SMALLEST_FORCE = 1e-3
"""Smallest typical force (N), for a joint that neither rotates nor transmits torque."""


@njit
def typical_force(par):
    """Larger one of the pins' tangential force T_r/(2R) and a pin's centrifugal force, N."""
    return max(abs(par.torque) / (2 * par.R), par.pin_mass * par.omega**2 * par.R, SMALLEST_FORCE)


@njit
def stiffness(body, par):
    """Mean stiffness (N/m, N m/rad) of the bushing that holds a lump; for the hub, that of a pin's bushing."""
    k = par.k_cross if body < ARM else par.k_fork
    return (k[0] + k[1] + k[2]) / 3, (k[3] + k[4] + k[5]) / 3


@njit
def set_weight(force, par, weight):
    """Write the weights of residuals to `weight`, (55,): 1 / `force` (1/N), for torques 1 / (`force` R)."""
    for body in range(N_LUMPS):
        for k in range(3):
            weight[6 * body + k] = 1 / force
            weight[6 * body + 3 + k] = 1 / force / par.R
    weight[PSI] = 1 / force / par.R
