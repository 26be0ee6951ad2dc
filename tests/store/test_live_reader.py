"""A file that is replaced while it is read: the reader gives the joints of its own campaign, or says so."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import tolstat
from tests.support import synthetic
from tolstat import study
from tolstat.common.errors import StoreError
from tolstat.common.tables import Status
from tolstat.store import ResultFile

TEXT = synthetic.REAL.replace("n = 60", "n = 11").replace("[limits]", '[output]\nhistories = "full"\n\n[limits]')


def load(folder: Path, seed: int) -> study.Study:
    (folder / f"{seed}.toml").write_text(TEXT.replace("seed = 2021", f"seed = {seed}"), encoding="utf-8")
    return study.load(folder / f"{seed}.toml")


def everything(store: ResultFile, done: NDArray[np.intp]) -> dict[str, bytes]:
    """Errors, results and histories of joints; what the file refuses to give is left out."""
    results = store.results()[done[1:]]
    found = {"errors": store.errors()[1:].tobytes()}
    found["results"] = b"".join(results[name].tobytes() for name in results.dtype.names or ())
    with suppress(StoreError):
        found["histories"] = store.histories("loads", done[1:]).tobytes()
    return found


@pytest.mark.parametrize("until_row", [8, pytest.param(None, marks=pytest.mark.slow)])
def test_no_joint_of_another_campaign_is_given(tmp_path: Path, until_row: int | None) -> None:
    """A campaign of another seed takes the place of one that is being read, finished or not."""
    path, other = tmp_path / "a.h5", tmp_path / "b.h5"
    tolstat.run(load(tmp_path, 1), path, workers=1, until_row=until_row, check=False)
    tolstat.run(load(tmp_path, 2), other, workers=1, check=False)
    with tolstat.open(path) as store:
        done = np.flatnonzero(store.status() != Status.PENDING)
        own = everything(store, done)
    with tolstat.open(other) as store:
        assert not set(everything(store, done).values()) & set(own.values())
    with tolstat.open(path) as store:
        os.replace(other, path)
        found = everything(store, done)
    assert [name for name in found if found[name] != own[name]] == []
