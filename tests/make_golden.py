"""``python -m tests.make_golden``: a small result file of the present schema, and what is in it as CSV.

Run once when a schema is released, and never again for it: the file stands for what users have on their disks.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from tests.support import fakes
from tolstat.common.tables import SCHEMA_VERSION
from tolstat.store import Reader, ResultStore, integrity

FOLDER = Path(__file__).parent / "golden"


def make(folder: Path) -> Path:
    """Make the files in `folder`: three joints that are done, one failed among them, with histories."""
    study = fakes.Study(n=3, output=fakes.Output("full"))
    errors = fakes.draw(study)
    errors["operation.alpha"] = [0.5, 2.5, -0.5]
    path = folder / f"schema{SCHEMA_VERSION}.h5"
    rows = np.arange(3)
    with ResultStore.create(path, study, errors, fakes.specs_of("full"), {"pin1.offset_e": 0}) as store:
        params = fakes.perturb(study.joint, study.operation, errors)
        store.write(rows, fakes.simulate(params, fakes.Options(), "full", 0))
        store.finish()
    with h5py.File(path, "r+") as file:
        file.attrs["git_commit"] = ""
        integrity.seal(file)
    with Reader.open(path) as store:
        store.to_pandas(nominal=True).to_csv(path.with_suffix(".csv"), lineterminator="\n")
    return path


if __name__ == "__main__":
    make(FOLDER)
