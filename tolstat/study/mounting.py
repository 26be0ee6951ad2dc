"""What holds the shafts and pins of a study: settings without effect or against each other, and notes.

Axial forces on a rigid shaft and swings without orders have no effect; notes say where rigid shafts decide, and where
nothing holds pins along their holes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from tolstat.common.cardan import PARTS
from tolstat.common.mechanism import Mechanism
from tolstat.common.shell import quote
from tolstat.common.toml_lines import KeyPath
from tolstat.joint import SPLINE, Joint, Operation, OperationOfLinkage, OperationOfShaft, joints_of, mechanism_of
from tolstat.joint.ideal import NO_CLOSED_FORM
from tolstat.joint.operation import parts_of, unbalances
from tolstat.joint.sections import FREE, RIGID, Shaft
from tolstat.study.axes import columns_of

FORCE = "operation.axial_force"
Varied = Mapping[str, Collection[str]]


class Setting(NamedTuple):
    """A joint at an operating point.

    Attributes
    ----------
    path : tuple
        Key path of the operating point in the file.
    joint, operation : Joint, Operation
        The joint, of a drive shaft joint 1, and the point.
    fidelity : str
        ``solver.fidelity``.
    """

    path: KeyPath
    joint: Joint
    operation: Operation
    fidelity: str

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joint, or both of a drive shaft."""
        return joints_of(self.joint, self.operation)

    @property
    def output(self) -> Shaft:
        """The output shaft, that of the last joint."""
        return self.joints[-1].shaft

    def moved(self, varied: Varied) -> bool:
        """Whether an axial force moves the output shaft; `varied` as in `refusals`."""
        return self.output.slides and bool({FORCE, SPLINE} & varied.keys() or self.operation.axial_force != 0.0)


def no_closed_form(settings: Iterable[Setting], varied: Varied) -> Iterator[tuple[str, str]]:
    """Why closed forms do not hold for some joints, and the remedy, of each reason; `varied` as in `refusals`."""
    every, remedy = list(settings), 'write "quasistatic" or "dynamic"'
    if any(setting.moved(varied) for setting in every):
        yield NO_CLOSED_FORM
    if any(joint.friction.mu is not None for setting in every for joint in setting.joints):
        yield "'ideal' does not hold with friction, which its closed forms leave out", remedy
    if any(isinstance(setting.operation, OperationOfLinkage) for setting in every):
        yield "'ideal' does not hold for a linkage: its closed forms are those of one joint", remedy
    if any(isinstance(setting.operation, OperationOfShaft) for setting in every):
        yield "'ideal' does not hold for a drive shaft: its closed forms are those of one joint", remedy


def idle_forces(settings: Sequence[Setting], varied: Varied) -> Iterator[tuple[KeyPath, str, str]]:
    """Refuse axial forces, and their scatter, on output shafts that are rigid; parameters and items as `refusals`."""
    if any(isinstance(setting.operation, OperationOfLinkage) for setting in settings):
        return
    if not any(setting.output.slides for setting in settings):
        paths = [(*setting.path, "axial_force") for setting in settings if setting.operation.axial_force]
        own = [setting.joint for setting in settings if not isinstance(setting.operation, OperationOfShaft)]
        paths += [("joint", "shaft", "spline")] * any(joint.shaft.spline for joint in own)
        remedy = 'write shaft.axial = "free" or a stiffness under [joint], or ' * bool(own) + "remove it"
        for path in dict.fromkeys([*paths, *((section, *FORCE.split(".")) for section in varied.get(FORCE, ()))]):
            yield path, "has no effect: the output shaft is rigid along its axis", remedy


def refusals(settings: Sequence[Setting], varied: Varied) -> Iterator[tuple[KeyPath, str, str]]:
    """Refuse what has no effect, closed forms where they do not hold, and joints with different parts.

    Of drive shafts, refuse what only one joint can have, and what holds no tube. For forces see `idle_forces`.

    Parameters
    ----------
    settings : sequence of Setting
        All joints of a study at all of their operating points.
    varied : mapping
        Errors that scatter or are swept, to the sections of the study in which they do.

    Yields
    ------
    tuple
        Key path, what was found, remedy.
    """
    of_shafts = [setting for setting in settings if isinstance(setting.operation, OperationOfShaft)]
    for key in ("speed", "torque"):
        if not any(getattr(setting.operation, f"{key}_orders") for setting in settings):
            remedy = f"write operation.{key} = {{ mean = ..., orders = [...] }}, or remove it"
            for section in varied.get(f"operation.{key}_swing", ()):
                yield (section, "operation", f"{key}_swing"), f"has no effect: the {key} has no orders", remedy
    for part in PARTS:
        if len({part in parts_of(setting.joint, setting.operation) for setting in settings}) > 1:
            found = f"some joints of the study have {part.replace('_', ' ')}, others have none"
            yield ("joint",), found, "give it to all of them, or to none"
    for body, (unbalance, _) in (found for s in settings for found in unbalances(s.joint, s.operation).items()):
        if unbalance and unbalance.angle is None and not varied.get(f"{body}.unbalance_angle"):
            uniform = '{ plus_minus = "180 deg", distribution = "uniform" }'
            path, bodies = ((*_last(settings), "shaft"), body) if body == "output" else (("shaft", "tube"), "tube*")
            remedy = f'write "{bodies}.unbalance_angle" = {uniform} under [tolerances], or give its angle'
            yield (*path, "unbalance"), "has no direction", remedy
    for k, path in enumerate(dict.fromkeys((("joint",), _last(of_shafts)))):
        joints = [setting.joints[k] for setting in of_shafts]
        if any(joint.thrust is None for joint in joints):
            found = "missing: pins that slide freely locate no tube across its axis"
            yield (*path, "thrust"), found, 'give end_play = "0.02 mm" and k = "1e8 N/m", of yours, or remove [shaft]'
        if any(joint.shaft.spline for joint in joints):
            remedy = "write shaft.spline, that of the tubes, or remove it"
            yield (*path, "shaft", "spline"), "is that of one joint", remedy
    if any(setting.output.axial == FREE for setting in of_shafts if mechanism_of(*setting[1:3]).spline):
        remedy = 'write axial = "rigid"'
        yield (*_last(of_shafts), "shaft", "axial"), "is free beside a spline: nothing holds the shaft", remedy
    for own, first in {(s.operation.joint2.bearing, s.joint.bearing) for s in of_shafts if s.operation.joint2}:
        for key in ("required_life", "reliability"):
            if own and first and getattr(own, key) not in (None, getattr(first, key)):
                found = "differs from that of joint 1: one life is required of both together"
                yield ("shaft", "joint2", "bearing", key), found, f"leave it out, or write {key} of joint 1 the same"
    for texts in no_closed_form((setting for setting in settings if setting.fidelity == "ideal"), varied):
        yield ("solver", "fidelity"), *texts


def _last(settings: Iterable[Setting]) -> tuple[str, ...]:
    """Key path of the last joint."""
    return ("shaft", "joint2") if any(setting.operation.joint2 for setting in settings) else ("joint",)


def with_free_shaft(study: str, stem: str, joint: Joint) -> str:
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


def note_on_shafts(toleranced: Iterable[str], axial: Iterable[float | str], mechanism: Mechanism, command: str) -> str:
    """Say what rigid shafts do to errors along them, and the command that tries a free one.

    Parameters
    ----------
    toleranced : iterable of str
        Errors and zones that scatter.
    axial : iterable of float or str
        ``shaft.axial`` of each variant.
    mechanism : Mechanism
        What is simulated.
    command : str
        The command.

    Returns
    -------
    str
        Empty where a shaft may move or a spline gives way, or no error along the shafts scatters.
    """
    along = any(column.endswith(".offset_z") for name in toleranced for column in columns_of(name))
    if not along or not mechanism.cardan or mechanism.spline or any(value != RIGID for value in axial):
        return ""
    return (
        "errors along the shafts (offset_z) scatter, and shafts that are rigid along their axes cannot give way to "
        f"them: some loads are larger than with a spline.\nWith a free output shaft: {command}"
    )


def note_on_pins(toleranced: Iterable[str], mechanism: Mechanism) -> str:
    """Say that errors along pins have hardly any effect where nothing holds the pins.

    Parameters
    ----------
    toleranced : iterable of str
        Errors and zones that scatter; without one along a pin there is nothing to say.
    mechanism : Mechanism
        What is simulated; with thrust faces there is nothing to say.
    """
    along = any(column.endswith(".offset_e") for name in toleranced for column in columns_of(name))
    if not along or mechanism.faces:
        return ""
    return (
        "errors along the pins (offset_e) scatter, and have hardly any effect: without thrust faces pins slide freely "
        "along their holes. Snap rings and cups that hold them: joint.thrust, see tolstat docs study."
    )
