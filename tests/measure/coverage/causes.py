"""Experiments on causes: Sobol' indices, the tail, indices of lines that are exchanged."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from tests.measure.coverage.trial import NUMBERS, Asked, Experiment, Found, Rng, found
from tolstat.analysis import exchanged, ranks, sensitivity
from tolstat.analysis.design import Independent
from tolstat.common.loads import FloatArray
from tolstat.questions.causes import shares

SLOPES = np.array([1.0, 0.5, 0.0])
"""Slopes of the loads in the three errors."""
LONG = "the variance of a load with a long tail is that of few joints; `causes --run` decomposes its logarithm"
BENT = "few joints for a load with several bends in an error"


class Load(NamedTuple):
    """A load of three independent errors, with its first-order and total indices, (3,)."""

    name: str
    draw: Callable[[Rng, tuple[int, ...]], FloatArray]
    of: Callable[[FloatArray], FloatArray]
    first: FloatArray
    total: FloatArray
    known: str = ""


def loads() -> list[Load]:
    """Linear, skew, and Ishigami's function."""
    square = SLOPES**2
    share = square / square.sum()
    a, b = 7.0, 0.1
    pi4, pi8 = np.pi**4, np.pi**8
    parts = np.array([0.5 * (1.0 + b * pi4 / 5.0) ** 2, a**2 / 8.0, 0.0])
    mixed = b**2 * pi8 * (1.0 / 18.0 - 1.0 / 50.0)
    variance = parts.sum() + mixed
    return [
        Load("linear", _normal, lambda x: x @ SLOPES, share, share),
        _exponential("exponential", SLOPES, LONG),
        _exponential("slightly skew", 0.3 * SLOPES),
        Load(
            "Ishigami",
            lambda rng, shape: rng.uniform(-np.pi, np.pi, shape),
            lambda x: np.sin(x[..., 0]) * (1.0 + b * x[..., 2] ** 4) + a * np.sin(x[..., 1]) ** 2,
            parts / variance,
            (parts + np.array([mixed, 0.0, mixed])) / variance,
        ),
    ]


def _exponential(name: str, slopes: FloatArray, known: str = "") -> Load:
    square = slopes**2
    whole = math.expm1(square.sum())
    first, total = np.expm1(square) / whole, 1.0 - np.expm1(square.sum() - square) / whole
    return Load(name, _normal, lambda x: np.exp(x @ slopes), first, total, known)


def _normal(rng: Rng, shape: tuple[int, ...]) -> FloatArray:
    return rng.standard_normal(shape)


def experiments() -> Iterator[Experiment]:
    """All of this file."""
    for load in loads():
        for n in NUMBERS:
            if n >= shares.MIN_JOINTS:
                yield _given_data(load, n)
            yield _by_pairs(load, n)
    for share in (0.5, 0.05):
        for n in NUMBERS:
            yield _event(share, n)
    for share in (0.1, 0.02):
        for n in (*NUMBERS[1:], 4096):
            yield _tail(share, n)
    yield _lines()


def _given_data(load: Load, n: int) -> Experiment:
    known = load.known or (BENT if load.name == "Ishigami" and n < 1000 else "")
    cases = [(f"{load.name}, error {k + 1}", n, np.nan, known) for k in range(3)]
    asked = [Asked("index alone", *case) for case in cases]

    def once(rng: Rng) -> list[Found]:
        x = load.draw(rng, (n, 3))
        return found(sensitivity.first_order(x, load.of(x)), load.first)

    return Experiment(tuple(asked), once)


def _exchanged(asked: list[Asked], estimator: Callable[..., exchanged.Indices], load: Load, n: int) -> Experiment:
    """Indices from the loads of points A and B, and of A with one error of B."""

    def once(rng: Rng) -> list[Found]:
        a, b = load.draw(rng, (2, n, 3))
        mixed = np.stack([np.where(np.arange(3) == k, b, a) for k in range(3)], axis=1)
        own = estimator(load.of(a), load.of(b), load.of(mixed))
        return found(own.first, load.first) + found(own.total, load.total)

    return Experiment(tuple(asked), once, refusal=(ValueError,))


def _by_pairs(load: Load, n: int) -> Experiment:
    cases = [(f"{load.name}, error {k + 1}", n) for k in range(3)]
    asked = [Asked(f"{name}, exchanged", *case) for name in ("index alone", "index in all") for case in cases]
    return _exchanged(asked, exchanged.indices, load, n)


def _event(share: float, n: int) -> Experiment:
    """Indices of the event that a linear load is above a level."""
    size = math.sqrt(float((SLOPES**2).sum()))
    z = float(norm.isf(share))

    x = np.linspace(-8.0, 8.0, 16_001)
    density = norm.pdf(x) / norm.pdf(x).sum()

    def of(part: float) -> float:
        """Closed index of errors that make up a part of the variance of the load."""
        if part in (0.0, 1.0):
            return part
        given = norm.sf((z - math.sqrt(part) * x) / math.sqrt(1.0 - part))
        return float(density @ (given - share) ** 2) / (share * (1.0 - share))

    parts = SLOPES**2 / size**2
    first, total = (np.array([f(float(p)) for p in parts]) for f in (of, lambda p: 1.0 - of(1.0 - p)))
    cases = [f"linear, {share:g}, {word}, error {k + 1}" for word in ("alone", "in all") for k in range(3)]
    load = Load("event", _normal, lambda x: (x @ SLOPES > z * size).astype(float), first, total)
    return _exchanged([Asked("index of the event", case, n) for case in cases], exchanged.of_event, load, n)


def _tail(share: float, n: int) -> Experiment:
    """Errors of joints above a limit beside those of the others, for a sum."""
    size, z = math.sqrt(float((SLOPES**2).sum())), float(norm.isf(share))
    x = np.linspace(-8.0, 8.0, 16_001)
    direction, far = [], []
    for w in SLOPES:
        beyond = norm.sf((z * size - w * x) / math.sqrt(size**2 - w**2))
        above, below = (norm.pdf(x) * part for part in (beyond, 1.0 - beyond))
        direction.append(_larger(above, below))
        far.append(_larger(above + above[::-1], below + below[::-1], 8_000))

    def once(rng: Rng) -> list[Found]:
        errors = rng.standard_normal((n, 3))
        own = ranks.tail(errors, errors @ SLOPES > z * size)
        return found(own.direction, direction) + found(own.size, far)

    asked = [
        Asked("errors above a limit", f"linear, {share:g}, {word} of error {k + 1}", n)
        for word in ("direction", "size")
        for k in range(3)
    ]
    return Experiment(tuple(asked), once, refusal=(ValueError,))


class _Joints(shares.Joints):
    """Loads as drawn, and a level, without a campaign."""

    def __init__(self, base: FloatArray, level: float) -> None:
        self.base, self.level, self.design = base, level, Independent()


def _lines(share: float = 0.1, first: int = 1024, most: int = 8192) -> Experiment:
    """Looks until the order of lines half as wide is settled; lines exact have the joints of the first look only."""
    slopes = np.array([1.0, 0.95, 0.3])
    level = float(norm.isf(share)) * math.sqrt(float((slopes**2).sum()))
    confidence = 1.0 - 0.05 / (1 + math.log2(most / first))

    def changed(factor: float) -> FloatArray:
        """Slopes with one line changed, (3, 3), a row each."""
        return slopes * np.where(np.eye(3, dtype=bool), factor, 1.0)

    halves, exact = changed(0.5), changed(0.0)
    asked = [
        Asked(f"line {word}", f"linear, {share:g}, line {k + 1}", most)
        for word in ("half as wide", "exact")
        for k in range(3)
    ]
    truths = [float(norm.sf(level / math.sqrt(float((row**2).sum())))) for row in (*halves, *exact)]

    def once(rng: Rng) -> list[Found]:
        errors, n = rng.standard_normal((most, 3)), first
        base, half, gone = errors @ slopes, errors @ halves.T, errors[:first] @ exact.T
        while n < most and not shares.is_settled([*half[:n].T], base[:n], level, confidence):
            n *= 2
        joints = _Joints(base[:n], level)
        each = [joints.estimates(values[:n], None)[0] for values in half.T]
        each += [joints.estimates(gone[:, k], half[:n, k])[0] for k in range(3)]
        return [Found(low, high, truth) for (_, low, high), truth in zip(each, truths, strict=True)]

    return Experiment(tuple(asked), once)


def _larger(one: FloatArray, other: FloatArray, first: int = 0) -> float:
    """P(value of one density > that of another), of densities at equally spaced points from index `first` on."""
    one, other = (own[first:] / own[first:].sum() for own in (one, other))
    return float(one @ (np.cumsum(other) - 0.5 * other))
