"""How large the forces of a joint are before anything of its motion is known, and residuals relative to that."""

from tolstat.kernel.mechanics.topology import ARM, N_LUMPS, PSI
from tolstat.kernel.simd.jit import njit

SMALLEST_FORCE = 1e-3
"""Scale (N) of the stopping test of a joint that neither turns nor carries."""


@njit
def typical_force(par):
    """Pins' tangential force T_r/(2R) or a pin's centrifugal force, the larger one, N."""
    return max(abs(par.torque) / (2 * par.R), par.pin_mass * par.omega**2 * par.R, SMALLEST_FORCE)


@njit
def stiffness(body, par):
    """Mean stiffness (N/m, N m/rad) of the bushing that a lump is held by: that of pins for the hub."""
    k = par.k_cross if body < ARM else par.k_fork
    return (k[0] + k[1] + k[2]) / 3, (k[3] + k[4] + k[5]) / 3


@njit
def set_weight(force, par, weight):
    """Weights of residuals: 1 / `force` (N), times R for torques."""
    for body in range(N_LUMPS):
        for k in range(3):
            weight[6 * body + k] = 1 / force
            weight[6 * body + 3 + k] = 1 / force / par.R
    weight[PSI] = 1 / force / par.R
