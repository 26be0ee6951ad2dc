"""Bushings between lumps and their bases (Cirelli et al. 2021, eq. 8)."""

from tolstat.kernel.mechanics.rotation import relative_to_turned, relative_vector, unspin
from tolstat.kernel.mechanics.triad import from_triad, to_triad
from tolstat.kernel.mechanics.vector import add, axpy, cross, row, scale, sub, turn, turn_back
from tolstat.kernel.simd.jit import njit


@njit
def markers(i, par):
    """Markers of bushing `i`, m, in axes of the member: from the reference points of lump and base."""
    lump, kind = par.bushing_lump[i], par.bushing_kind[i]
    on_lump = (par.marker[kind, 0, 0], par.marker[kind, 0, 1], par.marker[kind, 0, 2])
    on_base = (par.marker[kind, 1, 0], par.marker[kind, 1, 1], par.marker[kind, 1, 2])
    return from_triad(lump, on_lump, par), from_triad(lump, on_base, par)


@njit
def is_lump(body, par):
    """Whether a body has six unknowns; shafts turn about z of their member at most, and may move without tilting."""
    return body < par.lump_kind.shape[0]


@njit
def from_base(base, a, par, work):
    """Components in axes of the member of a vector in axes of a base: a lump, or a shaft turned about z."""
    if is_lump(base, par):
        return turn(work.rot, base, a)
    c, s = work.rot[base, 0, 0], work.rot[base, 1, 0]
    return (c * a[0] - s * a[1], s * a[0] + c * a[1], a[2])


@njit
def to_base(base, a, par, work):
    """Components in axes of a base of a vector in axes of its member."""
    if is_lump(base, par):
        return turn_back(work.rot, base, a)
    c, s = work.rot[base, 0, 0], work.rot[base, 1, 0]
    return (c * a[0] + s * a[1], c * a[1] - s * a[0], a[2])


@njit
def carried(base, lever, par, work):
    """Velocity of a point that moves with a base, `lever` from its reference point, in axes of the member."""
    if is_lump(base, par):
        return add(row(work.vel, base), cross(row(work.spin, base), lever))
    w = work.spin[base, 2]
    if par.across[base - par.lump_kind.shape[0]] >= 0:
        return (work.vel[base, 0] - w * lever[1], work.vel[base, 1] + w * lever[0], work.vel[base, 2])
    return (-w * lever[1], w * lever[0], work.vel[base, 2])


@njit
def accumulate(force, body, f, torque):
    """Add a force `f` (N) and a `torque` (N m), in axes of the body's member, to row `body` of `force`, (n, 6)."""
    for k in range(3):
        force[body, k] += f[k]
        force[body, 3 + k] += torque[k]


@njit
def bushing_load(i, par, work):
    """Evaluate the load of bushing `i`, eq. (8): write it to ``work.load[i]`` and add it to lump and base."""
    base, lump, kind = par.bushing_base[i], par.bushing_lump[i], par.bushing_kind[i]
    on_lump, on_base = markers(i, par)
    lever = turn(work.rot, lump, on_lump)
    base_lever = sub(add(row(work.pos, lump), lever), row(work.pos, base))
    d = sub(base_lever, from_base(base, on_base, par, work))
    rate = add(row(work.vel, lump), cross(row(work.spin, lump), lever))
    rate = sub(rate, carried(base, base_lever, par, work))
    free = is_lump(base, par)
    phi = relative_vector(work.rot, base, lump) if free else relative_to_turned(work.rot, base, lump)
    dphi = unspin(phi, to_base(base, sub(row(work.spin, lump), row(work.spin, base)), par, work))
    x, dx = to_base(base, d, par, work), to_base(base, rate, par, work)
    x, dx = to_triad(lump, x, par), to_triad(lump, dx, par)
    phi, dphi = to_triad(lump, phi, par), to_triad(lump, dphi, par)
    for k in range(3):
        work.load[i, k] = -par.k[kind, k] * x[k] - par.c[kind, k] * dx[k]
        work.load[i, 3 + k] = -par.k[kind, 3 + k] * phi[k] - par.c[kind, 3 + k] * dphi[k]
    if par.pushed.shape[0] > 0 and i == par.pushed[0]:
        work.load[i, 2] += par.push
    f = from_triad(lump, (work.load[i, 0], work.load[i, 1], work.load[i, 2]), par)
    torque = from_triad(lump, (work.load[i, 3], work.load[i, 4], work.load[i, 5]), par)
    f, torque = from_base(base, f, par, work), from_base(base, torque, par, work)
    accumulate(work.force, lump, f, axpy(1.0, cross(lever, f), torque))
    minus_f, minus_torque = scale(-1.0, f), scale(-1.0, torque)
    accumulate(work.force, base, minus_f, axpy(1.0, cross(base_lever, minus_f), minus_torque))
