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

from inspect import isroutine
from typing import TYPE_CHECKING, Any

from tolstat.common import late
from tolstat.common.arguments import checked
from tolstat.questions import PUBLIC, told

if TYPE_CHECKING:
    from tolstat.campaign.extend import merge as merge
    from tolstat.campaign.function import function as function
    from tolstat.campaign.plan import plan as plan
    from tolstat.campaign.replay import histories as histories
    from tolstat.campaign.replay import replay as replay
    from tolstat.campaign.replay import simulate_case as simulate_case
    from tolstat.campaign.run import extend as extend
    from tolstat.campaign.run import run as run
    from tolstat.common.errors import InputError as InputError
    from tolstat.common.errors import StoreError as StoreError
    from tolstat.common.errors import TolstatError as TolstatError
    from tolstat.common.tables import Status as Status
    from tolstat.joint import perturb as perturb
    from tolstat.questions.accuracy import accuracy as accuracy
    from tolstat.questions.allocate import allocate as allocate
    from tolstat.questions.assumptions.answer import assumptions as assumptions
    from tolstat.questions.bearing_life.answer import bearing_life as bearing_life
    from tolstat.questions.capability import capability as capability
    from tolstat.questions.causes.errors import causes as causes
    from tolstat.questions.causes.lines import lines as lines
    from tolstat.questions.causes.worst import worst as worst
    from tolstat.questions.change import change as change
    from tolstat.questions.compare import compare as compare
    from tolstat.questions.drawings.answer import draw_errors as draw_errors
    from tolstat.questions.drawings.answer import draw_joint as draw_joint
    from tolstat.questions.drawings.answer import draw_mechanism as draw_mechanism
    from tolstat.questions.drawings.answer import draw_row as draw_row
    from tolstat.questions.drawings.answer import drawings as drawings
    from tolstat.questions.exceedance.answer import exceedance as exceedance
    from tolstat.questions.exceedance.answer import limits as limits
    from tolstat.questions.exceedance.answer import quantiles as quantiles
    from tolstat.questions.fatigue.answer import fatigue as fatigue
    from tolstat.questions.fatigue.by_joint import fatigue_by_joint as fatigue_by_joint
    from tolstat.questions.heat import heat as heat
    from tolstat.questions.histograms import histograms as histograms
    from tolstat.questions.joints import failed as failed
    from tolstat.questions.joints import modes as modes
    from tolstat.questions.joints import tolerances as tolerances
    from tolstat.questions.orders import orders as orders
    from tolstat.questions.rare import rare as rare
    from tolstat.questions.sweep import cases as cases
    from tolstat.questions.sweep import sweep as sweep
    from tolstat.report.answer import statistics as statistics
    from tolstat.report.answer import write_report as write_report
    from tolstat.report.evaluate import evaluate as evaluate
    from tolstat.report.page import write_page as write_page
    from tolstat.sampling import draw as draw
    from tolstat.solver.simulation import simulate_rows as simulate_rows
    from tolstat.store import open as open
    from tolstat.store.exchange import write_table as write_table
    from tolstat.study import load as load
    from tolstat.study import load_case as load_case
    from tolstat.study.spectrum import spectrum as spectrum

__version__ = "0.1.0"

_HOMES = {
    "Status": "tolstat.common.tables",
    "draw": "tolstat.sampling",
    "evaluate": "tolstat.report.evaluate",
    "fatigue_by_joint": "tolstat.questions.fatigue.by_joint",
    "function": "tolstat.campaign.function",
    "merge": "tolstat.campaign.extend",
    "open": "tolstat.store",
    "perturb": "tolstat.joint",
    "plan": "tolstat.campaign.plan",
    "simulate_rows": "tolstat.solver.simulation",
    "spectrum": "tolstat.study.spectrum",
    "write_page": "tolstat.report.page",
    "write_table": "tolstat.store.exchange",
    **dict.fromkeys(("InputError", "StoreError", "TolstatError"), "tolstat.common.errors"),
    **dict.fromkeys(("draw_errors", "draw_joint", "draw_mechanism", "draw_row"), "tolstat.questions.drawings.answer"),
    **dict.fromkeys(("extend", "run"), "tolstat.campaign.run"),
    **dict.fromkeys(("histories", "replay", "simulate_case"), "tolstat.campaign.replay"),
    **dict.fromkeys(("load", "load_case"), "tolstat.study"),
    **dict.fromkeys(("statistics", "write_report"), "tolstat.report.answer"),
    **PUBLIC,
}

__all__ = sorted(_HOMES)
_named = late.names(__name__, _HOMES)


def __getattr__(name: str) -> Any:
    named = told(_named(name)) if name in PUBLIC else _named(name)
    return checked(named) if isroutine(named) else named


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
