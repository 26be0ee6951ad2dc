"""Numbers, units and names as people read them."""

import math

import numpy as np
import pandas as pd
import pytest

from tolstat.display import text
from tolstat.display.table import Column, fitted
from tolstat.display.unseen import visible


@pytest.mark.parametrize(
    ("x", "unit", "shown"),
    [
        (9999.0, "N", "9999 N"),
        (13200.0, "N", "13.2 kN"),
        (-2e4, "N*m", "-20 kN m"),
        (2e4, "1", "20000"),
        (math.nan, "N", "-"),
    ],
)
def test_large_loads_are_shown_in_multiples_of_their_unit(x, unit, shown):
    assert text.value(x, unit) == shown


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [(7776.0, 36310.0, "7.776 .. 36.31 kN"), (1.0, 2.0, "1 .. 2 N"), (20000.0, math.inf, "20 kN .. needs more joints")],
)
def test_both_ends_of_an_interval_have_one_unit(low, high, shown):
    assert text.span_of(low, high, "N") == shown


def test_characters_that_cannot_be_seen_are_shown_by_their_code():
    assert visible("a\u202eb\x00\x1b[31m\u2066") == "a[U+202E]b[U+0000][U+001B][31m[U+2066]"
    assert visible("Übermaß –\tΔ\nعربي") == "Übermaß –\tΔ\nعربي"


def test_tables_are_written_as_pandas_writes_them(tmp_path):
    floats = [0.1, 1.0, -0.0, 1e16, 123456789.123456789, 1e-300, 2.0 / 3.0, np.nan, np.inf]
    floats += np.random.default_rng(1).lognormal(0.0, 30.0, 500).tolist()
    words = ['a "b", c', "=1+1", "@x", "", "two\nlines", "Δ", None, "-"]
    n = len(floats)
    frame = pd.DataFrame(
        {"load": (words * n)[:n], "x, y": floats, "n": range(n), "some": [None, 1.5, True, "+"] * (n // 4) + [2]}
    )
    rows = text.columns_of(frame.astype(object).where(frame.notna(), None).to_dict("records"))
    frame.map(text.cell).to_csv(tmp_path / "pandas.csv", index=False, encoding="utf-8", lineterminator="\n")
    path = text.csv(rows, tmp_path / "stem", "rows")
    assert path.read_bytes() == (tmp_path / "pandas.csv").read_bytes()


@pytest.mark.parametrize(
    ("share", "shown"), [(0.0, "0 %"), (-0.0, "0 %"), (1.5e-40, "< 1e-07 %"), (3.2e-7, "3.2e-05 %"), (0.5, "50 %")]
)
def test_shares_below_one_in_a_billion_are_no_more_than_that(share, shown):
    assert text.percent(share) == shown
    assert text.span(1e-40, 0.5) == "0 .. 50 %"
    assert text.span(-0.02, 0.5) == "-2 .. 50 %"


def test_a_wide_table_fits_160_characters():
    columns = [Column(head, lambda row, head=head: row[head], words=True) for head in ("name", "since", "keys")]
    rows = [
        {"name": "a", "since": 40 * "since it is so ", "keys": 30 * "key = 1, "},
        dict.fromkeys(("name", "since", "keys"), "b"),
    ]
    shown, missing = fitted(columns, rows, None)
    assert max(map(len, shown.splitlines())) <= 160
    assert missing == ""
    assert shown.split().count("since") == 41
    assert fitted(columns, rows[1:], None)[0] == "name  since  keys\nb     b      b"


def test_one_thing_is_not_several():
    assert [text.several(n, "joint") for n in (0, 1, 2)] == ["0 joints", "1 joint", "2 joints"]
