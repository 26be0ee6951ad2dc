"""The joints of a study as a function from errors to loads, for other tools of reliability and design."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.campaign.block import Block, loads_of, simulate_block, spread
from tolstat.campaign.blocks import MAX_BLOCK, MIN_BLOCKS_PER_WORKER, SOME, compile_missing
from tolstat.campaign.inputs import Array, columns_of
from tolstat.campaign.run import choose_fidelity
from tolstat.common.cores import number_of_workers
from tolstat.common.error_fields import error_units
from tolstat.common.errors import Fault, InputError, gather, input_error, raise_all
from tolstat.common.loads import shown_loads, units_of_loads
from tolstat.common.tables import Options, tables
from tolstat.joint import nominal_errors
from tolstat.solver.simulation import simulate_rows
from tolstat.store.recorded import parameters_of, settings
from tolstat.study import Given, Study, axes, load
from tolstat.study.selection import select, suggestion

if TYPE_CHECKING:
    import openturns

STEP = 0.1
"""Step of the finite differences that OpenTURNS takes for derivatives, in standard deviations of the input."""

VARIANT = "variant"
"""Column of a study with several joints: which of them, by its number."""


class Function:
    """Loads of joints as a function of their errors; see `function`.

    ``f(x)`` takes errors of joints, SI, and returns loads, (n, m), SI, in the order of `loads`; NaN where a joint has
    no valid one, and `status` says why. A DataFrame, mapping or structured array gives errors by name: all of `names`,
    and any others of `units`; an array, (n, d), gives those of `names` by position. Errors are deviations, as
    `tolstat.draw` and exports have them, those of ``operation.*`` from the operating point. Loads equal what a campaign
    of the study stores for the same errors, to the last bit.

    Attributes
    ----------
    names : list of str
        Errors in which joints of the study differ, and ``variant`` if it has several joints.
    units : dict of str to str
        SI unit of each column that `f` takes; errors that are not given are those of the study.
    cube_names : list of str
        Coordinates of the unit cube that `uniform` maps to errors.
    loads : list of str
        Loads.
    limits : dict of str to float
        Limits of the study on these loads, SI.
    distributions : dict of str to Distribution, optional
        Distribution of each of `names` if each is drawn alone; `copula` correlates some. None where other errors enter.
    reason : str
        Why `distributions` is None; empty otherwise.
    copula : Copula
        Gaussian copula of the errors.
    status : ndarray, (n,), uint8
        `Status` of the joints of the last call.
    turning : dict of str to ndarray
        Of the joints of the last call ``equivalent_load`` of each bearing, (n, pins), N; ``alpha`` of each Cardan
        joint, (n, joints), rad; ``omega``, (n,), rad/s: what lives follow from.
    simulated : int
        Number of joints simulated so far.
    """

    def __init__(self, study: Study, loads: Sequence[str], point: str, workers: int | None) -> None:
        self._whole, self.study = study, study.at(point)
        self.loads, self.workers = list(loads), number_of_workers(workers)
        self.names, self.cube_names = _names(study), sampling.streams(study)
        self.units = error_units(study.mechanism) | ({VARIANT: "1"} if VARIANT in self.names else {})
        self.limits = {name: self.study.limits[name] for name in loads if name in self.study.limits}
        self.copula = study.copula
        zones = [name for name in study.tolerances if axes.is_zone(name)]
        whole = f"{zones[0]} is drawn as a vector, from which errors follow" if zones else ""
        self.reason = whole or _dependence(study)[1]
        self.distributions = None if self.reason else dict(study.tolerances)
        self.status: NDArray[np.uint8] = np.zeros(0, np.uint8)
        self.turning: dict[str, Array] = {}
        self.simulated = 0

    def __repr__(self) -> str:
        return f"<function of {len(self.names)} errors, {len(self.loads)} loads, of study {self.study.name!r}>"

    def __call__(self, x: Any) -> Array:
        """Loads of joints, (n, m), from their errors `x`: by name, or an array (n, d) in the order of `names`.

        Raises
        ------
        InputError
            When columns of `x` are missing or unknown, or a variant is not one of the study.
        ValueError
            When an array has another shape.
        """
        columns = columns_of(x, self.names, [name for name in self.units if name not in self.names], "names")
        n = len(next(iter(columns.values())))
        variant = self._variants(columns.pop(VARIANT, np.zeros(n)))
        errors = nominal_errors(n, self.study.mechanism)
        for name, value in (self.study.errors | columns).items():
            errors[name] = value
        return self._simulate(errors, variant)

    def _variants(self, numbers: Array) -> NDArray[np.intp]:
        last = len(self.study.joints) - 1
        wrong = numbers[~np.isin(numbers, np.arange(last + 1))]
        if wrong.size:
            raise input_error(VARIANT, f"{wrong[0]:g} is no joint of the study", f"give whole numbers from 0 to {last}")
        return numbers.astype(np.intp)

    def uniform(self, u: Any) -> Array:
        """Errors of joints, (n, d), SI, in the order of `names`, from points `u` of the unit cube.

        The coordinates of `u` come by name, or as an array (n, k) in the order of `cube_names`. A campaign draws its
        errors so from independent random numbers: zones, fits and correlation are in them.

        Raises
        ------
        InputError
            When joints of the study are listed, or depend on each other: with lots of several joints; when coordinates
            are missing, unknown, or not from 0 to 1.
        ValueError
            When an array has another shape.
        """
        self._check_free()
        columns = columns_of(u, self.cube_names, (), "cube_names")
        probabilities = np.column_stack([columns[name] for name in self.cube_names])
        outside = np.argwhere(~((probabilities >= 0.0) & (probabilities <= 1.0)))
        if outside.size:
            row, column = outside[0]
            value = f"{self.cube_names[column]} = {probabilities[row, column]:g} of point {row}"
            raise input_error("u", f"{value} is outside the unit cube", "give coordinates from 0 to 1")
        errors = sampling.from_probabilities(self.study, probabilities)
        return np.column_stack([errors[name] for name in self.names])

    @cached_property
    def nominal(self) -> Array:
        """Loads of the joint without errors, (m,), SI."""
        of_last_call = self.status, self.turning
        try:
            return np.asarray(self._simulate(nominal_errors(1, self.study.mechanism), np.zeros(1, np.intp))[0])
        finally:
            self.status, self.turning = of_last_call

    @cached_property
    def options(self) -> list[Options]:
        """Solver options of each joint of the study; those of fidelity "auto" come from the pilot of a campaign."""
        choice = choose_fidelity(self._whole) if self._whole.solver.fidelity == "auto" else {}
        options = [settings(solver, choice) for solver in self._whole.solvers]
        for each in dict.fromkeys(options):
            compile_missing(self.study.mechanism, each)
        return options

    def openturns(self, cube: bool = False) -> tuple[openturns.Function, openturns.Distribution]:
        """Return the function for OpenTURNS, and the distribution of its input.

        Parameters
        ----------
        cube : bool
            Take points of the unit cube as input, independent and uniform. So it is, too, where `distributions` is
            None; `uniform` gives the errors of a design point.

        Returns
        -------
        function : openturns.Function
            From errors, or points of the cube, to loads.
        distribution : openturns.Distribution
            Of the errors, with their copula, or of the cube.

        Raises
        ------
        InputError
            When joints of the study depend on each other; or a distribution has no equal in OpenTURNS.
        """
        import openturns as ot

        is_cube = cube or self.distributions is None
        if is_cube:
            self._check_free()
        names = self.cube_names if is_cube else self.names
        copula = ot.IndependentCopula(len(names))
        if is_cube:
            parts, steps = [ot.Uniform(0.0, 1.0)] * len(names), [STEP / math.sqrt(12.0)] * len(names)
        else:
            laws = list((self.distributions or {}).values())
            parts, steps = [law.openturns(ot) for law in laws], [STEP * law.moments.deviation for law in laws]
            if self.copula.names:
                correlation, at = np.eye(len(names)), [names.index(name) for name in self.copula.names]
                correlation[np.ix_(at, at)] = self.copula.matrix
                copula = ot.NormalCopula(ot.CorrelationMatrix(correlation.tolist()))

        def loads(sample: Any) -> Array:
            x = np.array(sample)
            return self(self.uniform(x) if is_cube else x)

        def gradient(point: Any) -> Array:
            x: Array = np.array(point)
            low, high = x - np.diag(steps), x + np.diag(steps)
            if is_cube:  # differences of points that are in it
                low, high = np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)
            values = loads(np.vstack([high, low]))
            return (values[: len(x)] - values[len(x) :]) / np.diagonal(high - low)[:, None]

        function = ot.PythonFunction(len(names), len(self.loads), func_sample=loads, gradient=gradient)
        function.setHessian(ot.CenteredFiniteDifferenceHessian(steps, function.getEvaluation()))
        function.setInputDescription(names)
        function.setOutputDescription(self.loads)
        joint = ot.JointDistribution(parts, copula)
        joint.setDescription(names)
        return function, joint

    def salib(self) -> dict[str, Any]:
        """Return the problem for SALib, on the unit cube: ``f(f.uniform(u))`` are loads of its points.

        Coordinates of one vector, such as both of a position's zone, are one group.

        Raises
        ------
        InputError
            When joints of the study depend on each other.
        """
        self._check_free()
        groups = {stream: name for name in self.study.tolerances for stream in axes.streams_of(name)}
        names, labels = self.cube_names, [groups[name] for name in self.cube_names]
        problem: dict[str, Any] = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
        return problem if len(set(labels)) == len(labels) else problem | {"groups": labels}

    def _check_free(self) -> None:
        """Refuse a study of whose joints no cube of independent numbers gives the errors."""
        key, found = _dependence(self.study)
        if key:
            remedy = f"remove {key}, or give errors that tolstat.draw(study) draws to f(x)"
            raise InputError([self.study.fault(key, found, remedy)])

    def _simulate(self, errors: NDArray[np.void], variant: NDArray[np.intp]) -> Array:
        n, workers = len(errors), self.workers
        self.simulated += n
        study, distinct = self.study, list(dict.fromkeys(self.options))
        option = np.array([distinct.index(own) for own in self.options])[variant]
        loads, self.status = np.full((n, len(self.loads)), np.nan), np.zeros(n, np.uint8)
        size = MAX_BLOCK if workers == 1 else min(MAX_BLOCK, -(-n // (MIN_BLOCKS_PER_WORKER * workers)))
        parts = []
        for number in range(len(distinct)):
            here = np.flatnonzero(option == number)
            parts += [(here[first : first + size], distinct[number]) for first in range(0, here.size, size)]
        of = tables(study.mechanism)
        shapes = {"equivalent_load": of.RESULT, "alpha": of.PARAM, "omega": of.PARAM}
        self.turning = {name: np.full((n, *table[name].shape), np.nan) for name, table in shapes.items()}
        some = spread(n, SOME)
        for own in distinct:  # once, before the threads start
            compile_missing(study.mechanism, own, parameters_of(study, variant[some], errors[some]))

        def simulated(part: tuple[NDArray[np.intp], Options]) -> tuple[Block, NDArray[np.void]]:
            slots, own = part
            block = Block("", slots, parameters_of(study, variant[slots], errors[slots]), own, study.mechanism)
            return block, simulate_block(simulate_rows, "none", 0, {}, block).simulation.results

        with ThreadPoolExecutor(workers) as threads:
            for block, table in threads.map(simulated, parts):
                self.status[block.slots] = table["status"]
                for name, values in self.turning.items():
                    values[block.slots] = (table if name == "equivalent_load" else block.params)[name]
                loads[block.slots] = loads_of(table, self.loads, study.mechanism)
        return loads


def function(
    study: Given, loads: str | Sequence[str] | None = None, *, point: str = "", workers: int | None = None
) -> Function:
    """Loads of the joints of a study as a function of their errors, for other tools.

    Parameters
    ----------
    study : Study, str, Path or mapping
        Study, see `study.load`, with tolerances, a sweep or listed joints; how it samples is left to the other tool.
    loads : str or sequence of str, optional
        Name of a load or pattern such as ``cross*.F``, or several; by default those with limits, without limits those
        of reports.
    point : str
        Operating point, of a study with several.
    workers : int, optional
        Number of threads; by default one per core. Affects no result.

    Returns
    -------
    Function

    Raises
    ------
    InputError
        When a load or the point is unknown, there are no loads or workers, or with the faults of the file.
    """
    faults: list[Fault] = []
    with gather(faults):
        number_of_workers(workers)
    with gather(faults):
        study = load(study)
    if not isinstance(study, Study):
        raise InputError(faults)
    loads = [loads] if isinstance(loads, str) else loads
    chosen: dict[str, None] = {}
    every = list(units_of_loads(study.mechanism))
    for pattern in (study.asked or shown_loads(study.mechanism)) if loads is None else loads:
        names = select(pattern, every)
        chosen.update(dict.fromkeys(names))
        if not names:
            faults.append(Fault("loads", f"{pattern!r} is no load", suggestion(pattern, every)))
    if not chosen and not faults:
        faults.append(
            Fault("loads", "is empty", 'give names or patterns, such as ["cross*.F"]; None: those with limits')
        )
    raise_all(faults)
    return Function(study, list(chosen), point, workers)


def _names(study: Study) -> list[str]:
    """Columns in which joints of a study differ: errors that are drawn, swept or listed, and the number of a joint."""
    of_errors = error_units(study.mechanism)
    swept = [name for axis in study.sweep for name in axis.names if name in of_errors]
    values = (*study.listed.cases.values(), *study.listed.points) if study.listed else ()
    errors = dict.fromkeys([*sampling.columns(study), *swept, *(name for errors in values for name in errors)])
    return [*errors, *([VARIANT] if len(study.joints) > 1 else [])]


def _dependence(study: Study) -> tuple[str, str]:
    """Key of a study whose joints are no independent draws, and why; empty if they are."""
    if not study.tolerances:
        return "sampling.method", f"is {study.sampling.method!r}: joints are listed, not drawn"
    if study.sampling.joints_per_lot > 1:
        return "sampling.joints_per_lot", "joints of one lot depend on each other"
    return "", ""
