"""All statistics of a campaign as JSON values, for other programs: the numbers of the report."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from tolstat import questions
from tolstat.common.errors import Fault, StoreError
from tolstat.common.tables import Status
from tolstat.joint.sections import mounting_and_law
from tolstat.report.headline import headline
from tolstat.report.life import life_verdicts
from tolstat.solver.fidelity import sentence
from tolstat.store import recorded

if TYPE_CHECKING:
    from tolstat.store.view import View


def statistics(view: View, accepted: float = math.nan) -> dict[str, Any]:
    """Collect the statistics of a campaign.

    Parameters
    ----------
    view : View
        Campaign of a study whose joints are drawn from tolerances.
    accepted : float
        Accepted share: share of the joints that may be above each limit; NaN if none is given.

    Returns
    -------
    dict
        JSON values in SI units, null if unknown: ``study``, ``method``, ``confidence``; ``verdict``, with ``answer``
        of the joints as drawn (null without an accepted share), ``stands_on``, ``sentence`` and ``notes``, null without
        limits; ``joints``, numbers by status; ``lives``, verdicts on required lives, only where the study requires one
        that is known without simulation; the answers ``exceedance``, ``lots``, ``bearing_life``, ``capability`` and
        ``accuracy``, each with
        ``facts``, ``sentences`` and ``tables``, null where the file cannot give it;
        ``joint``, mounting of the shafts and contact law in words; ``fidelity``, a sentence on the fidelity of the
        results; ``provenance``.

    Raises
    ------
    StoreError
        When the file holds listed joints or a sweep.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.statistics(store.view())
    >>> found["joints"], round(found["exceedance"]["tables"]["limits"]["rows"][0]["estimate"], 2)
    ({'ok': 12000}, 0.15)
    """
    store = view.store
    if view.method in ("cases", "sweep"):
        remedy = "its joints are in: tolstat export --csv"
        raise StoreError(str(Fault(str(store.path), "holds no sample of a production, and has no statistics", remedy)))
    verdict = headline(view, accepted)
    head = {
        "study": view.name,
        "method": view.method,
        "confidence": 0.95,
        "verdict": None if verdict is None else verdict.values(),
        "joints": {status.label: count for status in Status if (count := view.count(status))},
    }
    if lives := life_verdicts(view, accepted, samples=0):
        head["lives"] = [own.values() for own in lives]
    provenance = {
        "created": store.created,
        "git_commit": store.git_commit,
        "versions": store.versions,
        "sampling": store.sampling,
        "stop": store.stop,
    }
    found = questions.statistics(view)
    stands_on = {
        "joint": mounting_and_law(*recorded.mountings(store)),
        "fidelity": sentence(store.options, store.fidelity),
    }
    return head | found | stands_on | {"provenance": provenance}
