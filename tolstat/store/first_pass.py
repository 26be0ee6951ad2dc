"""What a view keeps of the results after one pass over them, of one operating point or the worst of several."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.loads import LOAD_FIELDS, FloatArray
from tolstat.common.tables import FAILED, RESULT, UNSETTLED, VALID
from tolstat.store import worst
from tolstat.store.sample_load import frozen

if TYPE_CHECKING:
    from tolstat.store.reader import Reader

AT_ONCE = 16_384
"""Rows read at once. They are written to a table column by column, faster where it fits the processor's cache."""
MAX_LISTED = 12
"""Number of joints without a valid load whose complete results are kept."""


class FirstPass(NamedTuple):
    """What is kept of the results after one pass over them.

    Attributes
    ----------
    results : dict of str to ndarray, shape (n, ...)
        Columns `LOAD_FIELDS` of the samples; the values of one load lie side by side.
    nominal : ndarray of RESULT, shape (1,) or (0,)
        The nominal joint, if the file has one and its results are valid.
    without_load : ndarray of RESULT, shape (m,)
        The first `MAX_LISTED` joints that failed or did not settle.
    mode_share : ndarray, shape (4, 4)
        Weighted mean over the valid joints; NaN if none is valid or the study does not keep it.
    """

    results: dict[str, NDArray[Any]]
    nominal: NDArray[np.void]
    without_load: NDArray[np.void]
    mode_share: FloatArray


def read(store: Reader, weights: FloatArray | None) -> FirstPass:
    """Read the results of a file at one operating point; `weights` are those of its samples, if they differ."""
    skip, n = store.first_sample, store.n - store.first_sample
    nominal = np.empty(0, RESULT)
    results = {name: np.empty((n, *RESULT[name].shape), RESULT[name].base, "F") for name in LOAD_FIELDS}
    kept, total, shares = [np.empty(0, RESULT)], 0.0, np.zeros((4, 4))
    for first in range(0, store.n, AT_ONCE):
        block = store.results(slice(first, first + AT_ONCE))
        if first == 0 and skip:
            nominal, block = block[:1][np.isin(block["status"][:1], VALID)].copy(), block[1:]
        begin = max(0, first - skip)
        for name in LOAD_FIELDS:
            results[name][begin : begin + len(block)] = block[name]
        if sum(map(len, kept)) < MAX_LISTED:
            kept.append(block[np.isin(block["status"], (*FAILED, *UNSETTLED))][:MAX_LISTED])
        valid = np.isin(block["status"], VALID)
        weight = np.ones(len(block)) if weights is None else weights[begin : begin + len(block)]
        shares += np.tensordot(weight[valid], block["mode_share"][valid], 1)
        total += float(weight[valid].sum())
    mean = shares / total if total else np.full((4, 4), np.nan)
    return FirstPass(_frozen(results), frozen(nominal), frozen(np.concatenate(kept)[:MAX_LISTED]), frozen(mean))


def of_points(parts: Sequence[FirstPass], stores: Sequence[Reader]) -> FirstPass:
    """Combine what was read at several operating points; `stores` are the file at each. There is no ``mode_share``."""
    results = worst.together([part.results for part in parts])
    samples = np.flatnonzero(np.isin(results["status"], (*FAILED, *UNSETTLED)))[:MAX_LISTED]
    deciding = worst.deciding([part.results["status"][samples] for part in parts])
    without = [np.empty(0, RESULT)]
    for sample, number in zip(samples.tolist(), deciding.tolist(), strict=True):
        slot = sample + stores[number].first_sample
        without.append(stores[number].results(slice(slot, slot + 1)))
    nominal = worst.nominal([part.nominal for part in parts])
    none = np.full((4, 4), np.nan)
    return FirstPass(_frozen(results), frozen(nominal), frozen(np.concatenate(without)), frozen(none))


def _frozen(columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    return {name: frozen(column) for name, column in columns.items()}
