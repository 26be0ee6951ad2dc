"""What the entries of ``[tolerances]`` mean, as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pandas as pd

from tolstat.study.tolerances.entry import Toleranced


def table(entries: Sequence[Toleranced]) -> pd.DataFrame:
    """Make one row for each entry and kind of error that it sets.

    Parameters
    ----------
    entries : sequence of Toleranced
        Entries of a study.

    Returns
    -------
    DataFrame
        ``entry``, its pattern; ``number``, what its number is; ``errors``, keys of the errors as a pattern; ``unit``
        and ``sigma``, standard deviation of each of these errors, SI (where several entries set an error, the part of
        this one); ``outside``, share of the parts outside the band or zone, NaN without either.
    """
    rows: dict[tuple[Any, ...], dict[str, None]] = {}
    for entry in entries:
        for site, model in entry.models:
            for found in model.meaning(site):
                sigma = float(f"{found.sigma:.6g}")
                key = (entry.pattern, found.number, found.unit, sigma, f"{found.outside:.6g}")
                rows.setdefault(key, {}).update(dict.fromkeys(name.partition(".")[2] for name in found.errors))
    columns = ["entry", "number", "unit", "sigma", "outside", "errors"]
    cells = [(*key[:4], float(key[4]), _pattern(list(keys))) for key, keys in rows.items()]
    made = pd.DataFrame(cells, columns=columns)
    return made[["entry", "number", "errors", "unit", "sigma", "outside"]]


def _pattern(keys: Sequence[str]) -> str:
    """Keys as one pattern where they have the same kind: ``offset_[tz]``."""
    kinds: dict[str, str] = {}
    for key in keys:
        kind, dash, part = key.rpartition("_")
        name = f"{kind}{dash}" if len(part) == 1 else key
        kinds[name] = kinds.get(name, "") + (part if len(part) == 1 else "")
    return ", ".join(f"{kind}[{parts}]" if len(parts) > 1 else f"{kind}{parts}" for kind, parts in kinds.items())
