"""Metadata of a result file: one JSON document in the dataset ``metadata``, with its SHA-256 beside it.

Among them is the provenance of the results: versions of the software that computed them, and the commit of the code.
"""

from __future__ import annotations

import hashlib
import json
import platform
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from pydantic import BaseModel, ConfigDict

import tolstat
from tolstat.common.cardan import MECHANISMS
from tolstat.common.fields import HistorySpec
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import Options, Variant, to_names
from tolstat.joint import linked
from tolstat.store.hdf5 import put_attributes, text
from tolstat.study import Study

DATASET, CHECKSUM = "metadata", "sha256"
"""Dataset that holds the document as UTF-8, and its attribute with the checksum."""


class Design(BaseModel):
    """Joints that a study lists."""

    cases: tuple[str, ...]
    variants: tuple[Variant, ...]


class Metadata(BaseModel):
    """All that a reader needs beyond the tables.

    Attributes
    ----------
    study_name, study : str
        Name of the study, and the TOML that it was read from.
    mechanism : str
        Name of the mechanism, see `simulated`.
    limits : dict of str to float
        Limit of each load, SI.
    points : dict of str to dict
        Values of each operating point by its name, see `study.points.Point.values`.
    joint : dict
        Nominal joint, as a study gives it.
    identity : dict
        All settings that determine results, by dotted key.
    options, fidelity, sampling, versions : dict
        Solver options; what ``solver.fidelity = "auto"`` chose; sampling with ``dimensions``; software versions.
    design : Design
        Joints that the study lists.
    histories : dict of str to HistorySpec
        Load histories that the campaign keeps.
    retries : tuple of dict
        Settings of each retry, in chronological order, see `campaign.remedy.Retry.entry`.
    stop : dict
        Stop rule and its outcome, see `campaign.stop_rule.Outcome.record`; empty without one.
    campaign_rows, first_row, n : int
        Number of rows of the campaign, first one in the file, number of them in the file.
    created, git_commit : str
        Time of creation (UTC), and commit of the code, if known.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    study_name: str
    study: str
    mechanism: str
    limits: dict[str, float]
    points: dict[str, dict[str, Any]]
    joint: dict[str, Any]
    identity: dict[str, Any]
    options: dict[str, Any]
    fidelity: dict[str, Any]
    sampling: dict[str, Any]
    versions: dict[str, str]
    design: Design
    histories: dict[str, HistorySpec]
    retries: tuple[dict[str, Any], ...] = ()
    stop: dict[str, Any] = {}
    campaign_rows: int
    first_row: int
    n: int
    created: str
    git_commit: str

    def __repr__(self) -> str:
        return f"<metadata of study {self.study_name!r}: {', '.join(type(self).model_fields)}>"

    @property
    def about(self) -> dict[str, Any]:
        """Title, version, date, seed and study, as results carry them into other programs."""
        known = {"title": self.study_name, "version": self.versions["tolstat"], "date": self.created}
        known |= {"seed": self.sampling["seed"], "study": self.study}
        return {name: value for name, value in known.items() if value is not None}

    @property
    def simulated(self) -> Mechanism:
        """The mechanism by its name, one of `cardan.MECHANISMS`, or a linkage of its operating points.

        Raises
        ------
        KeyError, ValueError, InputError
            When there is no such mechanism, or the linkage is damaged.
        """
        linkage = next(iter(self.points.values())).get("linkage") if self.points else None
        if linkage:
            return linked.named(self.mechanism, linkage)
        return MECHANISMS[self.mechanism]


def of_study(
    study: Study,
    rows: range,
    histories: Mapping[str, HistorySpec],
    options: Options | None = None,
    fidelity: Mapping[str, Any] | None = None,
) -> Metadata:
    """Metadata of a new campaign, or of a slice of it.

    Parameters
    ----------
    study : Study
        The study.
    rows : range
        Rows of the campaign that the file holds.
    histories : mapping of str to HistorySpec
        Histories that the campaign keeps.
    options, fidelity : Options and mapping, optional
        Settings that ``solver.fidelity = "auto"`` chose, and the record of that choice.
    """
    return Metadata(
        **editable(study),
        mechanism=study.mechanism.name,
        identity=study.identity(),
        options=to_names(options or study.solver.options()),
        fidelity=dict(fidelity or {}),
        sampling=study.sampling.model_dump(mode="json"),
        versions=versions(),
        design=Design(cases=tuple(study.case_names), variants=tuple(study.variants)),
        histories=dict(histories),
        campaign_rows=study.rows,
        first_row=rows.start,
        n=len(rows),
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        git_commit=git_commit(),
    )


def editable(study: Study) -> dict[str, Any]:
    """Return the values that affect no result and may change between two runs of a campaign."""
    return {
        "study_name": study.name,
        "study": study.text,
        "limits": dict(study.limits),
        "points": {point.name: point.values() for point in study.points},
        "joint": study.joint.given("json"),
    }


def read(file: h5py.File) -> Metadata:
    """Read the metadata of a file.

    Raises
    ------
    KeyError, ValueError
        When they are missing or damaged.
    """
    document = bytes(file[DATASET][()])
    if hashlib.sha256(document).hexdigest() != text(file[DATASET].attrs, CHECKSUM):
        raise ValueError("its metadata do not match their checksum")
    return Metadata.model_validate_json(document)


def write(file: h5py.File, metadata: Metadata) -> None:
    """Write the metadata to a file, in the place of those that it has."""
    document = json.dumps(metadata.model_dump(), allow_nan=False).encode()
    if DATASET in file:
        del file[DATASET]
    dataset = file.create_dataset(DATASET, data=np.bytes_(document))
    about = "study, joint and settings of the campaign as JSON in UTF-8"
    put_attributes(dataset, {"description": about, CHECKSUM: hashlib.sha256(document).hexdigest()})


LIBRARIES = ("numpy", "numba", "scipy", "h5py")
RESULT_SOURCES = (
    *("kernel", "joint", "common/fields.py", "common/tables.py", "sampling.py"),
    *("study/tolerances", "study/axes.py", "study/design.py"),
    *("solver/simulation.py", "solver/refinement.py", "solver/stationary.py", "solver/histories.py"),
)
"""Sources that, together with the study's identity, determine the results of a campaign."""


def versions() -> dict[str, str]:
    """Versions of tolstat, of Python and of the libraries that affect results, and `source_hash`."""
    of_tolstat = {"tolstat": tolstat.__version__, "sources": source_hash(), "python": platform.python_version()}
    return of_tolstat | {name: version(name) for name in LIBRARIES}


def differing(recorded: Mapping[str, str], other: Mapping[str, str], here: str, there: str) -> list[str]:
    """Compare two records of `versions`: ``"numpy: 2.1.0 in the file, 2.2.0 now"`` for each of `other` that differs."""
    return [
        f"{name}: {recorded.get(name, 'unknown')} {here}, {value} {there}"
        for name, value in other.items()
        if recorded.get(name) != value
    ]


def differing_code(recorded: Mapping[str, str]) -> list[str]:
    """Compare the code that began a file with that of now: only equal code adds joints to a file."""
    return differing(recorded, {"tolstat": tolstat.__version__, "sources": source_hash()}, "in the file", "now")


def source_hash() -> str:
    """Hash of the sources that determine results: during development, code changes without a new version number."""
    package = Path(tolstat.__file__).parent
    digest = hashlib.sha256()
    for name in RESULT_SOURCES:
        source = package / name
        for path in sorted(source.rglob("*.py")) if source.is_dir() else [source]:
            digest.update(path.relative_to(package).as_posix().encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def git_commit() -> str:
    """Git commit of the checkout that the package was installed from or runs in, with ``-dirty`` if files differ.

    Returns
    -------
    str
        Empty when the package is not at the top of a git checkout: a virtual environment may lie inside the
        repository of another project, whose commit does not describe this code.
    """
    package = Path(tolstat.__file__).resolve().parent
    recorded = package / "_commit.txt"
    if recorded.is_file():  # written when a wheel is built from a checkout
        return recorded.read_text(encoding="ascii").strip()
    root = package.parent
    top = _git(root, "rev-parse", "--show-toplevel")
    if not top or Path(top).resolve() != root:
        return ""
    return _git(root, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    try:
        return subprocess.run(command, capture_output=True, encoding="utf-8", check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
