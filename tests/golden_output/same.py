"""The test that every module of golden files has: its campaigns are the module's ``CAMPAIGNS``."""

from __future__ import annotations

import pytest

from tests.golden_output.catalogue import Campaign
from tests.golden_output.conftest import Check


@pytest.mark.slow
def test_output_is_that_of_the_golden_file(campaign: Campaign, name: str, check: Check) -> None:
    difference = check(campaign, name)
    assert not difference, difference
