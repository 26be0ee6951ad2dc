"""Work arrays of one joint: allocated once per process, rewritten for every joint; no step allocates.

They are the fields of one record: it passes between kernels as one pointer, and the shapes are constants to the
compiler. (With some thirty arrays in a NamedTuple instead, every call copied the arrays' descriptors, and a residual
took five times as long.)
"""

import numpy as np

from tolstat.common.parameters import MAX_STATIONS
from tolstat.kernel.mechanics.topology import N_BODIES, N_DOF, N_LUMPS

# columns of work.station
POINT, NORMAL, TANGENT = 0, 3, 6
RHO, DELTA, V_NORMAL, V_TANGENT, FORCE, SLOPE = 9, 10, 11, 12, 13, 14
N_STATION = 15

# rows of work.core
PSI_COLUMN, PSI_ROW, PSI_PSI = 0, 1, 2

FIELDS = {
    "frame_w": (3, 3),  # angular velocity of I, C, F in their own axes
    "frame_dw": (3, 3),  # its derivative
    "relative": (3, 3, 3),  # components in C to components in I, -, F
    "relative_w": (3, 3),  # angular velocity of C relative to I, -, F
    "shaft": (2,),  # ideal speed and acceleration of the output shaft
    "pos": (N_BODIES, 3),  # X + u
    "vel": (N_BODIES, 3),  # u'
    "rot": (N_BODIES, 3, 3),  # exp(phi x)
    "spin": (N_BODIES, 3),  # angular velocity relative to the ideal frame
    "force": (N_BODIES, 6),  # force, torque about the reference point
    "load": (8, 6),  # bushing loads on the lump, in the base marker's (e, t, z)
    "contact": (4, 3),  # normal force at the outer and inner end station of each pin, resultant of all its stations
    "mode": (4,),  # contact mode of each pin
    "station": (4, MAX_STATIONS, N_STATION),  # contact stations, see the column numbers above
    "lump_block": (N_LUMPS, 6, 6),  # blocks of the tangent, factorised in place
    "hub_pin": (4, 6, 6),  # rows of the hub, columns of pin p
    "pin_hub": (4, 6, 6),
    "pin_arm": (4, 6, 6),  # rows of pin p, columns of its arm
    "arm_pin": (4, 6, 6),
    "arm_psi": (4, 6),  # column psi in the rows of each arm
    "psi_arm": (4, 6),  # row psi
    "pin_psi": (4, 6),  # fill-in
    "psi_pin": (4, 6),  # fill-in
    "core": (1, 3, 6),  # psi: column in the rows of the hub, row, diagonal; after elimination their factors
    "vectors": (2, 12),  # d(displacements of a station along n and m) / d(pin, arm)
    "by_n": (12,),  # scratch of contact_tangent: d(forces of that station along n and m) / d(pin, arm)
    "by_m": (12,),
    "solution": (N_DOF,),  # right-hand side, then solution, of the linear system
}
"""State of the bodies at one instant, the loads between them, and the tangent's blocks.

All vectors of a body are in axes of its ideal frame.
"""

WORK = np.dtype([(name, np.float64, shape) for name, shape in FIELDS.items()])


def make_work():
    """Allocate the work record of a process, filled with NaN to expose values that are read before they are written."""
    work = np.zeros(1, WORK).view(np.recarray)[0]
    for name in FIELDS:
        work[name][...] = np.nan
    return work
