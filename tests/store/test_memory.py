"""What a million joints ask of a command's memory: no table of a campaign is read whole where a part of it will do."""

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.questions.test_causes import TEXT, made
from tests.support import synthetic
from tests.support.of_cardan import LOAD_FIELDS
from tolstat.cli import app
from tolstat.store import ResultFile, reader, recorded, view, worst

BLOCK = 256


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return made(tmp_path_factory.mktemp("memory"), TEXT.replace("3000", "1500"))


@pytest.fixture
def read(monkeypatch):
    """Rows of each whole table that is read."""
    rows = []
    for module, name in ((worst, "AT_ONCE"), (view, "BLOCK")):
        monkeypatch.setattr(module, name, BLOCK)

    own = reader.Reader._table

    def recording(*args):
        table = own(*args)
        rows.append(len(table))
        return table

    monkeypatch.setattr(reader.Reader, "_table", recording)
    return rows


@pytest.mark.parametrize(
    "command",
    [
        ("report", "--out", "."),
        ("capability",),
        ("causes", "--by", "psi"),
        ("export", "--statistics", "all.json"),
    ],
)
@pytest.mark.slow
def test_no_command_reads_a_whole_table(path, read, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    name, *options = command
    done = CliRunner().invoke(app, [name, str(path), *options])
    assert done.exit_code == 0, done.stderr
    assert max(read) <= BLOCK
    assert len(read) >= 1500 // BLOCK


def test_only_loads_that_were_asked_for_and_the_first_errors_are_held(path, monkeypatch):
    monkeypatch.setattr(view, "BLOCK", BLOCK)
    with ResultFile.open(path) as store:
        whole, part = store.results()[1:], store.view()
        assert not part.results
        part.load("fork2.T")
        assert set(part.results) == {"status", "T_max", "T_lower", "T_upper"}
        for field in LOAD_FIELDS:
            np.testing.assert_array_equal(part.results[field], whole[field])
        with pytest.raises(KeyError):
            part.results["no_column"]
        assert len(part._first_errors) == BLOCK


def test_errors_of_some_joints_are_those_rows(path, monkeypatch):
    monkeypatch.setattr(view, "BLOCK", BLOCK)
    samples = np.array([0, 3, 254, 255, 256, 1499])
    with ResultFile.open(path) as store:
        errors, made = store.errors()[1:], store.view()
        found = made.errors(samples, ["pin2.offset_z"])
        assert found.dtype.names == ("pin2.offset_z",)
        np.testing.assert_array_equal(found["pin2.offset_z"], errors["pin2.offset_z"][samples])
        np.testing.assert_array_equal(made.errors(samples[:4]), errors[samples[:4]])
        blocks = list(made.error_blocks(["pin2.offset_z"]))
        np.testing.assert_array_equal(np.concatenate([b["pin2.offset_z"] for b in blocks]), errors["pin2.offset_z"])


def test_the_list_of_variants_is_read_once(tmp_path, read):
    """Parameters of a sweep take a time that grows with its rows, not with their square."""
    swept = '"pin*.diameter" = { from = "-0.1 mm", to = "0.1 mm"'
    assert swept in synthetic.SWEEP
    text = synthetic.SWEEP.replace(swept, '"cross.R" = { from = "40 mm", to = "60 mm"')
    with ResultFile.open(synthetic.store(tmp_path, text, "sweep")) as store:
        before = len(read)
        params = recorded.parameters(store, np.arange(store.n))
    assert len(np.unique(params["R"])) == len(params)
    assert len(read) - before == 2  # errors, variants
