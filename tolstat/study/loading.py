"""Studies and cases from their files: their sections, then what does not go together between them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.loads import LOADS, load_of
from tolstat.common.strict import dotted, validate
from tolstat.common.tables import FINEST_STEPS
from tolstat.joint import Joint, Operation
from tolstat.study import rewriting, selective
from tolstat.study.file import OF_CASE, SECTIONS, StudyFile
from tolstat.study.model import MAX_ROWS, Output, Sampling, Solver, Subset
from tolstat.study.study import Case, Study
from tolstat.study.tolerances.entry import known_of

SCATTER = ("tolerances", "correlation", "errors", "reject")
"""Sections that define the joints of most sampling methods; the first is required."""
SECTIONS_OF = {
    "sweep": ("sweep", "errors"),
    "cases": ("case", "grid", "variant"),
    "importance": (*SCATTER, "proposal"),
}
"""Sections that define the joints of the other sampling methods; the first is required."""
PARTS = (
    *("fit", "joint", "assumed", "points", "operation", "solver", "errors", "copula", "proposals", "sampling", "sweep"),
    *("limits", "rejects", "fatigue", "output", "groups", "listed", "swept"),
)
"""Attributes of a study that `StudyFile` reads, in the order of their faults."""
INDEPENDENT = ("random", "importance")
"""Sampling methods whose joints can be reweighted to the processes that measured parts leave open, with intervals."""


def load(
    path: str | Path | Mapping[str, Any], n: int | None = None, text: str | None = None, joint: Joint | None = None
) -> Study:
    """Read a study file, or make a study of its sections.

    Parameters
    ----------
    path : str, Path or mapping
        TOML file; or the sections of one as nested dictionaries, ``{"joint": {"base": "cirelli2021"}, ...}``, whose
        paths start from the working directory.
    n : int, optional
        Number of joints instead of the file's ``sampling.n``.
    text : str, optional
        TOML to read instead of the file's; `path` is then only what faults and relative paths refer to.
    joint : Joint, optional
        Nominal joint in place of that of ``[joint]``; variants and swept dimensions are read from the file still.

    Returns
    -------
    Study
        With patterns expanded, units converted and the joint file read.

    Raises
    ------
    InputError
        With every fault of the file, of the joint file and of measured data that it names.
    """
    if isinstance(path, Mapping):
        text = rewriting.as_text(path)
        path = "study.toml"
    file = StudyFile(Path(path), SECTIONS, text)
    if n is not None:
        file.override_n(n)
    if joint is not None:
        file.joint = joint
    parts: dict[str, Any] = {name: getattr(file, name) for name in PARTS}
    _check(file)
    file.finish()
    read = file.scatter
    parts |= {"tolerances": read.distributions, "entries": read.entries, "axes": read.axes, "lots": read.lots}
    study = Study(path=file.path, text=file.text, signals=file.signals, **parts)
    study.check_mounting()
    return study


def load_case(path: str | Path) -> Case:
    """Read a case file: one joint with its errors.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    file = StudyFile(Path(path), OF_CASE)
    if "sampling" in file.data:
        remedy = f"run it with: tolstat run {file.path}"
        raise InputError([Fault(file.place, "is a study, not a case of one joint", remedy)])
    file.fit = None
    joint, operation = file.joint, file.model("operation", Operation, "add [operation]")
    solver, errors = file.solver, file.errors
    if solver is not None and solver.fidelity == "auto":
        remedy = 'write "dynamic", "quasistatic" or "ideal"'
        file.fault("solver.fidelity", "'auto' needs the joints of a campaign, a case has one joint", remedy)
    file.finish()
    assert joint is not None
    assert operation is not None
    assert solver is not None
    case = Case(file.path, file.text, joint, operation, solver, errors)
    case.check_mounting()
    return case


def _check(file: StudyFile) -> None:
    """Note sections and keys that do not go together; those that have faults are left out."""
    if file.sampling is not None:
        _sections(file, file.sampling)
        _method(file, file.sampling)
        _points(file, file.sampling)
        _known(file, file.sampling.method)
    if file.output is not None:
        _output(file, file.output)
    if file.output is not None and file.solver is not None:
        _histories(file, file.output, file.solver)


def _sections(file: StudyFile, sampling: Sampling) -> None:
    """Note sections that the sampling method needs or does not use."""
    used = SECTIONS_OF.get(sampling.method, SCATTER)
    if not file.data.get(used[0]):
        header = "[[case]]" if used[0] == "case" else f"[{used[0]}]"
        found = "missing table: no error has a tolerance" if used[0] == "tolerances" else "missing table"
        file.fault(used[0], found, f"add {header}, or set another sampling.method")
    for section in dict.fromkeys((*SCATTER, *(name for names in SECTIONS_OF.values() for name in names))):
        if section not in used and section in file.data:
            remedy = "remove it, or set another sampling.method"
            file.fault(section, f"has no effect with {sampling.method!r}", remedy)


def _method(file: StudyFile, sampling: Sampling) -> None:
    """Note keys that the sampling method needs or does not use."""
    if sampling.joints_per_lot > 1 and not file.scatter.lots:
        remedy = "write lot = { share = 0.3 } in an entry of [tolerances], or remove the key"
        file.fault("sampling.joints_per_lot", "has no effect: no tolerance has a lot", remedy)
    if sampling.is_matched and sampling.selective is not None:
        depending = {*file.copula.names, *file.scatter.lots, *file.accepted}
        for found, remedy in selective.faults(sampling.selective, file.scatter, depending):
            file.fault("sampling.selective", found, remedy)
    if sampling.method == "cases" and file.data.get("limits"):
        file.fault("limits", "has no effect with 'cases'", "remove it: listed joints have no exceedance")
    if sampling.method == "subset":
        remedy = 'write "random", and run: tolstat rare STUDY --limit "cross1.F > 900 N"'
        file.fault("sampling.method", "'subset' is set by tolstat rare, not in a study", remedy)
    if sampling.method == "importance" and not file.data.get("proposal"):
        remedy = "add [[proposal]] with share, and widen, shift or parts"
        file.fault("proposal", "missing table: distributions to draw joints from beside the tolerances", remedy)
    joints = math.prod(axis.points for axis in file.sweep)
    if joints > MAX_ROWS:
        file.fault("sweep", f"gives {joints} joints", f"give at most {MAX_ROWS}")


def _points(file: StudyFile, sampling: Sampling) -> None:
    """Note several operating points where the joints have points of their own."""
    if len(file.points) < 2:
        return
    if sampling.method == "cases":
        remedy = "write one [operation], and the others in [[variant]]: operation = { ... }"
        file.fault("operation", "several operating points are not possible with 'cases'", remedy)
    for name in (name for axis in file.sweep for name in axis.names if name.startswith("operation.")):
        remedy = "write one [operation], or sweep other errors"
        file.fault(f"sweep.{name}", "is given by several [[operation]] already", remedy)


def _known(file: StudyFile, method: str) -> None:
    """Note entries known from measured parts whose joints could not be reweighted to other means and deviations."""
    for entry in known_of(file.scatter.entries):
        key, known = dotted(("tolerances", entry.pattern)), f"is known from {entry.parts} measured parts"
        if method not in INDEPENDENT:
            remedy = 'write method = "importance", and a [[proposal]] with parts'
            file.fault(key, f"{known}, which needs independent joints, not {method!r}", remedy)
        if correlated := sorted(set(entry.names) & set(file.copula.names)):
            file.fault(key, f"{known}, and {correlated[0]} is correlated", "remove the correlation, or known_from")
        if accepted := sorted(set(entry.names) & file.accepted):
            remedy = 'remove known_from or the bonus, or write material_condition = "fills"'
            file.fault(key, f"{known}, and parts are accepted by {accepted[0]} and a position", remedy)


def _output(file: StudyFile, output: Output) -> None:
    """Note a fatigue section where no cycles are stored, but for points, and limits of loads that are not stored."""
    given = file.data.get("fatigue")
    if output.histories == "none" and isinstance(given, Mapping) and "point" not in given:
        file.fault("fatigue", "has no effect without histories", 'write histories = "cycles" in [output]')
    stored = {column.name for column in output.columns}
    lacking = [name for load in file.limits for name in load_of(load).columns if name not in stored]
    if lacking:
        found = f"leaves out columns that [limits] needs: {', '.join(lacking)}"
        file.fault("output.results", found, "add these columns, or remove their limits")


def _histories(file: StudyFile, output: Output, solver: Solver) -> None:
    """Note histories of different lengths, and more harmonics than the steps per revolution resolve.

    ``auto`` chooses enough steps for the harmonics.
    """
    different = {variant.steps_per_rev for variant in file.listed.solvers} if file.listed else set()
    if output.histories != "none" and len(different) > 1:
        found = f"variants have different steps per revolution: {', '.join(map(str, sorted(different)))}"
        remedy = 'give all variants the same solver.steps_per_rev, or write histories = "none"'
        file.fault("output.histories", found, remedy)
    steps = FINEST_STEPS if solver.fidelity == "auto" else solver.steps_per_rev
    most = (steps - 1) // 2
    if "harmonics" in output.histories and output.harmonics > most:
        found = f"{steps} steps per revolution do not resolve {output.harmonics} harmonics"
        file.fault("output.harmonics", found, f"give at most {most}, or a larger solver.steps_per_rev")


def subset_of(study: Study, sampling: Mapping[str, Any]) -> Study:
    """Make the study of a subset simulation from the study whose tolerances it uses.

    Parameters
    ----------
    study : Study
        Study with any sampling method that draws joints; its histories are not stored.
    sampling : mapping
        Fields of `model.Subset` except those that are taken from the study.

    Returns
    -------
    Study
        Study whose ``sampling`` is a `model.Subset`; it can draw the joints of level 0, which are those of a random
        campaign.

    Raises
    ------
    InputError
        When the study has no tolerances or does not store the load, and with every fault of `sampling`.
    """
    faults: list[Fault] = []
    if not study.tolerances:
        remedy = 'give a study with [tolerances] and sampling.method = "random"'
        faults.append(Fault(str(study.path), "has no tolerances to draw joints from", remedy))
    if study.sampling.is_matched:
        found = "matches diameters by classes, which a subset simulation does not draw"
        faults.append(study.fault("sampling.selective", found, "remove it"))
    for load in (LOADS[name] for name in sampling["levels"]):
        if not selected_results.holds(study.output.columns, load.name):
            remedy = f"add {', '.join(load.columns)}"
            faults.append(study.fault("output.results", f"leaves out {load.name}, which --limit needs", remedy))
    own = study.sampling.model_dump(include=set(Subset.FROM_STUDY))
    with gather(faults):
        read = validate(Subset, own | {"n": sampling["per_level"]} | dict(sampling), "subset simulation")
    if faults:
        raise InputError(faults)
    output = study.output.model_copy(update={"histories": "none"})
    return replace(study, sampling=read, proposals=(), output=output)
