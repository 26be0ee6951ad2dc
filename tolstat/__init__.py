"""tolstat: Monte Carlo tolerance analysis of Cardan joints.

    study = tolstat.load("studies/iso2768_f.toml")
    tolstat.run(study, "iso2768_f.h5")
    with tolstat.open("iso2768_f.h5") as store:
        frame = store.to_pandas()
        found = tolstat.causes_of(store, "cross1.F")

Functions on arrays (`exceedance`, `quantile`, `capability`) take the loads of joints and what became of them; those on
an open result file answer what the command line does. Names are imported when first used, so that the command line
starts at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolstat.analysis.capability import at as capability
    from tolstat.analysis.exceedance import at as exceedance
    from tolstat.analysis.quantile import at as quantile
    from tolstat.analysis.weighted import at as weighted_exceedance
    from tolstat.campaign.run import run
    from tolstat.campaign.trace import simulate_case
    from tolstat.common.errors import InputError, StoreError, TolstatError
    from tolstat.common.tables import Status
    from tolstat.joint import perturb
    from tolstat.questions.allocate.query import of_store as allocated
    from tolstat.questions.causes.angles import of_store as against_angle
    from tolstat.questions.causes.query import of_store as causes_of
    from tolstat.questions.causes.tail import worst as worst_joints
    from tolstat.questions.compare.query import of_stores as compared
    from tolstat.questions.fatigue.pylife import series as pylife_series
    from tolstat.questions.fatigue.query import read as load_cycles
    from tolstat.questions.fatigue.rendering import equivalent_loads
    from tolstat.questions.multifidelity.query import run as two_fidelities
    from tolstat.questions.rare.query import of_study as rare_event
    from tolstat.questions.reweight.query import of_store as reweighted
    from tolstat.questions.time_above.query import of_store as time_above
    from tolstat.report import write as write_report
    from tolstat.report.page import write as write_page
    from tolstat.report.summary import of_store as statistics
    from tolstat.sampling import draw
    from tolstat.solver.integrate import integrate
    from tolstat.solver.simulation import simulate_rows
    from tolstat.study import load, load_case

__version__ = "0.1.0"

__all__ = [
    "InputError",
    "Status",
    "StoreError",
    "TolstatError",
    "against_angle",
    "allocated",
    "capability",
    "causes_of",
    "compared",
    "draw",
    "equivalent_loads",
    "exceedance",
    "integrate",
    "load",
    "load_case",
    "load_cycles",
    "open",
    "perturb",
    "pylife_series",
    "quantile",
    "rare_event",
    "reweighted",
    "run",
    "simulate_case",
    "simulate_rows",
    "statistics",
    "time_above",
    "two_fidelities",
    "weighted_exceedance",
    "worst_joints",
    "write_page",
    "write_report",
]

_HOMES = {
    "InputError": "tolstat.common.errors:InputError",
    "Status": "tolstat.common.tables:Status",
    "StoreError": "tolstat.common.errors:StoreError",
    "TolstatError": "tolstat.common.errors:TolstatError",
    "against_angle": "tolstat.questions.causes.angles:of_store",
    "allocated": "tolstat.questions.allocate.query:of_store",
    "capability": "tolstat.analysis.capability:at",
    "causes_of": "tolstat.questions.causes.query:of_store",
    "compared": "tolstat.questions.compare.query:of_stores",
    "draw": "tolstat.sampling:draw",
    "equivalent_loads": "tolstat.questions.fatigue.rendering:equivalent_loads",
    "exceedance": "tolstat.analysis.exceedance:at",
    "integrate": "tolstat.solver.integrate:integrate",
    "load": "tolstat.study:load",
    "load_case": "tolstat.study:load_case",
    "load_cycles": "tolstat.questions.fatigue.query:read",
    "open": "tolstat.store:ResultStore.open",
    "perturb": "tolstat.joint:perturb",
    "pylife_series": "tolstat.questions.fatigue.pylife:series",
    "quantile": "tolstat.analysis.quantile:at",
    "rare_event": "tolstat.questions.rare.query:of_study",
    "reweighted": "tolstat.questions.reweight.query:of_store",
    "run": "tolstat.campaign.run:run",
    "simulate_case": "tolstat.campaign.trace:simulate_case",
    "simulate_rows": "tolstat.solver.simulation:simulate_rows",
    "statistics": "tolstat.report.summary:of_store",
    "time_above": "tolstat.questions.time_above.query:of_store",
    "two_fidelities": "tolstat.questions.multifidelity.query:run",
    "weighted_exceedance": "tolstat.analysis.weighted:at",
    "worst_joints": "tolstat.questions.causes.tail:worst",
    "write_page": "tolstat.report.page:write",
    "write_report": "tolstat.report:write",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'tolstat' has no attribute {name!r}")
    home, _, path = _HOMES[name].partition(":")
    value: Any = import_module(home)
    for part in path.split("."):
        value = getattr(value, part)
    return value
