"""Linkages of a study: ``[mechanism]``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from tolstat.common.errors import InputError, gather
from tolstat.joint import Linkage
from tolstat.study.selection import Reading


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
        if len(file.faults) == before:
            with _gather_as(file, "mechanism"):
                _ = linkage.chain
    return linkage if len(file.faults) == before else None


@contextmanager
def _gather_as(file: Reading, key: str) -> Iterator[None]:
    """Note the faults that are raised inside as those of a key."""
    try:
        yield
    except InputError as error:
        for fault in error.faults:
            file.fault(key, fault.found, fault.remedy)
