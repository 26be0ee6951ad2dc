"""Equations and tables of the paper that need no simulation: mobility, stiffness, contact, printed constants."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat import rccc
from tolstat.analysis import paper
from tolstat.joint import Joint, material
from tolstat.report.paper_source import PaperStudy

PRINTED_RHO = 7.70e-6
"""Density as printed beside eq. (7)."""
PRINTED_KD, PRINTED_CD = 38.1, 3.71e8
FIT_LOAD, H, XI = 20e3, 6.9, 0.05
"""Load range of the fit (N), ratio of eq. (4) and damping ratio of eq. (7) where a joint file gives none."""
MOBILITY_POSES = 24


class Check(NamedTuple):
    """A printed value beside what its formula gives.

    Attributes
    ----------
    what : str
        Quantity and where it is printed.
    printed, computed : str
        With units.
    remark : str
        What is wrong, or that it agrees.
    """

    what: str
    printed: str
    computed: str
    remark: str


class Linkage(NamedTuple):
    """A joint beside its RCCC linkage, over a revolution.

    Attributes
    ----------
    case : str
        Errors.
    alpha : float
        Misalignment, rad.
    psi_rigid, psi_flexible : float
        Largest |Psi|.
    couple_rigid, couple_flexible : float
        Largest couple about the cross's normal, N m.
    """

    case: str
    alpha: float
    psi_rigid: float
    psi_flexible: float
    couple_rigid: float
    couple_flexible: float


def misprints(joint: Joint) -> list[Check]:
    """Printed values that their own formulas or the other values contradict, computed with the joint's numbers."""
    steel, pin, contact = joint.material, joint.pin, joint.contact
    diameter = math.sqrt(4.0 * pin.A / math.pi)
    k_d, c_e = material.diameter_factor(contact.D_H, contact.D_P), material.compliance_factor(steel.E, steel.nu)
    mass = pin.mass or steel.rho * pin.A * pin.l
    damping = [
        material.contact_damping(contact.xi or XI, mass, length=pin.l, A=pin.A, J=pin.J, E=steel.E, rho=rho)
        for rho in (steel.rho, PRINTED_RHO)
    ]
    gap = contact.D_H - contact.D_P
    share = 100.0 * gap / contact.D_H
    return [
        Check(
            "c of the springs, below eq. (7)",
            f"{PRINTED_CD:.2e} N s/m",
            f"{damping[0]:.3g} N s/m with ρ = {steel.rho:g} kg/m³; {damping[1]:.3g} with {PRINTED_RHO:g} as printed",
            f"ρ is per mm³: too large by √10⁹ = {math.sqrt(1e9):.0f}",
        ),
        Check("K_D, Table 1", f"{PRINTED_KD} (no unit)", f"{1e3 * k_d:.0f} mm", "half of D_H stands in its place"),
        Check("C_E, Table 1", "9·10⁻¹² 1/GPa", f"{c_e:.3g} 1/Pa", "the number is per Pa"),
        Check(
            "pin diameter, below eq. (3)",
            f"{1e3 * contact.D_P:g} mm",
            f"{1e3 * diameter:.1f} mm from A = {1e4 * pin.A:g} cm²",
            f"A and J are those of a {1e3 * diameter:.0f} mm pin: diameters are doubled",
        ),
        Check(
            "clearance, below eq. (4)",
            "2 % of the diameter",
            f"{1e3 * gap:.2g} mm, {share:.2f} %",
            f"2 % is {20.0 * diameter:.2f} mm of the one pin, {20.0 * contact.D_P:.2f} mm of the other",
        ),
        Check(
            "J of the pin, below eq. (7)",
            "1.02·10⁻⁷ m⁻⁴",
            f"{math.pi * diameter**4 / 64.0:.3g} m⁴",
            "sign of the exponent",
        ),
    ]


def stiffness(joint: Joint) -> list[tuple[str, float, float, float, float]]:
    """Table 3: name; printed and computed stiffness of a cross bushing, then of a fork bushing (N/m, N m/rad)."""
    given = (joint.bushing.cross, joint.bushing.fork)
    beams = (joint.pin.beam(joint.material), joint.arm.beam(joint.material))
    rows = []
    for name in ("k_x", "k_y", "k_z", "k_bx", "k_by", "k_tz"):
        values = []
        for table, beam in zip(given, beams, strict=True):
            values += [float("nan") if table is None else float(getattr(table, name)), float(getattr(beam, name))]
        rows.append((name, *values))
    return [(str(r[0]), float(r[1]), float(r[2]), float(r[3]), float(r[4])) for r in rows]


def hertz(joint: Joint) -> tuple[float, float]:
    """Load range of the fit (N), and H of eq. (4)."""
    return joint.contact.fit_load or FIT_LOAD, joint.contact.H or H


def contact(joint: Joint) -> list[tuple[str, float, float]]:
    """Table 2: name; coefficient of the joint file and fitted to eq. (3) (N/m^2, N/m)."""
    of, steel = joint.contact, joint.material
    load, ratio = hertz(joint)
    fit = material.fit_contact(load, of.z, of.D_H, of.D_P, steel.E, steel.nu)
    fitted = (*fit, *material.point_coefficients(*fit, ratio))
    return list(zip(("k1u", "k2u", "k1p", "k2p"), of.stiffness(steel), fitted, strict=True))


def mobility(study: PaperStudy) -> list[tuple[str, str, int, int, str, str]]:
    """Eq. (1): pairs, errors, count, equations, ranks of the Jacobian over the revolution, degrees of freedom."""
    theta = np.arange(MOBILITY_POSES) * (2.0 * np.pi / MOBILITY_POSES) + 0.1
    rows = []
    bent = float(study.main.alpha.max())
    match = next(m for m in study.matches if m.printed.startswith("Ang") and m.alpha == bent)
    for pairs in ("RRRR", "RCCC"):
        for row, name in ((study.ideal(bent), "ideal"), (match.row, match.case)):
            found = rccc.mobility(rccc.solve(study.joint, study.main.errors[row], theta).lines, pairs)
            rows.append((pairs, name, found.kutzbach, found.equations, _span(found.rank), _span(found.dof)))
    return rows


def linkage(study: PaperStudy) -> list[Linkage]:
    """Ideal joint and nearest directions beside the rigid linkage without clearance."""
    rows = []
    for alpha in paper.printed().alpha:
        own = [m.row for m in study.matches if abs(m.alpha - alpha) < paper.SAME_ALPHA and m.row >= 0]
        for row in (study.ideal(float(alpha)), *own):
            rigid = rccc.solve(study.joint, study.main.errors[row], study.main.theta)
            rows.append(
                Linkage(
                    study.cases[study.main.case[row]],
                    float(alpha),
                    float(np.abs(rigid.psi).max()),
                    float(study.main.results["psi_max"][row]),
                    float(rigid.couple.max()),
                    float(np.abs(study.main.couple[row]).max()),
                )
            )
    return rows


def _span(values: np.ndarray[tuple[int], np.dtype[np.int64]]) -> str:
    low, high = int(values.min()), int(values.max())
    return str(low) if low == high else f"{low} to {high}"
