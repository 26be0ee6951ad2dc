"""Linkages of a study: ``[mechanism]``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from tolstat.common.errors import InputError, gather
from tolstat.joint import Joint, Linkage
from tolstat.joint.derived import BEARING
from tolstat.joint.linkage import PairOf
from tolstat.joint.linked import joint_of
from tolstat.joint.model import leaves
from tolstat.study.selection import Reading
from tolstat.study.tolerances import fits

OF_A_PAIR = ("material", "pin", "arm", "cross", "thrust", "friction", "bushing", "contact", "bearing")
"""Sections of the study's joint that a pair may have keys in place of."""


def read(file: Reading) -> Linkage | None:
    """``[mechanism]``: members and pairs; None if there is none, or with faults."""
    if "mechanism" not in file.data:
        return None
    before = len(file.faults)
    with gather(file.faults):
        linkage = file.model(Linkage, file.data["mechanism"], "mechanism")
        for key, *texts in linkage.faults():
            file.fault(f"mechanism.{key}", *texts)
        if "shaft" in file.data:
            file.fault("shaft", "has no effect beside a mechanism", "remove one of the two")
        for name, pair in linkage.pair.items():
            if file.joint is not None:
                _check_own(file, f"mechanism.pair.{name}", pair, file.joint)
        if len(file.faults) == before:
            with _gather_as(file, "mechanism"):
                _ = linkage.chain
    return linkage if len(file.faults) == before else None


def _check_own(file: Reading, key: str, pair: PairOf, joint: Joint) -> None:
    """Note faults of the keys of a pair in place of those of the study's joint."""
    given = leaves(pair.joint)
    for section in pair.joint:
        if section not in OF_A_PAIR:
            file.fault(f"{key}.joint.{section}", "is nothing of a pin or eye", f"give {', '.join(OF_A_PAIR)}")
        elif section in ("thrust", "friction") and section not in joint.parts:
            found, remedy = "has no effect: the study's joint has none", f"give [joint.{section}], for all pairs, too"
            file.fault(f"{key}.joint.{section}", found, remedy)
    if pair.clearance is not None and "contact.clearance" in given:
        file.fault(f"{key}.clearance", "is given as joint.contact.clearance, too", "give the latter alone")
    for diameter in BEARING:
        if file.fit is not None and diameter in given:
            file.fault(f"{key}.joint.{diameter}", *fits.BESIDE)
    with gather(file.faults):
        joint_of(pair, joint, f"{file.place}: {key}.joint")


@contextmanager
def _gather_as(file: Reading, key: str) -> Iterator[None]:
    """Note the faults that are raised inside as those of a key."""
    try:
        yield
    except InputError as error:
        for fault in error.faults:
            file.fault(key, fault.found, fault.remedy)
