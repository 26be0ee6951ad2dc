"""Numbers of joints that another program gives: by name where a table has names, else by position."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import Fault, input_error, raise_all
from tolstat.common.strict import did_you_mean

Array = NDArray[np.float64]

NO_NUMBERS = "has values that are no real numbers", "give a number for each joint and error, in SI units"
MAX_NAMED = 5
"""Most columns of one kind that a message names."""


def columns_of(values: Any, needed: Sequence[str], others: Collection[str], attribute: str) -> dict[str, Array]:
    """Columns of a table of numbers, row i of joint i.

    Parameters
    ----------
    values : DataFrame, mapping, structured array, or array of shape (n, d)
        With names its columns may have any order; an array without names has those of `needed`, in this order.
    needed : sequence of str
        Names of columns that it must have.
    others : collection of str
        Names of columns that a table with names may have, too.
    attribute : str
        Attribute of `Function` that lists `needed`.

    Returns
    -------
    dict of str to ndarray, (n,)

    Raises
    ------
    InputError
        With the faults of a table with names: columns that it lacks, has twice, or that mean nothing here; columns that
        are no numbers, or of other lengths than the first.
    ValueError
        When an array without names has not one column for each of `needed`.
    """
    names = _names(values)
    if names is None:
        return dict(zip(needed, _by_position(values, needed, attribute), strict=True))
    known, place = [*needed, *others], "columns of the joints"
    faults = _faults_of_names(names, needed, known, place, attribute)
    columns: dict[str, Array] = {}
    for name in (name for name in known if names.count(name) == 1):
        try:
            columns[name] = np.ascontiguousarray(_floats(values[name]))
        except (TypeError, ValueError):
            faults.append(Fault(f"{place}: {name}", *NO_NUMBERS))
    shapes = {name: column.shape for name, column in columns.items()}
    first = next(iter(shapes.values()), (0,))
    for name, shape in shapes.items():
        if len(shape) != 1 or shape != first:
            remedy = f"give one dimension of length {first[0] if first else 1}"
            faults.append(Fault(f"{place}: {name}", f"has shape {shape}", remedy))
    raise_all(faults)
    return columns


def _names(values: Any) -> list[Hashable] | None:
    """Names of the columns of a table; None if it has none."""
    if isinstance(values, np.ndarray):
        return None if values.dtype.names is None else list(values.dtype.names)
    names = getattr(values, "columns", values if isinstance(values, Mapping) else None)
    return None if names is None else list(names)


def _faults_of_names(
    names: list[Hashable], needed: Sequence[str], known: list[str], place: str, attribute: str
) -> list[Fault]:
    """Faults of the names of columns: those that are missing, twice, or unknown."""
    missing = [name for name in needed if name not in names]
    twice = [name for name in known if names.count(name) > 1]
    unknown = [name for name in names if name not in known]
    faults = []
    if missing:
        faults.append(Fault(place, f"lack {_listed(missing)}", f"give a column for each of f.{attribute}"))
    if twice:
        faults.append(Fault(place, f"have more than one {_listed(twice)}", "give one"))
    if any(not isinstance(name, str) for name in unknown):
        remedy = "give names such as 'pin1.tilt_t'; of a table read with two lines of headers: x.droplevel(1, axis=1)"
        faults.append(Fault(place, f"have names that are no text: {_listed(unknown)}", remedy))
    elif len(unknown) > 1:
        faults.append(Fault(place, f"have unknown ones: {_listed(unknown)}", f"leave them out: x[f.{attribute}]"))
    elif unknown:
        faults.append(Fault(place, f"{unknown[0]!r} is unknown", did_you_mean(str(unknown[0]), known)))
    return faults


def _floats(values: Any) -> Array:
    """Values as floats.

    Raises
    ------
    TypeError, ValueError
        When some are no real numbers.
    """
    array = np.asarray(values)
    if array.dtype.kind == "c":  # of which numpy would take the real part
        raise TypeError
    return array.astype(float)


def _listed(names: Sequence[Hashable]) -> str:
    """The first names of a list, and the number of the others."""
    more = len(names) - MAX_NAMED
    return ", ".join(map(str, names[:MAX_NAMED])) + f" and {more} more" * (more > 0)


def _by_position(values: Any, needed: Sequence[str], attribute: str) -> list[Array]:
    try:
        table = _floats(values)
    except (TypeError, ValueError) as error:
        raise input_error("array of the joints", *NO_NUMBERS) from error
    if table.ndim != 2 or table.shape[1] != len(needed):
        wanted = f"(n, {len(needed)}), a row for each joint and a column for each of f.{attribute}"
        remedy = "; give [x] for one joint" if table.shape == (len(needed),) else ""
        raise ValueError(f"an array of shape {wanted} is needed, not {table.shape}{remedy}")
    return [np.ascontiguousarray(column) for column in table.T]
