"""Tangent of the residual: S = d(residual) / d(unknowns) with dv = cv dq and da = ca dq.

Columns are increments of displacement and of attitude (du, dtheta in the frame's axes, attitude exp(dtheta x) R),
not of the rotation vector; `linsolve.solve` converts. Levers and attitudes are the actual ones, so that a rigid
motion of pins and hub together changes no cross bushing load. Neglected terms, each at most a few per cent of the term
beside it: rotation of the loads with the bodies, gyroscopic terms (2 Omega / cv of the inertia), and rates of levers.
"""

from tolstat.kernel.mechanics.bushing import markers
from tolstat.kernel.mechanics.dynamics import mass_of
from tolstat.kernel.mechanics.motion import to_cross
from tolstat.kernel.mechanics.topology import (
    ARM,
    ARM_OF_PIN,
    BUSHING_BASE,
    BUSHING_LUMP,
    FRAME,
    HUB,
    N_LUMPS,
    OUTPUT_SHAFT,
    PIN,
    QUARTERS,
)
from tolstat.kernel.mechanics.vector import add, axpy, cross, of_column, row, scale, sub, turn
from tolstat.kernel.mechanics.work import (
    ARM_PIN,
    DAMPING,
    DELTA,
    FILM,
    FORCE,
    NORMAL,
    OF_PSI,
    OF_S,
    PIN_HUB,
    POINT,
    RHO,
    SLOPE,
    TANGENT,
    V_NORMAL,
)
from tolstat.kernel.simd.jit import njit
from tolstat.kernel.simd.lane import any_of, fma, where


@njit
def clear(work):
    """Set to zero what parts add to: blocks of lumps, of pins and their arms, and the corner."""
    for b in range(PIN_HUB):
        for i in range(6):
            for j in range(i if b < N_LUMPS else 0, 6):
                work.block[b, i, j] = 0.0
    for unknown in (OF_PSI, OF_S):
        work.corner[unknown, OF_PSI] = work.corner[unknown, OF_S] = 0.0


@njit
def spread(matrices, i, body, k):
    """Columns of R diag(k) R^T, R being matrix `i` of `matrices`; `k`: along the triad of `body`."""
    x, y = (k[1], k[0]) if QUARTERS[body] % 2 == 1 else (k[0], k[1])
    columns = of_column(matrices, i, 0), of_column(matrices, i, 1), of_column(matrices, i, 2)
    return (
        _spread_column(columns, (x * columns[0][0], y * columns[1][0], k[2] * columns[2][0])),
        _spread_column(columns, (x * columns[0][1], y * columns[1][1], k[2] * columns[2][1])),
        _spread_column(columns, (x * columns[0][2], y * columns[1][2], k[2] * columns[2][2])),
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
    put_symmetric(work.block, body, 3, spread(work.rot, body, body, scale(ca, inertia)))


@njit
def bushing_tangent(i, cv, par, work):
    """Add stiffness plus `cv` (1/s) times damping of bushing `i`, between lump and base.

    a and b are that sum for displacements and for rotations in axes of the frame. A small rotation of lump or base also
    displaces the marker by rotation x lever: its columns, and by symmetry its rows, have that displacement times a.
    """
    base, lump = BUSHING_BASE[i], BUSHING_LUMP[i]
    k, c = (par.k_cross, par.c_cross) if base == HUB else (par.k_fork, par.c_fork)
    on_lump, _ = markers(i, par)
    lever = turn(work.rot, lump, on_lump)
    base_lever = sub(add(row(work.pos, lump), lever), row(work.pos, base))
    a = spread(work.rot, base, lump, (fma(cv, c[0], k[0]), fma(cv, c[1], k[1]), fma(cv, c[2], k[2])))
    b = spread(work.rot, base, lump, (fma(cv, c[3], k[3]), fma(cv, c[4], k[4]), fma(cv, c[5], k[5])))
    by_lump, by_base = turning(a, lever), turning(a, base_lever)
    block = work.block
    put_symmetric(block, lump, 0, a)
    put(block, lump, 0, 3, by_lump)
    put_symmetric(block, lump, 3, plus(b, crossed(lever, by_lump)))
    between = plus(b, crossed(lever, by_base))
    if base == HUB:
        put_symmetric(block, HUB, 0, a)
        put(block, HUB, 0, 3, by_base)
        put_symmetric(block, HUB, 3, plus(b, crossed(base_lever, by_base)))
        pin_hub = PIN_HUB + lump - PIN
        set_negative(block, pin_hub, 0, 0, a)
        set_negative(block, pin_hub, 0, 3, by_base)
        set_negative(block, pin_hub, 3, 0, transposed(by_lump))
        set_negative(block, pin_hub, 3, 3, between)
    elif base == OUTPUT_SHAFT:  # its unknowns are rotation about z and, where it slides, displacement along z
        slides = par.slides
        connect_shaft(OF_PSI, lump, by_base[2], between[2], work.edge)
        connect_shaft(OF_S, lump, scale(slides, a[2]), scale(slides, transposed(by_lump)[2]), work.edge)
        work.corner[OF_PSI, OF_PSI] += b[2][2] + cross(base_lever, by_base[2])[2]
        work.corner[OF_PSI, OF_S] += slides * by_base[2][2]
        work.corner[OF_S, OF_S] += slides * a[2][2]


@njit
def connect_shaft(unknown, arm, f, torque, edge):
    """Write minus `f` and `torque` to the column of the shaft's `unknown` in `edge`, rows of `arm`."""
    for n in range(3):
        edge[unknown, arm, n] = -f[n]
        edge[unknown, arm, 3 + n] = -torque[n]


@njit
def _directions(pin, j, work):
    """Write d(displacements of a station along n and m) / d(pin, arm) to ``work.vectors``."""
    body, arm = PIN + pin, ARM + ARM_OF_PIN[pin]
    frame = FRAME[arm]
    station = work.station[pin, j]
    point = (station[POINT], station[POINT + 1], station[POINT + 2])
    lever = sub(to_cross(frame, point, work), row(work.pos, body))
    arm_lever = sub(point, row(work.pos, arm))
    for k, first in ((0, NORMAL), (1, TANGENT)):
        u = (station[first], station[first + 1], station[first + 2])
        u_pin = to_cross(frame, u, work)
        about_pin, about_arm = cross(lever, u_pin), cross(arm_lever, u)
        for i in range(3):
            work.vectors[k, i], work.vectors[k, 3 + i] = u_pin[i], about_pin[i]
            work.vectors[k, 6 + i], work.vectors[k, 9 + i] = -u[i], -about_arm[i]


@njit
def _add_dyads(pin, n, by_n, m, by_m, work):
    """Add `n` `by_n`^T + `m` `by_m`^T to the blocks of a pin and its arm; (12,): the pin's six, the arm's six."""
    body, arm, back = PIN + pin, ARM + ARM_OF_PIN[pin], ARM_PIN + pin
    block = work.block
    for i in range(6):
        for j in range(6):
            block[back, i, j] = fma(m[6 + i], by_m[j], fma(n[6 + i], by_n[j], block[back, i, j]))
        for j in range(i, 6):
            block[body, i, j] = fma(m[i], by_m[j], fma(n[i], by_n[j], block[body, i, j]))
            block[arm, i, j] = fma(m[6 + i], by_m[6 + j], fma(n[6 + i], by_n[6 + j], block[arm, i, j]))


@njit
def contact_tangent(pin, cv, par, work):
    """Add the contact of `pin`: elastic force, damping, film; `cv`: 1/s.

    What damping and film couple, a force along n with a displacement along m or the reverse, is not symmetric, and left
    out.
    """
    by_n, by_m = work.by_n, work.by_m
    for j in range(par.n_stations):
        station = work.station[pin, j]
        touching = station[DELTA] > 0
        if not any_of(touching):
            continue
        # zero where nothing touches: film, damping and force are zero there, and rho can be 0
        by_rho = where(touching, 1 / station[RHO], 0.0)
        nn = station[SLOPE] + cv * station[DAMPING]
        mm = station[FORCE] * by_rho + station[FILM] * (cv - station[V_NORMAL] * by_rho)
        _directions(pin, j, work)
        n, m = work.vectors[0], work.vectors[1]
        for i in range(12):
            by_n[i], by_m[i] = nn * n[i], mm * m[i]
        _add_dyads(pin, n, by_n, m, by_m, work)


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
    clear(work)
    for body in range(N_LUMPS):
        inertia_tangent(body, ca, par, work)
    for i in range(8):
        bushing_tangent(i, cv, par, work)
    for pin in range(4):
        contact_tangent(pin, cv, par, work)
    work.corner[OF_PSI, OF_PSI] += ca * par.Js
    support = ca * par.m_s + cv_axial * par.c_a + par.k_a
    work.corner[OF_S, OF_S] += where(par.slides > 0, support, 1.0)
