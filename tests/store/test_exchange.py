"""Campaigns handed to other programs: statistics as JSON, Parquet and xarray where they are installed."""

import pandas as pd
import pytest
from typer.testing import CliRunner

from tests.support import synthetic
from tests.support.of_cardan import ERROR_COLUMNS
from tolstat import cli
from tolstat.common.errors import InputError, StoreError
from tolstat.report import answer as reports
from tolstat.store import ResultFile, result_file


def export(*arguments):
    return CliRunner().invoke(cli.app, ["export", *map(str, arguments)])


def test_statistics_are_of_a_sample(tmp_path):
    path = synthetic.store(tmp_path, synthetic.SWEEP, "sweep")
    with ResultFile.open(path) as store, pytest.raises(StoreError, match="no sample of a production"):
        reports.statistics(store.view())
    done = export(synthetic.store(tmp_path), "--csv", "x.csv", "--accept", "1 %")
    assert done.exit_code == 2
    assert "--accept is used with --statistics only" in done.stderr


def test_what_is_not_installed_is_said(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    with ResultFile.open(synthetic.store(tmp_path)) as store, pytest.raises(InputError, match="pip install xarray"):
        store.to_xarray()


def test_tables_are_written_block_by_block(tmp_path, monkeypatch):
    for source in (synthetic.store(tmp_path, failed=2), synthetic.store(tmp_path, synthetic.SWEEP, "sweep")):
        written = {}
        for rows in (10**6, 7):
            monkeypatch.setattr(result_file, "AT_ONCE", rows)
            out = tmp_path / f"{rows}.csv"
            assert export(source, "--csv", out, "--nominal").exit_code == 0
            written[rows] = out.read_text(encoding="utf-8")
        assert written[7] == written[10**6]
        found = pd.read_csv(out, header=[0, 1], index_col=0)
        found.columns = found.columns.get_level_values(0)
        with ResultFile.open(source) as store:
            pd.testing.assert_frame_equal(found, store.to_pandas(nominal=True), check_dtype=False, check_names=False)


def test_parquet_has_columns_units_and_rows(tmp_path):
    pytest.importorskip("pyarrow")
    path, out = synthetic.store(tmp_path, failed=2), tmp_path / "x.parquet"
    with ResultFile.open(path) as store:
        store.to_pandas().to_parquet(out)
        frame = pd.read_parquet(out)
        pd.testing.assert_frame_equal(frame, store.to_pandas(), check_like=False, check_index_type=False)
    assert frame.attrs["units"]["cross1.T_max"] == "N*m"


def test_the_nominal_joint_is_exported_if_asked_for(tmp_path):
    path = synthetic.store(tmp_path)
    for options, rows in (((), range(1, 61)), (("--nominal",), range(61))):
        lines = export(path, "--csv", "-", *options).stdout.splitlines()
        assert [int(line.split(",")[0]) for line in lines[2:]] == list(rows)
        assert ("nominal" in lines[0].split(",")) == bool(options)
    refused = export(path, "--statistics", "-", "--nominal")
    assert refused.exit_code == 2
    assert "--nominal is used with tables of joints" in refused.stderr


def test_xarray_has_units_and_descriptions(tmp_path):
    pytest.importorskip("xarray")
    with ResultFile.open(synthetic.store(tmp_path, failed=2)) as store:
        data, frame = store.to_xarray(), store.to_pandas()
    assert data.sizes == {"row": 60}
    assert data["cross1.F_max"].attrs["units"] == "N"
    assert data[ERROR_COLUMNS[0].name].attrs["description"] == ERROR_COLUMNS[0].description
    assert (data["status"].to_numpy() == frame["status"].to_numpy()).all()
