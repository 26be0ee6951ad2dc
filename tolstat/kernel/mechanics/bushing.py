"""Bushings between lumps and their bases (Cirelli et al. 2021, eq. 8)."""

from tolstat.kernel.mechanics.rotation import relative_vector, unspin
from tolstat.kernel.mechanics.topology import BUSHING_BASE, BUSHING_LUMP, FRAME, FRAME_I, HUB, TRIAD
from tolstat.kernel.mechanics.triad import from_triad, to_triad
from tolstat.kernel.mechanics.vector import add, axpy, cross, row, scale, sub, turn, turn_back
from tolstat.kernel.simd.jit import njit


@njit
def markers(i, par):
    """Marker of bushing `i`, m, in body axes: on the lump (from its reference point), on the base (from O)."""
    lump = BUSHING_LUMP[i]
    e = row(TRIAD[lump], 0)
    if BUSHING_BASE[i] == HUB:
        return scale(par.r_b - par.R, e), scale(par.r_b, e)
    z = par.l_f if FRAME[lump] != FRAME_I else -par.l_f
    return (0.0, 0.0, z), (par.R * e[0], par.R * e[1], z)


@njit
def accumulate(force, body, f, torque):
    """Add a force `f` (N) and a `torque` (N m), in axes of the body's frame, to row `body` of `force`, (11, 6)."""
    for k in range(3):
        force[body, k] += f[k]
        force[body, 3 + k] += torque[k]


@njit
def bushing_load(i, par, work):
    """Evaluate the load of bushing `i`, eq. (8): write it to ``work.load[i]`` and add it to lump and base."""
    base, lump = BUSHING_BASE[i], BUSHING_LUMP[i]
    on_lump, on_base = markers(i, par)
    lever = turn(work.rot, lump, on_lump)
    base_lever = sub(add(row(work.pos, lump), lever), row(work.pos, base))
    d = sub(base_lever, turn(work.rot, base, on_base))
    rate = sub(
        add(row(work.vel, lump), cross(row(work.spin, lump), lever)),
        add(row(work.vel, base), cross(row(work.spin, base), base_lever)),
    )
    phi = relative_vector(work.rot, base, lump)
    dphi = unspin(phi, turn_back(work.rot, base, sub(row(work.spin, lump), row(work.spin, base))))
    x, dx = turn_back(work.rot, base, d), turn_back(work.rot, base, rate)

    x, dx = to_triad(lump, x), to_triad(lump, dx)
    phi, dphi = to_triad(lump, phi), to_triad(lump, dphi)
    cross_bushing = base == HUB
    for k in range(3):
        if cross_bushing:
            work.load[i, k] = -par.k_cross[k] * x[k] - par.c_cross[k] * dx[k]
            work.load[i, 3 + k] = -par.k_cross[3 + k] * phi[k] - par.c_cross[3 + k] * dphi[k]
        else:
            work.load[i, k] = -par.k_fork[k] * x[k] - par.c_fork[k] * dx[k]
            work.load[i, 3 + k] = -par.k_fork[3 + k] * phi[k] - par.c_fork[3 + k] * dphi[k]

    f = turn(work.rot, base, from_triad(lump, (work.load[i, 0], work.load[i, 1], work.load[i, 2])))
    torque = turn(work.rot, base, from_triad(lump, (work.load[i, 3], work.load[i, 4], work.load[i, 5])))
    accumulate(work.force, lump, f, axpy(1.0, cross(lever, f), torque))
    minus_f, minus_torque = scale(-1.0, f), scale(-1.0, torque)
    accumulate(work.force, base, minus_f, axpy(1.0, cross(base_lever, minus_f), minus_torque))
