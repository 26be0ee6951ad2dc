"""Compare tolstat with other integrators at the same error, on the same joints and in the same run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tolstat.benchmarks.work_precision import measure, setup, table
from tolstat.benchmarks.work_precision.competitors import Code, Competitor
from tolstat.benchmarks.work_precision.measure import OtherJob
from tolstat.benchmarks.work_precision.setup import Others, Own, Setup, Truth
from tolstat.common.tables import Options, Start

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.study import Study

ERROR = 1e-3
"""Error of the largest loads at which times are compared: of the worst joint, relative to its largest load."""
STEPS = (24, 36, 60, 90, 180, 360)
"""Steps a revolution of tolstat; the cheapest that meets `ERROR` counts."""
RTOL = (1e-2, 1e-3, 1e-4, 1e-5)
FROM_REST = "from rest"


@dataclass(frozen=True)
class Contender:
    """An integrator at the cheapest of its settings that meets the error.

    Attributes
    ----------
    name : str
        Name of the integrator.
    ours : bool
        Whether it is tolstat.
    setting : float or None
        Steps a revolution, or relative tolerance; None if no setting met the error.
    ms : float
        CPU time of the median joint, ms; if no setting met the error, that of the slowest setting, a lower bound.
    error : float or None
        Error of the worst joint; None if no setting met the error.
    ratio : float
        `ms` over that of tolstat in lanes at its cheapest setting.
    ratio_default : float
        `ms` over that of tolstat in lanes with the study's own settings.
    """

    name: str
    ours: bool
    setting: float | None
    ms: float
    error: float | None
    ratio: float
    ratio_default: float


@dataclass(frozen=True)
class Comparison:
    """Times of all contenders at one error.

    Attributes
    ----------
    joints : int
        Number of joints compared, those with a truth.
    error : float
        Required error.
    contenders : list of Contender
        Tolstat's first.
    """

    joints: int
    error: float
    contenders: list[Contender]


def compare(study: Study, joints: int, limit: float, say: Callable[[str], None]) -> Comparison:
    """Solve some joints by tolstat and by other integrators at several settings.

    Parameters
    ----------
    study : Study
        Study that the joints are drawn from.
    joints : int
        Number of random joints, beside the nominal one if the study has it.
    limit : float
        CPU time after which a run of another integrator is stopped, s.
    say : callable
        Called with progress messages.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        When no joint has largest loads that repeat.
    """
    options = study.solver.options()
    codes: tuple[Code, ...] = ("Radau", "CVODE") if find_spec("sksundae") else ("Radau",)
    asked = Setup(
        study=study.name,
        joints=joints,
        seed=4,
        repeats=5,
        tolstat=Own(
            fidelities=("dynamic", "quasistatic"),
            methods=("bdf2",),
            steps_per_rev=tuple(sorted({*STEPS, options.steps_per_rev})),
            block=64,
        ),
        others=Others(codes=codes, rtol=RTOL, revolutions=2, limit=limit),
        truth=Truth(rtol=(1e-7, 1e-6)),
    )
    params = setup.parameters(asked, study)
    more = list(_from_rest(asked, options, params[: setup.measured(asked, study)]))
    points, truth = table.build(measure.run(asked, study, params, say, more))
    return Comparison(len(truth), ERROR, contenders(points, options.steps_per_rev))


def _from_rest(asked: Setup, options: Options, params: NDArray[np.void]) -> Iterator[OtherJob]:
    """Jobs of Radau without tolstat's initial equilibrium: from rest, with a rising torque (`Start.RAMP`)."""
    ramp = options._replace(start=int(Start.RAMP))
    others = asked.others
    for jacobian in (False, True):
        radau = Competitor("Radau", jacobian)
        for i in range(len(params)):
            row = params[i : i + 1]
            yield OtherJob(f"{radau}, {FROM_REST}", radau, others.rtol, row, ramp, i, others.revolutions, others.limit)


def contenders(points: pd.DataFrame, steps_per_rev: int) -> list[Contender]:
    """Select the cheapest setting of each contender that meets the error.

    Parameters
    ----------
    points : DataFrame
        As `work_precision.table.build` makes it.
    steps_per_rev : int
        The study's own setting.

    Returns
    -------
    list of Contender
    """
    lanes = points["ours"] & points["contender"].str.contains("at once")
    good = points["loads_worst"] <= ERROR
    best = float(points.loc[lanes & good, "ms"].min())
    default = float(points.loc[lanes & (points["setting"] == steps_per_rev), "ms"].iloc[0])
    found = []
    for name, group in points.groupby("contender", sort=False):
        met = group[group["loads_worst"] <= ERROR]
        ours = bool(group["ours"].iloc[0])
        setting, error, ms = None, None, float(group["ms"].max())
        for row in met.nsmallest(1, "ms").to_dict("records"):
            setting, error, ms = float(row["setting"]), float(row["loads_worst"]), float(row["ms"])
        found.append(Contender(str(name), ours, setting, ms, error, ms / best, ms / default))
    return found
