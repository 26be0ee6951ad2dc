"""Longest step for which `verlet` is stable, from the parameters of a joint.

The joint is linearised in the ideal pose with the stations of all pins closed, at one depth and in both directions
across the pin: more than can press at a time. The depth is that of the pin with the largest clearance: with needles the
same force presses no other pin deeper, and slopes rise with the depth. The largest eigenvalue of
M^-1 (h^2/4 K + h C), which must be below 1 for `verlet`, is found by power iteration.
"""

import math

from tolstat.kernel.mechanics.bushing import accumulate, markers
from tolstat.kernel.mechanics.dynamics import mass_of
from tolstat.kernel.mechanics.scale import typical_force
from tolstat.kernel.mechanics.spring import elastic, has_needles, penetration
from tolstat.kernel.mechanics.triad import from_triad, to_triad
from tolstat.kernel.mechanics.vector import add, cross, row, scale, sub
from tolstat.kernel.simd.jit import njit

STABLE = 0.98
"""Largest eigenvalue up to which a step counts as stable: the power iteration approaches it from below."""
ITERATIONS = 60
IMPACT = 15.0
"""Contact force of an end station, in units of the joint's typical force, that the first steps are stable for."""
FALL = 0.7
"""Exponent of the step's correction: the eigenvalue grows with a power of the step between 1 and 2."""
TRIES = 20
"""Maximum number of times that a step is added to each of the output grid's."""
DEEPER, DEEPEST = 1.2, 100
"""Factor from one depth to the next one that is tried, and maximum number of depths."""
TOO_MANY = 2**31 - 1
"""Number of steps that stands for no stable step found."""


@njit
def press_on(h, stiffness, damping):
    """Share of a spring and its damper in h^2/4 K + h C."""
    return h * (0.25 * h * stiffness + damping)


@njit
def connect(one, other, on_one, on_other, along, about, par, work):
    """Add the forces between points of two bodies that move by ``work.vel`` and ``work.spin`` to ``work.force``.

    Parameters
    ----------
    one, other : int
        Numbers of the bodies.
    on_one, on_other : tuple of 3 float
        The points, m, from the bodies' reference points, in axes of their ideal frame.
    along, about : tuple of 3 float
        Factors of displacement (N/m) and rotation (N m) along e, t, z of body `one`.
    par, work : records of PARAM and WORK
        The joint; scratch.
    """
    here = add(row(work.vel, one), cross(row(work.spin, one), on_one))
    there = add(row(work.vel, other), cross(row(work.spin, other), on_other))
    d, phi = to_triad(one, sub(here, there), par), to_triad(one, sub(row(work.spin, one), row(work.spin, other)), par)
    f = from_triad(one, (along[0] * d[0], along[1] * d[1], along[2] * d[2]), par)
    torque = from_triad(one, (about[0] * phi[0], about[1] * phi[1], about[2] * phi[2]), par)
    accumulate(work.force, one, f, add(cross(on_one, f), torque))
    accumulate(work.force, other, scale(-1.0, f), scale(-1.0, add(cross(on_other, f), torque)))


@njit
def multiply(h, depth, par, work):
    """Multiply ``work.vel``, ``work.spin`` by h^2/4 K + h C, stations at `depth` (m), into ``work.force``."""
    for body in range(work.force.shape[0]):
        for k in range(6):
            work.force[body, k] = 0.0
    for i in range(work.load.shape[0]):
        lump, base, kind = par.bushing_lump[i], par.bushing_base[i], par.bushing_kind[i]
        on_lump, on_base = markers(i, par)
        k, c = par.k[kind], par.c[kind]
        along = press_on(h, k[0], c[0]), press_on(h, k[1], c[1]), press_on(h, k[2], c[2])
        about = press_on(h, k[3], c[3]), press_on(h, k[4], c[4]), press_on(h, k[5], c[5])
        connect(lump, base, on_lump, on_base, along, about, par, work)
    for pin in range(par.pin.shape[0]):
        body, kind = par.pin[pin], par.pair_kind[pin]
        for j in range(par.n_stations[kind]):
            _, slope = elastic(kind, j, depth, par.clearance[pin], has_needles(kind, par), par)
            across = press_on(h, slope, max(par.c_d[kind], par.c_t[kind]) * par.station_weight[kind, j])
            at = from_triad(body, (par.station_s[kind, j], 0.0, 0.0), par)
            connect(body, par.hole[pin], at, at, (0.0, across, across), (0.0, 0.0, 0.0), par, work)


@njit
def eigenvalue(h, depth, par, work):
    """Largest eigenvalue of M^-1 (h^2/4 K + h C) for steps `h` (s) and stations pressed to `depth` (m)."""
    lumps, bodies = par.lump_kind.shape[0], work.force.shape[0]
    for body in range(bodies):
        for k in range(3):
            work.vel[body, k] = work.spin[body, k] = 0.0
    for body in range(lumps):
        for k in range(3):  # any motion without a symmetry
            work.vel[body, k] = 0.5 + (7 * k + 3 * body) % 5
            work.spin[body, k] = (0.5 + (5 * k + 4 * body) % 7) / par.R
    for shaft in range(par.turn.shape[0]):
        if par.turn[shaft] >= 0:
            work.spin[lumps + shaft, 2] = 1 / par.R
        if par.slide[shaft] >= 0:
            work.vel[lumps + shaft, 2] = par.slides
    largest = 0.0
    for _ in range(ITERATIONS):
        multiply(h, depth, par, work)
        work_done, energy = move_shafts(h, par, work)
        for body in range(lumps):
            mass, inertia = mass_of(body, par)
            turning = to_triad(body, row(work.spin, body), par)
            torque = to_triad(body, (work.force[body, 3], work.force[body, 4], work.force[body, 5]), par)
            for k in range(3):
                x, y = work.vel[body, k], work.force[body, k]
                work_done += x * y + turning[k] * torque[k]
                energy += mass * x * x + inertia[k] * turning[k] * turning[k]
                work.vel[body, k] = y / mass
            faster = (torque[0] / inertia[0], torque[1] / inertia[1], torque[2] / inertia[2])
            faster = from_triad(body, faster, par)
            for k in range(3):
                work.spin[body, k] = faster[k]
        largest = work_done / energy
        size = 1 / largest
        for body in range(bodies):
            for k in range(3):
                work.vel[body, k], work.spin[body, k] = size * work.vel[body, k], size * work.spin[body, k]
    return largest


@njit
def move_shafts(h, par, work):
    """Replace the velocities of the shafts by those that the forces of `multiply` give; return work and energy."""
    lumps = par.lump_kind.shape[0]
    work_done = energy = 0.0
    for u in range(par.Js.shape[0]):
        torque = speed = 0.0
        for shaft in range(par.turn.shape[0]):
            if par.turn[shaft] == u:
                speed = work.spin[lumps + shaft, 2]
                torque += work.force[lumps + shaft, 5]
        work_done += speed * torque
        energy += par.Js[u] * speed**2
        for shaft in range(par.turn.shape[0]):
            if par.turn[shaft] == u:
                work.spin[lumps + shaft, 2] = torque / par.Js[u]
    axial_mass = par.m_s if par.slides > 0 else 1.0
    for shaft in range(par.slide.shape[0]):
        if par.slide[shaft] >= 0:
            along = work.vel[lumps + shaft, 2]
            force = par.slides * (work.force[lumps + shaft, 2] + press_on(h, par.k_a, par.c_a) * along)
            work_done += along * force
            energy += axial_mass * along * along
            work.vel[lumps + shaft, 2] = force / axial_mass
    return work_done, energy


@njit
def widest(par):
    """Largest clearance (m) of the pins."""
    return par.clearance.max()


@njit
def depth_at(force, par):
    """Depth (m) to which a normal force (N) presses an end station at most; infinite without stiffness."""
    deepest = 0.0
    for kind in range(par.n_stations.shape[0]):
        depth = penetration(force, kind, 0, widest(par), par)
        deepest = max(deepest, depth if depth > 0 else math.inf)
    return deepest


@njit
def steps_for(force, par, options, work):
    """Least number of steps a revolution that is stable while no end station presses with more than `force` (N).

    It is a multiple of ``options.steps_per_rev``, or `TOO_MANY`; `work` is scratch.
    """
    period, depth = 2 * math.pi / abs(par.omega), depth_at(force, par)
    h = period / options.steps_per_rev
    for _ in range(6):
        h *= (STABLE / eigenvalue(h, depth, par, work)) ** FALL
    parts = period / h / options.steps_per_rev
    if not parts * options.steps_per_rev < TOO_MANY / 2:
        return TOO_MANY
    steps = options.steps_per_rev * math.ceil(parts)
    for _ in range(TRIES):
        if eigenvalue(period / steps, depth, par, work) <= STABLE:
            return steps
        steps += options.steps_per_rev
    return TOO_MANY


@njit
def fewest_steps(par, options, work):
    """Number of steps of the first revolution, as of `steps_for`."""
    return steps_for(IMPACT * typical_force(par), par, options, work)


@njit
def largest_force(steps, par, work):
    """Contact force of an end station (N) up to which so many steps a revolution are stable; `work` is scratch."""
    h, depth = 2 * math.pi / (abs(par.omega) * steps), depth_at(IMPACT * typical_force(par), par)
    for _ in range(DEEPEST):
        if not eigenvalue(h, DEEPER * depth, par, work) <= STABLE:
            break
        depth *= DEEPER
    least = math.inf
    for kind in range(par.n_stations.shape[0]):
        least = min(least, elastic(kind, 0, depth, widest(par), has_needles(kind, par), par)[0])
    return least
