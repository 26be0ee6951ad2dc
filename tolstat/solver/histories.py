"""What is kept of a joint's loads over the last revolution: samples, Fourier coefficients, rainflow cycles.

A settled revolution repeats, so counting begins at its largest value and every cycle closes (ASTM E1049-85, 5.4.5). The
four-point method gives the same cycles when its residue is appended to itself and counted again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.common.cardan import CARDAN
from tolstat.common.channels import BUSHING_LOADS, SHAFT_LOADS, LoadHistory, Signal, components, load_histories
from tolstat.common.fields import HistorySpec
from tolstat.common.load_kinds import CONTACTS, spans
from tolstat.common.mechanism import Mechanism, carried
from tolstat.common.tables import Options

Histories = Literal["none", "cycles", "harmonics", "harmonics+cycles", "full", "bearings"]
KEPT = 16
"""Maximum number of cycles kept per channel: joints made to ISO 2768-f have 1.7 a channel in the mean, 11 at most."""
GATE = 1e-4
"""Cycles up to this fraction of the joint's largest force or torque are not counted: the default of
``solver.settle_tol`` allows loads to differ by as much between two revolutions."""
MIN_SAMPLES = 90
"""Minimum number of samples a revolution where tolstat chooses the steps: errors of peaks of a load with four cycles
are within 1 %."""


def history_specs(
    options: Options, histories: Histories, n_harmonics: int, mechanism: Mechanism = CARDAN
) -> dict[str, HistorySpec]:
    """Describe the load histories that are kept of each joint.

    Parameters
    ----------
    options : Options
        ``steps_per_rev`` gives the number of samples; sample k belongs to the input angle 2 pi k / steps_per_rev.
    histories : {"none", "cycles", "harmonics", "harmonics+cycles", "full", "bearings"}
        What is kept. Of ``"bearings"``, contact forces and how pins lie in their bearings, no result file holds any.
    n_harmonics : int
        Highest multiple of the input speed that ``"harmonics"`` keeps.
    mechanism : Mechanism
        What the joints are.

    Returns
    -------
    dict of str to HistorySpec
    """
    n = options.steps_per_rev
    if histories in ("full", "bearings"):
        pins, of = len(mechanism.pairs), load_histories(mechanism)
        contact = f"contact force of pins 1-{pins}: of the outermost station, of the innermost one, resultant of all "
        contact += "stations"
        forces = HistorySpec((n, pins, len(CONTACTS)), "f4", "N", contact, ("theta", "pin", "contact_force"))
        if histories == "bearings":
            products = "products of displacements of the end stations; NaN where they are not recorded"
            ends = HistorySpec((n, pins, 3), "f8", "m^2", products, ("theta", "pin", "product"))
            return {"contact": forces, "ends": ends}
        modes = f"contact mode of pins 1-{pins}: 0 none, 1 one-point, 2 two-point, 3 uniform"
        return {
            "loads": _of_samples(of[BUSHING_LOADS], n),
            "contact": forces,
            "shafts": _of_samples(of[SHAFT_LOADS], n),
            "mode": HistorySpec((n, pins), "u1", "1", modes, ("theta", "pin")),
            "tau": HistorySpec((n,), "f8", "1", "speed ratio", ("theta",)),
        }
    specs = cycle_specs(mechanism) if "cycles" in histories else {}
    if "harmonics" in histories:
        specs |= harmonic_specs(min(n_harmonics, (n - 1) // 2) + 1, mechanism)
    return specs


def _of_samples(history: LoadHistory, n: int) -> HistorySpec:
    return HistorySpec((n, *history.shape), "f4", "N, N*m", history.meaning, ("theta", *history.axes))


def extracted(
    samples: NDArray[np.void], histories: Histories, specs: dict[str, HistorySpec], mechanism: Mechanism = CARDAN
) -> dict[str, NDArray[Any]]:
    """Extract the histories that are kept from the samples of the recorded revolution."""
    shafts = samples["shafts"][:, carried(mechanism)]
    if histories in ("full", "bearings"):
        fields = {name: samples["loads"][:, span] for name, span in spans(mechanism).items()}
        fields |= {name: samples[name] for name in samples.dtype.names or ()} | {"loads": samples["components"]}
        fields[SHAFT_LOADS] = shafts
        return {name: fields[name].reshape(spec.shape) for name, spec in specs.items()}
    fields = {BUSHING_LOADS: samples["components"], SHAFT_LOADS: shafts}
    loads = {name: np.ascontiguousarray(values) for name, values in fields.items()}
    sample = cycles(loads, mechanism) if "cycles" in histories else {}
    if "harmonics" in histories:
        sample |= coefficients(loads, specs["coefficients_real"].shape[-1], mechanism)
    return sample


def harmonic_specs(n_coefficients: int, mechanism: Mechanism = CARDAN) -> dict[str, HistorySpec]:
    """Describe what `coefficients` gives for a joint, as histories of a result file."""
    result: dict[str, HistorySpec] = {}
    for history in load_histories(mechanism).values():
        shape, axes = (*history.shape, n_coefficients), (*history.axes, "harmonic")
        text = f"part of the Fourier coefficients c_h: {history.meaning}; "
        text += "load(theta) = Re(c_0 + 2 sum c_h exp(i h theta))"
        error = "largest deviation of the load so restored, relative to the largest |F| and |T| of the joint"
        result |= {
            f"{history.prefix}coefficients_real": HistorySpec(shape, "f4", "N, N*m", f"real {text}", axes),
            f"{history.prefix}coefficients_imag": HistorySpec(shape, "f4", "N, N*m", f"imaginary {text}", axes),
            f"{history.prefix}harmonics_error": HistorySpec((2,), "f8", "1", error, ("load",)),
        }
    return result


def coefficients(
    loads: Mapping[str, NDArray[np.float64]], n_coefficients: int, mechanism: Mechanism = CARDAN
) -> dict[str, NDArray[Any]]:
    """Fourier coefficients of the loads of a joint.

    Parameters
    ----------
    loads : mapping of str to ndarray
        By name of `load_histories`, (samples, places, components) each, N and N m.
    n_coefficients : int
        Number of coefficients, the mean included.
    mechanism : Mechanism
        What the joints are.

    Returns
    -------
    dict
        By name of `specs`. Errors of all loads are relative to the largest bushing force and torque.
    """
    bushing = loads[BUSHING_LOADS]
    size = [np.linalg.norm(bushing[..., k : k + 3], axis=-1).max() for k in (0, 3)]
    coefficients: dict[str, NDArray[Any]] = {}
    for history in load_histories(mechanism).values():
        values = loads[history.name]
        spectrum = np.moveaxis(np.fft.rfft(values, axis=0) / len(values), 0, -1)[..., :n_coefficients]
        real, imag = spectrum.real.astype("f4"), spectrum.imag.astype("f4")
        difference = np.abs(restore(real, imag, len(values)) - values).max(axis=(0, 1))
        error = [difference[k : k + 3].max() / s if s > 0 else 0.0 for k, s in zip((0, 3), size, strict=True)]
        parts = {"coefficients_real": real, "coefficients_imag": imag, "harmonics_error": np.array(error)}
        coefficients |= {f"{history.prefix}{name}": part for name, part in parts.items()}
    return coefficients


def restore(real: NDArray[Any], imag: NDArray[Any], samples: int) -> NDArray[np.float64]:
    """Restore load histories from their harmonics.

    Parameters
    ----------
    real, imag : ndarray, shape (..., harmonics + 1)
        Fourier coefficients as stored, N and N m.
    samples : int
        Number of equally spaced input angles, from zero.

    Returns
    -------
    ndarray, shape (samples, ...)
    """
    spectrum = np.zeros((*real.shape[:-1], samples // 2 + 1), complex)
    known = min(real.shape[-1], spectrum.shape[-1])
    spectrum[..., :known] = real[..., :known] + 1j * imag[..., :known].astype(np.float64)
    return np.moveaxis(np.fft.irfft(spectrum * samples, samples), -1, 0)


def cycle_specs(mechanism: Mechanism = CARDAN) -> dict[str, HistorySpec]:
    """Describe what `cycles` gives for a joint, as histories of a result file."""
    result: dict[str, HistorySpec] = {}
    for history in load_histories(mechanism).values():
        n, channel = math.prod(history.shape), f"{history.prefix}channel"
        text = "range and mean of the largest rainflow cycles of the last revolution, descending, 0 where there are "
        text += "none; where none is counted, the first is the range of the load, up to the gate, and its middle; "
        text += history.signals
        result |= {
            f"{history.prefix}cycles": HistorySpec((n, KEPT, 2), "f4", "N, N*m", text, (channel, "cycle", "of_cycle")),
            f"{history.prefix}cycle_count": HistorySpec(
                (n,), "u2", "1", "rainflow cycles of the last revolution, those not kept included", (channel,)
            ),
        }
    return result


def periodic(signal: ArrayLike, gate: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rainflow cycles of one period of a signal that repeats.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Equally or unequally spaced samples of one period; the last is followed by the first.
    gate : float
        Cycles whose range is not above it are left out.

    Returns
    -------
    ranges, means : ndarray, shape (cycles,)
        In the unit of the signal, ranges descending. Every cycle is a whole one.

    Raises
    ------
    ValueError
        When the signal is empty, not one-dimensional or not finite.

    Examples
    --------
    The history of ASTM E1049-85, Figure 7: cycles of 9, 7, 4 and 3 units.

    >>> periodic([-2, 1, -3, 5, -1, 3, -4, 4])[0].tolist()
    [9.0, 7.0, 4.0, 3.0]
    """
    from tolstat.kernel.revolution import rainflow

    x = np.ascontiguousarray(signal, dtype=float)
    if x.ndim != 1 or not x.size or not np.isfinite(x).all():
        raise ValueError(f"signal of shape {x.shape}: finite values of one period expected")
    ranges, means = np.empty((2, 1 + x.size // 2))
    n = rainflow.count(x, float(gate), np.empty(x.size + 1), ranges, means)
    return ranges[:n], means[:n]


def between(
    visits: Sequence[int], low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Rainflow cycles that a sequence of operating points closes, and those of revolutions that they replace.

    The sequence repeats. A visit is of whole revolutions, from the largest load of the point to the same again. Of each
    the first goes here into the sequence, with the smallest load between: cycles between the two loads of one point are
    those of a revolution; where one of them closes with another point, the revolution lacks its largest cycle.

    Parameters
    ----------
    visits : sequence of int
        Points in the order in which they are visited.
    low, high : ndarray, shape (n, points)
        Smallest and largest load of each row at each point.

    Returns
    -------
    ranges, means, numbers : ndarray, shape (n, k)
        Cycles between points of each row, and how often each occurs in the sequence; 0 in empty places, ranges NaN
        where a load is.
    replaced : ndarray, shape (n, points)
        Largest cycles of revolutions at each point that these take the place of.

    Examples
    --------
    >>> ranges, _, _, replaced = between([0, 1], np.array([[0.0, 10.0]]), np.array([[1.0, 11.0]]))
    >>> ranges.tolist(), replaced.tolist()
    ([[11.0]], [[1.0, 0.0]])
    """
    points = high.shape[1]
    levels = np.hstack([high, low]).astype(float)
    ranks = np.argsort(np.argsort(levels, axis=1, kind="stable"), axis=1)
    orders, which = np.unique(ranks, axis=0, return_inverse=True)  # which cycles close depends on the order alone
    course = np.column_stack([visits, points + np.asarray(visits), visits]).ravel()
    closed: list[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]] = []
    replaced = np.empty((len(orders), points))
    for i, order in enumerate(orders):
        sizes, middles = periodic(order[course])
        by_rank = np.argsort(order)
        top, bottom = (by_rank[np.rint(middles + end * sizes).astype(int)] for end in (0.5, -0.5))
        own = top % points == bottom % points
        replaced[i] = np.bincount(visits, minlength=points) - np.bincount(top[own] % points, minlength=points)
        pairs, times = np.unique((2 * points * top + bottom)[~own], return_counts=True)
        closed.append((*np.divmod(pairs, 2 * points), times))
    ranges, means, numbers = np.zeros((3, len(levels), max([1, *(len(times) for *_, times in closed)])))
    for row, index in enumerate(which.ravel()):
        top, bottom, times = closed[index]
        upper, lower, k = levels[row, top], levels[row, bottom], len(times)
        ranges[row, :k], means[row, :k], numbers[row, :k] = upper - lower, 0.5 * (upper + lower), times
    ranges[np.isnan(levels).any(axis=1)] = np.nan
    return ranges, means, numbers, replaced[which.ravel()]


def cycles(loads: Mapping[str, NDArray[Any]], mechanism: Mechanism = CARDAN) -> dict[str, NDArray[Any]]:
    """Rainflow cycles of all load components of a joint.

    Parameters
    ----------
    loads : mapping of str to ndarray
        As in `count`, of all histories.
    mechanism : Mechanism
        What the joint is.

    Returns
    -------
    dict
        By name of `cycle_specs`, for each history: ``cycles`` (components, KEPT, 2), N and N m, and ``cycle_count``
        (components,). NaN and 0 when a load is not finite.
    """
    described, kept, end = cycle_specs(mechanism), dict[str, NDArray[Any]](), 0
    counted = None
    if all(np.isfinite(values).all() for values in loads.values()):
        counted = count(loads, tuple(components(mechanism).values()), mechanism=mechanism)
    for history in load_histories(mechanism).values():
        names = [f"{history.prefix}{name}" for name in ("cycles", "cycle_count")]
        table, number = (described[name].blank(1)[0] for name in names)
        begin, end = end, end + len(number)
        if counted is not None:
            ranges, means, number[...] = (each[begin:end] for each in counted)
            table[...] = np.stack([ranges, means], axis=-1)
        kept |= dict(zip(names, (table, number), strict=True))
    return kept


def count(
    loads: Mapping[str, NDArray[Any]], signals: tuple[Signal, ...], kept: int = KEPT, mechanism: Mechanism = CARDAN
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Rainflow cycles of some signals of a joint over one revolution.

    Parameters
    ----------
    loads : mapping of str to ndarray
        By name of `load_histories`, (samples, places, components) each, N and N m, finite. Those of bushings are
        needed: no cycle counts up to a fraction of their largest ones, see `GATE`.
    signals : tuple of Signal
        Signals, (c,).
    mechanism : Mechanism
        What the joint is.
    kept : int
        Maximum number of cycles of each, the largest ones.

    Returns
    -------
    ranges, means : ndarray, shape (c, kept)
        Descending, 0 in empty places, in the unit of the signal. Of a signal none of whose cycles counts, the first is
        from its smallest to its largest value.
    number : ndarray, shape (c,)
        Number of cycles, those not kept included.
    """
    from tolstat.kernel.revolution import rainflow

    places, factors = _tables(signals, mechanism)
    bushing = loads[BUSHING_LOADS]
    sizes = [np.linalg.norm(bushing[..., part].astype(float), axis=-1).max() for part in (slice(3), slice(3, 6))]
    gates = GATE * (np.abs(factors) @ np.repeat(sizes, 3))
    histories = [loads[name] for name in load_histories(mechanism) if name in loads]
    values = np.ascontiguousarray(np.concatenate(histories, axis=1), dtype=float)
    ranges, means = np.empty((2, len(signals), kept))
    number = np.empty(len(signals), np.int64)
    rainflow.count_joint(values, places, factors, gates, ranges, means, number)
    return ranges, means, number


@cache
def _tables(signals: tuple[Signal, ...], mechanism: Mechanism) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Place of each signal among those of all histories, and its factors, (signals, components)."""
    names = [(history, place) for history in load_histories(mechanism).values() for place in history.places]
    places = [names.index((signal.history, signal.place)) for signal in signals]
    return np.array(places, np.int64), np.array([signal.factors for signal in signals])
