"""Work arrays of one joint: made once per process, rewritten for every joint, nothing is allocated per step."""

from typing import NamedTuple

import numpy as np

from tolstat.kernel.topology import N_BODIES, N_DOF, N_LUMPS
from tolstat.tables import MAX_STATIONS

# columns of Work.station
POINT, NORMAL, TANGENT = 0, 3, 6
RHO, DELTA, V_NORMAL, V_TANGENT, FORCE, SLOPE, EXCESS = 9, 10, 11, 12, 13, 14, 15
N_STATION = 16


class Work(NamedTuple):
    """State of the bodies at one instant, the loads between them, and the tangent's blocks.

    All vectors of a body are in axes of its ideal frame.
    """

    frame_w: np.ndarray  # (3, 3) angular velocity of I, C, F in their own axes
    frame_dw: np.ndarray  # (3, 3) its derivative
    relative: np.ndarray  # (3, 3, 3) components in C to components in I, -, F
    relative_w: np.ndarray  # (3, 3) angular velocity of C against I, -, F
    shaft: np.ndarray  # (2,) ideal speed and acceleration of the output shaft
    pos: np.ndarray  # (11, 3) X + u
    vel: np.ndarray  # (11, 3) u'
    rot: np.ndarray  # (11, 3, 3) exp(phi x)
    spin: np.ndarray  # (11, 3) angular velocity against the ideal frame
    force: np.ndarray  # (11, 6) force, torque about the reference point
    load: np.ndarray  # (8, 6) bushing loads on the lump, in the base marker's (e, t, z)
    contact: np.ndarray  # (4, 2) normal force on the outer and inner half of each pin
    mode: np.ndarray  # (4,) contact mode of each pin
    station: np.ndarray  # (4, MAX_STATIONS, N_STATION) contact stations, see the column numbers above
    mode_weight: np.ndarray  # (4, 5) w of the law `mode`, then dw/d(delta_a, m_a, delta_b, m_b)
    diagonal: np.ndarray  # (9, 6, 6) blocks of the tangent, factorised in place
    hub_pin: np.ndarray  # (4, 6, 6) rows of the hub, columns of pin p
    pin_hub: np.ndarray  # (4, 6, 6)
    pin_arm: np.ndarray  # (4, 6, 6) rows of pin p, columns of its arm
    arm_pin: np.ndarray  # (4, 6, 6)
    arm_psi: np.ndarray  # (4, 6) column psi in the rows of each arm
    psi_arm: np.ndarray  # (4, 6) row psi
    pin_psi: np.ndarray  # (4, 6) fill-in
    psi_pin: np.ndarray  # (4, 6) fill-in
    core: np.ndarray  # (1, 7, 7) hub and psi after elimination
    vectors: np.ndarray  # (2, 12) n and m of a contact station as displacements of pin and arm
    left: np.ndarray  # (2, 12) scratch of contact_tangent
    right: np.ndarray  # (2, 12)
    solution: np.ndarray  # (N_DOF,) right-hand side, then solution, of the linear system


def make_work() -> Work:
    """Allocate the work arrays, filled with NaN so that reading before writing shows."""
    shapes = {
        "frame_w": (3, 3),
        "frame_dw": (3, 3),
        "relative": (3, 3, 3),
        "relative_w": (3, 3),
        "shaft": (2,),
        "pos": (N_BODIES, 3),
        "vel": (N_BODIES, 3),
        "rot": (N_BODIES, 3, 3),
        "spin": (N_BODIES, 3),
        "force": (N_BODIES, 6),
        "load": (8, 6),
        "contact": (4, 2),
        "mode": (4,),
        "station": (4, MAX_STATIONS, N_STATION),
        "mode_weight": (4, 5),
        "diagonal": (N_LUMPS, 6, 6),
        "hub_pin": (4, 6, 6),
        "pin_hub": (4, 6, 6),
        "pin_arm": (4, 6, 6),
        "arm_pin": (4, 6, 6),
        "arm_psi": (4, 6),
        "psi_arm": (4, 6),
        "pin_psi": (4, 6),
        "psi_pin": (4, 6),
        "core": (1, 7, 7),
        "vectors": (2, 12),
        "left": (2, 12),
        "right": (2, 12),
        "solution": (N_DOF,),
    }
    arrays = {name: np.full(shape, np.nan) for name, shape in shapes.items() if name != "mode"}
    return Work(mode=np.zeros(4, np.int64), **arrays)
