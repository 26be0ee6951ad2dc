"""Selective assembly: yield and unmatched parts by number of classes, and the classes of one campaign."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from tolstat.analysis.sample import total_interval
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.shown import shown
from tolstat.joint.perturbation import HOLE_OF_PIN
from tolstat.store import error_budget
from tolstat.store.hdf5 import BLOCK
from tolstat.store.view import View
from tolstat.study import Study, load
from tolstat.study.rewriting import with_keys
from tolstat.study.selective import KINDS, Matching, matching

CLASSES = (1, 2, 3, 5)
"""Numbers of classes that the command simulates unless told otherwise; 1: not sorted."""


@shown
class Assembled(NamedTuple):
    """Campaigns with different numbers of classes.

    Attributes
    ----------
    table : DataFrame
        One row per campaign, by number of classes: ``classes``; ``unmatched``, share of the crosses and forks without a
        partner of their class; ``clearance``, standard deviation of the radial clearance, m; ``n``, ``count`` (above at
        least one limit), ``n_failed``, ``n_unsettled``; ``good``, yield of the assembled joints, with its total
        interval ``good_lower``, ``good_upper``; ``of_all``, share of all crosses that are in a good joint, with its
        ends.
    """

    table: pd.DataFrame


def study_of(path: Path, classes: int, n: int | None = None) -> Study:
    """Read a study with ``sampling.selective``, and set its number of classes and, if given, of joints.

    Raises
    ------
    InputError
        With every fault of the study.
    """
    plan = load(path)
    if plan.sampling.selective is None:
        remedy = 'add selective = { classes = 3, gauge = "2 um" } to [sampling]'
        raise InputError([plan.fault("sampling", "missing key selective", remedy)])
    text = with_keys(plan.text, {("sampling", "selective"): {"classes": classes}}, str(path))
    return load(path, n, text)


def classes_of(view: View) -> Matching | None:
    """Classes of a campaign; None if its parts are not sorted."""
    study = view.study
    if not study.sampling.is_matched or study.sampling.selective is None:
        return None
    return matching(study.sampling.selective, study.entries, study.tolerances)


def assembled(views: Sequence[View], confidence: float = 0.95) -> Assembled:
    """Compare campaigns of one study with different numbers of classes.

    Parameters
    ----------
    views : sequence of View
        Campaigns with limits; one without classes counts as one class.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    Assembled

    Raises
    ------
    StoreError
        When a study has no limits, or its joints are no sample of a production.

    Examples
    --------
    >>> with tolstat.open("selective_k3.h5") as store:  # doctest: +SKIP
    ...     found = tolstat.assembled([store.view()])
    """
    table = pd.DataFrame([_row(view, confidence) for view in views])
    return Assembled(table.sort_values("classes", kind="stable", ignore_index=True))


def _row(view: View, confidence: float) -> dict[str, Any]:
    view.check("mean")
    if not view.limits:
        remedy = "add [limits] to the study, and run the same command again"
        raise StoreError(str(Fault(str(view.path), "is of a study without [limits]", remedy)))
    classes, own = classes_of(view), view.load(ANY_LIMIT)
    above = own.above(1.0, confidence)
    low, high = total_interval(error_budget.with_error(view, own), 1.0, confidence)
    unmatched = 0.0 if classes is None else classes.unmatched
    row: dict[str, Any] = {"classes": 1 if classes is None else classes.matched.size, "unmatched": unmatched}
    row |= {"clearance": _clearance(view)}
    row |= {key: getattr(above, key) for key in ("n", "count", "n_failed", "n_unsettled")}
    good = {"good": 1.0 - above.estimate, "good_lower": 1.0 - high, "good_upper": 1.0 - low}
    return row | good | {key.replace("good", "of_all"): (1.0 - unmatched) * share for key, share in good.items()}


def _clearance(view: View) -> float:
    """Standard deviation of the radial clearance of the pairs, m; from the first joints of a large campaign."""
    errors = view.errors(np.arange(min(view.n, BLOCK)))
    each = [0.5 * (errors[f"{hole}.diameter"] - errors[f"{pin}.diameter"]) for pin, hole in HOLE_OF_PIN.items()]
    return float(np.sqrt(np.mean([own.var() for own in each])))


def parts(found: Matching) -> pd.DataFrame:
    """Table of the classes: number, upper edges of pins and holes (m), share of each kind of part, share matched."""
    columns: dict[str, Any] = {"class": np.arange(1, found.matched.size + 1)}
    columns |= {"pins": found.edges[0, 1:], "holes": found.edges[1, 1:]}
    columns |= {kind.name: found.shares[k] for k, kind in enumerate(KINDS)}
    return pd.DataFrame(columns | {"matched": found.matched})
