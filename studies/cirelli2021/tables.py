"""The tables of Cirelli, Rossi, Valentini and Pennestri (2021) against joints simulated here.

The paper prints no sign with any error it reports, though its eq. (14) has one, and neither direction nor sign of the
errors it puts in. Each of its cases is therefore compared with every direction that a study runs, and the nearest is
named: by the modulus of Gamma, and with its sign, as if each printed value were an increase.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import kinds

Array = NDArray[np.float64]
Table = NDArray[np.void]

BUSHINGS = kinds(CARDAN)["F"].places
"""Bushings of the joint, in the order of its loads."""
OUTPUT_SIDE = tuple(BUSHINGS.index(name) for name in ("cross1", "cross2", "fork3", "fork4"))
INPUT_SIDE = tuple(BUSHINGS.index(name) for name in ("cross3", "cross4", "fork1", "fork2"))
CROSS, FORK = slice(0, 4), slice(4, 8)
SAME_ALPHA = 1e-6
"""Misalignments (rad) that differ by less are the same."""
TIE = 0.01
"""Distances that differ by no more are a tie, percentage points."""


class Printed(NamedTuple):
    """Tables 4 to 7.

    Attributes
    ----------
    cases : tuple of str
        ``"Pos fork"``, ``"Ang fork"``, ``"Pos cross"``, ``"Ang cross"``.
    alpha : ndarray, shape (2,)
        Misalignments, rad.
    gamma : ndarray, shape (4, 2, 8, 2)
        Case, misalignment, bushing (order of `BUSHINGS`), force and torque; per cent.
    tables : ndarray of int, shape (2, 2)
        Number of the paper's table: misalignment; cross and fork.
    """

    cases: tuple[str, ...]
    alpha: Array
    gamma: Array
    tables: NDArray[np.int64]


class Match(NamedTuple):
    """A printed case at one misalignment beside the direction that comes nearest.

    Attributes
    ----------
    printed : str
        Name of the printed case.
    alpha : float
        Misalignment, rad.
    row : int
        Row of the nearest joint.
    case : str
        Its name, ``"Ang fork +z"``.
    distance : float
        Mean of ``| |Gamma| - printed |`` over the sixteen loads, percentage points; of ``| Gamma - printed |`` where
        signs were compared.
    ties : tuple of str
        Other directions that are no further away than `TIE` more.
    """

    printed: str
    alpha: float
    row: int
    case: str
    distance: float
    ties: tuple[str, ...] = ()


def printed() -> Printed:
    """Read Tables 4 to 7 as printed, from the table beside this file."""
    with Path(__file__).with_name("tables.csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(line for line in file if not line.startswith("#")))
    cases = tuple(dict.fromkeys(line["case"] for line in lines))
    degrees = sorted({float(line["alpha_deg"]) for line in lines})
    gamma = np.full((len(cases), len(degrees), len(BUSHINGS), 2), np.nan)
    tables = np.zeros((len(degrees), 2), np.int64)
    for line in lines:
        at, bushing = degrees.index(float(line["alpha_deg"])), BUSHINGS.index(line["bushing"])
        gamma[cases.index(line["case"]), at, bushing] = float(line["Gamma_F"]), float(line["Gamma_T"])
        tables[at, bushing // 4] = int(line["table"])
    return Printed(cases, np.radians(degrees), gamma, tables)


def directions(name: str, cases: tuple[str, ...]) -> list[int]:
    """Indices of the cases that are directions of the printed case `name`: ``"Pos fork"``, ``"Pos fork +t"``."""
    return [index for index, case in enumerate(cases) if case == name or case.startswith(f"{name} ")]


def covers(cases: tuple[str, ...], alpha: Array) -> bool:
    """Whether a study with these cases and misalignments (rad) can be laid beside the printed tables."""
    table = printed()
    has_alpha = all(np.any(np.abs(alpha - angle) < SAME_ALPHA) for angle in table.alpha)
    return has_alpha and all(directions(name, cases) for name in table.cases)


def misfit(value: Array, target: Array, signed: bool = False) -> Array:
    """Mean over the last two axes (bushing, load) of ``| |value| - target |``, percentage points.

    With `signed` of ``| value - target |``: what is printed without a sign is then an increase.
    """
    return np.asarray(np.abs((value if signed else np.abs(value)) - target).mean(axis=(-2, -1)))


def nearest(
    value: Array, case: NDArray[np.int32], alpha: Array, cases: tuple[str, ...], signed: bool = False
) -> list[Match]:
    """Direction nearest to each printed case at each misalignment.

    Parameters
    ----------
    value : ndarray, shape (m, 8, 2)
        Gamma of the rows of one joint (one variant), per cent.
    case : ndarray of int, shape (m,)
        Case of each row.
    alpha : ndarray, shape (m,)
        Misalignment of each row, rad.
    cases : tuple of str
        Names of the cases.
    signed : bool
        Compare Gamma with its sign, as eq. (14) has it; else its modulus.

    Returns
    -------
    list of Match
        By misalignment, then by printed case; ``row`` counts within `value`. Without a result, ``row`` is -1.
    """
    table, found = printed(), []
    for a, angle in enumerate(table.alpha):
        for c, name in enumerate(table.cases):
            rows = np.flatnonzero(np.isin(case, directions(name, cases)) & (np.abs(alpha - angle) < SAME_ALPHA))
            far = misfit(value[rows], table.gamma[c, a], signed)
            if np.isfinite(far).any():
                best = int(np.nanargmin(far))
                close = [k for k in np.flatnonzero(far <= far[best] + TIE) if k != best]
                ties = tuple(cases[case[rows[k]]] for k in close)
                direction = cases[case[rows[best]]]
                found.append(Match(name, float(angle), int(rows[best]), direction, float(far[best]), ties))
            else:
                found.append(Match(name, float(angle), -1, "", float("nan")))
    return found


def tabulated(value: Array, matches: list[Match]) -> Array:
    """Gamma of the matches in the shape of `Printed.gamma`, (4, 2, 8, 2), with its sign; per cent."""
    table = printed()
    out = np.full(table.gamma.shape, np.nan)
    for match in matches:
        if match.row >= 0:
            a = int(np.argmin(np.abs(table.alpha - match.alpha)))
            out[table.cases.index(match.printed), a] = value[match.row]
    return out
