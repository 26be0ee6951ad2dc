"""The question of exceedance as it stands on the page: tolerance limits."""

import numpy as np
import pytest

from tests.support import synthetic
from tests.support.cells import body, head
from tolstat.display.table import Table
from tolstat.questions.exceedance.answer import quantiles
from tolstat.store import ResultFile


def tolerance_limit(folder, joints):
    """Tolerance limit of cross1.F on the page, as printed, and the loads of the joints, N, ascending."""
    path = synthetic.store(folder, synthetic.STUDY.replace("n = 60", f"n = {joints}"))
    with ResultFile.open(path) as store:
        view = store.view()
        blocks = quantiles(view).blocks()
        loads = np.sort(view.load("cross1.F").values)
    (table,) = [block for block in blocks if isinstance(block, Table) and "tolerance limits (Wilks)" in block.title]
    (row,) = [row for row in body(table) if row[0] == "cross1.F"]
    return row[head(table).index("tolerance limit 99 % / 95 %")], loads


@pytest.mark.parametrize(("joints", "from_above"), [(299, 1), (472, 1), (473, 2), (1000, 5)])
def test_tolerance_limit_is_the_joint_that_wilks_names(tmp_path, joints, from_above):
    """Of 99 % of the joints with 95 % confidence: the largest of 299 joints, the second largest of 473."""
    printed, loads = tolerance_limit(tmp_path, joints)
    distance = np.abs(loads - float(printed.partition(" ")[0]))
    assert np.argmin(distance) == joints - from_above
    assert distance.min() < 1e-3 * loads[-1]


def test_fewer_joints_than_wilks_number_have_no_tolerance_limit(tmp_path):
    assert tolerance_limit(tmp_path, 298)[0] == "needs more joints"
