"""What commands say that lead to decisions."""

from __future__ import annotations

import pytest

from tests.golden_output import catalogue_decisions as catalogue
from tests.golden_output.catalogue import Campaign, cases
from tests.golden_output.conftest import Check

CAMPAIGNS = (catalogue.DECIDED, catalogue.RARE, catalogue.WHAT_IF, catalogue.CHANGE)


@pytest.mark.slow
@pytest.mark.parametrize(("campaign", "name"), cases(*CAMPAIGNS))
def test_output_is_that_of_the_golden_file(campaign: Campaign, name: str, check: Check) -> None:
    difference = check(campaign, name)
    assert not difference, difference
