"""Tangent of the residual: S = d(residual) / d(unknowns) when velocity and acceleration follow as cv dq and ca dq.

Columns are increments of displacement and of attitude (du, dtheta in the frame's axes, attitude exp(dtheta x) R),
not of the rotation vector; `linsolve.solve` converts. Levers and attitudes are the actual ones, so that a rigid
motion of pins and hub together costs exactly nothing. Left out, each a few per cent of what stands beside it at most:
turning of the loads themselves with the bodies, gyroscopic terms (2 Omega / cv of the inertia), and rates of levers.
"""

from tolstat.kernel._jit import njit
from tolstat.kernel.bushing import markers
from tolstat.kernel.contact import MODE_LAW, smooth_step, smooth_step_slope
from tolstat.kernel.dynamics import mass_of
from tolstat.kernel.lane import any_of, where
from tolstat.kernel.topology import (
    ARM,
    ARM_OF_PIN,
    BUSHING_BASE,
    BUSHING_LUMP,
    FRAME,
    HUB,
    N_LUMPS,
    OUTPUT_SHAFT,
    PIN,
    TRIAD,
)
from tolstat.kernel.vector import add, cross, row, sub, turn, turn_back
from tolstat.kernel.work import (
    DELTA,
    EXCESS,
    FORCE,
    NORMAL,
    POINT,
    RHO,
    SLOPE,
    TANGENT,
    V_NORMAL,
    V_TANGENT,
)

UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@njit
def clear(work):
    """Set all blocks of the tangent to zero."""
    work.lump_block[:] = 0.0
    work.hub_pin[:] = 0.0
    work.pin_hub[:] = 0.0
    work.pin_arm[:] = 0.0
    work.arm_pin[:] = 0.0
    work.arm_psi[:] = 0.0
    work.psi_arm[:] = 0.0
    work.core[0, 6, 6] = 0.0


@njit
def inertia_tangent(body, ca, par, work):
    """Add ca M of a lump to its diagonal block."""
    mass, inertia = mass_of(body, par)
    block = work.lump_block
    for j in range(3):
        block[body, j, j] += ca * mass
        u = turn(TRIAD, body, turn_back(work.rot, body, UNIT[j]))
        u = turn(work.rot, body, turn_back(TRIAD, body, (inertia[0] * u[0], inertia[1] * u[1], inertia[2] * u[2])))
        for i in range(3):
            block[body, 3 + i, 3 + j] += ca * u[i]


@njit
def column(blocks, b, j, f, torque, sign):
    """Add a force and a torque to column `j` of block `b`."""
    for i in range(3):
        blocks[b, i, j] += sign * f[i]
        blocks[b, 3 + i, j] += sign * torque[i]


@njit
def bushing_tangent(i, cv, par, work):
    """Add bushing `i`: stiffness and cv times damping between lump and base."""
    base, lump = BUSHING_BASE[i], BUSHING_LUMP[i]
    k, c = (par.k_cross, par.c_cross) if base == HUB else (par.k_fork, par.c_fork)
    on_lump, _ = markers(i, par)
    lever = turn(work.rot, lump, on_lump)
    base_lever = sub(add(row(work.pos, lump), lever), row(work.pos, base))
    for j in range(6):
        u = UNIT[j % 3]
        local = turn(TRIAD, lump, turn_back(work.rot, base, u))
        zero = (0.0, 0.0, 0.0)
        if j < 3:  # displacement of the lump, then of the base
            f_lump = _restore(local, k, c, cv, 0, base, lump, work)
            torque = zero
            f_base = f_lump
        else:  # rotation
            torque = _restore(local, k, c, cv, 3, base, lump, work)
            by_lump = turn(TRIAD, lump, turn_back(work.rot, base, cross(u, lever)))
            by_base = turn(TRIAD, lump, turn_back(work.rot, base, cross(u, base_lever)))
            f_lump = _restore(by_lump, k, c, cv, 0, base, lump, work)
            f_base = _restore(by_base, k, c, cv, 0, base, lump, work)
        on_lump_by_lump = add(torque, cross(lever, f_lump))
        column(work.lump_block, lump, j, f_lump, on_lump_by_lump, 1.0)
        if base == HUB:
            pin = lump - PIN
            column(work.pin_hub, pin, j, f_base, add(torque, cross(lever, f_base)), -1.0)
            column(work.hub_pin, pin, j, f_lump, add(torque, cross(base_lever, f_lump)), -1.0)
            column(work.lump_block, HUB, j, f_base, add(torque, cross(base_lever, f_base)), 1.0)
        elif base == OUTPUT_SHAFT:  # of the shaft only rotation about z is free
            arm = lump - ARM
            work.psi_arm[arm, j] -= torque[2] + cross(base_lever, f_lump)[2]
            if j == 5:
                on_arm = add(torque, cross(lever, f_base))
                for n in range(3):
                    work.arm_psi[arm, n] -= f_base[n]
                    work.arm_psi[arm, 3 + n] -= on_arm[n]
                work.core[0, 6, 6] += torque[2] + cross(base_lever, f_base)[2]


@njit
def _restore(x, k, c, cv, first, base, lump, work):
    """Restoring force, in axes of the frame, of a displacement `x` in the base marker's axes."""
    f = (
        (k[first] + cv * c[first]) * x[0],
        (k[first + 1] + cv * c[first + 1]) * x[1],
        (k[first + 2] + cv * c[first + 2]) * x[2],
    )
    return turn(work.rot, base, turn_back(TRIAD, lump, f))


@njit
def _directions(pin, j, work):
    """Write how a displacement along n and m at a station follows from pin and arm; ``work.vectors``."""
    body, arm = PIN + pin, ARM + ARM_OF_PIN[pin]
    frame = FRAME[arm]
    station = work.station[pin, j]
    point = (station[POINT], station[POINT + 1], station[POINT + 2])
    lever = sub(turn_back(work.relative, frame, point), row(work.pos, body))
    arm_lever = sub(point, row(work.pos, arm))
    for k, first in ((0, NORMAL), (1, TANGENT)):
        u = (station[first], station[first + 1], station[first + 2])
        u_pin = turn_back(work.relative, frame, u)
        about_pin, about_arm = cross(lever, u_pin), cross(arm_lever, u)
        for i in range(3):
            work.vectors[k, i], work.vectors[k, 3 + i] = u_pin[i], about_pin[i]
            work.vectors[k, 6 + i], work.vectors[k, 9 + i] = -u[i], -about_arm[i]


@njit
def _add_dyad(pin, left, right, work):
    """Add left right^T, both over (pin, arm), to the four blocks of a pin and its arm."""
    body, arm = PIN + pin, ARM + ARM_OF_PIN[pin]
    for i in range(6):
        for j in range(6):
            work.lump_block[body, i, j] += left[i] * right[j]
            work.pin_arm[pin, i, j] += left[i] * right[6 + j]
            work.arm_pin[pin, i, j] += left[6 + i] * right[j]
            work.lump_block[arm, i, j] += left[6 + i] * right[6 + j]


@njit
def contact_tangent(pin, cv, par, work):
    """Add the contact of `pin`: elastic, damping, film, and the sharing between its stations."""
    left, right = work.left, work.right  # row 0 for one station, row 1 summed over stations for the sharing
    left[1, :] = 0.0
    right[1, :] = 0.0
    for j in range(par.n_stations):
        station = work.station[pin, j]
        touching = station[DELTA] > 0
        if not any_of(touching):
            continue
        x, weight = station[DELTA] / par.delta_d, par.station_weight[j]
        film = par.c_t * weight * smooth_step(x)
        damping = where(station[FORCE] > 0, par.c_d * weight * smooth_step(x), 0.0)
        # zero where nothing touches: film, damping and force are, but the pin may be centred
        by_rho = where(touching, 1 / station[RHO], 0.0)
        turning = station[V_TANGENT] * by_rho
        nn = station[SLOPE] + cv * damping
        nm = (damping - film) * turning
        mn = par.c_t * weight * smooth_step_slope(x) / par.delta_d * station[V_TANGENT]
        mm = station[FORCE] * by_rho + film * (cv - station[V_NORMAL] * by_rho)
        _directions(pin, j, work)
        n, m = work.vectors[0], work.vectors[1]
        for i in range(12):
            right[0, i] = nn * n[i] + nm * m[i]
        _add_dyad(pin, n, right[0], work)
        for i in range(12):
            right[0, i] = mn * n[i] + mm * m[i]
        _add_dyad(pin, m, right[0], work)
        if par.law == MODE_LAW:
            by_delta, by_m = work.mode_weight[pin, 1 + 2 * j], work.mode_weight[pin, 2 + 2 * j]
            for i in range(12):
                left[1, i] += station[EXCESS] * n[i]
                right[1, i] += by_delta * n[i] + by_m * m[i]
    if par.law == MODE_LAW and any_of(work.mode_weight[pin, 0] > 0):
        _add_dyad(pin, left[1], right[1], work)


@njit
def assemble(cv, ca, par, work):
    """Assemble the tangent at the state that ``dynamics.forces`` was last evaluated at."""
    clear(work)
    for body in range(N_LUMPS):
        inertia_tangent(body, ca, par, work)
    for i in range(8):
        bushing_tangent(i, cv, par, work)
    for pin in range(4):
        contact_tangent(pin, cv, par, work)
    work.core[0, 6, 6] += ca * par.Js
