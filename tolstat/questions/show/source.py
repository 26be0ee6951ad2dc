"""What `tolstat show` draws: a joint file, the joint of a study or case, or a joint of a result file."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import joint as joints
from tolstat import study
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import read_toml
from tolstat.joint import Joint
from tolstat.store import ResultFile
from tolstat.store.recorded import joint_of, operation_of

ALPHA = float(np.radians(15.0))
"""Misalignment that the joint of a joint file is drawn at, rad."""


class Shown(NamedTuple):
    """A joint to be drawn.

    Attributes
    ----------
    joint : Joint
        The nominal joint.
    alpha : float
        Misalignment, rad.
    title : str
        Headline.
    errors : ndarray of ERROR, shape (1,), optional
        Errors of the row asked for.
    """

    joint: Joint
    alpha: float
    title: str
    errors: NDArray[np.void] | None = None


def read(source: str | Path, row: int | None = None, alpha: float | None = None) -> Shown:
    """Read the joint to be drawn.

    Parameters
    ----------
    source : str or Path
        Name of a joint that comes with the package, a joint file, study or case (TOML), or a result file (HDF5).
    row : int, optional
        Row of the campaign whose errors are drawn; of a result file.
    alpha : float, optional
        Misalignment for a joint file, which has none, rad; `ALPHA` by default.

    Raises
    ------
    InputError, StoreError
        When there is no such joint or row, or a file cannot be read.
    """
    path = Path(source)
    if path.is_file() and path.suffix != ".toml":
        _refuse(alpha)
        with ResultFile.open(path) as store:
            return _of_file(store, row)
    if row is not None:
        raise InputError([Fault(str(source), "has no rows, which --row asks for", "give a result file: FILE.h5")])
    if path.suffix != ".toml" and len(path.parts) == 1:
        return _named(str(source), alpha)
    data = read_toml(path)
    if "joint" not in data and "operation" not in data:
        return _titled(joints.load(source, {}, str(source)), path.stem, alpha)
    _refuse(alpha)
    case = study.load(path) if "sampling" in data else study.load_case(path)
    first = case.points[0].name if isinstance(case, study.Study) else ""
    return Shown(case.joint, case.operation.alpha, f"{path.stem}, at {first}" if first else path.stem)


def _named(name: str, alpha: float | None) -> Shown:
    """Joint that comes with the package."""
    try:
        return _titled(joints.load(name, {}, name), name, alpha)
    except InputError as error:
        remedy = error.faults[0].remedy
        raise InputError([Fault(name, "is neither a file nor the name of a joint", remedy)]) from error


def _titled(joint: Joint, name: str, alpha: float | None) -> Shown:
    return Shown(joint, ALPHA if alpha is None else alpha, joint.description or name)


def _refuse(alpha: float | None) -> None:
    if alpha is not None:
        raise InputError([Fault("--alpha", "is used with a joint file only", "leave it out: the study has its own")])


def _of_file(store: ResultFile, row: int | None) -> Shown:
    """Joint of a result file, of its first slot or of a row; of several operating points at the first."""
    at = store.each()[0]
    where = f", at {at.point}" if at.point else ""
    if row is None:
        return Shown(joint_of(store, 0), at.operation.alpha, f"{store.study_name}{where}")
    if row not in store.rows:
        found = f"has rows {store.rows[0]} to {store.rows[-1]}, not {row}"
        raise InputError([Fault(str(store.path), found, f"give one of these rows, for example --row {store.rows[0]}")])
    slot = store.slot(row)
    errors = store.errors(slice(slot, slot + 1))
    return Shown(joint_of(store, slot), operation_of(at, slot).alpha, f"{store.study_name}, row {row}", errors)
