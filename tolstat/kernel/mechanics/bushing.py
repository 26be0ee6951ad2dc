"""Bushings between lumps and their bases (Cirelli et al. 2021, eq. 8)."""

from tolstat.kernel.mechanics.rotation import relative_to_turned, relative_vector, unspin
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
def from_base(base, a, work):
    """Components in axes of the frame of a vector in axes of a base: the hub, or a shaft turned about z."""
    if base == HUB:
        return turn(work.rot, base, a)
    c, s = work.rot[base, 0, 0], work.rot[base, 1, 0]
    return (c * a[0] - s * a[1], s * a[0] + c * a[1], a[2])


@njit
def to_base(base, a, work):
    """Components in axes of a base of a vector in axes of its frame."""
    if base == HUB:
        return turn_back(work.rot, base, a)
    c, s = work.rot[base, 0, 0], work.rot[base, 1, 0]
    return (c * a[0] + s * a[1], c * a[1] - s * a[0], a[2])


@njit
def carried(base, lever, work):
    """Velocity of a point that moves with a base, `lever` from its reference point, in axes of the frame."""
    if base == HUB:
        return add(row(work.vel, base), cross(row(work.spin, base), lever))
    w = work.spin[base, 2]
    return (-w * lever[1], w * lever[0], work.vel[base, 2])


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
    d = sub(base_lever, from_base(base, on_base, work))
    rate = add(row(work.vel, lump), cross(row(work.spin, lump), lever))
    rate = sub(rate, carried(base, base_lever, work))
    phi = relative_vector(work.rot, base, lump) if base == HUB else relative_to_turned(work.rot, base, lump)
    dphi = unspin(phi, to_base(base, sub(row(work.spin, lump), row(work.spin, base)), work))
    x, dx = to_base(base, d, work), to_base(base, rate, work)
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

    f = from_base(base, from_triad(lump, (work.load[i, 0], work.load[i, 1], work.load[i, 2])), work)
    torque = from_base(base, from_triad(lump, (work.load[i, 3], work.load[i, 4], work.load[i, 5])), work)
    accumulate(work.force, lump, f, axpy(1.0, cross(lever, f), torque))
    minus_f, minus_torque = scale(-1.0, f), scale(-1.0, torque)
    accumulate(work.force, base, minus_f, axpy(1.0, cross(base_lever, minus_f), minus_torque))
