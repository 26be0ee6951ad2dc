"""Work arrays of one joint: allocated once per process, rewritten for every joint; no step allocates.

They are the fields of one record: it passes between kernels as one pointer, and the shapes are constants to the
compiler. (With some thirty arrays in a NamedTuple instead, every call copied the arrays' descriptors, and a residual
took five times as long.) All 6 x 6 blocks lie in one array: a kernel is compiled once for each shape.
"""

from functools import cache

import numpy as np

from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import sizes
from tolstat.common.mechanism import GENERAL, blocks_of
from tolstat.common.parameters import MAX_STATIONS

# columns of work.station
POINT, NORMAL, TANGENT = 0, 3, 6
RHO, DELTA, V_NORMAL, V_TANGENT, FORCE, SLOPE, DAMPING, FILM = 9, 10, 11, 12, 13, 14, 15, 16
N_STATION = 17


@cache
def work_fields(mechanism):
    """Shapes of the fields of a work record: the bodies at one instant, the loads between them, and the tangent.

    All vectors of a body are in axes of its ideal frame.
    """
    members, lumps, shafts = len(mechanism.members), len(mechanism.lumps), len(mechanism.shafts)
    bodies, pairs, border = lumps + shafts, len(mechanism.pairs), len(mechanism.unknowns)
    general = len(mechanism.hinges) if any(hinge.axis == GENERAL for hinge in mechanism.hinges) else 0
    return {
        "frame_w": (members, 3),  # angular velocity of each member in its own axes
        "frame_dw": (members, 3),  # its derivative
        "relative": (len(mechanism.hinges), 3),  # pin's member in the hole's: cosine, sine of the angle, its rate
        "drive": (3,),  # angular velocity and acceleration of the input; resisting torque, without the ramp
        "turned": (members, 2),  # of those that turn about z: cosine and sine of their angle
        "attitude": (mechanism.placed, 3, 3),  # of members with a place, in axes of the ground
        "origin": (mechanism.placed, 3),  # in axes of the ground
        "origin_v": (mechanism.placed, 3),  # its velocity
        "origin_a": (mechanism.placed, 3),  # its acceleration in axes of the member
        # general motion of pins' members in holes': rotation, place, their rates
        "into_hole": (general, 3, 3),
        "place": (general, 3),
        "place_v": (general, 3),
        "relative_w": (general, 3),
        "pos": (bodies, 3),  # X + u
        "vel": (bodies, 3),  # u'
        "rot": (bodies, 3, 3),  # exp(phi x)
        "series": (lumps, 3),  # `rotation.coefficients` of its rotation vector
        "spin": (bodies, 3),  # angular velocity relative to the ideal frame
        "force": (bodies, 6),  # force, torque about the reference point
        "load": (len(mechanism.bushings), 6),  # bushing loads on the lump, in the base marker's (e, t, z)
        "contact": (pairs, 3),  # normal force at the outer and inner end station of each pin, resultant of all
        "mode": (pairs,),  # contact mode of each pin
        "output": (2,),  # speed ratio of the output shaft and its error Psi, eq. (13)
        "loads": (sizes(mechanism).instant,),  # as `loads.write_loads` writes them
        "shafts": (shafts, 6),  # force and moment about O on each shaft, in axes that do not turn
        "station": (pairs, MAX_STATIONS, N_STATION),  # contact stations, see the column numbers above
        "face": (len(mechanism.faces), N_STATION),  # thrust faces, likewise; their normal is the hole's axis
        # where pins rub, likewise; normal: direction of sliding, tangent: across it
        "rubbing": (pairs if mechanism.friction else 0, MAX_STATIONS, N_STATION),
        "loss": (pairs if mechanism.friction else 0,),  # power of each pin's friction, W
        "block": (blocks_of(mechanism), 6, 6),  # matrices of the tangent, factorised in place; rows of what goes first
        "edge": (border, lumps, 6),  # its columns of the shafts' unknowns, rows of the lumps
        "corner": (border, border),  # its rows and columns of these; factorised in place
        "vectors": (2, 12),  # d(displacements of a station along n and m) / d(pin, hole)
        "by_n": (12,),  # scratch of contact_tangent: d(forces of that station along n and m) / d(pin, hole)
        "by_m": (12,),
        "solution": (mechanism.dof,),  # right-hand side, then solution, of the linear system
    }


SINGLE = ("block", "edge", "corner", "vectors", "by_n", "by_m", "solution")
"""Fields in single precision, those of the tangent: its age leaves more of a residual than rounding does."""


@cache
def work_dtype(mechanism=CARDAN):
    """Type of a work record."""
    fields = work_fields(mechanism).items()
    return np.dtype([(name, np.float32 if name in SINGLE else np.float64, shape) for name, shape in fields])


@cache
def factors_dtype(mechanism=CARDAN):
    """Type of a factorised tangent in use."""
    fields = work_fields(mechanism)
    return np.dtype([(name, np.float32, fields[name]) for name in ("block", "edge", "corner", "solution")])


def make_work(mechanism=CARDAN):
    """Allocate the work record of a process, filled with NaN to expose values that are read before they are written."""
    work = np.zeros(1, work_dtype(mechanism)).view(np.recarray)[0]
    for name in work_fields(mechanism):
        work[name][...] = np.nan
    return work
