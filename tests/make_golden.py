"""``python -m tests.make_golden``: a small result file of the present schema, and what is in it as CSV.

Run once when a schema is released, and never again for it: the file stands for what users have on their disks. The
file of the schema before takes the place of the one that is refused; its CSV is removed.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from tests.support import fakes
from tolstat.store import ResultFile, Writer, metadata

FOLDER = Path(__file__).parent / "golden"
PRESENT, BEFORE = "schema.h5", "schema_before.h5"
"""Names of the file of the present schema, with its CSV, and of that of the schema before, which is refused."""


def make(folder: Path) -> Path:
    """Make the files in `folder`: three joints that are done, one failed among them, with histories."""
    study = fakes.Study(n=3, output=fakes.Output("full"))
    errors = fakes.draw(study)
    errors["operation.alpha"] = [0.5, 2.5, -0.5]
    path = folder / PRESENT
    rows = np.arange(3)
    with Writer.create(path, study, [errors], fakes.specs_of("full")) as store:
        params = fakes.perturb(study.joint, study.operation, errors)
        store.write(rows, fakes.simulate(params, fakes.Options(), "full", 0))
        store.finish()
    with h5py.File(path, "r+") as file:
        metadata.write(file, metadata.read(file).model_copy(update={"git_commit": ""}))
    with ResultFile.open(path) as store:
        store.to_pandas(nominal=True).to_csv(path.with_suffix(".csv"), lineterminator="\n")
    return path


if __name__ == "__main__":
    (FOLDER / PRESENT).replace(FOLDER / BEFORE)
    make(FOLDER)
