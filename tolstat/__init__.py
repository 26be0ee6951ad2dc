"""tolstat: Monte Carlo tolerance analysis of over-constrained mechanisms, the Cardan joint first.

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

from typing import TYPE_CHECKING, Any

from tolstat.common import late
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
    from tolstat.store import open as open
    from tolstat.study import load as load
    from tolstat.study import load_case as load_case

__version__ = "0.1.0"

_HOMES = {
    "Status": "tolstat.common.tables",
    "draw": "tolstat.sampling",
    "function": "tolstat.campaign.function",
    "open": "tolstat.store",
    "perturb": "tolstat.joint",
    "run": "tolstat.campaign.run",
    "simulate_case": "tolstat.campaign.replay",
    "simulate_rows": "tolstat.solver.simulation",
    "write_page": "tolstat.report.page",
    **dict.fromkeys(("InputError", "StoreError", "TolstatError"), "tolstat.common.errors"),
    **dict.fromkeys(("draw_errors", "draw_joint", "draw_mechanism", "draw_row"), "tolstat.questions.drawings.answer"),
    **dict.fromkeys(("load", "load_case"), "tolstat.study"),
    **dict.fromkeys(("statistics", "write_report"), "tolstat.report.answer"),
    **PUBLIC,
}

__all__ = sorted(_HOMES)
_named = late.names(__name__, _HOMES)


def __getattr__(name: str) -> Any:
    return told(_named(name)) if name in PUBLIC else _named(name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
