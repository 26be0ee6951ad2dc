"""What the page of the paper's study needs of a result file, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studies.cirelli2021 import choices as paper_choices
from studies.cirelli2021 import laws as paper_laws
from studies.cirelli2021 import page_main as paper_main
from studies.cirelli2021 import statements as paper_statements
from studies.cirelli2021 import statics as paper_statics
from studies.cirelli2021 import tables as paper
from studies.cirelli2021.evidence import Answer
from studies.cirelli2021.page_main import Main, revolutions
from tolstat.common.cardan import CARDAN
from tolstat.common.columns import result_columns
from tolstat.common.tables import Status, Variant
from tolstat.joint import Joint, operating, varied
from tolstat.questions.sweep import relative_errors
from tolstat.store import ResultFile
from tolstat.store.recorded import operating_points

Array = NDArray[np.float64]
AS_PRINTED = 1e7
"""Contact damping (N s/m) above which a joint is one with c_d as printed."""
LAW = "contact.law"


@dataclass(frozen=True)
class PaperStudy:
    """A study of the paper's cases, at the paper's misalignments.

    Attributes
    ----------
    name, created : str
        Name of the study, time of creation.
    joints : int
        How many joints the file holds.
    joint : Joint
        The joint of the first variant.
    base : Joint
        The joint that the variants are made of.
    cases : tuple of str
        Names of the errors, ``"ideal"`` first.
    variants : tuple of Variant
        The joints.
    variant, case : ndarray of int, shape (n,)
        What each row is.
    alpha : ndarray, shape (n,)
        Misalignment, rad.
    results : ndarray of RESULT, shape (n,)
        The rows.
    gamma : ndarray, shape (n, 8, 2)
        Eq. (14), per cent.
    mains : dict
        Name of the contact law to the variant that differs from the first by nothing else; the first is the first.
    settle_tol : float
        Closure error below which a joint is settled.
    """

    name: str
    created: str
    joints: int
    joint: Joint
    base: Joint
    cases: tuple[str, ...]
    variants: tuple[Variant, ...]
    variant: NDArray[np.int32]
    case: NDArray[np.int32]
    alpha: Array
    results: NDArray[np.void]
    gamma: Array
    mains: dict[str, Main]
    settle_tol: float

    @property
    def main(self) -> Main:
        """The first variant."""
        return next(iter(self.mains.values()))

    @cached_property
    def matches(self) -> list[paper.Match]:
        """Nearest direction of each printed case by the modulus of Gamma, rows counted in `main`."""
        return paper.nearest(self.main.gamma, self.main.case, self.main.alpha, self.cases)

    @cached_property
    def signed(self) -> list[paper.Match]:
        """The same with the sign of Gamma."""
        return paper.nearest(self.main.gamma, self.main.case, self.main.alpha, self.cases, signed=True)

    @cached_property
    def computed(self) -> Array:
        """Gamma in the shape of the printed tables, see `paper.tabulated`."""
        return paper.tabulated(self.main.gamma, self.matches)

    @cached_property
    def fits(self) -> list[paper_choices.Fit]:
        """How near each variant comes to the printed tables."""
        return paper_choices.fits(self.gamma, self.variant, self.case, self.alpha, self.cases)

    @property
    def families(self) -> tuple[str, ...]:
        """Family of each variant."""
        return tuple(variant.family for variant in self.variants)

    def sweeps(self) -> list[paper_choices.Sweep]:
        """Families in which one quantity moves."""
        return paper_choices.sweeps(self.families, tuple(v.values for v in self.variants))

    def searched(self) -> tuple[list[int], list[str]]:
        """Variants in which several quantities move, and which."""
        return paper_choices.searched(self.families, tuple(v.values for v in self.variants))

    def as_printed(self) -> NDArray[np.intp]:
        """Rows of the joint with c_d as printed."""
        members = [i for i, v in enumerate(self.variants) if float(v.values.get("contact.c_d") or 0.0) > AS_PRINTED]
        return np.flatnonzero(np.isin(self.variant, members))

    def ideal(self, alpha: float) -> int:
        """Row in `main` of the joint without errors at a misalignment, rad."""
        return self.main.ideal(alpha)

    @cached_property
    def answers(self) -> list[Answer]:
        """Sentences of the paper, tested on the first variant."""
        return paper_statements.answers(self.main.evidence(self.cases, self._printed_revolutions()))

    @cached_property
    def laws(self) -> list[paper_laws.Law]:
        """Contact laws beside the first variant's."""
        printed = self._printed_revolutions()
        return paper_laws.compare({name: main.evidence(self.cases, printed) for name, main in self.mains.items()})

    def _printed_revolutions(self) -> Array:
        return revolutions(self.results[self.as_printed()])

    def contradictions(self) -> list[paper_statics.Contradiction]:
        """Test of Table 4 by statics, with the first variant's ideal joint."""
        row = self.ideal(0.0)
        return paper_statics.contradictions(self._loads(self.main.results[row], self.joint))

    def exclusions(self) -> list[paper_statics.Exclusion]:
        """The same with every variant whose ideal joint has a result."""
        loads, ratio = [], []
        rows = np.flatnonzero((self.case == 0) & (np.abs(self.alpha) < paper.SAME_ALPHA))
        for row in rows[self.results["status"][rows] == Status.OK]:
            joint = varied(self.base, self.variants[self.variant[row]].values)
            loads.append(self._loads(self.results[row], joint))
            ratio.append(joint.cross.r_b / joint.cross.R)
        return paper_statics.exclusions(loads, np.array(ratio))

    def _loads(self, result: np.void, joint: Joint) -> paper_statics.Loads:
        force, torque = (float(result[name][:4].max()) for name in ("F_max", "T_max"))
        resisting = float(operating(self.main.operation, self.main.errors)["torque"][0])
        return paper_statics.Loads(force, torque, resisting, joint.cross.r_b)


def matching(store: ResultFile) -> bool:
    """Whether a file is a complete study of the paper's cases with all results and with what the page draws."""
    if store.columns != result_columns(CARDAN) or not store.case_names or not store.complete:
        return False
    if not {"loads", "contact", "tau"} <= set(store.history_specs):
        return False
    design, alpha = store.design, operating_points(store)["alpha"]
    rows = _kept(design, alpha)
    rows = rows[design["variant"][rows] == 0]
    names = tuple(store.case_names[i] for i in np.unique(design["case"][rows]))
    whole = bool(np.all(store.status()[rows] == Status.OK))
    return whole and paper.covers(names, alpha[rows])


def _kept(design: NDArray[np.void], alpha: Array) -> NDArray[np.intp]:
    """Rows at the paper's misalignments: of each variant one group for each, the first where a grid has more."""
    rows: list[NDArray[np.intp]] = []
    for variant in np.unique(design["variant"]):
        for angle in paper.printed().alpha:
            here = np.flatnonzero((design["variant"] == variant) & (np.abs(alpha - angle) < paper.SAME_ALPHA))
            rows.append(here[design["group"][here] == design["group"][here[:1]]])
    return np.concatenate(rows)


def read(store: ResultFile) -> PaperStudy:
    """Take the study from its file; see `matching`."""
    design, results = store.design, store.results()
    alpha = operating_points(store)["alpha"]
    gamma = relative_errors(results, design["group"])
    base = Joint.model_validate(store.joint)
    rows = _kept(design, alpha)
    own = {v: rows[design["variant"][rows] == v] for v in range(len(store.variants))}
    mains: dict[str, Main] = {}
    for v in _laws(store.variants):
        joint = varied(base, store.variants[v].values)
        whole = bool(np.all(results["status"][own[v]] == Status.OK))
        alike = np.array_equal(design["case"][own[v]], design["case"][own[0]])
        if whole and alike and joint.contact.law not in mains:
            mains[joint.contact.law] = paper_main.read(store, joint, own[v], gamma)
    return PaperStudy(
        store.study_name,
        store.created,
        len(results),
        next(iter(mains.values())).joint,
        base,
        store.case_names,
        store.variants,
        design["variant"][rows],
        design["case"][rows],
        alpha[rows].copy(),
        results[rows],
        gamma[rows],
        mains,
        float(store.options["settle_tol"]),
    )


def _laws(variants: tuple[Variant, ...]) -> list[int]:
    """The first variant and those that differ from it by the contact law alone."""
    first = {key: value for key, value in variants[0].values.items() if key != LAW}
    others = [{key: value for key, value in v.values.items() if key != LAW} for v in variants]
    return [0, *(v for v in range(1, len(variants)) if others[v] == first and LAW in variants[v].values)]
