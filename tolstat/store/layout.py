"""Layout of a result file: each object is reached by hard links and stored as this package writes it.

Checked before anything is read, so that no link leads to another file, no filter or virtual dataset enlarges what is
read, and no length that a file states is used to allocate memory before the file is known to hold that many bytes. The
functions of HDF5 are called directly: a file has some 200 datasets, and h5py's objects would take a second for them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

import h5py
import numpy as np
from h5py import h5a, h5d, h5f, h5g, h5l, h5o, h5t, h5z

ObjectID: TypeAlias = h5d.DatasetID | h5g.GroupID

FILTERS = [h5z.FILTER_SHUFFLE, h5z.FILTER_DEFLATE]
"""Filters of histories, in their order; other datasets have none."""
MAX_COMPRESSION = 1100
"""Largest compression ratio accepted (deflate cannot exceed 1032): a dataset that claims more is incomplete."""
MAX_OBJECTS = 100_000
"""Largest number of links in a file: each operating point of a campaign has some 200."""
MAX_LEVELS = 6
"""Largest number of groups inside each other: ``points/NAME/verify/CHECK`` has four."""
OF_SCALES = (b"DIMENSION_LIST", b"REFERENCE_LIST")
"""Attributes in which HDF5 itself keeps references, for dimension scales; nothing follows them."""
HISTORIES = "histories"
"""Name of the groups whose datasets are compressed; there are texts among them, the names along an axis."""
WHAT_IF = "what_if"
"""Group whose sets have the names of their loads as texts."""


class Stored(NamedTuple):
    """Shape and HDF5 type of a dataset."""

    shape: tuple[int, ...]
    type: h5t.TypeID

    def __str__(self) -> str:
        return f"{self.shape} of {self.type.dtype}"


class Layout(NamedTuple):
    """What one walk through a file finds.

    Attributes
    ----------
    values : list of (str, str, str)
        What `values` returns.
    datasets : dict of str to Stored
        Datasets by path, such as ``/results/status``.
    """

    values: list[tuple[str, str, str]]
    datasets: dict[str, Stored]


def check(file: h5py.File, compressed: str = HISTORIES) -> Layout:
    """Check the layout of a whole file; its attributes are read in the same walk.

    Parameters
    ----------
    file : h5py.File
        The file.
    compressed : str
        Name of the groups whose datasets may be compressed; empty for the root.

    Raises
    ------
    ValueError
        With the first object that is linked from elsewhere, or stored otherwise than this package does.
    """
    size = file.id.get_filesize()
    found = Layout([], {})
    for path, held in objects(file):
        if isinstance(held, h5d.DatasetID):
            parts = path.split("/")
            inside = parts[-2] == compressed
            named = inside or (parts[1], parts[-1]) == (WHAT_IF, "load")
            found.datasets[path] = _check_dataset(path, held, size, inside, named)
        for name, attribute in _attributes(held):
            stored = attribute.get_type()
            if stored.get_class() not in (h5t.STRING, h5t.INTEGER, h5t.FLOAT):
                raise ValueError(f"attribute {name} of {path} is neither text nor number")
            found.values.append((path, name, _value(attribute, stored)))
    return found


def values(file: h5py.File) -> list[tuple[str, str, str]]:
    """Path, name and value as text of each attribute of a file, in an order that does not depend on how it was made."""
    return [
        (path, name, _value(attribute, attribute.get_type()))
        for path, held in objects(file)
        for name, attribute in _attributes(held)
    ]


def objects(holder: h5py.Group) -> Iterator[tuple[str, ObjectID]]:
    """Yield path and identifier of a group and of everything in it, sorted by path; each link must be a hard one.

    Raises
    ------
    ValueError
        For another link, a group with two links, or more objects or levels than a campaign has.
    """
    yield "/", holder.id
    yield from _inside(holder.id, "", 0, {h5o.get_info(holder.id).addr}, [0])


def _inside(
    group: h5g.GroupID, above: str, level: int, seen: set[int], count: list[int]
) -> Iterator[tuple[str, ObjectID]]:
    for name in sorted(group):
        path = f"{above}/{name.decode('utf-8')}"
        count[0] += 1
        if count[0] > MAX_OBJECTS or level > MAX_LEVELS:
            raise ValueError(f"{path} is one of more groups and datasets than a campaign has")
        if group.links.get_info(name).type != h5l.TYPE_HARD:
            raise ValueError(f"{path} is a link to another place")
        held = h5o.open(group, name)
        if not isinstance(held, (h5d.DatasetID, h5g.GroupID)):
            raise ValueError(f"{path} is neither a dataset nor a group")
        yield path, held
        if isinstance(held, h5g.GroupID):
            address = h5o.get_info(held).addr
            if address in seen:
                raise ValueError(f"{path} is a second link to a group")
            seen.add(address)
            yield from _inside(held, path, level + 1, seen, count)


def _attributes(held: ObjectID | h5f.FileID) -> Iterator[tuple[str, h5a.AttrID]]:
    """Yield the attributes of an object by name, sorted, but for those of dimension scales."""
    names: list[bytes] = []
    h5a.iterate(held, names.append)
    for name in sorted(names):
        if name not in OF_SCALES:
            yield name.decode("utf-8"), h5a.open(held, name)


def _value(attribute: h5a.AttrID, stored: h5t.TypeID) -> str:
    """Value of an attribute as text, independent of how HDF5 stores it: texts of fixed and variable length agree."""
    if stored.get_class() == h5t.STRING and not stored.is_variable_str() and stored.get_strpad() == h5t.STR_NULLPAD:
        # nearly all attributes: their bytes are read as they are, since h5py takes as long again to make a dtype
        held = np.zeros(attribute.shape, f"S{stored.get_size()}")
        attribute.read(held, mtype=stored)
    else:
        held = np.empty(attribute.shape, dtype=attribute.dtype)
        attribute.read(held)
    plain = held.tolist()
    if isinstance(plain, bytes):
        return plain.rstrip(b"\0").decode("utf-8")
    return plain if isinstance(plain, str) else repr(plain)


def _check_dataset(path: str, held: h5d.DatasetID, size: int, compressed: bool, texts: bool) -> Stored:
    made = held.get_create_plist()
    layout = made.get_layout()
    if made.get_external_count() or layout == h5d.VIRTUAL:
        raise ValueError(f"{path} has its data in another file")
    filters = [made.get_filter(k)[0] for k in range(made.get_nfilters())]
    stored_type = held.get_type()
    itemsize = stored_type.get_size()  # h5py takes ten times as long to make a dtype
    found = Stored(held.shape, stored_type)
    nbytes = itemsize * math.prod(found.shape)
    if compressed and layout == h5d.CHUNKED:
        if filters != FILTERS:
            raise ValueError(f"{path} is not compressed as histories are")
        chunk = itemsize * math.prod(made.get_chunk())
        if max(nbytes, chunk) > MAX_COMPRESSION * held.get_storage_size():
            raise ValueError(f"{path} is incomplete")
        return found
    if layout != h5d.CONTIGUOUS or filters:
        raise ValueError(f"{path} is not stored contiguously")
    kind = stored_type.get_class()
    if kind not in (h5t.INTEGER, h5t.FLOAT) and not (texts and kind == h5t.STRING):
        raise ValueError(f"{path} does not hold numbers")
    offset, stored = held.get_offset(), held.get_storage_size()
    if offset is None or stored < nbytes or offset + stored > size:
        raise ValueError(f"{path} reaches beyond the end of the file")
    return found
