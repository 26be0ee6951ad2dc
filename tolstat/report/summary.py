"""All statistics of a campaign as JSON values, for other programs: the numbers of the report."""

from __future__ import annotations

from typing import Any

from tolstat.common.errors import Fault, StoreError
from tolstat.common.loads import LOAD_FIELDS
from tolstat.common.tables import Status
from tolstat.display import text
from tolstat.questions.capability import rendering as capability
from tolstat.questions.exceedance import rendering as exceedance
from tolstat.questions.exceedance.accuracy import usual
from tolstat.solver.fidelity import sentence
from tolstat.store import ResultStore, view


def of_store(store: ResultStore, confidence: float = 0.95) -> dict[str, Any]:
    """Collect the statistics of a campaign.

    Parameters
    ----------
    store : ResultStore
        File of a study whose joints are drawn from tolerances.
    confidence : float
        Confidence level of all intervals.

    Returns
    -------
    dict
        JSON values in SI units, null if unknown: ``study``, ``method``, ``confidence``; ``joints``, numbers by status;
        ``limits`` (share above each, as `exceedance.rendering.limits`), ``quantiles`` of every load kept,
        ``capability`` (as `capability.rendering.limits`; empty for weighted joints); ``numerical_error`` by kind of
        load; ``fidelity``, a sentence on the fidelity of the results; ``provenance``.

    Raises
    ------
    StoreError
        When the file holds listed joints or a sweep.

    Examples
    --------
    >>> with tolstat.open(path) as store:
    ...     found = tolstat.statistics(store)
    >>> found["joints"], round(found["limits"][0]["estimate"], 2)
    ({'ok': 12000}, 0.15)
    """
    if store.sampling["method"] in ("cases", "sweep"):
        remedy = "its joints are in: tolstat export --csv"
        raise StoreError(str(Fault(str(store.path), "holds no sample of a production, and has no statistics", remedy)))
    campaign = view.read(store, LOAD_FIELDS, (), weighted=True)
    states = campaign.results["status"]
    judged = bool(campaign.limits)
    counted = judged and campaign.weights is None
    return {
        "study": store.study_name,
        "method": campaign.method,
        "confidence": confidence,
        "joints": {s.label: int((states == s).sum()) for s in Status if (states == s).any()},
        "limits": text.records(exceedance.limits(campaign, confidence)) if judged else [],
        "quantiles": text.records(exceedance.quantiles(campaign, confidence)) if campaign.listed else [],
        "capability": text.records(capability.limits(campaign, confidence)) if counted else [],
        "numerical_error": usual(campaign.verification) if campaign.verification else {},
        "fidelity": sentence(store.options, store.fidelity),
        "provenance": {
            "created": store.created,
            "git_commit": store.git_commit,
            "versions": store.versions,
            "sampling": store.sampling,
            "stop": store.stop,
        },
    }
