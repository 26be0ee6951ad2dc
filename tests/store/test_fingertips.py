"""What a store looks like at the prompt: loads by name, the nominal joint apart, short texts, nothing that writes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import tolstat
from tests.support import synthetic
from tests.support.of_cardan import LOADS
from tolstat.analysis.estimates import Inexact
from tolstat.analysis.sample import largest_of
from tolstat.common.errors import InputError
from tolstat.store import ResultFile, Writer

MAX_REPR = 250
WRITING = {name for name in set(dir(Writer)) - set(dir(ResultFile)) if not name.startswith("_")}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return synthetic.store(tmp_path_factory.mktemp("store"), synthetic.WHOLE, failed=2, unsettled=3)


@pytest.fixture
def store(path):
    with tolstat.open(path) as opened:
        yield opened


def test_loads_have_names_and_rows_of_the_campaign(store):
    load, table = LOADS["fork2.T"], store.results()
    series = store.loads["fork2.T"]
    assert (series.name, series.index.name, series.attrs["units"]) == ("fork2.T", "row", "N*m")
    assert series.index.tolist() == list(range(1, 61))
    assert series.isna().sum() == 5
    np.testing.assert_array_equal(series[:55], load.of(table)[1:56])
    assert list(store.loads) == [*LOADS]
    assert len(store.loads) == len(LOADS)
    assert "psi" in store.loads
    assert pd.DataFrame(dict(store.loads)).shape == (60, len(LOADS))
    assert store.nominal["fork2.T"] == load.of(table)[0]
    assert store.nominal.index.tolist() == [*LOADS]
    assert store.loads._ipython_key_completions_() == tuple(LOADS)
    with pytest.raises(InputError, match="did you mean"):
        store.loads["fork2.t"]


def test_a_slice_without_the_nominal_joint(tmp_path):
    source = tmp_path / "a.toml"
    source.write_text(synthetic.WHOLE, encoding="utf-8")
    study = tolstat.load(source)
    Writer.create(tmp_path / "a.h5", study, [tolstat.draw(study, range(20, 30))], rows=range(20, 30)).close()
    with tolstat.open(tmp_path / "a.h5") as opened:
        assert opened.loads["psi"].index.tolist() == list(range(20, 30))
        assert opened.loads["psi"].isna().all()
        assert opened.nominal.isna().all()
        assert opened.to_pandas().index.tolist() == list(range(20, 30))
        assert not opened.to_pandas(nominal=True)["nominal"].any()


def test_what_is_opened_for_reading_cannot_write(store):
    assert type(store) is ResultFile
    assert {"create", "write", "finish", "change", "mark_pending"} <= WRITING
    assert not WRITING & set(dir(store))
    view = store.view()
    load = view.load("cross1.F")
    kept = [load.values, *load.inexact, load.status, load.valid, view.nominal, view.mode_share]
    kept += [*view.results.values(), view.first_without_load, next(view.error_blocks(()))]
    assert not any(array.flags.writeable for array in kept)
    with pytest.raises(ValueError, match="read-only"):
        view.load("cross1.F").values[0] = 0.0


def test_a_load_is_a_column_of_what_is_read_and_ratios_are_not_kept(store):
    """Copies of loads, their ends and their ratios to limits once took a page of a million joints to 2.7 GB."""
    view = store.view()
    load, whole = view.load("cross1.F"), view.load("any limit")
    for part in (load, *whole.parts):
        held = getattr(part.value, "base", part.value).values  # beside joints that are not valid
        computed = LOADS[part.name].kind.parts  # the largest of a pin's contact forces
        assert computed or any(np.shares_memory(held, column) for column in view.results.values())
        assert held.flags.c_contiguous
    assert [part.limit for part in whole.each()] == [1.0] * len(view.limits)
    np.testing.assert_array_equal(whole.values, np.maximum.reduce([part.values for part in whole.each()]))


def test_intervals_of_loads_follow_their_joints(store):
    load = store.view().load("cross1.F")
    lower, upper = load.lower.values.copy(), load.upper.values.copy()
    lower[[2, 50]] -= 4.0
    upper[[2, 50]] += 6.0
    joints = np.union1d([2, 50], load.inexact.joints)
    one, other = (
        replace(load, inexact=Inexact(joints, lower[joints], upper[joints])),
        load.shifted(np.arange(60.0) % 7 - 3),
    )
    by = np.arange(60.0)
    larger = np.maximum(lower, other.lower.values), np.maximum(upper, other.upper.values)
    for found, expected in (
        (one.shifted(by), (lower + by, upper + by)),
        (one.of_limit(), (lower / 700.0, upper / 700.0)),
        (one.only(np.arange(40, 60)), (lower[40:], upper[40:])),
        (one.only(by < 40.0), (lower[:40], upper[:40])),
        (largest_of("both", [one, other]), larger),
        (largest_of("both", [other, one]), larger),
    ):
        np.testing.assert_array_equal((found.lower.values, found.upper.values), expected)
    level = float(load.values[2]) + 1.0
    alone = one.above(level)
    assert one.valid.size == 55
    assert one.above(level) == alone, "sorted or not"
    undecided = 5 + np.sum((lower[[2, 50]] <= level) & (level < upper[[2, 50]]))
    assert round(alone.n * (alone.bound_upper - alone.bound_lower)) == undecided


def test_texts_at_the_prompt_are_short(path, store):
    view = store.view()
    assert repr(store) == "<result file 'small.h5': 60 joints (55 ok, 3 not_settled, 2 newton_failed)>"
    assert repr(view.study) == "<study 'small': 60 joints (random), 4 toleranced errors, 7 limits>"
    for result in (store, view.study, view.load("cross1.F").quantile(0.5), store.counts()):
        assert len(repr(result)) <= MAX_REPR
        assert "\n" not in repr(result)
    assert view.study._repr_html_().startswith("<table>")
    closed = tolstat.open(path)
    closed.close()
    assert repr(closed) == "<result file 'small.h5', closed>"
