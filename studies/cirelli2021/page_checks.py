"""Printed values that the paper's own formulas or its other values contradict, and what each does to the results."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from studies.cirelli2021 import tables as paper
from studies.cirelli2021.page_main import revolutions
from studies.cirelli2021.page_source import PaperStudy
from tolstat.joint import material

E, NU, RHO = 210e9, 0.28, 7700.0
"""Steel: Table 1, and the density below eq. (7) with its unit mended; SI."""
PRINTED_RHO, PRINTED_KD, PRINTED_CD = 7.70e-6, 38.1, 3.71e8
PIN_L, PIN_A, PIN_J, PIN_MASS, XI = 36.41e-3, 11.34e-4, 1.02e-7, 0.32, 0.05
"""The pin below eq. (7): length, section, area moment, mass (SI), damping ratio."""
D_H, D_P = 76.2e-3, 76.0e-3
"""Diameters below eq. (3), m."""


class Misprint(NamedTuple):
    """A printed value beside what it should be.

    Attributes
    ----------
    what : str
        Quantity and where it is printed.
    printed, computed : str
        With units.
    remark : str
        What is wrong.
    effect : str
        What it does to the results of the study.
    """

    what: str
    printed: str
    computed: str
    remark: str
    effect: str


def misprints(study: PaperStudy) -> list[Misprint]:
    """Printed values that cannot be right, computed with the other printed values; effects are those of the study."""
    diameter = math.sqrt(4.0 * PIN_A / math.pi)
    k_d, c_e = material.diameter_factor(D_H, D_P), material.compliance_factor(E, NU)
    damping = [contact_damping(rho) for rho in (RHO, PRINTED_RHO)]
    gap = D_H - D_P
    percent = [2.0 * 1e3 * 0.01 * d for d in (diameter, D_P)]
    return [
        Misprint(
            "ρ, and with it c of the springs, below eq. (7)",
            f"{PRINTED_RHO:.2e} kg m³, {PRINTED_CD:.2e} N s/m",
            f"{damping[0]:.3g} N s/m with ρ = {RHO:g} kg/m³; {damping[1]:.3g} with {PRINTED_RHO:g} as printed",
            f"ρ is per mm³: c is too large by √10⁹ = {math.sqrt(1e9):.0f}",
            damping_effect(study),
        ),
        Misprint(
            "K_D, Table 1",
            f"{PRINTED_KD} (no unit)",
            f"{1e3 * k_d:.0f} mm",
            "half of D_H stands in its place",
            "none: Table 2 is printed and goes with the formula's K_D",
        ),
        Misprint("C_E, Table 1", "9·10⁻¹² 1/GPa", f"{c_e:.3g} 1/Pa", "the number is per Pa", "none"),
        Misprint(
            "D_H and D_P, below eq. (3)",
            f"{1e3 * D_H:g} and {1e3 * D_P:g} mm",
            f"{1e3 * diameter:.1f} mm from A = {1e4 * PIN_A:g} cm²",
            f"A and J are those of a {1e3 * diameter:.0f} mm pin: diameters are doubled",
            clearance_effect(study, 0.25 * gap, "half the clearance"),
        ),
        Misprint(
            "clearance, below eq. (4)",
            "2 % of the diameter",
            f"{1e3 * gap:.2g} mm, {100.0 * gap / D_H:.2f} %",
            f"2 % is {percent[0]:.2f} mm of the one pin, {percent[1]:.2f} mm of the other",
            clearance_effect(study, 0.5e-3 * percent[0], f"{percent[0]:.2f} mm"),
        ),
        Misprint(
            "J of the pin, below eq. (7)",
            "1.02·10⁻⁷ m⁻⁴",
            f"{math.pi * diameter**4 / 64.0:.3g} m⁴",
            "sign of the exponent",
            "none",
        ),
        Misprint(
            "where errors sit, section 4",
            "“cross bushing 2”, “output fork bushing 2”",
            "pin 1 and the hole that takes it",
            "Figure 10 and the rest of the text say so; in Table 6 bushing 4 moves with cross bushing 1",
            "none: runs follow Figure 10",
        ),
    ]


def omega(rho: float) -> float:
    """First circular frequency of the pin, eq. (6), with a density (kg/m^3); rad/s."""
    return (math.pi / PIN_L) ** 2 * math.sqrt(E * PIN_J / (rho * PIN_A))


def contact_damping(rho: float) -> float:
    """Damping of a contact, eqs. (6)-(7), of the printed pin with a density (kg/m^3); N s/m."""
    return material.contact_damping(XI, PIN_MASS, length=PIN_L, A=PIN_A, J=PIN_J, E=E, rho=rho)


def damping_effect(study: PaperStudy) -> str:
    """What c_d as printed does: revolutions to settle, and the largest change of a load."""
    rows, main = study.as_printed(), study.main
    turns, own = revolutions(study.results[rows]), revolutions(main.results)
    if not np.isfinite(turns).any():
        return "not run"
    changes = []
    for row in rows[np.isfinite(turns)]:
        same = np.abs(main.alpha - study.alpha[row]) < paper.SAME_ALPHA
        (twin,) = np.flatnonzero((main.case == study.case[row]) & same)
        pairs = [(study.results[name][row], main.results[name][twin]) for name in ("F_max", "T_max")]
        changes.append(max(float(np.abs(new / old - 1.0).max()) for new, old in pairs))
    lost = int(np.isinf(turns).sum())
    text = f"joints settle in up to {turns[np.isfinite(turns)].max():.1f} instead of {own.max():.1f} revolutions"
    text += f" ({lost} do not settle)" if lost else ""
    return f"{text}; largest loads change by up to {100.0 * max(changes):.1f} %"


def clearance_effect(study: PaperStudy, radial: float, words: str) -> str:
    """Largest changes of a load with another radial clearance (m), from the joint of the sweep that comes nearest."""
    hole = study.joint.contact.D_H
    found = [s for s in study.sweeps() if s.key == "contact.D_P"]
    if not found:
        return "not run"
    gaps = 0.5 * (hole - found[0].values)
    nearest = int(np.argmin(np.abs(gaps - radial)))
    parts = []
    for word in ("Pos", "Ang"):
        numbers = [i for i, name in enumerate(study.cases) if name.startswith(word)]
        before = _largest(study, 0, numbers)
        after = _largest(study, int(found[0].variants[nearest]), numbers)
        force, torque = (f"{old:.1f} → {new:.1f} %" for old, new in zip(before, after, strict=True))
        parts.append(f"{word} {force} of force, {torque} of torque")
    return f"{words} (radially {1e3 * gaps[nearest]:.2f} mm run): {'; '.join(parts)}"


def _largest(study: PaperStudy, variant: int, cases: list[int]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Largest |Gamma| of output side force and torque, (2,) per cent."""
    rows = (study.variant == variant) & np.isin(study.case, cases)
    return np.asarray(np.nanmax(np.abs(study.gamma[rows][:, paper.OUTPUT_SIDE]), axis=(0, 1)))
