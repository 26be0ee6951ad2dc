"""The study of a subset simulation, made from a study with tolerances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.loads import LOADS
from tolstat.common.strict import validate
from tolstat.study.model import Subset
from tolstat.study.study import Study


def subset_of(study: Study, sampling: Mapping[str, Any]) -> Study:
    """Make the study of a subset simulation from the study whose tolerances it uses.

    Parameters
    ----------
    study : Study
        Study with any sampling method that draws joints; its histories are not stored.
    sampling : mapping
        Fields of `model.Subset` except those that are taken from the study.

    Returns
    -------
    Study
        Study whose ``sampling`` is a `model.Subset`; it can draw the joints of level 0, which are those of a random
        campaign.

    Raises
    ------
    InputError
        When the study has no tolerances or does not store the load, and with every fault of `sampling`.
    """
    faults: list[Fault] = []
    if not study.tolerances:
        remedy = 'give a study with [tolerances] and sampling.method = "random"'
        faults.append(Fault(str(study.path), "has no tolerances to draw joints from", remedy))
    if study.sampling.is_matched:
        found = "matches diameters by classes, which a subset simulation does not draw"
        faults.append(study.fault("sampling.selective", found, "remove it"))
    for load in (LOADS[name] for name in sampling["levels"]):
        if not selected_results.holds(study.output.columns, load.name):
            remedy = f"add {', '.join(load.columns)}"
            faults.append(study.fault("output.results", f"leaves out {load.name}, which --limit needs", remedy))
    own = study.sampling.model_dump(include=set(Subset.FROM_STUDY))
    with gather(faults):
        read = validate(Subset, own | {"n": sampling["per_level"]} | dict(sampling), "subset simulation")
    if faults:
        raise InputError(faults)
    output = study.output.model_copy(update={"histories": "none"})
    return replace(study, sampling=read, proposals=(), output=output)
