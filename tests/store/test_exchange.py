"""Campaigns handed to other programs: statistics as JSON, Parquet and xarray where they are installed."""

import json

import pandas as pd
import pytest
from typer.testing import CliRunner

from tests.questions.test_causes import made
from tests.support import synthetic
from tolstat import cli
from tolstat.common.columns import ERROR_COLUMNS
from tolstat.common.errors import InputError, StoreError
from tolstat.common.loads import BUSHING_LOADS
from tolstat.questions.capability import query as capability
from tolstat.questions.exceedance import query as exceedance
from tolstat.report import summary
from tolstat.store import ResultStore


def export(*arguments):
    return CliRunner().invoke(cli.app, ["export", *map(str, arguments)])


def test_json_has_all_statistics_as_the_reports_have_them(tmp_path):
    path, out = made(tmp_path, synthetic.STUDY.replace("n = 60", "n = 300")), tmp_path / "all.json"
    done = export(path, "--statistics", out, "--by", "cross1.F")
    assert done.exit_code == 0
    found = json.loads(out.read_text(encoding="utf-8"))
    with ResultStore.open(path) as store:
        view = store.view()
        tables = (("limits", exceedance.limits(view)), ("capability", capability.limits(view)))
        assert found["provenance"]["versions"] == store.versions
    assert found["joints"] == {"ok": 295, "not_settled": 2, "newton_failed": 3}
    for key, table in tables:
        told = pd.DataFrame(found[key]).astype(table.dtypes.to_dict())
        pd.testing.assert_frame_equal(
            told, table.replace([float("inf"), -float("inf")], float("nan")), check_exact=False
        )
    assert len(found["quantiles"]) == 4 * len(BUSHING_LOADS)
    assert found["causes"]["cross1.F"]["table"][0]["error"] == "pin1.offset_t"


def test_statistics_are_of_a_sample(tmp_path):
    path = synthetic.store(tmp_path, synthetic.SWEEP, "sweep")
    with ResultStore.open(path) as store, pytest.raises(StoreError, match="no sample of a production"):
        summary.statistics(store.view())
    done = export(synthetic.store(tmp_path), "--csv", "x.csv", "--by", "cross1.F")
    assert done.exit_code == 2
    assert "--by is used with --statistics only" in done.stderr


def test_what_is_not_installed_is_said_before_anything_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr("tolstat.cli.export.find_spec", lambda name: None)
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    path, out = synthetic.store(tmp_path), tmp_path / "x.csv"
    done = export(path, "--parquet", tmp_path / "x.parquet", "--csv", out)
    assert done.exit_code == 2
    assert "pip install pyarrow" in done.stderr
    assert not out.exists()
    with ResultStore.open(path) as store, pytest.raises(InputError, match="pip install xarray"):
        store.to_xarray()


def test_parquet_has_columns_units_and_rows(tmp_path):
    pytest.importorskip("pyarrow")
    path, out = synthetic.store(tmp_path, failed=2), tmp_path / "x.parquet"
    assert export(path, "--parquet", out).exit_code == 0
    frame = pd.read_parquet(out)
    with ResultStore.open(path) as store:
        pd.testing.assert_frame_equal(frame, store.to_pandas(), check_like=False, check_index_type=False)
    assert frame.attrs["units"]["cross1.T_max"] == "N*m"


def test_xarray_has_units_and_descriptions(tmp_path):
    pytest.importorskip("xarray")
    with ResultStore.open(synthetic.store(tmp_path, failed=2)) as store:
        data, frame = store.to_xarray(), store.to_pandas()
    assert data.sizes == {"row": 61}
    assert data["cross1.F_max"].attrs["units"] == "N"
    assert data[ERROR_COLUMNS[0].name].attrs["description"] == ERROR_COLUMNS[0].description
    assert (data["status"].to_numpy() == frame["status"].to_numpy()).all()
