"""The nominal joint: what a joint file holds, and how it is read."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from tolstat.common import strict
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import data_dir
from tolstat.common.strict import Strict, refuse
from tolstat.joint.contact import Contact, keys_valid_for
from tolstat.joint.sections import Arm, Array, Bushing, Cross, Hub, Material, Pin, Shaft


class Joint(Strict):
    """A nominal Cardan joint: the sections of a joint file in SI units.

    Arrays of three or six values that the properties return refer to the local axes (e, t, z) of a pin or arm.
    """

    description: Annotated[
        str, Field(description="text about the joint, copied to result files", examples=["gearbox A, drawing 4711"])
    ] = ""
    material: Material
    pin: Pin
    arm: Arm
    hub: Hub
    shaft: Shaft
    cross: Cross
    bushing: Bushing
    contact: Contact

    @field_validator("contact")
    @classmethod
    def _beside_the_centre(cls, value: Contact, info: ValidationInfo) -> Contact:
        cross = info.data.get("cross")
        if cross is not None and value.z >= 2.0 * cross.R:
            keys = ("contact.z", "cross.R")
            remedy = "give contact.z < 2 cross.R, where cross.R = {cross.R}"
            raise refuse("z = {contact.z} reaches past the joint centre", remedy, *keys)
        return value

    @field_validator("contact")
    @classmethod
    def _fits_hertz(cls, value: Contact, info: ValidationInfo) -> Contact:
        """Refuse a load range in which eq. (3) stops rising, because the logarithms of 2 D / b become negative."""
        of = info.data.get("material")
        if value.coefficients == "fitted" and of is not None and not min(value.stiffness(of)) > 0.0:
            raise refuse("the fit to eq. (3) gives no stiffening contact", "give a smaller contact.fit_load")
        return value

    def warnings(self) -> list[Fault]:
        """Settings that can be simulated but are probably not intended, by key path in the joint file."""
        found = "can touch alone with weight 0: nothing damps the whirl of the pin there"
        remedy = "give it a weight, or a station with a weight beyond it"
        return [Fault(f"contact.stations[{i}]", found, remedy) for i in self.contact.undamped_ends()]

    @property
    def k_cross(self) -> Array:
        """Stiffness of a cross bushing (N/m, N*m/rad), shape (6,): the beam's z, x, y are e, t, z."""
        given = self.bushing.cross if self.bushing.stiffness == "given" else None
        k = given or self.pin.beam(self.material)
        return np.array([k.k_z, k.k_x, k.k_y, k.k_tz, k.k_bx, k.k_by])

    @property
    def k_fork(self) -> Array:
        """Stiffness of a fork bushing (N/m, N*m/rad), shape (6,): the beam's y, x, z are e, t, z."""
        given = self.bushing.fork if self.bushing.stiffness == "given" else None
        k = given or self.arm.beam(self.material)
        return np.array([k.k_y, k.k_x, k.k_z, k.k_by, k.k_bx, k.k_tz])


def load(
    base: str | Path,
    overrides: Mapping[str, Any],
    place: str,
    relative_to: Path | None = None,
    section: str = "joint",
) -> Joint:
    """Read a joint file and merge a case's own keys over it.

    Parameters
    ----------
    base : str or Path
        Name of a file in ``data/joints`` without ``.toml``, or a path (it ends in ``.toml`` or has a folder).
    overrides : mapping
        Keys of the case's ``[joint]`` table other than `base`, nested as TOML nests them.
    place : str
        Name of the case file, under which faults of `base` and `overrides` are reported.
    relative_to : Path, optional
        Folder that a relative path is taken from; the working directory by default.
    section : str
        Key path of `base` and `overrides` in the case's file.

    Returns
    -------
    Joint
        The resolved joint.

    Raises
    ------
    InputError
        With every fault: those of the joint file under its name, those of `overrides` under `place`.
    """
    path = _find(base, f"{place}: {section}", relative_to)
    data = strict.read_toml(path)
    with strict.lines_of(path):
        try:
            return strict.validate(Joint, overridden(data, overrides), place)
        except InputError as error:
            raise InputError(_attributed(error.faults, data, path, place, section)) from error


def _find(base: str | Path, place: str, relative_to: Path | None) -> Path:
    path = Path(base)
    if path.suffix == ".toml" or len(path.parts) > 1:
        return (relative_to or Path()) / path
    folder = data_dir() / "joints"
    names = sorted(p.stem for p in folder.glob("*.toml"))
    if str(base) in names:
        return folder / f"{base}.toml"
    close = difflib.get_close_matches(str(base), names, n=1)
    known = f"did you mean {close[0]!r}?" if close else f"write one of {', '.join(names)}, or a path to a .toml file"
    raise InputError([Fault(f"{place}.base", f"no joint is named {str(base)!r}", known)])


def overridden(data: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Replace keys of a joint by those of `over`; where `over` sets a contact law, remove the keys of other laws."""
    contact, own = data.get("contact"), over.get("contact")
    if isinstance(contact, Mapping) and isinstance(own, Mapping) and "law" in own:
        data = {**data, "contact": keys_valid_for(contact, own["law"])}
    return merged(data, over)


def merged(data: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Replace keys of `data` by those of `over`, table by table."""
    result = dict(data)
    for key, value in over.items():
        below = result.get(key)
        if isinstance(below, Mapping) and isinstance(value, Mapping):
            value = merged(below, value)
        result[key] = value
    return result


def _attributed(
    faults: tuple[Fault, ...], data: Mapping[str, Any], path: Path, place: str, section: str
) -> list[Fault]:
    """Report the faults that the joint file has without overrides under its name, the others under `place`."""
    try:
        strict.validate(Joint, data, str(path))
        own = {}
    except InputError as error:
        own = {(f.place.removeprefix(f"{path}: "), f.found): f for f in error.faults}
    attributed = []
    for f in faults:
        key = f.place.removeprefix(f"{place}: ")
        attributed.append(own.get((key, f.found)) or Fault(f"{place}: {section}.{key}", f.found, f.remedy))
    return attributed
