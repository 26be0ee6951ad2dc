"""tolstat: Monte Carlo tolerance analysis of Cardan joints.

    study = tolstat.load("studies/iso2768_f.toml")
    tolstat.run(study, "iso2768_f.h5")
    with tolstat.open("iso2768_f.h5") as store:
        force = store.loads["cross1.F"]
        frame = store.to_pandas()
        found = tolstat.causes(store.view(), "cross1.F")

Functions of a view of an open result file answer what the command line does. Names are imported when first used, so
that the command line starts at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tolstat.questions import PUBLIC, told

if TYPE_CHECKING:
    from tolstat.campaign.function import function as function
    from tolstat.campaign.replay import simulate_case as simulate_case
    from tolstat.campaign.run import run as run
    from tolstat.common.errors import InputError as InputError
    from tolstat.common.errors import StoreError as StoreError
    from tolstat.common.errors import TolstatError as TolstatError
    from tolstat.common.tables import Status as Status
    from tolstat.joint import perturb as perturb
    from tolstat.questions.drawings.answer import draw_errors as draw_errors
    from tolstat.questions.drawings.answer import draw_joint as draw_joint
    from tolstat.questions.drawings.answer import draw_mechanism as draw_mechanism
    from tolstat.questions.drawings.answer import draw_row as draw_row
    from tolstat.report.answer import statistics as statistics
    from tolstat.report.answer import write_report as write_report
    from tolstat.report.page import write_page as write_page
    from tolstat.sampling import draw as draw
    from tolstat.solver.simulation import simulate_rows as simulate_rows
    from tolstat.store import ResultFile
    from tolstat.study import load as load
    from tolstat.study import load_case as load_case

    open = ResultFile.open

__version__ = "0.1.0"

_HOMES = {
    "InputError": "tolstat.common.errors:InputError",
    "Status": "tolstat.common.tables:Status",
    "StoreError": "tolstat.common.errors:StoreError",
    "TolstatError": "tolstat.common.errors:TolstatError",
    "draw": "tolstat.sampling:draw",
    "draw_errors": "tolstat.questions.drawings.answer:draw_errors",
    "draw_joint": "tolstat.questions.drawings.answer:draw_joint",
    "draw_mechanism": "tolstat.questions.drawings.answer:draw_mechanism",
    "draw_row": "tolstat.questions.drawings.answer:draw_row",
    "function": "tolstat.campaign.function:function",
    "load": "tolstat.study:load",
    "load_case": "tolstat.study:load_case",
    "open": "tolstat.store:ResultFile.open",
    "perturb": "tolstat.joint:perturb",
    "run": "tolstat.campaign.run:run",
    "simulate_case": "tolstat.campaign.replay:simulate_case",
    "simulate_rows": "tolstat.solver.simulation:simulate_rows",
    "statistics": "tolstat.report.answer:statistics",
    "write_page": "tolstat.report.page:write_page",
    "write_report": "tolstat.report.answer:write_report",
} | {name: f"{module}:{name}" for name, module in PUBLIC.items()}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'tolstat' has no attribute {name!r}")
    home, _, path = _HOMES[name].partition(":")
    value: Any = import_module(home)
    for part in path.split("."):
        value = getattr(value, part)
    return told(value) if name in PUBLIC else value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
