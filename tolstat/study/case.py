"""A case: one joint with its errors, read from a TOML file."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path

from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import dotted, with_lines
from tolstat.joint import Joint, Operation
from tolstat.study import mounting
from tolstat.study.file import OF_CASE, StudyFile
from tolstat.study.model import Solver
from tolstat.study.mounting import Setting
from tolstat.study.points import Point


@dataclass(frozen=True, repr=False)
class Case:
    """One joint to be simulated.

    Attributes
    ----------
    path : Path
        The file.
    text : str
        The file as read.
    joint : Joint
        Nominal joint.
    operation : Operation
        Operating point.
    solver : Solver
        Numerical settings.
    errors : dict
        Error name to deviation (SI).
    """

    path: Path
    text: str
    joint: Joint
    operation: Operation
    solver: Solver
    errors: dict[str, float]

    @property
    def name(self) -> str:
        """Name of the file without folder and ending."""
        return self.path.stem

    def fault(self, key: str, found: str, remedy: str) -> Fault:
        """Fault of a key of the file, with its line."""
        (lined,) = with_lines([Fault(f"{self.path}: {key}", found, remedy)], str(self.path), self.text)
        return lined

    def __repr__(self) -> str:
        errors = f"{len(self.errors)} errors" if self.errors else "no errors"
        return f"<case {self.name!r}: one joint, {errors}, {self.solver.fidelity}>"

    def _repr_html_(self) -> str:
        rows = (f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in self._entries())
        return f"<table><caption>{escape(repr(self)[1:-1])}</caption>{''.join(rows)}</table>"

    def _entries(self) -> list[tuple[str, object]]:
        """Named values that a notebook shows."""
        solver, turned = self.solver, Point("", self.operation).in_words
        words = f"{solver.fidelity}, {solver.method}, {solver.steps_per_rev} steps a revolution"
        errors = ", ".join(f"{name} {value:.4g}" for name, value in self.errors.items()) or "none"
        return [("file", str(self.path)), ("operation", turned), ("solver", words), ("fixed errors, SI", errors)]


def load_case(path: str | Path) -> Case:
    """Read a case file: one joint with its errors.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    file = StudyFile(Path(path), OF_CASE)
    if "sampling" in file.data:
        raise InputError(
            [Fault(file.place, "is a study, not a case of one joint", f"run it with: tolstat run {file.path}")]
        )
    joint = file.joint()
    operation = file.model("operation", Operation, required=True)
    solver = file.model("solver", Solver)
    errors = file.errors()
    if solver is not None:
        file.check_one_joint(solver)
    file.finish()
    assert joint is not None
    assert operation is not None
    assert solver is not None
    case = Case(file.path, file.text, joint, operation, solver, errors)
    found = mounting.refusals([Setting(("operation",), joint, operation, solver.fidelity)], {})
    if faults := [case.fault(dotted(path), text, remedy) for path, text, remedy in found]:
        raise InputError(faults)
    return case
