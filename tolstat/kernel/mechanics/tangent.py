"""Tangent of the residual: S = d(residual) / d(unknowns) with dv = cv dq and da = ca dq.

Columns are increments of displacement and of attitude (du, dtheta in the frame's axes, attitude exp(dtheta x) R),
not of the rotation vector; `linsolve.solve` converts. Levers and attitudes are the actual ones, so that a rigid
motion of pins and hub together changes no cross bushing load. Neglected terms, each at most a few per cent of the term
beside it: rotation of the loads with the bodies, gyroscopic terms (2 Omega / cv of the inertia), and rates of levers.
"""

from tolstat.common.mechanism import ALONG_Z, OBLIQUE
from tolstat.kernel.mechanics.bushing import is_lump, markers
from tolstat.kernel.mechanics.dynamics import mass_of
from tolstat.kernel.mechanics.motion import point_to_pin, to_pin
from tolstat.kernel.mechanics.vector import add, axpy, cross, of_column, of_row, row, scale, sub, turn
from tolstat.kernel.mechanics.work import (
    DAMPING,
    DELTA,
    FILM,
    FORCE,
    NORMAL,
    POINT,
    RHO,
    SLOPE,
    TANGENT,
    V_NORMAL,
)
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import any_of, fma, where


@njit
def clear(par, work):
    """Set to zero what parts add to: blocks of lumps, of pairs, of lumps joined by elimination, and the corner."""
    lumps, pairs = par.lump_kind.shape[0], par.pin.shape[0]
    for b in range(work.block.shape[0]):
        if b < lumps + pairs or b >= par.first_filled:
            for i in range(6):
                for j in range(i if b < lumps else 0, 6):
                    work.block[b, i, j] = 0.0
    for unknown in range(work.corner.shape[0]):
        for other in range(work.corner.shape[0]):
            work.corner[unknown, other] = 0.0


@njit
def spread(matrices, i, body, k, par):
    """Columns of R diag(k) R^T, R being matrix `i` of `matrices`; `k`: along the triad of `body`."""
    x, y, z = k
    columns = of_column(matrices, i, 0), of_column(matrices, i, 1), of_column(matrices, i, 2)
    if par.quarters[body] == ALONG_Z:
        x, y, z = k[1], k[2], k[0]
    elif par.quarters[body] == OBLIQUE:
        e, t, n = of_row(par.triad, body, 0), of_row(par.triad, body, 1), of_row(par.triad, body, 2)
        columns = turn(matrices, i, e), turn(matrices, i, t), turn(matrices, i, n)
    elif par.quarters[body] % 2 == 1:
        x, y = k[1], k[0]
    return (
        _spread_column(columns, (x * columns[0][0], y * columns[1][0], z * columns[2][0])),
        _spread_column(columns, (x * columns[0][1], y * columns[1][1], z * columns[2][1])),
        _spread_column(columns, (x * columns[0][2], y * columns[1][2], z * columns[2][2])),
    )


@njit
def _spread_column(columns, s):
    return axpy(s[2], columns[2], axpy(s[1], columns[1], scale(s[0], columns[0])))


@njit
def turning(a, lever):
    """Columns of A X: A has columns `a`, X takes a small rotation to its displacement, rotation x `lever`."""
    x, y, z = lever
    return (
        axpy(y, a[2], scale(-z, a[1])),
        axpy(z, a[0], scale(-x, a[2])),
        axpy(x, a[1], scale(-y, a[0])),
    )


@njit
def crossed(lever, a):
    """Columns of `lever` x A, A having columns `a`."""
    return cross(lever, a[0]), cross(lever, a[1]), cross(lever, a[2])


@njit
def transposed(a):
    """Columns of the transpose of the matrix with columns `a`."""
    return (
        (a[0][0], a[1][0], a[2][0]),
        (a[0][1], a[1][1], a[2][1]),
        (a[0][2], a[1][2], a[2][2]),
    )


@njit
def plus(a, b):
    """Columns of a + b."""
    return add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])


@njit
def put(blocks, b, i, j, a):
    """Add the 3 x 3 matrix with columns `a` to block `b` of `blocks`, (n, 6, 6), from row `i` and column `j` on."""
    for k in range(3):
        blocks[b, i + k, j] += a[0][k]
        blocks[b, i + k, j + 1] += a[1][k]
        blocks[b, i + k, j + 2] += a[2][k]


@njit
def put_symmetric(blocks, b, i, a):
    """Add the symmetric 3 x 3 matrix with columns `a` to block `b` of `blocks`, from row and column `i` on."""
    for k in range(3):
        blocks[b, i, i + k] += a[k][0]
    for k in range(1, 3):
        blocks[b, i + 1, i + k] += a[k][1]
    blocks[b, i + 2, i + 2] += a[2][2]


@njit
def set_negative(blocks, b, i, j, a):
    """Write minus the 3 x 3 matrix with columns `a` to block `b` of `blocks`, from row `i` and column `j` on."""
    for k in range(3):
        blocks[b, i + k, j] = -a[0][k]
        blocks[b, i + k, j + 1] = -a[1][k]
        blocks[b, i + k, j + 2] = -a[2][k]


@njit
def inertia_tangent(body, ca, par, work):
    """Add `ca` (1/s^2) times the mass matrix of a lump to its diagonal block."""
    mass, inertia = mass_of(body, par)
    for j in range(3):
        work.block[body, j, j] += ca * mass
    put_symmetric(work.block, body, 3, spread(work.rot, body, body, scale(ca, inertia), par))


@njit
def bushing_tangent(i, cv, par, work):
    """Add stiffness plus `cv` (1/s) times damping of bushing `i`, between lump and base.

    a and b are that sum for displacements and for rotations in axes of the frame. A small rotation of lump or base also
    displaces the marker by rotation x lever: its columns, and by symmetry its rows, have that displacement times a.
    """
    base, lump, kind = par.bushing_base[i], par.bushing_lump[i], par.bushing_kind[i]
    k, c = par.k[kind], par.c[kind]
    on_lump, _ = markers(i, par)
    lever = turn(work.rot, lump, on_lump)
    base_lever = sub(add(row(work.pos, lump), lever), row(work.pos, base))
    a = spread(work.rot, base, lump, (fma(cv, c[0], k[0]), fma(cv, c[1], k[1]), fma(cv, c[2], k[2])), par)
    b = spread(work.rot, base, lump, (fma(cv, c[3], k[3]), fma(cv, c[4], k[4]), fma(cv, c[5], k[5])), par)
    by_lump, by_base = turning(a, lever), turning(a, base_lever)
    block = work.block
    put_symmetric(block, lump, 0, a)
    put(block, lump, 0, 3, by_lump)
    put_symmetric(block, lump, 3, plus(b, crossed(lever, by_lump)))
    between = plus(b, crossed(lever, by_base))
    if is_lump(base, par):
        put_symmetric(block, base, 0, a)
        put(block, base, 0, 3, by_base)
        put_symmetric(block, base, 3, plus(b, crossed(base_lever, by_base)))
        joined = par.bushing_block[i]
        set_negative(block, joined, 0, 0, a)
        set_negative(block, joined, 0, 3, by_base)
        set_negative(block, joined, 3, 0, transposed(by_lump))
        set_negative(block, joined, 3, 3, between)
        return
    rotation, slide = par.turn[base - par.lump_kind.shape[0]], par.slide[base - par.lump_kind.shape[0]]
    if rotation >= 0:
        connect_shaft(rotation, lump, by_base[2], between[2], work.edge)
        work.corner[rotation, rotation] += b[2][2] + cross(base_lever, by_base[2])[2]
    if slide >= 0:
        slides = par.slides
        connect_shaft(slide, lump, scale(slides, a[2]), scale(slides, transposed(by_lump)[2]), work.edge)
        work.corner[rotation, slide] += slides * by_base[2][2]
        work.corner[slide, slide] += slides * a[2][2]
    across = par.across[base - par.lump_kind.shape[0]]
    if across >= 0:
        rows = transposed(by_lump)
        for k in range(2):
            connect_shaft(across + k, lump, a[k], rows[k], work.edge)
            work.corner[rotation, across + k] += by_base[2][k]
            if slide >= 0:
                work.corner[slide, across + k] += par.slides * a[2][k]
            for n in range(k, 2):
                work.corner[across + k, across + n] += a[n][k]


@njit
def connect_shaft(unknown, arm, f, torque, edge):
    """Write minus `f` and `torque` to the column of the shaft's `unknown` in `edge`, rows of `arm`."""
    for n in range(3):
        edge[unknown, arm, n] = -f[n]
        edge[unknown, arm, 3 + n] = -torque[n]


@njit
def _directions(pin, station, par, work):
    """Write d(displacements of `station`, a row of stations, along n and m) / d(pin, hole) to ``work.vectors``."""
    body, hole, hinge = par.pin[pin], par.hole[pin], par.hinge[pin]
    point = (station[POINT], station[POINT + 1], station[POINT + 2])
    lever = sub(point_to_pin(hinge, point, par, work), row(work.pos, body))
    hole_lever = sub(point, row(work.pos, hole))
    for k, first in ((0, NORMAL), (1, TANGENT)):
        u = (station[first], station[first + 1], station[first + 2])
        u_pin = to_pin(hinge, u, par, work)
        about_pin, about_hole = cross(lever, u_pin), cross(hole_lever, u)
        for i in range(3):
            work.vectors[k, i], work.vectors[k, 3 + i] = u_pin[i], about_pin[i]
            work.vectors[k, 6 + i], work.vectors[k, 9 + i] = -u[i], -about_hole[i]


@njit
def _add_dyads(pin, n, by_n, m, by_m, par, work):
    """Add `n` `by_n`^T + `m` `by_m`^T to the blocks of a pin and its hole; (12,): the pin's six, the hole's six."""
    body, hole, back = par.pin[pin], par.hole[pin], par.lump_kind.shape[0] + pin
    block = work.block
    for i in range(6):
        for j in range(6):
            block[back, i, j] = fma(m[6 + i], by_m[j], fma(n[6 + i], by_n[j], block[back, i, j]))
        for j in range(i, 6):
            block[body, i, j] = fma(m[i], by_m[j], fma(n[i], by_n[j], block[body, i, j]))
            block[hole, i, j] = fma(m[6 + i], by_m[6 + j], fma(n[6 + i], by_n[6 + j], block[hole, i, j]))


@njit
def contact_tangent(pin, cv, par, work):
    """Add the contact of `pin`: elastic force, damping, film; `cv`: 1/s.

    What damping and film couple, a force along n with a displacement along m or the reverse, is not symmetric, and left
    out.
    """
    for j in range(par.n_stations[par.pair_kind[pin]]):
        station = work.station[pin, j]
        touching = station[DELTA] > 0
        if not any_of(touching):
            continue
        # zero where nothing touches: film, damping and force are zero there, and rho can be 0
        by_rho = where(touching, 1 / station[RHO], 0.0)
        nn = station[SLOPE] + cv * station[DAMPING]
        mm = station[FORCE] * by_rho + station[FILM] * (cv - station[V_NORMAL] * by_rho)
        point_tangent(pin, station, nn, mm, par, work)


@njit
def point_tangent(pin, station, nn, mm, par, work):
    """Add the stiffness `nn` along n and `mm` along m of `station`, N/m."""
    _directions(pin, station, par, work)
    n, m, by_n, by_m = work.vectors[0], work.vectors[1], work.by_n, work.by_m
    for i in range(12):
        by_n[i], by_m[i] = nn * n[i], mm * m[i]
    _add_dyads(pin, n, by_n, m, by_m, par, work)


@njit
def friction_tangent(pin, cv, par, work):
    """Add the friction of `pin`, its change with the force that presses left out; `cv`: 1/s."""
    for j in range(par.n_stations[par.pair_kind[pin]]):
        rubbing = work.rubbing[pin, j]
        if any_of(rubbing[DAMPING] > 0):
            point_tangent(pin, rubbing, cv * rubbing[SLOPE], cv * rubbing[DAMPING], par, work)


@njit
def assemble(cv, ca, cv_axial, par, work):
    """Assemble the tangent at the state that ``dynamics.forces`` was last evaluated at.

    Parameters
    ----------
    cv, ca : float
        dv/dq (1/s) and da/dq (1/s^2) of the integration formula.
    cv_axial : float
        That dv/dq for the damping of the output shaft along its axis: 0 for an equilibrium, 1/s.
    par : record of PARAM
        The joint.
    work : record of WORK
        Bodies and stations are read; the blocks of the tangent are written.
    """
    clear(par, work)
    for body in range(par.lump_kind.shape[0]):
        inertia_tangent(body, ca, par, work)
    for i in range(work.load.shape[0]):
        bushing_tangent(i, cv, par, work)
    for pin in range(work.contact.shape[0]):
        contact_tangent(pin, cv, par, work)
    for face in range(par.face_pair.shape[0]):
        of_face = work.face[face]
        if any_of(of_face[FORCE] > 0):
            along = of_face[SLOPE] + cv * of_face[DAMPING]
            point_tangent(par.face_pair[face], of_face, along, 0.0 * along, par, work)
    if par.friction == 1:
        for pin in range(work.contact.shape[0]):
            friction_tangent(pin, cv, par, work)
    rotations = par.Js.shape[0]
    for u in range(rotations):
        work.corner[u, u] += ca * par.Js[u]
    support = ca * par.m_s + cv_axial * par.c_a + par.k_a
    for shaft in range(par.slide.shape[0]):
        if par.slide[shaft] >= 0:
            work.corner[par.slide[shaft], par.slide[shaft]] += where(par.slides > 0, support, 1.0)
        if par.across[shaft] >= 0:
            for u in range(par.across[shaft], par.across[shaft] + 2):
                work.corner[u, u] += ca * par.m_s + cv * par.c_l + par.k_l
