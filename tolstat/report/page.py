"""The report of a result file as one page: read and evaluate the campaign, then write the HTML."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import exceedance, overrepresentation
from tolstat.campaign.remedy import remedy
from tolstat.common.draw_records import check_equal_weights
from tolstat.common.errors import Fault, StoreError, TolstatError
from tolstat.common.loads import LOAD_FIELDS
from tolstat.common.tables import FAILED, SIMULATED, UNSETTLED, VALID, Fidelity, Method, Start, Status
from tolstat.questions.causes import angles, tail
from tolstat.questions.causes import query as causes
from tolstat.questions.causes.angles import AgainstAngle
from tolstat.questions.causes.query import Causes
from tolstat.questions.fatigue import query as fatigue
from tolstat.questions.fatigue.query import Loading
from tolstat.report import compose, html
from tolstat.report.findings import Findings, Lost, Worst
from tolstat.solver import fidelity
from tolstat.store import ResultStore, revolutions, view
from tolstat.store.integrity import DIGEST
from tolstat.store.reader import BLOCK
from tolstat.store.recall import recall
from tolstat.store.view import Campaign, load
from tolstat.study import Study
from tolstat.study.tolerances.distributions import score

JOINTS = 20_000
"""Maximum number of joints (the first ones) used for causes; a quarter for cycles. More add little and take memory."""
WORST, DRAWN = 8, 3
"""Numbers of worst joints listed and drawn for each leading load."""
HEAVY = 3.0
"""Ratio of the largest load to the median above which the causes refer to the load's logarithm."""
NAMED = 12
"""Maximum number of joints without a valid result that are listed."""


def write(path: str | Path, out: str | Path, accepted: float = np.nan, again: int = angles.JOINTS) -> Path:
    """Write the report of a result file as one page; the campaign may be unfinished.

    Parameters
    ----------
    path : str or Path
        The result file of a study that draws its joints or sweeps.
    out : str or Path
        HTML file to write.
    accepted : float
        Accepted share: share of the joints that may be above a limit; NaN if none is given.
    again : int
        Number of joints whose load histories are evaluated; without stored histories they are simulated again. With 0
        the page shows no histories.

    Returns
    -------
    Path
        The file written; the same result file gives the same bytes.

    Raises
    ------
    StoreError
        When the file cannot be read, lists its joints, or holds levels of a subset simulation.

    Examples
    --------
    >>> tolstat.write_page("iso2768_f.h5", "iso2768_f.html", accepted=0.01)  # doctest: +SKIP
    PosixPath('iso2768_f.html')
    """
    with ResultStore.open(path) as store:
        if store.case_names:
            remedy = "leave the ending .html out: tolstat report FILE writes their table, and the paper's page"
            raise StoreError(str(Fault(str(path), "lists its joints one by one", remedy)))
        made = compose.compose(gather(store, accepted, again))
    html.write(made, Path(out))
    return Path(out)


def simulates(store: ResultStore) -> bool:
    """Whether the page needs joints to be simulated again: the file holds a sample without load histories."""
    return store.sampling["method"] in angles.DRAWN and not revolutions.held(store)


def gather(store: ResultStore, accepted: float = np.nan, again: int = angles.JOINTS) -> Findings:
    """Evaluate everything that the page shows; what cannot be evaluated is left out, and a note says why.

    Parameters
    ----------
    store : ResultStore
        The result file.
    accepted, again
        As in `write`.
    """
    campaign, modes = read(store)
    names = leading(campaign)
    logarithmic = frozenset(name for name in names if heavy(campaign, name))
    notes = [note for note in (fidelity.sentence(store.options, store.fidelity), _stopped(store)) if note]
    found: tuple[list[Causes], list[AgainstAngle], list[Worst]] = ([], [], [])
    lost_errors = None
    if campaign.method != "sweep" and campaign.count(*VALID):
        with _noting(notes, "causes and worst joints are left out", store.path):
            study = recall(store)
            if campaign.weights is None and not study.groups:
                lost_errors = _errors_of_lost(store, study, campaign)
            found = _of_leading(store, study, campaign, names, logarithmic, again, notes)
    return Findings(
        campaign=campaign,
        question=question(store.study_text),
        accepted=accepted,
        counts={status.label: campaign.count(status) for status in Status},
        modes=modes,
        leading=names,
        logarithmic=logarithmic,
        causes=tuple(found[0]),
        angles=tuple(found[1]),
        worst=tuple(found[2]),
        loading=_cycles(store, campaign, notes),
        lost=tuple(_lost(store, campaign)),
        lost_errors=lost_errors,
        facts=tuple(_facts(store)),
        study=store.study_text,
        notes=tuple(f"{note[0].upper()}{note[1:]}." for note in notes),
    )


@contextmanager
def _noting(notes: list[str], what: str, path: Path) -> Iterator[None]:
    """Turn a `TolstatError` into a note, so that the rest of the report is still written.

    The note names the file without its folder, so that the page does not depend on the folder.
    """
    try:
        yield
    except TolstatError as error:
        notes.append(f"{what}: {str(error).splitlines()[0].replace(str(path), path.name)}")


def read(store: ResultStore) -> tuple[Campaign, NDArray[np.float64]]:
    """Read the part of the campaign that the page needs: 200 bytes per joint.

    Returns
    -------
    campaign : Campaign
        Its results have the fields `loads.LOAD_FIELDS`; it has errors only for a sweep.
    modes : ndarray, shape (4, 4)
        Mean share of the revolution by pin and contact mode, over the settled joints.

    Raises
    ------
    StoreError
        When the file holds levels of a subset simulation, which are not a sample.
    """
    swept = store.sampling["method"] == "sweep"
    campaign = view.read(store, LOAD_FIELDS, None if swept else (), weighted=True)
    skip, total, modes = _first(store), 0.0, np.zeros((4, 4))
    for first in range(0, len(campaign.results), BLOCK):
        rows = slice(first + skip, min(first + BLOCK, len(campaign.results)) + skip)
        shares = store.results(rows, ("mode_share",))["mode_share"]
        here = slice(first, first + len(shares))
        valid = np.isin(campaign.results["status"][here], VALID)
        weights = valid.astype(float) if campaign.weights is None else np.where(valid, campaign.weights[here], 0.0)
        modes += np.tensordot(weights[valid], shares[valid], 1)
        total += weights.sum()
    return campaign, modes / total if total else np.full((4, 4), np.nan)


def leading(campaign: Campaign) -> tuple[str, ...]:
    """Select the leading load of each kind (force, torque, ...).

    Candidates are the loads with limits or, without limits, all bushing loads kept. The leading load is the one whose
    limit the largest share of the joints exceeds; ties are decided by the 99 % quantile over the limit (without limits
    by the 99 % quantile).
    """
    names = list(campaign.limits) or list(campaign.drawn)
    found: dict[str, tuple[tuple[float, float], str]] = {}
    for name in names:
        values = load(campaign.results, name)[0]
        valid = exceedance.sort_out(values, campaign.results["status"]).valid
        if valid.size:
            limit = campaign.limits.get(name, 1.0)
            share = campaign.above(values, limit, 0.95).estimate if name in campaign.limits else 0.0
            rank = (share, float(valid[int(0.99 * (valid.size - 1))]) / limit)
            kind = name.rpartition(".")[2]
            found[kind] = max(found.get(kind, (rank, name)), (rank, name), key=lambda item: item[0])
    return tuple(name for _, name in found.values())


def heavy(campaign: Campaign, name: str) -> bool:
    """Whether all valid values of a load are positive and the largest exceeds `HEAVY` times the median."""
    valid = exceedance.sort_out(load(campaign.results, name)[0], campaign.results["status"]).valid
    return bool(valid[0] > 0 and valid[-1] > HEAVY * valid[valid.size // 2])


def question(text: str) -> str:
    """Question of a study: the paragraph ``# Question: ...`` of its opening comment; empty if there is none."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("#").strip())
    found = re.search(r"^Question:\s*(.*?)(?=^\w[\w ]*:|\Z)", "\n".join(lines), flags=re.DOTALL | re.MULTILINE)
    return " ".join(found[1].split()) if found else ""


def _first(store: ResultStore) -> int:
    """File slot of the first joint after the nominal one: 1 if slot 0 holds the nominal joint, else 0."""
    return int(bool(store.sampling["nominal_first"]) and store.rows.start == 0)


def _of_leading(
    store: ResultStore,
    study: Study,
    campaign: Campaign,
    names: tuple[str, ...],
    logarithmic: frozenset[str],
    again: int,
    notes: list[str],
) -> tuple[list[Causes], list[AgainstAngle], list[Worst]]:
    """Causes, contribution of the errors against the shaft angle, and worst joints of the leading loads."""
    found, at_angles, worst = [], list[AgainstAngle](), []
    bushings = [name for name in names if name.endswith((".F", ".T"))]
    with _noting(notes, "causes are left out", store.path):
        check_equal_weights(store.sampling, store.path)
        part = _some(store, campaign)
        for name in names:
            log = name in logarithmic
            with _noting(notes, f"no causes of {name}", store.path):
                found.append(
                    causes.of_store(store, name, log=log)
                    if study.groups
                    else causes.of_campaign(part, study, name, log=log, place=campaign.name)
                )
        if again and bushings and not study.groups:
            with _noting(notes, "nothing against the shaft angle", store.path):
                at_angles = angles.of_store(store, study, bushings, again, logarithmic)
    for name in names:
        worst.append(_worst(store, study, campaign, name, bool(again) and name in bushings))
    return found, at_angles, worst


def _some(store: ResultStore, campaign: Campaign) -> Campaign:
    """The first `JOINTS` joints, with their errors."""
    skip, results = _first(store), campaign.results[:JOINTS]
    return replace(campaign, results=results, errors=store.errors(slice(skip, skip + len(results))))


def _worst(store: ResultStore, study: Study, campaign: Campaign, name: str, histories: bool) -> Worst:
    values, unit = load(campaign.results, name)
    status = campaign.results["status"]
    place = np.flatnonzero(np.isin(status, SIMULATED) & np.isfinite(values))
    place = place[np.argsort(-values[place], kind="stable")][:WORST]
    rows = place + _first(store)
    joints = tail.describe(store, study, rows, values[place], status[place])
    drawn = revolutions.read(store, np.sort(rows[:DRAWN]), 180) if histories else None
    return Worst(name, unit, joints, drawn and drawn._replace(rows=drawn.rows + store.rows.start))


def _cycles(store: ResultStore, campaign: Campaign, notes: list[str]) -> Loading | None:
    """Load cycles of the first joints; None if the file has no usable histories."""
    if not store.history_specs or campaign.method == "sweep" or not campaign.count(Status.OK):
        return None
    with _noting(notes, "load cycles are left out", store.path):
        return fatigue.read([store.path], most=JOINTS // 4)
    return None


def _lost(store: ResultStore, campaign: Campaign) -> list[Lost]:
    skip, found = _first(store), []
    for place in np.flatnonzero(np.isin(campaign.results["status"], (*FAILED, *UNSETTLED)))[:NAMED].tolist():
        row = store.results(slice(place + skip, place + skip + 1))[0]
        text = remedy(row, store.options)
        found.append(Lost(store.rows[place + skip], Status(int(row["status"])).label, text))
    return found


def _errors_of_lost(store: ResultStore, study: Study, campaign: Campaign) -> pd.DataFrame | None:
    """Compare errors of lost and settled joints among the first `JOINTS`; None if there are too few of either."""
    status, skip = campaign.results["status"][:JOINTS], _first(store)
    done = status != Status.PENDING
    lost = np.isin(status, (*FAILED, *UNSETTLED))[done]
    if min(int(lost.sum()), int((~lost).sum())) < overrepresentation.FEWEST:
        return None
    errors = store.errors(slice(skip, skip + len(status)))[done]
    names = causes.scattering(study, errors)
    z = np.column_stack([score(study.tolerances[name], sampling.values(errors, name)) for name in names])
    found = overrepresentation.tail(z, lost, iid=campaign.iid)
    columns: dict[str, Any] = {"error": names}
    for key, part in found._asdict().items():
        columns |= {key: part.estimate, f"{key}_lower": part.lower, f"{key}_upper": part.upper, f"{key}_p": part.p}
    table = pd.DataFrame(columns)
    far = np.maximum(abs(table["direction"] - 0.5), abs(table["size"] - 0.5))
    return table.iloc[np.argsort(-far, kind="stable")].reset_index(drop=True)


def _stopped(store: ResultStore) -> str:
    if not store.stop:
        return ""
    return f"stopped by {store.stop['rule']} at {store.stop['joints']} joints: intervals here are not corrected for it"


def _facts(store: ResultStore) -> Iterator[tuple[str, str]]:
    """Provenance of the numbers, as names and values."""
    attributes = store.attributes()
    yield "Study", store.study_name
    rows = f"{store.n}" if store.whole else f"{store.rows.start} to {store.rows.stop - 1} of {store.campaign_rows}"
    yield "Rows of the campaign", rows
    yield "Sampling", f"{store.sampling['method']}, seed {store.sampling['seed']}"
    yield "Begun", store.created
    yield "Versions", ", ".join(f"{name} {value}" for name, value in store.versions.items() if name != "sources")
    yield "Code", f"{store.git_commit or 'no commit known'}; sources {store.versions.get('sources', 'unknown')}"
    digest = attributes.get(DIGEST)
    yield "Result file", f"schema {attributes['schema_version']}, attributes {digest or 'without checksum'}"
    if digest:
        yield "Checksum of the results", results_digest(store)
    yield "Solver", ", ".join(f"{name} {_word(name, value)}" for name, value in store.options.items())
    for k, retry in enumerate(store.retries, 1):
        yield f"Retry {k}", ", ".join(f"{name} {value}" for name, value in retry.get("settings", {}).items())


def _word(name: str, value: Any) -> str:
    """Value of a solver setting as it is written in a study."""
    kinds: dict[str, type[IntEnum]] = {"method": Method, "start": Start, "fidelity": Fidelity}
    return kinds[name](value).name.lower() if name in kinds else str(value)


def results_digest(store: ResultStore) -> str:
    """SHA-256 over the checksums of all rows: equal for files with the same joints and results."""
    digest = hashlib.sha256()
    for first in range(0, store.n, BLOCK):
        digest.update(store.column("ledger", "results_check", slice(first, first + BLOCK)).tobytes())
    return digest.hexdigest()
