"""A campaign that others are compared with."""

from __future__ import annotations

import pytest

from tests.campaign.test_campaign import datasets
from tests.support import fakes


@pytest.fixture(scope="session")
def expected(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Make the datasets of the fake study, run in one go."""
    path = tmp_path_factory.mktemp("reference") / "a.h5"
    fakes.run(fakes.Study(), path, 1)
    return datasets(path)
