"""Studies and cases from their files: what is made of each section, and what does not go together between them.

Each function reads one section, or what follows from several, adds faults to those of the file, and returns what could
be made, so that all faults are reported at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

from tolstat.common.columns import holds
from tolstat.common.errors import Fault, collected, gather, input_error, raise_all
from tolstat.common.loads import load_of, loads_of, split, units_of_limits
from tolstat.common.strict import dotted, validate
from tolstat.common.tables import FINEST_STEPS
from tolstat.joint import SPLINE, DriveShaft, Joint, reading
from tolstat.joint.derived import BEARING
from tolstat.joint.model import Assumed, leaves, merged
from tolstat.joint.reading import faults_of_assumed
from tolstat.study import fatigue, linkages, listing, points, rewriting, selection
from tolstat.study.design import Design
from tolstat.study.model import MAX_ROWS, Output, Sampling, Solver, Subset
from tolstat.study.points import Point
from tolstat.study.selection import Assignments, Entry, Reading, toleranced_units
from tolstat.study.study import Given, Study, is_read
from tolstat.study.tolerances import correlation, fits, kinds
from tolstat.study.tolerances.kinds import Tolerances

OF_CASE = ("joint", "operation", "shaft", "mechanism", "solver", "errors", "limits")
"""Sections that a case may have, too."""
SECTIONS = (
    *OF_CASE,
    *("tolerances", "correlation", "sampling", "sweep", "grid", "case", "variant", "assumed"),
    *("fatigue", "output"),
)
"""Sections of a study, in the order of the reference."""
SCATTER = ("tolerances", "correlation", "errors")
"""Sections that define the joints of most sampling methods; the first is required."""
SECTIONS_OF = {"sweep": ("sweep", "errors"), "cases": ("case", "grid", "variant")}
"""Sections that define the joints of the other sampling methods; the first is required."""


def _joint(file: Reading) -> Joint | None:
    """``[joint]``: a joint file by name or path, and keys that replace some of its own; diameters by the fit."""
    keys = file.table("joint")
    if keys.get("base") is None:
        file.fault("joint.base", "missing key", 'add base, for example base = "cirelli2021"')
        return None
    return _loaded(file, keys, "joint")


def _joint2(file: Reading) -> Joint | None:
    """``[shaft.joint2]``: joint 2 of a drive shaft as ``[joint]`` is joint 1; None where both are the same."""
    keys = file.table("shaft").get("joint2")
    if keys is None:
        return None
    if not isinstance(keys, Mapping) or keys.get("base") is None:
        found = "missing key" if isinstance(keys, Mapping) else f"{keys!r} is not a table"
        file.fault("shaft.joint2.base", found, 'write [shaft.joint2] with base = "mine.toml", the file of joint 2')
        return None
    return _loaded(file, keys, "shaft.joint2")


def _loaded(file: Reading, keys: Mapping[str, Any], section: str) -> Joint:
    """Joint of a section with a `base`."""
    if file.fit is not None and isinstance(keys["base"], str):
        keys = _with_diameters(file, keys, section)
    return reading.load(keys["base"], keys, file.place, file.folder, section)


def _shaft(file: Reading) -> DriveShaft | None:
    """``[shaft]``, with `_joint2`."""
    keys = file.table("shaft")
    if "shaft" not in file.data:
        return None
    shaft = file.model(DriveShaft, {key: value for key, value in keys.items() if key != "joint2"}, "shaft")
    return shaft.model_copy(update={"joint2": file.joint2})


def _with_diameters(file: Reading, keys: Mapping[str, Any], section: str) -> dict[str, Any]:
    """Keys of a joint with the fit's diameters; note diameters and clearance that its `section` sets beside it."""
    contact, diameters = keys.get("contact", {}), file.fit.diameters
    if not isinstance(contact, Mapping):
        return merged(keys, {"contact": diameters})
    twice = [key for key in (*diameters, "clearance") if key in contact]
    for key in twice:
        file.fault(f"{section}.contact.{key}", *fits.BESIDE)
    return {**keys, "contact": merged({k: v for k, v in contact.items() if k not in twice}, diameters)}


def _assumed(file: Reading) -> tuple[Assumed, ...]:
    """``[[assumed]]``: assumptions that the study adds to those of its joint file."""
    before = len(file.faults)
    entries = file.models("assumed", Assumed)
    if file.joint is None or len(file.faults) > before:
        return ()
    keys = {key: value for key, value in file.table("joint").items() if key != "base"}
    file.faults += faults_of_assumed(entries, file.joint.given("json"), keys, file.place)
    for number, entry in enumerate(entries if file.fit else []):
        for n, value in enumerate(entry.values):
            for key in (key for key in leaves(value) if key in BEARING):
                file.fault(f"assumed[{number}].values[{n}].{key}", *fits.BESIDE)
    return tuple(entries)


def _sampling(file: Reading) -> Sampling | None:
    """``[sampling]``."""
    if "sampling" in file.data:
        return file.model(Sampling, file.data["sampling"], "sampling")
    file.fault("sampling", "missing table", f"add [sampling]; to simulate one joint: tolstat simulate {file.place}")
    return None


def _scatter(file: Reading) -> Tolerances:
    """``[tolerances]``: how errors scatter."""
    written = []
    for entry in fits.entries(file.table("tolerances"), file.fit, file.mechanism):
        with gather(file.faults):
            selected = selection.resolve(entry, toleranced_units(file.mechanism), file.place)
            with gather(file.faults):
                file.claims.claim(entry, selected)
            written.append((entry, selected))
    named = {*(file.errors or ()), *(name for _, selected in written for name in selected)}
    if file.mechanism.spline and written and SPLINE not in named:
        written.append((Entry(SPLINE, ("joint", SPLINE), {"plus_minus": 1.0, "distribution": "uniform"}), [SPLINE]))
    return kinds.read(written, file)


def _limits(file: Reading) -> dict[str, float]:
    """``[limits]``: limit of each load that has one (SI), ``cross1.F`` at all points, ``cross1.F at cruise``."""
    limits: dict[str, float] = {}
    claims, units = Assignments(file.place, file.mechanism), units_of_limits(file.mechanism)
    names_of_points = [point.name for point in file.points]
    for entry in file.entries("limits"):
        with gather(file.faults):
            pattern, where = split(entry.pattern)
            names = selection.resolve(entry._replace(pattern=pattern), units, file.place)
            value = selection.quantity(entry, units[names[0]], file.place)
            if names_of_points:  # if not, the points have faults of their own
                chosen = points.names_of(where, names_of_points, f"{file.place}: {dotted(entry.path)}")
                names = [points.at(name, chosen, names_of_points) for name in names]
            claims.claim(entry, names)
            if value <= 0:
                file.fault(entry.path, f"{entry.value!r} is not positive", "give a limit above zero")
            limits |= dict.fromkeys(names, value)
    return limits


def _output(file: Reading) -> Output:
    """``[output]``."""
    output = file.model(Output, file.data.get("output", {}), "output")
    raise_all(
        Fault(f"{file.place}: output.results[{number}]", *texts) for number, *texts in output.unknown(file.mechanism)
    )
    return output


def _listed(file: Reading) -> Design | None:
    """``[grid]``, ``[[case]]`` and ``[[variant]]``: joints listed one by one, variants of the joint."""
    return listing.design(file) if file.sampling is not None and file.sampling.method == "cases" else None


READERS: dict[str, Callable[[Reading], Any]] = {
    "fit": fits.read,
    "joint": _joint,
    "assumed": _assumed,
    "linkage": linkages.read,
    "joint2": _joint2,
    "shaft": _shaft,
    "points": points.read,
    "operation": lambda file: file.points[0].operation if file.points else None,
    "solver": lambda file: file.model(Solver, file.data.get("solver", {}), "solver"),
    "errors": lambda file: selection.fixed_errors(file, file.table("errors"), ("errors",), file.claims),
    "scatter": _scatter,
    "copula": correlation.read,
    "sampling": _sampling,
    "sweep": listing.axes_of_sweep,
    "limits": _limits,
    "fatigue": fatigue.read,
    "output": _output,
    "listed": _listed,
    "swept": listing.swept,
}
"""What makes each part of a study of its file, in the order of the faults."""


def _check(file: Reading) -> None:
    """Note sections and keys that do not go together; those that have faults are left out."""
    if file.sampling is not None:
        _check_sections(file, file.sampling)
        _check_method(file, file.sampling)
        _check_points(file, file.sampling)
    if file.output is not None:
        _check_output(file, file.output)
    if file.output is not None and file.solver is not None:
        _check_histories(file, file.output, file.solver)


def _check_sections(file: Reading, sampling: Sampling) -> None:
    """Note sections that the sampling method needs or does not use."""
    used = SECTIONS_OF.get(sampling.method, SCATTER)
    if not file.data.get(used[0]):
        header = "[[case]]" if used[0] == "case" else f"[{used[0]}]"
        found = "missing table: no error has a tolerance" if used[0] == "tolerances" else "missing table"
        file.fault(used[0], found, f"add {header}, or set another sampling.method")
    for section in dict.fromkeys((*SCATTER, *(name for names in SECTIONS_OF.values() for name in names))):
        if section not in used and section in file.data:
            file.fault(section, f"has no effect with {sampling.method!r}", "remove it, or set another sampling.method")


def _check_method(file: Reading, sampling: Sampling) -> None:
    """Note keys that the sampling method needs or does not use."""
    written = (entry.value for entry in file.entries("tolerances") if isinstance(entry.value, Mapping))
    if sampling.joints_per_lot > 1 and not any("lot" in keys for keys in written):
        remedy = "write lot = { share = 0.3 } in an entry of [tolerances], or remove the key"
        file.fault("sampling.joints_per_lot", "has no effect: no tolerance has a lot", remedy)
    if sampling.method == "subset":
        remedy = 'write "random", and run: tolstat rare STUDY --limit "cross1.F > 900 N"'
        file.fault("sampling.method", "'subset' is set by tolstat rare, not in a study", remedy)
    joints = math.prod(axis.points for axis in file.sweep)
    if joints > MAX_ROWS:
        file.fault("sweep", f"gives {joints} joints", f"give at most {MAX_ROWS}")


def _check_points(file: Reading, sampling: Sampling) -> None:
    """Note several operating points where the joints have points of their own."""
    if len(file.points) < 2:
        return
    if sampling.method == "cases":
        remedy = "write one [operation], and the others in [[variant]]: operation = { ... }"
        file.fault("operation", "several operating points are not possible with 'cases'", remedy)
    for name in (name for axis in file.sweep for name in axis.names if name.startswith("operation.")):
        remedy = "write one [operation], or sweep other errors"
        file.fault(f"sweep.{name}", "is given by several [[operation]] already", remedy)


def _check_output(file: Reading, output: Output) -> None:
    """Note limits of loads that are not stored."""
    stored = {column.name for column in output.columns(file.mechanism)}
    lacking = [name for load in file.limits for name in load_of(load, file.mechanism).columns if name not in stored]
    if lacking:
        found = f"leaves out columns that [limits] needs: {', '.join(lacking)}"
        file.fault("output.results", found, "add these columns, or remove their limits")


def _check_histories(file: Reading, output: Output, solver: Solver) -> None:
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


def load(
    path: Given,
    n: int | None = None,
    text: str | None = None,
    joint: Joint | None = None,
    joint2: Joint | None = None,
) -> Study:
    """Read a study file, or make a study of its sections.

    Parameters
    ----------
    path : str, Path, mapping or Study
        TOML file; or the sections of one as nested dictionaries, ``{"joint": {"base": "cirelli2021"}, ...}``, whose
        paths start from the working directory. A study is returned as it is, with `n` read again.
    n : int, optional
        Number of joints instead of the file's ``sampling.n``.
    text : str, optional
        TOML to read instead of the file's; `path` is then only what faults and relative paths refer to.
    joint : Joint, optional
        Nominal joint in place of that of ``[joint]``; variants and swept dimensions are read from the file still.
    joint2 : Joint, optional
        Joint 2 of a drive shaft in place of that of ``[shaft.joint2]``.

    Returns
    -------
    Study
        With patterns expanded, units converted and the joint file read.

    Raises
    ------
    InputError
        With every fault of the file, of the joint file and of measured data that it names.
    """
    if is_read(path):
        return path if n is None else load(path.path, n, path.text)
    file = Reading(*rewriting.source(path, text), SECTIONS)
    if n is not None and isinstance(file.data.setdefault("sampling", {}), dict):
        file.data["sampling"]["n"] = n if isinstance(n, bool) or not hasattr(n, "__index__") else n.__index__()
    file.joint, file.joint2 = joint, joint2
    _read(file, READERS)
    _check(file)
    # of joints that the file lists or sweeps, nothing is known where it has faults
    whole = file.sampling is not None and (file.sampling.method not in ("sweep", "cases") or not file.faults)
    if whole and None not in (file.joint, file.operation, file.solver, file.output):
        read: Tolerances = file.scatter
        apart = ("scatter", "shaft", "joint2", "linkage")
        parts = {name: part for name in READERS if name not in apart and (part := getattr(file, name)) is not None}
        parts |= {"tolerances": read.distributions, "entries": read.entries, "axes": read.axes, "lots": read.lots}
        study = Study(file.path, file.text, **parts, notes=file.notes)
        with gather(file.faults):
            study.check_mounting()
    file.finish("sampling.n" if n is not None else "")
    return study


def _read(file: Reading, names: Iterable[str]) -> None:
    """Make parts of sections; one that is there already stays. Faults of a linkage, which gives names, end it."""
    for name in names:
        if getattr(file, name) is None:
            with gather(file.faults):
                setattr(file, name, READERS[name](file))
            if name == "linkage" and "mechanism" in file.data and file.linkage is None:
                file.finish()


def load_case(path: Given) -> Study:
    """Read a case, see `load`: one joint with its errors, a study whose only joint has its fixed errors.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    if is_read(path):
        return path
    file = Reading(*rewriting.source(path), OF_CASE)
    if "sampling" in file.data:
        remedy = (
            f"run it with: tolstat run {file.path}; a measured joint: tolstat evaluate {file.path} --in CSV --out CSV"
        )
        raise input_error(file.place, "is a study, not a case of one joint", remedy)
    _read(file, ["joint", "linkage", "joint2", "shaft"])
    file.points = ()
    with gather(file.faults):
        file.points = (Point("", points.operation(file), 1.0),)
    _read(file, ["operation", "solver", "errors", "limits"])
    if file.solver is not None and file.solver.fidelity == "auto":
        remedy = 'write "dynamic", "quasistatic" or "ideal"'
        file.fault("solver.fidelity", "'auto' needs the joints of a campaign, a case has one joint", remedy)
    if None in (file.joint, file.operation, file.solver, file.errors):
        file.finish()
    one, parts = Sampling(method="cases"), (file.joint, file.operation, file.solver, file.errors)
    case = Study(file.path, file.text, *parts, one, Output(), file.points, limits=file.limits)
    with gather(file.faults):
        case.check_mounting()
    file.finish()
    return case


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
    with collected() as faults:
        if not study.tolerances:
            remedy = 'give a study with [tolerances] and sampling.method = "random"'
            faults.append(Fault(str(study.path), "has no tolerances to draw joints from", remedy))
        for load in (loads_of(study.mechanism)[name] for name in sampling["levels"]):
            if not holds(study.columns, load):
                found, remedy = f"leaves out {load.name}, which --limit needs", f"add {', '.join(load.columns)}"
                faults.append(study.fault("output.results", found, remedy))
        kept = study.sampling.model_dump(include=set(Subset.FROM_STUDY))
        with gather(faults):
            read = validate(Subset, kept | {"n": sampling["per_level"]} | dict(sampling), "subset simulation")
    output = study.output.model_copy(update={"histories": "none"})
    return replace(study, sampling=read, output=output)
