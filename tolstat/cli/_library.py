"""Modules that do the work of commands, imported when first used: the help of a command needs none of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tolstat.common.late import Late

if TYPE_CHECKING:
    import numpy as np

    from tolstat import store as stores
    from tolstat import study as studies
    from tolstat.analysis import accuracy as numerical
    from tolstat.analysis import design as designs
    from tolstat.campaign import extend as growth
    from tolstat.campaign import function as functions
    from tolstat.campaign import plan as plans
    from tolstat.campaign import pool as pool
    from tolstat.campaign import remedy as remedies
    from tolstat.campaign import replay as replays
    from tolstat.campaign import run as campaigns
    from tolstat.campaign import stop_rule as stop_rule
    from tolstat.campaign import verify as checks
    from tolstat.campaign import work as works
    from tolstat.common import draw_records as draw_records
    from tolstat.common import loads as load_units
    from tolstat.common import strict as strict
    from tolstat.common import tables as records
    from tolstat.common import units as units
    from tolstat.display import answer as answers
    from tolstat.display import style as style
    from tolstat.display import table as tables
    from tolstat.display import text as texts
    from tolstat.joint import sections as sections
    from tolstat.questions import accuracy as accuracy
    from tolstat.questions import joints as joints
    from tolstat.questions.causes import errors as causes
    from tolstat.questions.drawings import answer as drawings
    from tolstat.questions.drawings import views as views
    from tolstat.questions.fatigue import pylife as pylife
    from tolstat.report import answer as reports
    from tolstat.report import page as pages
    from tolstat.report import workbook as workbook
    from tolstat.solver import compilation as compilation
    from tolstat.store import recorded as recorded
    from tolstat.store import result_file as result_files
    from tolstat.store import revolutions as revolutions
    from tolstat.store import verification as verification
    from tolstat.store import what_if as what_if
    from tolstat.study import assumptions as assumptions
    from tolstat.study import mounting as mounting
    from tolstat.study import points as points
    from tolstat.study import rewriting as rewriting
    from tolstat.study import schema as schemas
    from tolstat.study import spectrum as spectra
    from tolstat.study import starter as starter
else:
    np = Late("numpy")
    stores, studies = (Late(f"tolstat.{name}") for name in ("store", "study"))
    designs, numerical = (Late(f"tolstat.analysis.{name}") for name in ("design", "accuracy"))
    growth, functions, plans, pool, remedies, replays, campaigns, stop_rule, checks, works = (
        Late(f"tolstat.campaign.{name}")
        for name in ("extend", "function", "plan", "pool", "remedy", "replay", "run", "stop_rule", "verify", "work")
    )
    draw_records, load_units, strict, records, units = (
        Late(f"tolstat.common.{name}") for name in ("draw_records", "loads", "strict", "tables", "units")
    )
    answers, style, tables, texts = (Late(f"tolstat.display.{name}") for name in ("answer", "style", "table", "text"))
    sections = Late("tolstat.joint.sections")
    accuracy, joints = (Late(f"tolstat.questions.{name}") for name in ("accuracy", "joints"))
    causes = Late("tolstat.questions.causes.errors")
    drawings, views = (Late(f"tolstat.questions.drawings.{name}") for name in ("answer", "views"))
    pylife = Late("tolstat.questions.fatigue.pylife")
    reports, pages, workbook = (Late(f"tolstat.report.{name}") for name in ("answer", "page", "workbook"))
    compilation = Late("tolstat.solver.compilation")
    recorded, result_files, revolutions, verification, what_if = (
        Late(f"tolstat.store.{name}") for name in ("recorded", "result_file", "revolutions", "verification", "what_if")
    )
    assumptions, mounting, points, rewriting, schemas, spectra, starter = (
        Late(f"tolstat.study.{name}")
        for name in ("assumptions", "mounting", "points", "rewriting", "schema", "spectrum", "starter")
    )
