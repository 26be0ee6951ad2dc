"""Powers of a mechanism in motion, by the slow twin: what drive and loads give, what friction and dampers take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tests.support import naive


class Powers(NamedTuple):
    """Powers at one state, or their means, W."""

    drive: float
    applied: float
    friction: float
    damping: float


def powers(t, q, v, par, mechanism) -> Powers:
    """Powers at a state; what bushings, contacts and faces store has no mean over a period and is left out."""
    now = naive.motion(t, q, v, 0 * q, par, mechanism)
    between, lumps = naive.loads_between(now, par, mechanism), len(mechanism.lumps)
    given = (naive.applied(t, par, mechanism) * np.hstack([now.velocity, now.spin])[:lumps]).sum()
    of_prescribed = (between.force * np.hstack([now.velocity, now.spin]))[lumps:].sum()
    damping = sum(_of_pair(p, now, par, mechanism) for p in range(len(mechanism.pairs)))
    damping += sum(_of_face(i, now, par, mechanism) for i in range(len(mechanism.faces)))
    damping += sum(_of_bushing(bushing, now, par, mechanism) for bushing in mechanism.bushings)
    return Powers(-of_prescribed, given, between.loss.sum(), damping)


def _sliding(point, p, now, mechanism):
    """Velocity of pin p at a point against its eye."""
    pin, hole = (mechanism.bodies.index(name) for name in (mechanism.pairs[p].pin, mechanism.pairs[p].hole))
    return naive.velocity_at(point, pin, now) - naive.velocity_at(point, hole, now)


def _of_pair(p, now, par, mechanism):
    """Power of normal damping and film at the stations of pair p."""
    power, kind = 0.0, naive.kind_of(p, mechanism)
    for j, (point, n, delta, pressing, force) in enumerate(naive.stations_of(p, now, par, mechanism)):
        if delta > 0:
            elastic = par.station_k1[kind, j] * delta**2 + par.station_k2[kind, j] * delta
            elastic += naive.needles(delta, p, kind, j, par)
            slip = _sliding(point, p, now, mechanism)
            power += (pressing - elastic) * (slip @ n) - (force + pressing * n) @ slip
    return power


def _of_face(i, now, par, mechanism):
    """Power of the damping of a thrust face."""
    end, inwards, delta, pressing = naive.face_of(i, now, par, mechanism)
    if delta <= 0:
        return 0.0
    p = [pair.pin for pair in mechanism.pairs].index(mechanism.faces[i].pin)
    elastic = par.face_k[naive.kind_of(p, mechanism)] * delta
    return -(pressing - elastic) * (_sliding(end, p, now, mechanism) @ inwards)


def _of_bushing(bushing, now, par, mechanism):
    """Power of a bushing's dampers, for small rotations."""
    lump, base = (mechanism.bodies.index(name) for name in (bushing.lump, bushing.base))
    kind, local = mechanism.bushing_kinds.index(bushing.kind), naive.triads_of(par, mechanism)[lump]
    position, attitude = now.bodies
    marker = position[lump] + attitude[lump] @ (par.marker[kind] @ local)[0]
    moving = naive.velocity_at(marker, lump, now) - naive.velocity_at(marker, base, now)
    rate = np.concatenate([moving, now.spin[lump] - now.spin[base]]).reshape(2, 3) @ (local @ attitude[base].T).T
    return (par.c[kind] * rate.ravel() ** 2).sum()
