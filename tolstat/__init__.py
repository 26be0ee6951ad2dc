"""tolstat: Monte Carlo tolerance analysis of Cardan joints.

    study = tolstat.load("studies/iso2768_f.toml")
    tolstat.run(study, "iso2768_f.h5")
    with tolstat.open("iso2768_f.h5") as store:
        frame = store.to_pandas()

Names are imported when first used, so that the command line starts at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolstat.analysis.exceedance import at as exceedance
    from tolstat.campaign import run
    from tolstat.errors import InputError, StoreError, TolstatError
    from tolstat.integration import integrate
    from tolstat.joint import perturb
    from tolstat.pylife import series as pylife_series
    from tolstat.report import write as report
    from tolstat.sampling import draw
    from tolstat.simulation import simulate_rows
    from tolstat.study import load, load_case
    from tolstat.tables import Status
    from tolstat.trace import simulate_case

__version__ = "0.1.0"

__all__ = [
    "InputError",
    "Status",
    "StoreError",
    "TolstatError",
    "draw",
    "exceedance",
    "integrate",
    "load",
    "load_case",
    "open",
    "perturb",
    "pylife_series",
    "report",
    "run",
    "simulate_case",
    "simulate_rows",
]

_HOMES = {
    "InputError": "tolstat.errors:InputError",
    "Status": "tolstat.tables:Status",
    "StoreError": "tolstat.errors:StoreError",
    "TolstatError": "tolstat.errors:TolstatError",
    "draw": "tolstat.sampling:draw",
    "exceedance": "tolstat.analysis.exceedance:at",
    "integrate": "tolstat.integration:integrate",
    "load": "tolstat.study:load",
    "load_case": "tolstat.study:load_case",
    "open": "tolstat.store:ResultStore.open",
    "perturb": "tolstat.joint:perturb",
    "pylife_series": "tolstat.pylife:series",
    "report": "tolstat.report:write",
    "run": "tolstat.campaign:run",
    "simulate_case": "tolstat.trace:simulate_case",
    "simulate_rows": "tolstat.simulation:simulate_rows",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'tolstat' has no attribute {name!r}")
    home, _, path = _HOMES[name].partition(":")
    value: Any = import_module(home)
    for part in path.split("."):
        value = getattr(value, part)
    return value
