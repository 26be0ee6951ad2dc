"""Composition of the report page: the `Findings` of a campaign become sections of blocks."""

from __future__ import annotations

from tolstat.common.tables import FAILED, UNSETTLED, VALID
from tolstat.display.blocks import Page, Section
from tolstat.questions.causes import section as causes
from tolstat.report import basis, joints, loads, verdict
from tolstat.report.findings import Findings

__all__ = ["Findings", "Page", "compose"]


def compose(found: Findings) -> Page:
    """Compose the page from the findings, in reading order; sections without content are left out.

    Parameters
    ----------
    found : Findings
        Results of the evaluation of the campaign.

    Returns
    -------
    Page
    """
    campaign = found.campaign
    sections: list[Section] = [verdict.section(found)]
    valid = campaign.count(*VALID) > 0
    if campaign.method == "sweep":
        sections.append(basis.sweep_section(found))
    elif campaign.listed and valid:
        sections.append(loads.section(found))
    if found.sampled and found.alike and campaign.limits and valid:
        sections.append(loads.capability_section(found))
    if found.causes or found.angles:
        sections.append(causes.section(found.causes, found.angles, found.logarithmic))
    if found.worst:
        sections.append(joints.worst_section(found))
    if found.loading is not None:
        sections.append(basis.fatigue_section(found))
    if (found.modes == found.modes).any():
        sections.append(joints.modes_section(found))
    if campaign.verification is not None:
        sections.append(basis.accuracy_section(found, campaign.verification))
    if valid or campaign.count(*FAILED, *UNSETTLED):
        sections.append(joints.lost_section(found))
    sections.append(basis.provenance_section(found))
    return Page(campaign.name, f"{campaign.head()}.", sections)
