"""Draw the errors of a study's joints, before any of them is simulated.

The errors of joint i depend on the seed, i and the error's name only: not on the number of joints, not on which
others are drawn with it, and not on other errors that are added to the study later. Joints that share a lot have the
same scores of the lot, whose number follows from i.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import SUBSET
from tolstat.common.late import special
from tolstat.joint import MEANS, Operation, nominal_errors
from tolstat.study import Given, Study, axes, load
from tolstat.study.design import KEYS, Design
from tolstat.study.tolerances.distributions import score
from tolstat.study.tolerances.zone_laws import plane_scores

Array = NDArray[np.float64]
Table = NDArray[np.void]

BLOCK = 1 << 16
"""Number of rows drawn at a time: a table of 27 MB."""


def draw(study: Given, rows: range | None = None) -> Table:
    """Draw the errors of the joints of a study.

    Parameters
    ----------
    study : Study, str, Path or mapping
        Study whose errors are drawn, see `study.load`.
    rows : range, optional
        Rows to draw, with step 1; all rows of the study by default.

    Returns
    -------
    ndarray, (len(rows),), dtype ERROR
        Row 0 is the nominal joint if the study has one: no error of any kind, not even the study's fixed ones. The
        other rows are samples 0, 1, 2, ...
    """
    study = load(study)
    rows = range(study.rows) if rows is None else rows
    table = nominal_errors(len(rows), study.mechanism)
    numbers = study.sampling.samples(rows)
    samples = table[len(rows) - len(numbers) :]
    for name, value in study.errors.items():
        samples[name] = value
    if study.sampling.method == "sweep":
        _fill_grid(samples, study, numbers)
    elif study.listed is not None:
        _fill_listed(samples, study.listed, numbers)
    else:
        u = _uniforms(streams(study), numbers, study)
        _fill_from(samples, study, u, _of_lots(study, u, numbers) if study.sampling.joints_per_lot > 1 else {})
    return table


def draw_blocks(study: Study, rows: range) -> Iterator[Table]:
    """Draw `rows` of a study as tables of at most `BLOCK` rows, one after the other."""
    for first in range(0, len(rows), BLOCK):
        yield draw(study, rows[first : first + BLOCK])


def origin_blocks(study: Study, rows: range) -> Iterator[Table] | None:
    """Return a table of how `rows` are drawn, those of level 0 of a subset simulation; None for other methods."""
    if study.sampling.method != "subset":
        return None
    table = np.zeros(len(rows), SUBSET)
    table["level"][: len(rows) - len(study.sampling.samples(rows))] = -1  # the nominal joint
    table["parent"] = -1
    return iter([table])


def scores(study: Study, numbers: range) -> Array:
    """Independent standard normal scores from which the errors of a random campaign's samples are computed.

    Returns
    -------
    ndarray, (len(numbers), d)
        One column for each of the d `streams`.
    """
    return np.column_stack([special.ndtri(u) for u in _uniforms(streams(study), numbers, study).values()])


def noise(study: Study, level: int, first: int, count: int) -> Array:
    """Independent standard normal numbers of a level of a subset simulation, from number `first` on, (count, d)."""
    of_level = (_stream(study.sampling.seed, f"subset {level} {name}", first) for name in streams(study))
    return np.column_stack([special.ndtri(np.maximum(stream.random(count), 2.0**-54)) for stream in of_level])


def from_scores(study: Study, scores: Array) -> Table:
    """Errors of joints, (n,) table ERROR, with given standard normal scores, (n, d); see `from_probabilities`."""
    return from_probabilities(study, _probability(scores))


def from_probabilities(study: Study, u: Array) -> Table:
    """Errors of joints with given probabilities of the streams: those that a random campaign draws, to the last bit.

    Parameters
    ----------
    study : Study
        Its tolerances, correlation and fixed errors are applied.
    u : ndarray, (n, d)
        Independent probabilities, one column for each of `streams`; 0 and 1 count as the nearest numbers between them.

    Returns
    -------
    ndarray, (n,), dtype ERROR
    """
    table = nominal_errors(len(u), study.mechanism)
    for name, value in study.errors.items():
        table[name] = value
    inside = np.clip(np.ascontiguousarray(u.T), np.finfo(float).tiny, 1 - np.finfo(float).epsneg)
    _fill_from(table, study, dict(zip(streams(study), inside, strict=True)))
    return table


def values(study: Study, errors: Table, name: str) -> Array:
    """Values that were drawn from the distribution of a quantity.

    Parameters
    ----------
    study : Study
        Its axes tell how errors follow from what is drawn.
    errors : ndarray, shape (n,), dtype ERROR
        Errors of joints, with the columns of the quantity at least.
    name : str
        A quantity of the study.

    Returns
    -------
    ndarray, (n,)
        SI; of a vector the radius.
    """
    if not axes.is_zone(name):
        return np.asarray(errors[name])
    vector = _vector(study, errors, name)
    return axes.component(name, vector) if axes.is_component(name) else np.asarray(np.hypot(*vector))


def components(study: Study, errors: Table) -> dict[str, Array]:
    """Independent numbers from which the errors of joints follow: what load statistics are told against.

    Returns
    -------
    dict of str to ndarray, (n,)
        Of each quantity its `values`; of a vector its two `plane_scores`, named ``pin1.position_inner_t``, ``..._z``.
    """
    drawn: dict[str, Array] = {}
    for name, distribution in study.tolerances.items():
        if axes.is_zone(name) and not axes.is_component(name):
            both = plane_scores(distribution, _vector(study, errors, name))
            drawn |= {f"{name}_{along}": part for along, part in zip("tz", both, strict=True)}
        else:
            drawn[name] = values(study, errors, name)
    return drawn


def normal_scores(study: Study, errors: Table) -> dict[str, Array]:
    """Return the standard normal scores of the `components` of joints, (n,) each."""
    scored = ((name, drawn, study.tolerances.get(name)) for name, drawn in components(study, errors).items())
    return {name: drawn if distribution is None else score(distribution, drawn) for name, drawn, distribution in scored}


def _vector(study: Study, errors: Table, name: str) -> Array:
    feature, _, key = name.rpartition(".")
    return study.axes[feature].vector(errors, key)


def columns(study: Study) -> list[str]:
    """Names of the columns of the table ERROR that what is drawn follows from."""
    return list(dict.fromkeys(column for name in study.tolerances for column in axes.columns_of(name)))


def streams(study: Study) -> list[str]:
    """Names of the random streams of a study: one for each dimension, named after columns of the table ERROR."""
    return list(dict.fromkeys(stream for name in study.tolerances for stream in axes.streams_of(name)))


def _fill_grid(samples: Table, study: Study, numbers: range) -> None:
    """Set the points of the product grid of the axes, the last of which varies fastest; dimensions are no errors."""
    index = np.unravel_index(np.arange(numbers.start, numbers.stop), [axis.points for axis in study.sweep])
    for axis, at in zip(study.sweep, index, strict=True):
        for name in set(axis.names).intersection(samples.dtype.names or ()).difference(KEYS):
            samples[name] = np.linspace(axis.start, axis.stop, axis.points)[at] - _nominal(study.operation, name)


def _nominal(operation: Operation, name: str) -> float:
    """Value that an error is a deviation from, where a file gives the value itself: that of the operating point."""
    section, _, key = name.partition(".")
    return float(getattr(operation, key)) if section == "operation" and key in MEANS else 0.0


def _fill_listed(samples: Table, design: Design, numbers: range) -> None:
    """Set each row's grid point and errors (of its case)."""
    here = slice(numbers.start, numbers.stop)
    variant, case, point = design.table["variant"][here], design.table["case"][here], design.point()[here]
    for values, index in ((design.points, point), (tuple(design.cases.values()), case)):
        for number, errors in enumerate(values):
            for name, value in errors.items():
                samples[name][index == number] = value
    for name in {name for values in design.points for name in values}:
        samples[name] -= np.array([_nominal(operation, name) for operation in design.operations])[variant]


def _of_lots(study: Study, u: dict[str, Array], numbers: range) -> dict[str, Array]:
    """Probabilities of the errors with lots, of samples of which several are of one lot."""
    size = study.sampling.joints_per_lot
    first, last = numbers.start // size, -(-numbers.stop // size)
    lot_of_joint = np.arange(numbers.start, numbers.stop) // size - first
    probabilities = {}
    for name, lot in study.lots.items():
        drawn = _stream(study.sampling.seed, f"lot {lot.score}", first).random(last - first)
        z_lot, z_part = special.ndtri(np.maximum(drawn, 2.0**-54))[lot_of_joint], special.ndtri(u[name])
        probabilities[name] = _probability(np.sqrt(lot.share) * z_lot + np.sqrt(1.0 - lot.share) * z_part)
    return probabilities


def _fill_from(samples: Table, study: Study, u: dict[str, Array], of_lots: Mapping[str, Array] | None = None) -> None:
    """Set the errors that scatter, from independent probabilities `u` of their columns.

    Errors in `of_lots`, which depend on other joints, have these probabilities instead.
    """
    names = study.copula.names
    if names:
        correlated = study.copula.apply(np.column_stack([u[name] for name in names]))
        u |= {name: correlated[:, i] for i, name in enumerate(names)}
    u |= of_lots or {}
    vectors: dict[str, dict[str, Array]] = {}
    for name, distribution in study.tolerances.items():
        if not axes.is_zone(name):
            samples[name] = distribution.ppf(u[name])
            continue
        first, *second = axes.streams_of(name)
        drawn = distribution.ppf(u[first])
        if second:
            direction = 2 * np.pi * u[second[0]]
            vector = np.array([drawn * np.cos(direction), drawn * np.sin(direction)])
        else:
            vector = axes.of_component(name, drawn)
        feature, _, key = name.rpartition(".")
        vectors.setdefault(feature, {})[key] = vector
    for feature, parts in vectors.items():
        study.axes[feature].fill(samples, parts)


def _uniforms(names: Sequence[str], numbers: range, study: Study) -> dict[str, Array]:
    """Probabilities in (0, 1) of the samples `numbers`, independent from name to name; shape (len(numbers),) each."""
    # a stream may give 0 itself, once in 2^53 draws
    drawn = {name: _stream(study.sampling.seed, name, numbers.start).random(len(numbers)) for name in names}
    return {name: np.maximum(u, 2.0**-54) for name, u in drawn.items()}


def _probability(scores: Array) -> Array:
    """Probabilities in (0, 1) of standard normal scores, clipped where double precision would round to 0 or 1."""
    inside: Array = np.clip(special.ndtr(scores), np.finfo(float).tiny, 1 - np.finfo(float).epsneg)
    return inside


def _stream(seed: int, name: str, first: int = 0) -> np.random.Generator:
    """Random stream of one name from number `first` on; counter-based, so that streams of two keys never overlap."""
    digest = hashlib.blake2b(name.encode(), digest_size=8).digest()
    key = np.array([seed, int.from_bytes(digest, "little")], dtype=np.uint64)
    counter, within = divmod(first, 4)  # one Philox counter value gives four numbers
    bits = np.random.Philox(key=key)
    bits.advance(counter)
    stream = np.random.Generator(bits)
    stream.random(within)
    return stream
