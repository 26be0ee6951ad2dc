"""``python -m tests.measure.numerical_error``: is the largest numerical error that a run prints the bound that it says?

Campaigns of `studies/iso2768_f.toml` differ in their seeds; each says that a share of all joints is below the largest
error of those that it checked at random. The share is counted in other joints whose errors are known from tight
references. With ``--references`` these are computed anew and kept in ``tests/reference/errors.npz``, some 4 s a joint.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.support.environment import ROOT
from tolstat import sampling, study
from tolstat.analysis import accuracy
from tolstat.campaign import run, verify
from tolstat.campaign.pool import kept_workers
from tolstat.common.cardan import CARDAN
from tolstat.common.cores import available_cores
from tolstat.common.load_kinds import kinds
from tolstat.common.tables import Status, without_results
from tolstat.solver.simulation import simulate_rows
from tolstat.store import ResultFile
from tolstat.store.recorded import perturbed

STUDY, REFERENCES = ROOT / "studies" / "iso2768_f.toml", ROOT / "tests" / "reference" / "errors.npz"
JOINTS, CAMPAIGNS, OF_CAMPAIGN = 512, 60, 64
KEPT = ("status", "F_max", "T_max", "contact_max")
KINDS = ("F", "T", "contact")


class Misses(NamedTuple):
    """Numbers of campaigns whose bound is too low, by kind of load.

    Attributes
    ----------
    largest : dict of str to int
        Bound from the largest error of the joints that a run checks at random, as it is printed.
    control : dict of str to int
        The same words about the largest of two joints.
    """

    largest: dict[str, int]
    control: dict[str, int]


def references() -> NDArray[np.void]:
    """Compute the tight reference of `JOINTS` joints of the study, RESULT (n,)."""
    params, plan = _joints()
    options = [plan.solver.options()] * len(params)
    return verify.run_checks(params, options, CARDAN, ("reference",), workers=available_cores())["reference"].results


def true_errors() -> NDArray[np.float64]:
    """Errors of joints against their tight references, (n, kinds), of those that settled."""
    params, plan = _joints()
    other = without_results(len(params), Status.OK, CARDAN)
    with np.load(REFERENCES) as kept:
        for name in KEPT:
            other[name] = kept[name]
    base = simulate_rows(params, plan.solver.options()).results
    with np.errstate(invalid="ignore"):
        errors = accuracy.by_kind(accuracy.differences(base, other, CARDAN), CARDAN)
    return errors[other["status"] == Status.OK]


def _joints() -> tuple[NDArray[np.void], study.Study]:
    plan = study.load(STUDY, n=JOINTS)
    return perturbed(plan, np.arange(plan.rows), sampling.draw(plan))[plan.first_sample :], plan


def measure(campaigns: int = CAMPAIGNS, joints: int = OF_CAMPAIGN) -> Misses:
    """Count the campaigns of so many joints whose bound is below that share of the true errors."""
    true, columns = true_errors(), [list(kinds(CARDAN)).index(kind) for kind in KINDS]
    largest, control = np.zeros((2, len(KINDS)), int)
    with kept_workers():
        for seed in range(campaigns):
            errors = checked(seed, joints)[:, columns]
            level = np.quantile(true[:, columns], accuracy.share_below_largest(len(errors)), axis=0)
            largest += errors.max(axis=0) < level
            control += errors[:2].max(axis=0) < level
    return Misses(*(dict(zip(KINDS, counts.tolist(), strict=True)) for counts in (largest, control)))


def checked(seed: int, joints: int) -> NDArray[np.float64]:
    """Estimated errors of the joints that a run with another seed checks at random, (m, kinds)."""
    text = STUDY.read_text(encoding="utf-8").replace("seed = 2021", f"seed = {seed}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.toml")
        path.write_text(text, encoding="utf-8")
        run.run(study.load(path, n=joints), path.with_suffix(".h5"), workers=1, block=joints + 1)
        with ResultFile.open(path.with_suffix(".h5")) as store:
            found = store.view().verification
    assert found is not None
    checks = {name: check.results for name, check in found.checks.items()}
    return accuracy.by_kind(accuracy.numerical(found.base, checks, CARDAN), CARDAN)


def main() -> None:
    """Print the misses, or make the references."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--references", action="store_true", help="compute the tight references anew")
    if parser.parse_args().references:
        results = references()
        floats = {name: results[name].astype("f4") for name in KEPT if name != "status"}
        np.savez_compressed(REFERENCES, status=results["status"], **floats)
    misses = measure()
    for kind in KINDS:
        counts = f"{misses.largest[kind]} of {CAMPAIGNS} bounds too low, of two joints {misses.control[kind]}"
        print(f"{kind}: {counts}")


if __name__ == "__main__":
    main()
