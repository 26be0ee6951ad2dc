"""Settings without effect: axial forces on a rigid shaft, swings without orders; a note where rigid shafts decide."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from shlex import quote
from typing import NamedTuple

from tolstat.joint import Joint, Operation
from tolstat.joint.ideal import NO_CLOSED_FORM
from tolstat.joint.sections import RIGID
from tolstat.study.axes import columns_of

FORCE = "operation.axial_force"
Path = tuple[int | str, ...]
Varied = Mapping[str, Collection[str]]


class Setting(NamedTuple):
    """A joint at an operating point.

    Attributes
    ----------
    path : tuple
        Key path of the operating point in the file.
    joint, operation : Joint, Operation
        The joint and the point.
    fidelity : str
        ``solver.fidelity``.
    """

    path: Path
    joint: Joint
    operation: Operation
    fidelity: str

    def moved(self, varied: Varied) -> bool:
        """Whether an axial force moves the output shaft; `varied` as in `refusals`."""
        return self.joint.shaft.slides and (FORCE in varied or self.operation.axial_force != 0.0)


def refusals(settings: Sequence[Setting], varied: Varied) -> Iterator[tuple[Path, str, str]]:
    """Refuse axial forces and swings without effect, and closed forms where an axial force moves the output shaft.

    Parameters
    ----------
    settings : sequence of Setting
        All joints of a study at all of their operating points.
    varied : mapping
        Errors of the operating point that scatter or are swept, to the sections of the study in which they do.

    Yields
    ------
    tuple
        Key path, what was found, remedy.
    """
    if not any(setting.joint.shaft.slides for setting in settings):
        paths = [(*setting.path, "axial_force") for setting in settings if setting.operation.axial_force]
        remedy = 'write shaft.axial = "free" or a stiffness under [joint], or remove it'
        for path in dict.fromkeys([*paths, *((section, *FORCE.split(".")) for section in varied.get(FORCE, ()))]):
            yield path, "has no effect: the output shaft is rigid along its axis", remedy
    for key in ("speed", "torque"):
        if not any(getattr(setting.operation, f"{key}_orders") for setting in settings):
            remedy = f"write operation.{key} = {{ mean = ..., orders = [...] }}, or remove it"
            for section in varied.get(f"operation.{key}_swing", ()):
                yield (section, "operation", f"{key}_swing"), f"has no effect: the {key} has no orders", remedy
    if any(setting.fidelity == "ideal" and setting.moved(varied) for setting in settings):
        yield ("solver", "fidelity"), *NO_CLOSED_FORM


def command(study: str, stem: str, joint: Joint) -> str:
    """Command that runs a study with an output shaft that is free along its axis.

    Parameters
    ----------
    study, stem : str
        Study file, and its name without ending.
    joint : Joint
        The study's joint; what a free shaft needs and it lacks is in the command, too.
    """
    needed = {"mass": "5 kg", "axial_damping": "2e4 N*s/m"}
    lacking = [f'"joint.shaft.{key}={value}"' for key, value in needed.items() if getattr(joint.shaft, key) is None]
    settings = " ".join(f"--set {setting}" for setting in ("joint.shaft.axial=free", *lacking))
    return f"tolstat run {quote(study)} {settings} --out {quote(f'{stem}_free.h5')}"


def note(toleranced: Iterable[str], axial: Iterable[float | str], command: str) -> str:
    """Say what rigid shafts do to errors along them, and the command that tries a free one.

    Parameters
    ----------
    toleranced : iterable of str
        Errors and zones that scatter.
    axial : iterable of float or str
        ``shaft.axial`` of each variant.
    command : str
        The command.

    Returns
    -------
    str
        Empty where a shaft may move, or no error along the shafts scatters.
    """
    along = any(column.endswith(".offset_z") for name in toleranced for column in columns_of(name))
    if not along or any(value != RIGID for value in axial):
        return ""
    return (
        "errors along the shafts (offset_z) scatter, and shafts that are rigid along their axes cannot give way to "
        "them: some loads are larger than with a spline.\n"
        f"With a free output shaft: {command}"
    )
