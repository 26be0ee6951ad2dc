"""Commands beside those of an older checkout: each runs, and a checkout beside itself has ratios about 1."""

import pytest

from tests.measure import start
from tests.support.systems import needs_posix


@needs_posix
@pytest.mark.slow  # compiles the kernels twice
def test_a_checkout_beside_itself(capsys):
    start.main([str(start.HERE), "--rounds", "1", "--compilations", "1"])
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split()[-1] == "ratio"
    assert len(rows) == len(start.COMMANDS)
    assert all(0.3 < float(row.split()[-1]) < 3.0 for row in rows)
