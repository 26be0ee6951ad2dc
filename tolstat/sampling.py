"""From a study to the errors of all its joints, drawn before anything runs.

The errors of joint i depend on the seed, i and the error's name only: not on the number of joints, and not on
other errors that are added to the study later (`lhs` excepted, whose strata are as many as its joints).
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.joint import nominal_errors
from tolstat.study import Study
from tolstat.study.design import Design, sobol
from tolstat.study.model import SweepAxis
from tolstat.study.selection import columns_of
from tolstat.tables import ERROR_FIELDS

Array = NDArray[np.float64]
Table = NDArray[np.void]


def draw(study: Study) -> Table:
    """Draw the errors of all joints of a study.

    Parameters
    ----------
    study : Study
        What to draw.

    Returns
    -------
    ndarray, (study.rows,), dtype ERROR
        Row 0 is the nominal joint when ``sampling.nominal_first`` is true: no error of any kind, not even the
        study's fixed ones. The other rows are samples 0, 1, 2, ...
    """
    table = nominal_errors(study.rows, study.operation)
    samples = table[int(study.sampling.nominal_first) :]
    for name, value in study.errors.items():
        samples[name] = value
    if study.sampling.method == "sweep":
        _fill_grid(samples, study.sweep)
    elif study.listed is not None:
        _fill_listed(samples, study.listed)
    else:
        _fill_scatter(samples, study)
    return table


def dimensions() -> dict[str, int]:
    """Sobol' dimension of each error: its place in the table, whichever errors a study lets scatter.

    New errors must be appended to the table: SciPy's scrambling gives all dimensions other values when their
    number changes.
    """
    return {field.name: number for number, field in enumerate(ERROR_FIELDS)}


def _fill_grid(samples: Table, axes: Sequence[SweepAxis]) -> None:
    """Product grid of the axes, the last running fastest."""
    values = np.meshgrid(*(np.linspace(a.start, a.stop, a.points) for a in axes), indexing="ij")
    for axis, value in zip(axes, values, strict=True):
        for name in axis.names:
            samples[name] = value.ravel()


def _fill_listed(samples: Table, design: Design) -> None:
    """Point of the grid and errors of the case of each row."""
    for values, index in ((design.points, design.point()), (tuple(design.cases.values()), design.table["case"])):
        for number, fixed in enumerate(values):
            for name, value in fixed.items():
                samples[name][index == number] = value


def _fill_scatter(samples: Table, study: Study) -> None:
    columns = list(dict.fromkeys(column for name in study.tolerances for column in columns_of(name)))
    u = _uniforms(columns, samples.size, study.sampling.method, study.sampling.seed)
    names = study.copula.names
    if names:
        correlated = study.copula.apply(np.column_stack([u[name] for name in names]))
        u |= {name: correlated[:, i] for i, name in enumerate(names)}
    for name, distribution in study.tolerances.items():
        if name.endswith(".offset_radial"):
            t, z = columns_of(name)
            radius, direction = distribution.ppf(u[t]), 2 * np.pi * u[z]
            samples[t], samples[z] = radius * np.cos(direction), radius * np.sin(direction)
        else:
            samples[name] = distribution.ppf(u[name])


def _uniforms(names: Sequence[str], n: int, method: str, seed: int) -> dict[str, Array]:
    """Probabilities in (0, 1), independent from name to name; shape (n,) each."""
    if method == "sobol":
        points = sobol(n, len(ERROR_FIELDS), seed)
        return {name: points[:, dimensions()[name]] for name in names}
    if method == "lhs":
        return {name: _stratified(n, _stream(seed, f"lhs {name}")) for name in names}
    # a stream may give 0 itself, once in 2^53 draws
    return {name: np.maximum(_stream(seed, name).random(n), 2.0**-54) for name in names}


def _stream(seed: int, name: str) -> np.random.Generator:
    """Random stream of one name: counter-based, so that two keys never share a part of a stream."""
    digest = hashlib.blake2b(name.encode(), digest_size=8).digest()
    key = np.array([seed, int.from_bytes(digest, "little")], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key))


def _stratified(n: int, stream: np.random.Generator) -> Array:
    """One value in each of n equal intervals, in random order (Latin hypercube of one dimension)."""
    u = (stream.permutation(n) + stream.random(n)) / n
    return np.clip(u, 2.0**-54, 1 - 2.0**-53)
