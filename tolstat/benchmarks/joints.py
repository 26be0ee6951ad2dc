"""Joints of a study that are measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat import joint, sampling
from tolstat.store.recorded import perturbed
from tolstat.study import Study

Params = NDArray[np.void]


def parameters(study: Study, rows: NDArray[np.intp]) -> Params:
    """Draw joints of a study.

    Parameters
    ----------
    study : Study
        The study.
    rows : ndarray, shape (m,)
        Rows of the joints, in any order.

    Returns
    -------
    ndarray of PARAM, shape (m,)
    """
    whole = study.sampling.method == "lhs"  # its joints cannot be drawn one by one
    first, end = (0, study.rows) if whole else (int(rows.min()), int(rows.max()) + 1)
    errors = sampling.draw(study, range(first, end))[rows - first]
    return perturbed(study, rows, errors, joint.perturb)


def choose(study: Study, n: int, seed: int, block: int) -> tuple[Params, int]:
    """Choose the joints on which integrators are compared, then further ones for a block.

    Parameters
    ----------
    study : Study
        The study.
    n : int
        Number of random joints to compare, beside the nominal one if the study has it.
    seed : int
        Seed of the choice.
    block : int
        Number of joints to return, if the study has as many and not more are compared.

    Returns
    -------
    params : ndarray of PARAM
        The joints, those that are compared first.
    count : int
        Number of joints that are compared.
    """
    first = int(study.sampling.nominal_first)
    drawn = first + np.random.default_rng(seed).permutation(study.rows - first)
    rows = np.concatenate([np.arange(first), drawn])
    count = min(first + n, len(rows))
    return parameters(study, rows[: max(block, count)]), count
