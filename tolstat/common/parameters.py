"""Parameters of one joint for the kernel: the fields of the table PARAM."""

from __future__ import annotations

import hashlib
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.fields import Field
from tolstat.common.load_kinds import load_numbers
from tolstat.common.mechanism import OBLIQUE, Mechanism, numbering

MAX_STATIONS = 16
"""Maximum number of contact stations of a pin."""
MAX_ORDERS = 32
"""Maximum number of different orders of speed and torque: 16 of each."""

LAMINAE, TERMS = 30, 5
"""Laminae of a needle, the smallest number that ISO/TS 16281 admits; coefficients of a polynomial of `needle_fit`."""
PLACE, RELIEF, EDGES = range(3)
"""Rows of `lamina`."""
OF_FORCE, OF_DAMAGE, OF_POWER = range(3)
"""Rows of `needle_fit`."""
ACROSS_NEEDLES = 1e-5
"""Unit of an approach in the fit of its power, m."""
IN_LINE, LEAST_DAMAGE = 40, -80.0
"""Number and first of the natural logarithms of damage of `in_line`, in steps of 1."""


@cache
def numbers(mechanism: Mechanism) -> dict[str, NDArray[np.int64]]:
    """Integers of PARAM: the parts of a mechanism and its loads, as `numbering` and `load_numbers` have them."""
    return numbering(mechanism) | load_numbers(mechanism)


NUMBERS: dict[str, dict[str, NDArray[np.int64]]] = {}
"""`numbers` of the mechanisms in use by `mark_of`."""


@cache
def mark_of(mechanism: Mechanism) -> str:
    """Name of a field that tells the numbers of a mechanism from those of others with the same sizes."""
    found = numbers(mechanism)
    text = repr([(name, values.tolist()) for name, values in found.items()])
    name = f"numbers_{hashlib.sha256(text.encode()).hexdigest()[:12]}"
    NUMBERS[name] = found
    return name


def numbers_of(record: Any) -> dict[str, NDArray[np.int64]]:
    """Numbers of the mechanism of a Numba type of PARAM; of other records, none."""
    return next((NUMBERS[name] for name in record.fields if name in NUMBERS), {})


def param_fields(mechanism: Mechanism) -> tuple[Field, ...]:
    """Fields of PARAM; those of pins and holes are indexed by pair, other fields by kind of lump, bushing or pair."""
    joints, pairs = len(mechanism.cardan), len(mechanism.pairs)
    lumps, bushings, kinds = map(len, (mechanism.lump_kinds, mechanism.bushing_kinds, mechanism.pair_kinds))
    pulls = len(mechanism.forces)
    oblique = len(mechanism.lumps) if any(lump.quarters == OBLIQUE for lump in mechanism.lumps) else 0
    return (
        Field("alpha", "rad", "misalignment of each Cardan joint", shape=(joints,)),
        Field("ahead", "rad", "angle of its input fork ahead of the output fork that drives it", shape=(joints,)),
        Field("plane", "rad", "angle of its plane ahead of that of the joint before", shape=(joints,)),
        Field("span", "m", "distance of its centre from that of the joint before", shape=(joints,)),
        Field("omega", "rad/s", "mean angular velocity of the input shaft"),
        Field("torque", "N*m", "mean resisting torque T"),
        Field("n_orders", "1", "number of orders", "i8"),
        Field("order", "1", "cycles of each order in a revolution of the input", shape=(MAX_ORDERS,)),
        Field("speed_order", "rad", "factors of cosine and sine of each order in theta", shape=(MAX_ORDERS, 2)),
        Field("torque_order", "N*m", "factors of cosine and sine of each order in T_r", shape=(MAX_ORDERS, 2)),
        Field("Js", "kg*m^2", "inertia of each shaft that turns", shape=(len(mechanism.rotations),)),
        Field("slides", "1", "1 where the output shaft may move along its axis, 0 where it is held rigidly"),
        Field("m_s", "kg", "mass of the output shaft, which moves along its axis and across it"),
        Field("k_a", "N/m", "axial stiffness of the shafts' bearings; 0: free"),
        Field("c_a", "N*s/m", "axial damping of the output shaft"),
        Field("k_l", "N/m", "stiffness of the shafts' bearings across the output shaft; 0: free"),
        Field("c_l", "N*s/m", "damping across the output shaft"),
        Field("F_a", "N", "axial force on the output shaft, away from the joint"),
        Field("R", "m", "typical length: smallest distance of the pins' and arms' reference points from O"),
        Field("pivot", "m", "where the origin of a member is in its parent", shape=(mechanism.placed, 3)),
        Field(
            "mount", "1", "axes, by columns, of a member in its parent at the angle 0", shape=(mechanism.placed, 3, 3)
        ),
        Field("angle", "rad, 1", "angle of a member at theta = 0, and its turns by theta", shape=(mechanism.placed, 2)),
        Field(
            "wave",
            "rad",
            "factors of cosine and sine of each order of theta in the angle",
            shape=(mechanism.placed, mechanism.waves, 2),
        ),
        Field(
            "weight", "m/s^2", "acceleration by gravity, in axes of the ground", shape=(3 if mechanism.placed else 0,)
        ),
        Field("pull", "N", "given force, in axes of the ground, or of its member if it turns", shape=(pulls, 3)),
        Field(
            "pull_at", "m", "where it acts, from its lump's reference point, in axes of its member", shape=(pulls, 3)
        ),
        Field("triad", "1", "oblique triads: rows e, t, z of each lump in axes of its member", shape=(oblique, 3, 3)),
        Field("mass", "kg", "mass of a lump", shape=(lumps,)),
        Field("inertia", "kg*m^2", "inertia of a lump about e, t, z", shape=(lumps, 3)),
        Field("at", "m", "reference point of a lump in its member, along e, t, z", shape=(lumps, 3)),
        Field("k", "N/m, N*m/rad", "bushing stiffness: force e, t, z, torque e, t, z", shape=(bushings, 6)),
        Field("c", "N*s/m, N*m*s/rad", "bushing damping, same order", shape=(bushings, 6)),
        Field(
            "marker",
            "m",
            "marker of a bushing from the reference points of lump and base, along e, t, z of the lump",
            shape=(bushings, 2, 3),
        ),
        Field("push", "N", "force of a bushing that is pushed, along its z on the lump"),
        Field("c_d", "N*s/m", "normal contact damping", shape=(kinds,)),
        Field("c_t", "N*s/m", "tangential contact damping (lubricant film)", shape=(kinds,)),
        Field("delta_d", "m", "penetration over which contact damping rises", shape=(kinds,)),
        Field("n_stations", "1", "contact stations per pin", "i8", (kinds,)),
        Field(
            "station_s",
            "m",
            "signed distance of each station from P along the pin, falling",
            shape=(kinds, MAX_STATIONS),
        ),
        Field("station_k1", "N/m^2", "quadratic coefficient of each station's force", shape=(kinds, MAX_STATIONS)),
        Field("station_k2", "N/m", "linear coefficient of each station's force", shape=(kinds, MAX_STATIONS)),
        Field("station_k3", "N/m^(9/8)", "coefficient of each station's needles", shape=(kinds, MAX_STATIONS)),
        Field("station_weight", "1", "weight of each station's damping and film", shape=(kinds, MAX_STATIONS)),
        Field("needle_b", "1", "share b of the clearance in the force of needles; 0: no needles", shape=(kinds,)),
        Field("needle_k", "N/m^(10/9)", "stiffness of a needle; 0: not known", shape=(kinds,)),
        Field("needles", "1", "needles of a bearing", shape=(kinds,)),
        Field("needle_half", "m", "half of the length of a needle", shape=(kinds,)),
        Field(
            "lamina",
            "1, m, 1",
            "laminae of a needle: place from -1 to 1, approach that the profile takes off, weight in damage",
            shape=(kinds, 3, LAMINAE),
        ),
        Field("needle_fit", "1", "polynomials of force, damage and power of an approach", shape=(kinds, 3, TERMS)),
        Field("in_line", "1", "log of force over needle_k in line and without clearance", shape=(kinds, IN_LINE)),
        Field("clearance", "m", "radial clearance c of each pin", shape=(pairs,)),
        Field("pin_point", "m", "P less the pin's reference point, in axes of its member", shape=(pairs, 3)),
        Field("pin_axis", "1", "direction of the pin axis, in axes of its member", shape=(pairs, 3)),
        Field(
            "hole_point", "m", "hole centre less the hole's reference point, in axes of its member", shape=(pairs, 3)
        ),
        Field("hole_axis", "1", "direction of the hole axis, in axes of its member", shape=(pairs, 3)),
        Field(
            "face_at",
            "m",
            "thrust faces: of the pin from P along its axis, of the hole from its centre along its axis",
            shape=(len(mechanism.faces), 2),
        ),
        Field("face_k", "N/m", "stiffness of a thrust face", shape=(kinds,)),
        Field("face_c", "N*s/m", "damping of a thrust face", shape=(kinds,)),
        Field("mu", "1", "coefficient of friction of pins around their axes", shape=(kinds,)),
        Field("mu_ratio", "1", "coefficient of friction along the pins over that around them", shape=(kinds,)),
        Field("friction_radius", "m", "distance from the pin's axis at which friction acts", shape=(kinds,)),
        Field("slip_speed", "m/s", "sliding speed over which friction rises", shape=(kinds,)),
        Field(
            "bearing_at",
            "m",
            "bearings of shafts: of the nearer and of the farther one, place along z of the shaft",
            shape=(sum(shaft.borne for shaft in mechanism.shafts), 2),
        ),
        Field(
            "unbalance",
            "kg*m",
            "unbalance of a body along x and y of its frame",
            shape=(len(mechanism.unbalanced), 2),
        ),
        Field(
            "of_root",
            "1/m^3",
            "stress at the root of a pin by bending and by torsional moment",
            shape=(len(mechanism.roots), 2),
        ),
        Field(mark_of(mechanism), "1", "mark of the mechanism's numbers", "f8", (0,)),
        *(
            Field(name, "1", "number of the mechanism", "i8", values.shape)
            for name, values in numbers(mechanism).items()
        ),
    )
