"""Largest loads of a file's joints by name, as pandas Series."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from tolstat.common.loads import LOADS
from tolstat.common.shown import table

if TYPE_CHECKING:
    import pandas as pd

    from tolstat.store.view import View


class NamedLoads:
    """Loads of the joints by name: ``loads["cross1.F"]``, ``list(loads)``, ``dict(loads)``, ``"psi" in loads``.

    Parameters
    ----------
    view : View
        The file.
    """

    def __init__(self, view: View) -> None:
        self._view = view

    def __getitem__(self, name: str) -> pd.Series[float]:
        """Largest load over the revolution of each joint, SI.

        Parameters
        ----------
        name : str
            ``cross1.F``; one of `keys`.

        Returns
        -------
        pandas.Series
            Index ``row``: row of the campaign; the nominal joint is not among them. NaN for a joint without a valid
            load: pending, failed or not settled. ``attrs["units"]`` is the SI unit.

        Raises
        ------
        InputError, StoreError
            When the file has no such load for a sample of joints; see `View.load`.
        """
        import pandas as pd

        load, store = self._view.load(name), self._view.store
        index = pd.RangeIndex(store.rows[store.first_sample :], name="row")
        series = pd.Series(load.valid_or_nan, index, name=name)
        series.attrs["units"] = load.unit
        return series

    def nominal(self) -> pd.Series[float]:
        """Loads of the nominal joint by name, SI; see `Reader.nominal`."""
        import pandas as pd

        held = self._view.nominal
        values = [float(LOADS[name].of(held)[0]) if len(held) else np.nan for name in self.keys()]
        series = pd.Series(values, pd.Index(self.keys(), name="load"), dtype=float, name="nominal")
        series.attrs["units"] = {name: LOADS[name].unit for name in self.keys()}
        return series

    def keys(self) -> tuple[str, ...]:
        """Names of the loads that the study keeps."""
        return self._view.kept_loads

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __len__(self) -> int:
        return len(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.keys()

    def _ipython_key_completions_(self) -> tuple[str, ...]:
        return self.keys()

    def __repr__(self) -> str:
        names = self.keys()
        named = ", ".join(names) if len(names) <= 3 else f"{names[0]}, {names[1]}, ..., {names[-1]}"
        return f"<{len(names)} loads of {self._view.n} joints: {named}>"

    def _repr_html_(self) -> str:
        return table(repr(self)[1:-1], [("load", ", ".join(self.keys()))])
