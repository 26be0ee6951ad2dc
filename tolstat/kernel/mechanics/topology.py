"""Topology of the joint as constant arrays (docs/model.md, "Parts" and "Frames").

Bodies 0 hub, 1-4 pins 1-4, 5-8 arms 1-4, 9 input shaft, 10 output shaft. The unknowns are six per lump
(three displacements, three rotations, in axes of the lump's ideal frame), then psi and s of the output
shaft, its rotation about its axis and its displacement along it: 9 * 6 + 2 = 56.
"""

import numpy as np

HUB, PIN, ARM, INPUT_SHAFT, OUTPUT_SHAFT = 0, 1, 5, 9, 10
N_BODIES, N_LUMPS = 11, 9
PSI = 6 * N_LUMPS
S = PSI + 1
N_DOF = S + 1

FRAME_I, FRAME_C, FRAME_F = 0, 1, 2
FRAME = np.array([FRAME_C] * 5 + [FRAME_I] * 2 + [FRAME_F] * 2 + [FRAME_I, FRAME_F])
"""Ideal frame of each body."""

ARM_OF_PIN = np.array([3, 2, 0, 1])
"""Pin 1 turns in the hole of arm 4, pin 2 in arm 3, pin 3 in arm 1, pin 4 in arm 2 (numbers from 0 here)."""


def _triads():
    """Rows e, t, z of each body's triad, in axes of its frame; unit matrix for hub and shafts."""
    z = np.array([0.0, 0.0, 1.0])
    triads = np.tile(np.eye(3), (N_BODIES, 1, 1))
    axes = {1: (0, 1), 2: (0, -1), 3: (1, 0), 4: (-1, 0), 5: (1, 0), 6: (-1, 0), 7: (0, -1), 8: (0, 1)}
    for body, (x, y) in axes.items():
        e = np.array([x, y, 0.0])
        triads[body] = e, np.cross(z, e), z
    return triads


TRIAD = _triads()

QUARTERS = np.round(np.arctan2(TRIAD[:, 0, 1], TRIAD[:, 0, 0]) / (0.5 * np.pi)).astype(np.int64) % 4
"""Quarter turns about z that take the frame's axes to each body's triad."""

BUSHING_BASE = np.array([HUB] * 4 + [INPUT_SHAFT] * 2 + [OUTPUT_SHAFT] * 2)
BUSHING_LUMP = np.arange(PIN, PIN + 8)
"""Base and lump of the bushings cross 1-4, fork 1-4."""
