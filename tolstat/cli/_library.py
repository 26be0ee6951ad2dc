"""Modules that do the work of commands, imported when first used: the help of a command needs none of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tolstat.common.late import Late

if TYPE_CHECKING:
    import numpy as np

    from tolstat import store as stores
    from tolstat import study as studies
    from tolstat.analysis import accuracy as numerical
    from tolstat.campaign import extend, function, plan, pool, remedy, run, stop_rule
    from tolstat.campaign import replay as replays
    from tolstat.campaign import verify as checks
    from tolstat.campaign import work as works
    from tolstat.common import counts, strict, tables, units
    from tolstat.common import loads as load_units
    from tolstat.display import answer as answers
    from tolstat.display import rewording, style, table, text
    from tolstat.joint import sections
    from tolstat.questions import accuracy, joints
    from tolstat.questions.drawings import answer as drawings
    from tolstat.questions.drawings import dimensions
    from tolstat.questions.exceedance import answer as exceedance
    from tolstat.questions.fatigue import loads as fatigue
    from tolstat.report import answer as reports
    from tolstat.report import evaluate as evaluating
    from tolstat.report import page, parts
    from tolstat.store import exchange, recorded, result_file, revolutions, verification, what_if
    from tolstat.study import assumptions, crosses, mounting, points, rewriting, starter
    from tolstat.study import schema as schemas
    from tolstat.study import spectrum as spectra
else:
    names = ("numpy", "tolstat.store", "tolstat.study", "tolstat.analysis.accuracy")
    np, stores, studies, numerical = map(Late, names)
    names = ("extend", "function", "plan", "pool", "remedy", "replay", "run", "stop_rule", "verify", "work")
    extend, function, plan, pool, remedy, replays, run, stop_rule, checks, works = (
        Late(f"tolstat.campaign.{name}") for name in names
    )
    names = ("counts", "loads", "strict", "tables", "units")
    counts, load_units, strict, tables, units = (Late(f"tolstat.common.{name}") for name in names)
    names = ("answer", "rewording", "style", "table", "text")
    answers, rewording, style, table, text = (Late(f"tolstat.display.{name}") for name in names)
    names = ("accuracy", "joints", "drawings.answer", "drawings.dimensions", "exceedance.answer", "fatigue.loads")
    accuracy, joints, drawings, dimensions, exceedance, fatigue = (Late(f"tolstat.questions.{name}") for name in names)
    names = ("report.answer", "report.evaluate", "report.page", "report.parts", "joint.sections")
    reports, evaluating, page, parts, sections = (Late(f"tolstat.{name}") for name in names)
    names = ("exchange", "recorded", "result_file", "revolutions", "verification", "what_if")
    exchange, recorded, result_file, revolutions, verification, what_if = (
        Late(f"tolstat.store.{name}") for name in names
    )
    names = ("assumptions", "crosses", "mounting", "points", "rewriting", "schema", "spectrum", "starter")
    assumptions, crosses, mounting, points, rewriting, schemas, spectra, starter = (
        Late(f"tolstat.study.{name}") for name in names
    )
