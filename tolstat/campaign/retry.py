"""Simulate joints with a given status again, with other solver settings or with the same."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tolstat.common import strict
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.solver_options import to_names
from tolstat.common.tables import HistorySpec, Options, Status
from tolstat.joint.ideal import NO_CLOSED_FORM
from tolstat.solver import fidelity
from tolstat.store import Writer
from tolstat.study.rewriting import given

if TYPE_CHECKING:
    from tolstat.study import Study


class Retry(NamedTuple):
    """Which joints are simulated again, and how.

    Attributes
    ----------
    status : tuple of Status
        Status of the joints that are simulated again.
    settings : dict
        Settings that replace the study's, ``{"solver.steps_per_rev": 360}``.
    options : Options
        Complete solver options.
    auto : bool
        Whether fidelity and steps a revolution are those that ``solver.fidelity = "auto"`` chose for the campaign.
    """

    status: tuple[Status, ...]
    settings: dict[str, Any]
    options: Options
    auto: bool = False

    def chosen(self, record: Mapping[str, Any]) -> Retry:
        """Return the retry with the fidelity and steps that ``auto`` chose for the campaign, if `auto` is true."""
        return self._replace(options=fidelity.apply(self.options, record)) if self.auto else self

    def entry(self) -> dict[str, Any]:
        """Return the entry for `retries` of the result file."""
        status = [state.label for state in self.status]
        return {"status": status, "settings": self.settings, "options": to_names(self.options)}


def parse(statuses: str, settings: Sequence[str], study: Study) -> Retry:
    """Parse a retry from the arguments of the command line.

    Parameters
    ----------
    statuses : str
        ``"newton_failed,crashed"``.
    settings : sequence of str
        ``"solver.steps_per_rev=360"``: a key of the study's ``[solver]`` and its value as in TOML.
    study : Study
        The study whose settings they replace.

    Raises
    ------
    InputError
        With every fault.
    """
    faults: list[Fault] = []
    labels = {state.label: state for state in Status if state != Status.PENDING}
    names = [name.strip() for name in statuses.split(",")]
    for name in names:
        if name not in labels:
            faults.append(Fault("--retry", f"{name!r} is not a status", strict.did_you_mean(name, list(labels))))
    changed: dict[str, Any] = {}
    for text in settings:
        with gather(faults):
            key, value = _setting(text)
            changed[key] = value
    solver = study.solver
    with gather(faults):
        new = {key.removeprefix("solver."): value for key, value in changed.items()}
        solver = strict.validate(type(solver), solver.model_dump(exclude_unset=True) | new, "--set", prefix=("solver",))
    if study.has_axial_force and solver.fidelity == "ideal":
        faults.append(Fault("--set: solver.fidelity", *NO_CLOSED_FORM))
    if faults:
        raise InputError(faults)
    chosen = tuple(labels[name] for name in dict.fromkeys(names))
    return Retry(chosen, changed, solver.options(), auto=solver.fidelity == "auto")


def _setting(text: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if not (equals and key.startswith("solver.")):
        raise InputError([Fault("--set", f"{text!r} is not a solver setting", "write --set solver.steps_per_rev=360")])
    return key.strip(), given(value)


def begin(store: Writer, retry: Retry, specs: Mapping[str, HistorySpec], tell: Callable[[str], None]) -> None:
    """Mark the joints of a retry as pending, unless the same retry is already under way in the file.

    Parameters
    ----------
    store : Writer
        Open for writing.
    retry : Retry
        Which joints, and how.
    specs : mapping of str to HistorySpec
        Histories that joints would have with the settings of the retry.
    tell : callable
        Called with a message that gives the number of joints.

    Raises
    ------
    InputError
        When histories would have another shape than those of the other joints.
    StoreError
        When there is no room for a second copy of the file.
    """
    entry = json.loads(json.dumps(retry.entry()))
    number = len(store.retries)
    each = store.each()
    if store.retries[-1:] == (entry,) and any(np.any(one.attempt()[one.pending()] == number) for one in each):
        return
    if dict(specs) != store.history_specs:
        found = "these settings give load histories another number of samples than those in the file"
        remedy = "remove solver.steps_per_rev, or run another campaign: tolstat run STUDY --out OTHER.h5"
        raise InputError([Fault("--set", found, remedy)])
    rows = {one.point or "": np.flatnonzero(np.isin(one.status(), retry.status)) for one in each}
    again = sum(slots.size for slots in rows.values())
    tell(f"{again} joints are simulated again")
    if again:
        store.begin_retry(rows, entry)
