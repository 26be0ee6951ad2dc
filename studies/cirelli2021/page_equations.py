"""Equations and Tables 1 to 3 of the paper: printed, with the joint of the study, and by formula."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from studies.cirelli2021 import page_checks as paper_checks
from studies.cirelli2021 import rccc, rccc_statics
from studies.cirelli2021 import tables as paper
from studies.cirelli2021.page_source import PaperStudy
from tolstat.joint import Joint, ideal, material
from tolstat.joint.derived import DERIVED

FIT_LOAD, H = 20e3, 6.9
"""Load range of the fit (N) and ratio of eq. (4) where a joint file gives none."""
MOBILITY_POSES = 24

TABLE_2 = {"k1u": 7.5e13, "k2u": 1.2e9, "k1p": 1.6e12, "k2p": 1.8e8}
"""As printed: quadratic coefficients N/m^2, linear ones N/m."""
TABLE_3 = {
    "k_x": (2.21e9, 2.14e9),
    "k_y": (2.21e9, 2.14e9),
    "k_z": (6.54e9, 6.82e9),
    "k_bx": (5.90e5, 2.32e5),
    "k_by": (5.90e5, 1.91e6),
    "k_tz": (4.44e5, 8.08e5),
}
"""As printed: cross and fork bushing, N/m and N m/rad."""


class Linkage(NamedTuple):
    """A joint beside its RCCC linkage, over a revolution.

    Attributes
    ----------
    printed, case : str
        Printed case and the direction nearest to it; ``"ideal"``.
    alpha : float
        Misalignment, rad.
    psi_rigid, psi_flexible : float
        Largest |Psi|.
    couple_rigid, couple_inertia, couple_flexible : float
        Largest couple about the cross's normal: quasi-static, with the output side's inertia, of the flexible joint;
        N m.
    """

    printed: str
    case: str
    alpha: float
    psi_rigid: float
    psi_flexible: float
    couple_rigid: float
    couple_inertia: float
    couple_flexible: float


class Row(NamedTuple):
    """A line of a table: its name with the unit, and its numbers."""

    name: str
    values: tuple[float, ...]


def elastic(joint: Joint) -> list[Row]:
    """Table 1: printed, and of the joint."""
    steel, of = joint.material, joint.contact
    k_d = 1e3 * material.diameter_factor(of.D_H, of.D_P) if of.D_H > of.D_P else float("inf")
    return [
        Row("E [GPa]", (210.0, 1e-9 * steel.E)),
        Row("G [GPa]", (79.0, 1e-9 * steel.G)),
        Row("ν", (0.28, steel.nu)),
        Row("K_D [mm]", (paper_checks.PRINTED_KD, k_d)),
        Row("C_E [1/Pa], printed as 1/GPa", (9e-12, material.compliance_factor(steel.E, steel.nu))),
    ]


def hertz(joint: Joint) -> tuple[float, float]:
    """Load range of the fit (N), and H of eq. (4)."""
    return joint.contact.fit_load or FIT_LOAD, joint.contact.H or H


def contact(joint: Joint) -> list[Row]:
    """Table 2: coefficients printed, of the joint, and fitted to eq. (3) with the joint's diameters."""
    of, steel = joint.contact, joint.material
    load, ratio = hertz(joint)
    fitted: tuple[float, ...] = (float("nan"),) * 4
    if of.D_H > of.D_P:
        fit = material.fit_contact(load, of.z, of.D_H, of.D_P, steel.E, steel.nu)
        fitted = (*fit, fit[0] / ratio**2, fit[1] / ratio)  # eq. (4)
    rows = zip(TABLE_2.items(), of.coefficients(), fitted, strict=True)
    return [Row(f"{name} [{'N/m²' if '1' in name else 'N/m'}]", (p, own, fit)) for (name, p), own, fit in rows]


def stiffness(joint: Joint) -> list[Row]:
    """Table 3: printed, of the joint, and by eqs. (9)-(11); of a cross bushing, then of a fork bushing."""
    axes = ("k_z", "k_x", "k_y", "k_tz", "k_bx", "k_by"), ("k_y", "k_x", "k_z", "k_by", "k_bx", "k_tz")
    used = [dict(zip(names, k, strict=True)) for names, k in zip(axes, (joint.k_cross, joint.k_fork), strict=True)]
    rules = [{name: DERIVED[f"bushing.{part}.{name}"] for name in TABLE_3} for part in ("cross", "fork")]
    rows = []
    for name, printed in TABLE_3.items():
        values: list[float] = []
        for side in (0, 1):
            values += [printed[side], float(used[side][name]), rules[side][name].value(joint)]
        rows.append(Row(f"{name} [{'N/m' if name[2] in 'xyz' else 'N m/rad'}]", tuple(values)))
    return rows


def bushings(joint: Joint) -> list[Row]:
    """Eqs. (8) and (12): diagonals of [K] and [C] along and about (e, t, z); cross, then fork; SI."""
    xi = joint.bushing.xi
    columns = []
    for k, body in ((joint.k_cross, joint.pin), (joint.k_fork, joint.arm)):
        columns += [k, material.bushing_damping(k, body.mass, np.array(body.inertia), xi)]
    names = [f"{word} {axis}" for word in ("along", "about") for axis in "etz"]
    return [Row(name, tuple(float(c[i]) for c in columns)) for i, name in enumerate(names)]


def ratios(study: PaperStudy) -> list[Row]:
    """Eqs. (2) and (13): misalignment (deg), cos alpha, range of tau by eq. (2) and of the ideal joint, its |Psi|."""
    rows = []
    for alpha in paper.printed().alpha:
        row = study.ideal(float(alpha))
        tau, exact = study.main.tau[row], ideal.speed_ratio(study.main.theta, float(alpha))
        psi = float(study.main.results["psi_max"][row])
        values = (exact.min(), exact.max(), tau.min(), tau.max(), psi)
        rows.append(Row(f"{np.degrees(alpha):.0f}°", tuple(float(x) for x in values)))
    return rows


def damping(study: PaperStudy) -> list[Row]:
    """Eqs. (6) and (7) with the printed pin: density (kg/m^3), omega (rad/s), c (N s/m); then c of the joint."""
    rows = []
    pairs = (("ρ in SI", paper_checks.RHO), ("ρ as printed", paper_checks.PRINTED_RHO))
    for name, rho in pairs:
        rows.append(Row(name, (rho, paper_checks.omega(rho), paper_checks.contact_damping(rho))))
    own = study.joint.contact.c_d
    rows.append(Row("printed", (float("nan"), float("nan"), paper_checks.PRINTED_CD)))
    rows.append(Row("this joint", (study.joint.material.rho, float("nan"), own)))
    return rows


def mobility(study: PaperStudy) -> list[tuple[str, str, int, int, str, str]]:
    """Eq. (1): pairs, errors, count, equations, ranks of the Jacobian over the revolution, degrees of freedom."""
    theta = np.arange(MOBILITY_POSES) * (2.0 * np.pi / MOBILITY_POSES) + 0.1
    rows = []
    match = [m for m in study.matches if m.printed.startswith("Ang")][-1]
    for pairs in ("RRRR", "RCCC"):
        for row, name in ((study.ideal(match.alpha), "ideal"), (match.row, match.case)):
            found = rccc_statics.mobility(
                rccc.solve(study.joint, study.main.operation, study.main.errors[row], theta).lines, pairs
            )
            rows.append((pairs, name, found.kutzbach, found.equations, _span(found.rank), _span(found.dof)))
    return rows


def linkage(study: PaperStudy) -> list[Linkage]:
    """Ideal joint and the direction nearest to each printed case beside the rigid linkage without clearance."""
    rows = []
    for alpha in paper.printed().alpha:
        own = [(m.printed, m.row) for m in study.matches if abs(m.alpha - alpha) < paper.SAME_ALPHA and m.row >= 0]
        for printed, row in (("ideal", study.ideal(float(alpha))), *own):
            rigid = rccc.solve(study.joint, study.main.operation, study.main.errors[row], study.main.theta)
            numbers: list[Any] = [np.abs(rigid.psi).max(), study.main.results["psi_max"][row], rigid.couple.max()]
            numbers += [np.abs(study.main.rigid_couple(row)).max(), np.abs(study.main.couple[row]).max()]
            name = study.cases[study.main.case[row]]
            rows.append(Linkage(printed, name, float(alpha), *(float(x) for x in numbers)))
    return rows


def _span(values: np.ndarray[tuple[int], np.dtype[np.int64]]) -> str:
    low, high = int(values.min()), int(values.max())
    return str(low) if low == high else f"{low} to {high}"
