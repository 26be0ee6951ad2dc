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
    from tolstat.allocate import of_store as allocated
    from tolstat.analysis.capability import at as capability
    from tolstat.analysis.exceedance import at as exceedance
    from tolstat.analysis.quantile import at as quantile
    from tolstat.analysis.weighted import at as weighted_exceedance
    from tolstat.angles import of_store as against_angle
    from tolstat.campaign import run
    from tolstat.causes import of_store as causes_of
    from tolstat.compare import of_stores as compared
    from tolstat.duration import of_store as time_above
    from tolstat.errors import InputError, StoreError, TolstatError
    from tolstat.fatigue import read as load_cycles
    from tolstat.integration import integrate
    from tolstat.joint import perturb
    from tolstat.multifidelity import run as two_fidelities
    from tolstat.page import write as write_page
    from tolstat.pylife import series as pylife_series
    from tolstat.rare import of_study as rare_event
    from tolstat.report import write as write_report
    from tolstat.report.fatigue import equivalent_loads
    from tolstat.reweight import of_store as reweighted
    from tolstat.sampling import draw
    from tolstat.simulation import simulate_rows
    from tolstat.study import load, load_case
    from tolstat.summary import of_store as statistics
    from tolstat.tables import Status
    from tolstat.tail import worst as worst_joints
    from tolstat.trace import simulate_case

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
    "InputError": "tolstat.errors:InputError",
    "Status": "tolstat.tables:Status",
    "StoreError": "tolstat.errors:StoreError",
    "TolstatError": "tolstat.errors:TolstatError",
    "against_angle": "tolstat.angles:of_store",
    "allocated": "tolstat.allocate:of_store",
    "capability": "tolstat.analysis.capability:at",
    "causes_of": "tolstat.causes:of_store",
    "compared": "tolstat.compare:of_stores",
    "draw": "tolstat.sampling:draw",
    "equivalent_loads": "tolstat.report.fatigue:equivalent_loads",
    "exceedance": "tolstat.analysis.exceedance:at",
    "integrate": "tolstat.integration:integrate",
    "load": "tolstat.study:load",
    "load_case": "tolstat.study:load_case",
    "load_cycles": "tolstat.fatigue:read",
    "open": "tolstat.store:ResultStore.open",
    "perturb": "tolstat.joint:perturb",
    "pylife_series": "tolstat.pylife:series",
    "quantile": "tolstat.analysis.quantile:at",
    "rare_event": "tolstat.rare:of_study",
    "reweighted": "tolstat.reweight:of_store",
    "run": "tolstat.campaign:run",
    "simulate_case": "tolstat.trace:simulate_case",
    "simulate_rows": "tolstat.simulation:simulate_rows",
    "statistics": "tolstat.summary:of_store",
    "time_above": "tolstat.duration:of_store",
    "two_fidelities": "tolstat.multifidelity:run",
    "weighted_exceedance": "tolstat.analysis.weighted:at",
    "worst_joints": "tolstat.tail:worst",
    "write_page": "tolstat.page:write",
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
