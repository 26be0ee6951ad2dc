"""Work arrays of one joint: allocated once per process, rewritten for every joint; no step allocates.

They are the fields of one record: it passes between kernels as one pointer, and the shapes are constants to the
compiler. (With some thirty arrays in a NamedTuple instead, every call copied the arrays' descriptors, and a residual
took five times as long.) All 6 x 6 blocks lie in one array: a kernel is compiled once for each shape.
"""

import numpy as np

from tolstat.common.fields import MAX_STATIONS
from tolstat.kernel.mechanics.loads import N_INSTANT
from tolstat.kernel.mechanics.topology import N_BODIES, N_DOF, N_LUMPS

# columns of work.station
POINT, NORMAL, TANGENT = 0, 3, 6
RHO, DELTA, V_NORMAL, V_TANGENT, FORCE, SLOPE, DAMPING, FILM = 9, 10, 11, 12, 13, 14, 15, 16
N_STATION = 17

ARM_PIN, PIN_HUB = N_LUMPS, N_LUMPS + 4
"""First matrix of each kind in ``work.block``, after those of the lumps: rows of the arm that holds pin p, columns of
the pin; rows of pin p, columns of the hub. Those below the diagonal are their transposes."""
OF_PSI, OF_S = 0, 1

FIELDS = {
    "frame_w": (3, 3),  # angular velocity of I, C, F in their own axes
    "frame_dw": (3, 3),  # its derivative
    "relative": (3, 3),  # of C relative to I (about x), -, F (about y): cosine and sine of the angle, its rate
    "drive": (2,),  # angular velocity of the input shaft; resisting torque, without the ramp at the start
    "shaft": (2,),  # ideal speed and acceleration of the output shaft
    "turned": (2, 2),  # cosine and sine of the angle theta of the input, and theta_o of the output shaft
    "pos": (N_BODIES, 3),  # X + u
    "vel": (N_BODIES, 3),  # u'
    "rot": (N_BODIES, 3, 3),  # exp(phi x)
    "series": (N_LUMPS, 3),  # `rotation.coefficients` of its rotation vector
    "spin": (N_BODIES, 3),  # angular velocity relative to the ideal frame
    "force": (N_BODIES, 6),  # force, torque about the reference point
    "load": (8, 6),  # bushing loads on the lump, in the base marker's (e, t, z)
    "contact": (4, 3),  # normal force at the outer and inner end station of each pin, resultant of all its stations
    "mode": (4,),  # contact mode of each pin
    "output": (2,),  # speed ratio of the output shaft and its error Psi, eq. (13)
    "loads": (N_INSTANT,),  # as `loads.write_loads` writes them
    "shafts": (2, 6),  # force and moment about O on input and output shaft, in axes that do not turn
    "station": (4, MAX_STATIONS, N_STATION),  # contact stations, see the column numbers above
    "block": (N_LUMPS + 8, 6, 6),  # matrices of the tangent, those of lumps above the diagonal; factorised in place
    "edge": (2, N_LUMPS, 6),  # its columns psi and s, rows of the output arms; of their pins and the hub: fill-in
    "corner": (2, 2),  # its rows and columns psi and s; factorised in place
    "vectors": (2, 12),  # d(displacements of a station along n and m) / d(pin, arm)
    "by_n": (12,),  # scratch of contact_tangent: d(forces of that station along n and m) / d(pin, arm)
    "by_m": (12,),
    "solution": (N_DOF,),  # right-hand side, then solution, of the linear system
}
"""State of the bodies at one instant, the loads between them, and the tangent's blocks.

All vectors of a body are in axes of its ideal frame.
"""

SINGLE = ("block", "edge", "corner", "vectors", "by_n", "by_m", "solution")
"""Fields in single precision, those of the tangent: its age leaves more of a residual than rounding does."""
WORK = np.dtype([(name, np.float32 if name in SINGLE else np.float64, shape) for name, shape in FIELDS.items()])
FACTORS = np.dtype([(name, np.float32, FIELDS[name]) for name in ("block", "edge", "corner", "solution")])
"""A factorised tangent in use."""


def make_work():
    """Allocate the work record of a process, filled with NaN to expose values that are read before they are written."""
    work = np.zeros(1, WORK).view(np.recarray)[0]
    for name in FIELDS:
        work[name][...] = np.nan
    return work
