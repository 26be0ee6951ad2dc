"""Views of campaigns with invented results, without a file."""

from copy import copy
from pathlib import Path

import numpy as np

from tests.support import synthetic
from tests.support.of_cardan import RESULT_COLUMNS
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Options
from tolstat.joint import Operation
from tolstat.store.reader import Reader
from tolstat.store.view import View
from tolstat.study.points import Point

OPERATION = Operation.model_construct(alpha=0.2618, speed=52.36, torque=100.0)
"""Operating point of all invented campaigns."""


class FakeStore(Reader):
    """What a view reads of a result file, in memory; slot 0 is the nominal joint. `results` may be tables by point."""

    def __init__(self, method, limits, errors, results, study_text="", columns=RESULT_COLUMNS, joint=None):
        self.path, self.study_name, self.study_text = Path("made_up.h5"), "made up", study_text
        self.sampling = {"method": method, "nominal_first": True, "n": len(errors) - 1}
        self.limits, self.columns, self.mechanism = limits, columns, CARDAN
        self.variants, self.case_names, self.joint, self.identity = (), (), joint, {}
        self.options, self.fidelity, self.stop = Options()._asdict(), {"reason": ""}, {}
        self._errors, self._results = errors, results if isinstance(results, dict) else {"": results}
        self.points = {name: Point(name, OPERATION, 1.0 / len(self._results)) for name in self._results}
        self.point = next(iter(self.points)) if len(self.points) == 1 else None
        self.n, self.rows = len(errors), range(len(errors))

    @property
    def operation(self):
        return self.points[self.point].operation

    def group(self, name, at_point=True):
        return None

    def at(self, point):
        found = copy(self)
        found.point = point
        return found

    def errors(self, rows=slice(None), fields=None):
        return self._errors[rows]

    def results(self, rows=slice(None), fields=None):
        return self._results[self.point][rows]


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
        errors["operation.alpha"] = alpha - OPERATION.alpha
    made = View(FakeStore(method, limits, errors, results, columns=columns, joint=joint))
    return made


def at_points(results, limits=None, method="random", joint=None, points=()):
    """View of the same joints at several operating points, from their tables of results by name of the point.

    `joint` holds the sections of a joint file; `points` take the place of those with equal operation and share.
    """
    n = len(next(iter(results.values())))
    store = FakeStore(method, limits or {}, synthetic.errors(n), results, joint=joint)
    store.points |= {point.name: point for point in points}
    return View(store)


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
    return made
