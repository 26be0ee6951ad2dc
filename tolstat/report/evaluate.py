"""Joints whose errors another program gives, simulated: their loads as a table, and which of them exceed limits."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tolstat.campaign.function import VARIANT, function
from tolstat.common.late import pandas as pd
from tolstat.common.loads import units_of_loads
from tolstat.common.tables import FACTORS, VALID, Status
from tolstat.common.wording import Wording
from tolstat.display import rewording
from tolstat.display.answer import Answer
from tolstat.display.progress import Tell, silent
from tolstat.report import parts
from tolstat.study import Given, crosses, load


class Evaluated(NamedTuple):
    """Joints that were simulated with given errors.

    Attributes
    ----------
    frame : pandas.DataFrame
        A row for each joint, in the order given: ``joint``, its name, if the joints have any; ``status``; its loads,
        and the rating lives of its bearings (h) if it has what they need; NaN where there is none. SI units by column
        in ``attrs["units"]``.
    answer : Answer
        Which joints are beyond a limit.
    """

    frame: pd.DataFrame
    answer: Answer


def evaluate(
    study: Given,
    errors: str | Path,
    loads: str | Sequence[str] | None = None,
    *,
    uniform: bool = False,
    point: str = "",
    workers: int | None = None,
    tell: Tell = silent,
    stage: Tell = silent,
) -> Evaluated:
    """Simulate joints whose errors a text table has.

    Parameters
    ----------
    study : Study, str, Path or mapping
        Study whose joint, operating point and settings they have, see `study.load`.
    errors : str or Path
        Text table; its header has names of errors, in any order, units there or below, or SI. Errors without a column
        are those of ``[errors]``, or nominal.
    loads : str or sequence of str, optional
        Load or pattern such as ``cross*.F``; by default those with limits.
    uniform : bool
        The columns are points of the unit cube, from which errors are drawn as in a campaign.
    point : str
        Operating point, of a study with several.
    workers : int, optional
        Number of processes; by default one per core. Affects no result.
    tell, stage : callable, optional
        Called with messages on the table, and with the name of the stage that begins.

    Returns
    -------
    Evaluated

    Raises
    ------
    InputError
        With every fault of the study, of the loads or of the table.
    """
    whole = load(study)
    chosen = function(whole, loads, point=point)
    shown_loads = parts.names_of(chosen.study.limits, whole.mechanism)
    f = function(whole, [*chosen.loads, *shown_loads], point=point, workers=workers)
    names, units = (f.cube_names, dict.fromkeys(f.cube_names, "1")) if uniform else (f.names, f.units)
    needed = [name for name in names if uniform or name == VARIANT]
    varied = [name for name in names if name not in needed]
    joints = crosses.read(Path(errors), whole.mechanism, units, None if uniform else whole.errors, needed)
    wording = Wording.of(whole.mechanism, whole.text, joints.labels)
    for note in joints.notes:
        tell(wording(note))
    own = dict.fromkeys(FACTORS, 1.0) | whole.errors
    nominal = {name: np.full(len(joints.labels), own.get(name, 0.0)) for name in varied}
    stage("simulation")
    y = f(f.uniform(joints.columns) if uniform else nominal | joints.columns)
    unit_of, has_life = units_of_loads(f.study.mechanism), np.isin(f.status, VALID)
    columns = {"joint": np.array(joints.labels, object)} if joints.named else {}
    columns["status"] = np.array([Status(number).label for number in f.status], object)
    columns |= dict(zip(chosen.loads, y.T[: len(chosen.loads)], strict=True))
    lives = {name: np.where(has_life, h, np.nan) for name, h in parts.lives(f.study, f.turning).items()}
    frame = pd.DataFrame(columns | lives)
    units = unit_of | dict.fromkeys(lives, "h")
    frame.attrs["units"] = {name: units.get(name, "") for name in map(str, frame)}
    found = parts.parts(f.study, dict(zip(f.loads, y.T, strict=True)), f.turning, joints.labels, f.status)
    return Evaluated(frame, rewording.answer(Answer("evaluate", "Joints", found), wording))
