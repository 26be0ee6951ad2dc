"""Simulate one joint: that of a case file, or one of a campaign again from its result file, to compare the results."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign.remedy import remedy
from tolstat.common import loads
from tolstat.common.channels import BUSHING_LOADS, SHAFT_LOADS, LoadHistory, load_histories, unit_of
from tolstat.common.errors import Fault, InputError, input_error
from tolstat.common.late import pandas as pd
from tolstat.common.load_kinds import CONTACTS, kinds, measure_of
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Options, Simulation, Status
from tolstat.joint import ideal, nominal_errors, perturb
from tolstat.solver.compilation import warm_up
from tolstat.solver.simulation import simulate_rows
from tolstat.store import Reader
from tolstat.store.metadata import differing, versions
from tolstat.store.recorded import options_of, parameters
from tolstat.store.result_file import viewed
from tolstat.study import Given, load_case

if TYPE_CHECKING:
    import xarray

KEPT = {"histories": "histories", "n_harmonics": "harmonics"}
"""Key of ``[output]`` that each parameter of the simulation has its value from."""
PLAIN_UNITS = {"theta": "rad", "tau": "1", "Psi": "1", "mode": "1"}
"""Units of columns of a trace that are no loads."""


class CaseResult(NamedTuple):
    """A simulated case.

    Attributes
    ----------
    simulation : Simulation
        The joint: one row, with full histories.
    params : ndarray, (1,), dtype PARAM
        Its parameters.
    wall_s : float
        Time that both simulations took together, without compilation, s.
    options : Options
        Solver options of the simulation.
    mechanism : Mechanism
        What was simulated.
    nominal : ndarray, (1,), dtype RESULT, optional
        Results of the joint without errors.
    """

    simulation: Simulation
    params: NDArray[np.void]
    wall_s: float
    options: Options
    mechanism: Mechanism
    nominal: NDArray[np.void] | None = None

    def summary(self) -> dict[str, Any]:
        """Return key results as plain Python values; None for those that a failed joint does not have.

        ``max`` holds the largest value of each load that can have a limit, by name: its ``unit`` and the value in this
        joint (``joint``); where the joint without errors was simulated, too, also the value there
        (``without_errors``) and the relative difference (``change``), None for a load that is zero there, up to the
        solver's accuracy.
        """
        row = self.simulation.results[0]
        facts = {
            "status": Status(row["status"]).label,
            "settled": bool(row["settled"]),
            "closure": _number(row["closure"]),
            "closure_trend": _number(row["closure_trend"]),
            "period": int(row["period"]),
            "revolutions": _number(row["revolutions"]),
            "steps": int(row["steps"]),
            "newton_iterations": int(row["newton_iterations"]),
            "halvings": int(row["halvings"]),
            "wall_s": self.wall_s,
        }
        if self.nominal is not None:
            facts["status_without_errors"] = Status(self.nominal[0]["status"]).label
        every = loads.loads_of(self.mechanism).values()
        return facts | {"max": {load.name: self._largest(load) for load in every}}

    def _largest(self, load: loads.Load) -> dict[str, Any]:
        value = float(load.of(self.simulation.results)[0])
        facts = {"unit": load.unit, "joint": _number(value)}
        if self.nominal is None:
            return facts
        nominal = float(load.of(self.nominal)[0])
        accuracy = self.options.newton_tol * loads.of_kind(self.nominal, measure_of(load.kind)).max()
        change = value / nominal - 1.0 if nominal > accuracy else math.nan
        return facts | {"without_errors": _number(nominal), "change": _number(change)}

    def remedy(self) -> str:
        """Return what to do about a joint that is not ok; empty for one that is."""
        return remedy(self.simulation.results[0], self.options._asdict())

    def to_pandas(self) -> pd.DataFrame:
        """Trace of the last revolution, one row per input angle.

        Columns: ``theta`` (rad; with speed orders its mean, omega t), ``tau``, ``Psi``, then ``cross1.F_e`` …
        ``fork4.T_z`` (N and N m, on the lump, in the base marker's axes), ``pin1.contact_outer``,
        ``pin1.contact_inner``, ``pin1.contact_resultant`` … (N),
        ``input.f_x`` … ``output.m_z`` (force and moment about O on the shafts, N and N m, in axes that do not turn) and
        ``pin1.mode`` …
        ``attrs["units"]`` has the SI unit of each column.
        """
        histories = {name: values[0] for name, values in self.simulation.histories.items()}
        tau = histories["tau"].astype(float)
        theta = 2 * math.pi * np.arange(len(tau)) / len(tau)
        turned = ideal.input_motion(np.copysign(theta, self.params["omega"]), self.params)[0][0]
        columns: dict[str, NDArray[Any]] = {
            "theta": theta,
            "tau": tau,
            "Psi": (tau - ideal.ratio_of_all(turned, self.params[0])) / tau,
        }
        of_loads, pins = load_histories(self.mechanism), kinds(self.mechanism)["contact"].places
        columns |= _components(of_loads[BUSHING_LOADS], histories)
        for p, pin in enumerate(pins):
            for i, of in enumerate(CONTACTS):
                columns[f"{pin}.contact_{of}"] = histories["contact"][:, p, i]
        columns |= _components(of_loads[SHAFT_LOADS], histories)
        for p, pin in enumerate(pins):
            columns[f"{pin}.mode"] = histories["mode"][:, p]
        frame = pd.DataFrame(columns)
        frame.attrs["units"] = {name: self._unit_of(name) for name in columns}
        return frame

    def _unit_of(self, column: str) -> str:
        what = column.rpartition(".")[2]
        if what in PLAIN_UNITS:
            return PLAIN_UNITS[what]
        return "N" if what.startswith("contact_") else unit_of(column, self.mechanism)


def _components(history: LoadHistory, histories: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Columns of the components at each place of a history."""
    values = histories[history.name]
    return {
        f"{place}.{component}": values[:, i, k]
        for i, place in enumerate(history.places)
        for k, component in enumerate(history.components)
    }


def simulate_case(case: Given) -> CaseResult:
    """Simulate the joint of a case file, and the same joint without errors.

    Parameters
    ----------
    case : Study, str, Path or mapping
        One joint with its errors, see `study.load_case`.

    Returns
    -------
    CaseResult
    """
    case = load_case(case)
    errors = nominal_errors(2, case.mechanism)
    for name, value in case.errors.items():
        errors[name][0] = value
    params, options = perturb(case.joint, case.operation, errors), case.solver.options()
    both, wall_s = _timed(params, options, case.mechanism)
    with_errors = Simulation(both.results[:1], {name: values[:1] for name, values in both.histories.items()})
    return CaseResult(with_errors, params[:1], wall_s, options, case.mechanism, both.results[1:])


def _timed(params: NDArray[np.void], options: Options, mechanism: Mechanism) -> tuple[Simulation, float]:
    """Joints with full histories, and the time of their simulation without compilation, s."""
    warm_up(mechanism=mechanism)
    begin = time.perf_counter()
    simulation = simulate_rows(params, options, mechanism=mechanism, histories="full")
    return simulation, time.perf_counter() - begin


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


class Difference(NamedTuple):
    """A value that differs from the stored one.

    Attributes
    ----------
    name : str
        Column of the results, or ``histories/`` and the name of a history.
    stored, now : float
        Stored and new value; for a history those of the sample with the largest difference.
    """

    name: str
    stored: float
    now: float

    @property
    def relative(self) -> float:
        """Difference relative to the larger magnitude of the two; infinite if one is not finite."""
        if not np.isfinite([self.stored, self.now]).all():
            return np.inf
        return abs(self.now - self.stored) / max(abs(self.now), abs(self.stored))


class Replay(NamedTuple):
    """A joint simulated again.

    Attributes
    ----------
    row : int
        Row of the campaign.
    result : CaseResult
        The joint, with full histories.
    stored : Status
        Status of the joint in the campaign.
    differences : list of Difference
        Values that are not the same to the last bit.
    code : list of str
        Software versions that differ from those that made the file: ``"numpy: 2.1.0 in the file, 2.4.6 now"``.
    """

    row: int
    result: CaseResult
    stored: Status
    differences: list[Difference]
    code: list[str]

    def __repr__(self) -> str:
        return f"<row {self.row}, simulated again: {len(self.differences)} values differ from those stored>"


def replay(source: str | Path | Reader, row: int, point: str = "") -> Replay:
    """Simulate a joint of a campaign again and compare with the stored results.

    Parameters
    ----------
    source : str, Path or Reader
        The result file.
    row : int
        Row of the campaign.
    point : str
        Operating point, of a file with several.

    Returns
    -------
    Replay

    Raises
    ------
    InputError
        When the file has no such row, the row is pending, or this version cannot read the file's joint or options.
    """
    with viewed(source) as view:
        return _again(view.at(point).store, row)


def histories(source: str | Path | Reader, rows: Sequence[int], point: str = "") -> xarray.DataArray:
    """Loads of some joints over their last revolution, simulated again.

    Parameters
    ----------
    source, point
        As of `replay`.
    rows : sequence of int
        Rows of the campaign, such as those of `worst`.

    Returns
    -------
    xarray.DataArray, (rows, theta, channels)
        Columns of `CaseResult.to_pandas`, SI; coordinates ``row``, ``theta`` (rad), ``channel`` and along it
        ``unit``. All rows need the same number of steps per revolution.

    Raises
    ------
    InputError
        As `replay`; without xarray.
    """
    try:
        import xarray
    except ImportError as error:
        raise input_error("histories", "xarray is not installed", "install it with: pip install xarray") from error
    if not isinstance(rows, Iterable) or not len(rows := list(rows)):
        raise input_error("rows", f"{rows!r} are no rows", "give a list of them, such as [17, 45]")
    with viewed(source) as view:
        frames = [_again(view.at(point).store, row).result.to_pandas().set_index("theta") for row in rows]
    channels = list(frames[0].columns)
    coords = {
        "row": list(rows),
        "theta": frames[0].index.to_numpy(),
        "channel": channels,
        "unit": ("channel", [frames[0].attrs["units"][name] for name in channels]),
    }
    values = np.stack([frame.to_numpy(float) for frame in frames])
    return xarray.DataArray(values, coords, ("row", "theta", "channel"), name="loads")


def _again(store: Reader, row: int) -> Replay:
    place = str(store.path)
    if row not in store.rows:
        found = f"has rows {store.rows[0]} to {store.rows[-1]}, not {row}"
        raise InputError([Fault(place, found, f"give one of these rows, for example --row {store.rows[0]}")])
    here = slice(store.slot(row), store.slot(row) + 1)
    stored = store.results(here)
    if stored["status"][0] == Status.PENDING:
        raise input_error(place, f"row {row} is pending", f"simulate it first: tolstat run STUDY --out {place}")
    params = parameters(store, np.array([here.start]))
    options = options_of(store, here.start, int(store.attempt(here)[0]))
    simulation, wall_s = _timed(params, options, store.mechanism)
    result = CaseResult(simulation, params, wall_s, options, store.mechanism)
    differences = []
    for c in store.columns:
        before, now = (np.ascontiguousarray(c.of(table)) for table in (stored, simulation.results))
        if before.tobytes() != now.tobytes():
            differences.append(Difference(c.name, float(before[0]), float(now[0])))
    if store.history_specs:
        differences += _different_histories(store, here.start, params, options)
    changed = differing(store.versions, versions(), "in the file", "now")
    return Replay(row, result, Status(stored["status"][0]), differences, changed)


def _different_histories(store: Reader, row: int, params: NDArray[np.void], options: Options) -> list[Difference]:
    kept = {name: store.identity[f"output.{key}"] for name, key in KEPT.items()}
    now = simulate_rows(params, options, mechanism=store.mechanism, **kept).histories
    differences = []
    for name in store.history_specs:
        before = store.histories(name, np.array([row]))
        if before.tobytes() != now[name].tobytes():
            apart = np.nan_to_num(np.abs(before.astype(float) - now[name]), nan=np.inf)
            at = np.unravel_index(np.argmax(apart), apart.shape)
            differences.append(Difference(f"histories/{name}", float(before[at]), float(now[name][at])))
    return differences
