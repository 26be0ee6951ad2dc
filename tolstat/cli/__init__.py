"""The command line: one file per command, shared parts in `_app`. `tolstat --help` lists commands in this order."""

from tolstat.cli import (
    allocate,
    bench,
    capability,
    causes,
    compare,
    export,
    extend,
    fatigue,
    merge,
    multifidelity,
    plan,
    rare,
    replay,
    report,
    reweight,
    run,
    simulate,
    status,
    time_above,
    verify,
    work_precision,
    worst,
)
from tolstat.cli._app import app, main

__all__ = ["app", "main"]

COMMANDS = (
    *(simulate.simulate, plan.plan, run.run, extend.extend, merge.merge, status.status, verify.verify),
    *(worst.worst, replay.replay, export.export, fatigue.fatigue, time_above.time_above, report.report),
    *(capability.capability, causes.causes, reweight.reweight, compare.compare, allocate.allocate),
    *(rare.rare, multifidelity.multifidelity),
    *(work_precision.work_precision, bench.bench),
)
for command in COMMANDS:
    app.command()(command)
