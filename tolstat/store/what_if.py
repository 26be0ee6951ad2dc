"""The group ``what_if`` of a result file: joints of the campaign's seed with one change, and their loads."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import Fault
from tolstat.store.hdf5 import DAMAGE_ERRORS, put_attributes, text
from tolstat.store.layout import GROUPS, MEANINGS, put_meanings
from tolstat.store.reader import Reader
from tolstat.store.writer import Writer

LOG = logging.getLogger("tolstat.store")
GROUP = "what_if"
COMMANDS = (("causes", " --run"), ("assumptions", " --run"), ("change", " ..."), ("allocate", " ..."))
"""Commands that simulate changes."""
DATASETS = {
    "sample": ("i8", "1", "number of the sample; of an exchange, of the pair of samples 2 i and 2 i + 1"),
    "load": (h5py.string_dtype(), "1", "name of the load, of several operating points with that of the point"),
    "loads": ("f8", "N, N*m", "largest loads over the revolution; NaN without a valid one"),
    "status": ("u1", "1", "outcome of the simulation; of several operating points that of the point that decides"),
}
"""Type, unit and description of each dataset of a set; the first two are the scales of the others."""


class Altered(NamedTuple):
    """Loads of consecutive joints with one change of the tolerances or of the joint.

    Attributes
    ----------
    about : dict
        The change, as JSON values: ``kind`` (``width``, ``fit``, ``exchange``, ``joint``, ``study`` or ``as drawn``),
        ``label``, ``seed``, and what determines the errors, ``keys`` of the joint, or what ``differs`` in the study.
    first : int
        Sample of the first joint; of an exchange, the number of the first pair.
    names : tuple of str
        The loads, (k,); of a campaign at several operating points each with one of them, ``cross1.F at cruise``.
    loads : ndarray, shape (n, k)
        SI, NaN for a joint without a valid load at that point.
    status : ndarray of uint8, shape (n,)
        `tables.Status` of each joint; of several operating points that of the point that decides, `worst.deciding`.
    """

    about: Mapping[str, Any]
    first: int
    names: tuple[str, ...]
    loads: NDArray[np.float64]
    status: NDArray[np.uint8]

    @property
    def end(self) -> int:
        """Number after that of the last joint."""
        return self.first + len(self.status)

    def holds(self, names: Sequence[str]) -> bool:
        """Whether all these loads are among `names`."""
        return set(names) <= set(self.names)

    def valid(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Largest of some loads of each joint, NaN where one of them is not valid, (n,)."""
        return np.asarray(np.max(self.loads[:, [self.names.index(name) for name in names]], axis=1))


def key(about: Mapping[str, Any]) -> str:
    """Digest of a change: the name of its set in the file. The words for what differs in a study do not count."""
    about = {name: value for name, value in about.items() if name != "label" or "differs" not in about}
    return hashlib.sha256(json.dumps(about, sort_keys=True, allow_nan=False).encode()).hexdigest()[:16]


def read(store: Reader) -> dict[str, Altered]:
    """Read all sets, by the digest of their change; damaged ones are left out with a warning, and so run again."""
    altered, lost = _read(store)
    if lost:
        sets = "1 change" if lost == 1 else f"{lost} changes"
        commands = (f"tolstat {name} {store.path}{end}" for name, end in COMMANDS)
        remedy = f"simulate them again: {', '.join(commands)}"
        found = f"the joints of {sets} of what_if are damaged and left out"
        LOG.warning("warning: %s", Fault(str(store.path), found, remedy))
    return altered


def damaged(store: Reader) -> int:
    """Number of sets that do not match their checksum."""
    return _read(store)[1]


def _read(store: Reader) -> tuple[dict[str, Altered], int]:
    """Sets by the digest of their change, and number of damaged ones."""
    group_of_sets = store.group(GROUP, at_point=False)
    sets: dict[str, Altered] = {}
    lost = 0
    for name, group in {} if group_of_sets is None else group_of_sets.items():
        try:
            altered = Altered(
                json.loads(text(group.attrs, "change")),
                int(group["sample"][0]),
                tuple(group["load"].asstr()[:].tolist()),
                np.asarray(group["loads"][:], float),
                np.asarray(group["status"][:], np.uint8),
            )
            sound = text(group.attrs, "check") == _check(altered) and key(altered.about) == name
        except DAMAGE_ERRORS:  # not what `write` writes
            sound = False
        if sound:
            sets[name] = altered
        else:
            lost += 1
    return sets, lost


def write(store: Writer, sets: Mapping[str, Altered]) -> None:
    """Write sets to a result file; those it has of the same changes are replaced.

    Raises
    ------
    StoreError
        When there is no room for a second copy of the file.
    """
    growth = sum(altered.loads.nbytes + altered.status.nbytes for altered in sets.values())
    store.replace(lambda file: _write(file, sets), growth)


def _write(file: h5py.File, sets: Mapping[str, Altered]) -> None:
    group = file.require_group(GROUP)
    put_attributes(group, {"description": GROUPS[GROUP]})
    for name, altered in sets.items():
        if name in group:
            del group[name]
        holder = group.create_group(name)
        change, seed = json.dumps(dict(altered.about), allow_nan=False), int(altered.about["seed"])
        about = ": ".join(str(altered.about[word]) for word in ("kind", "label", "step") if word in altered.about)
        put_attributes(holder, {"description": about, "change": change, "seed": seed, "check": _check(altered)})
        columns = {"sample": np.arange(altered.first, altered.end), "load": np.array(altered.names, dtype=object)}
        for column, values in (columns | {"loads": altered.loads, "status": altered.status}).items():
            dtype, unit, description = DATASETS[column]
            dataset = holder.create_dataset(column, data=values, dtype=dtype)
            put_attributes(dataset, {"units": unit, "description": description})
            if column in columns:
                dataset.make_scale(column)
                continue
            for k, scale in enumerate(list(columns)[: dataset.ndim]):
                dataset.dims[k].attach_scale(holder[scale])
        put_meanings(holder["status"], MEANINGS["status"])


def _check(altered: Altered) -> str:
    """SHA-256 of a set: its change, numbers, loads and states."""
    head = json.dumps([dict(altered.about), altered.first, altered.names], sort_keys=True, allow_nan=False)
    digest = hashlib.sha256(head.encode())
    for values in (altered.loads.astype("<f8"), altered.status):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
