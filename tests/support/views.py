"""Views of campaigns with invented results, without a file."""

import numpy as np

from tests.support import synthetic
from tolstat.common.columns import RESULT_COLUMNS
from tolstat.common.tables import Options
from tolstat.store.numbering import Numbering
from tolstat.store.view import View


class FakeStore(Numbering):
    """What a view reads of a result file, in memory; slot 0 is the nominal joint."""

    def __init__(self, method, limits, errors, results, study_text="", columns=RESULT_COLUMNS, joint=None):
        self.path, self.study_name, self.study_text = "made_up.h5", "made up", study_text
        self.sampling, self.limits, self.columns = {"method": method, "nominal_first": True}, limits, columns
        self.variants, self.joint, self.heaviest = (), joint, 1.0
        self.options = Options()._asdict()
        self.n, self.rows = len(results), range(len(results))
        self._errors, self._results = errors, results

    def errors(self, rows=slice(None), fields=None):
        return self._errors[rows]

    def results(self, rows=slice(None), fields=None):
        return self._results[rows]


def view(n=201, method="random", limits=None, columns=RESULT_COLUMNS, change=None, joint=None, alpha=None, **kwargs):
    """View of n - 1 joints and the nominal one; `change` alters the table of results before it is read.

    `joint` holds the sections of a joint file, `alpha` the misalignment of each joint, rad.
    """
    results = synthetic.results(n, **kwargs)
    if change is not None:
        change(results[1:])
    limits = {"cross1.F": 700.0} if limits is None else limits
    errors = synthetic.errors(n)
    if alpha is not None:
        errors["operation.alpha"] = alpha
    made = View(FakeStore(method, limits, errors, results, columns=columns, joint=joint))
    made.verification, made.altered = None, {}
    return made


def swept(second=1, limits=None, named=True, columns=RESULT_COLUMNS, change=None):
    """Grid of 11 pin diameters by `second` tilts."""
    n = 11 * second + 1
    errors = np.zeros(n, synthetic.errors(2).dtype)
    for k in (1, 2, 3, 4):
        errors[f"pin{k}.diameter"][1:] = np.tile(np.linspace(-1e-4, 1e-4, 11), second)
    errors["pin1.tilt_z"][1:] = np.repeat(np.radians(np.linspace(0.5, 1.0, second)), 11)
    results = synthetic.results(n)
    if change is not None:
        change(results[1:])
    keys = '[sweep]\n"pin*.diameter" = { from = "-0.1 mm" }\npin1.tilt_z = { from = "0.5 deg" }\n' if named else ""
    made = View(FakeStore("sweep", limits or {}, errors, results, keys, columns))
    made.verification, made.altered = None, {}
    return made
