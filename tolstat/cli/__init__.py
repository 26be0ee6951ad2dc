"""The command line: a file a command; what commands share is in `_app`. Help lists them in the order given here."""

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
    worst,
)
from tolstat.cli._app import app, main

__all__ = ["app", "main"]

COMMANDS = (
    *(simulate.simulate, plan.plan, run.run, extend.extend, merge.merge, status.status, verify.verify),
    *(worst.worst, replay.replay, export.export, fatigue.fatigue, time_above.time_above, report.report),
    *(capability.capability, causes.causes, reweight.reweight, compare.compare, allocate.allocate),
    *(rare.rare, multifidelity.multifidelity),
)
for command in COMMANDS:
    app.command()(command)
for words, instrument in bench.INSTRUMENTS.items():
    app.command(words, epilog=bench.SEE_ALSO)(instrument)
