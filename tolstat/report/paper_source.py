"""What the page of the paper's study needs of a result file, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import paper, paper_choices, paper_spectra, paper_statements, paper_statics
from tolstat.joint import Joint
from tolstat.store import ResultStore
from tolstat.tables import Status, Variant

Array = NDArray[np.float64]
AS_PRINTED = 1e7
"""Contact damping (N s/m) above which a joint is one with c_d as printed."""


@dataclass(frozen=True)
class Main:
    """The joints of the study's first variant with their histories; row i is one of them.

    Attributes
    ----------
    case : ndarray of int, shape (m,)
        Index of the errors in `PaperStudy.cases`.
    alpha : ndarray, shape (m,)
        Misalignment, rad.
    errors, results : ndarray of ERROR and RESULT, shape (m,)
        Rows of the file.
    gamma : ndarray, shape (m, 8, 2)
        Eq. (14), per cent.
    moduli : ndarray, shape (m, samples, 8, 2)
        Force (N) and torque (N m) over the input angle.
    couple : ndarray, shape (m, samples)
        Couple of cross bushings 1 and 2 about the cross's normal, N m.
    contact : ndarray, shape (m, samples, 4, 2)
        Normal force on outer and inner half of pins 1 to 4, N.
    tau : ndarray, shape (m, samples)
        Speed ratio.
    """

    case: NDArray[np.int32]
    alpha: Array
    errors: NDArray[np.void]
    results: NDArray[np.void]
    gamma: Array
    moduli: Array
    couple: Array
    contact: Array
    tau: Array

    @property
    def theta(self) -> Array:
        """Input angle of the samples, rad, shape (samples,)."""
        return np.linspace(0.0, 2.0 * np.pi, self.tau.shape[1], endpoint=False)


@dataclass(frozen=True)
class PaperStudy:
    """A study of the paper's cases.

    Attributes
    ----------
    name, created : str
        Name of the study, time of creation.
    joint : Joint
        The joint of the study.
    cases : tuple of str
        Names of the errors, ``"ideal"`` first.
    variants : tuple of Variant
        The joints.
    variant, case : ndarray of int, shape (n,)
        What each row of the file is.
    alpha : ndarray, shape (n,)
        Misalignment, rad.
    results : ndarray of RESULT, shape (n,)
        All rows.
    gamma : ndarray, shape (n, 8, 2)
        Eq. (14), per cent.
    main : Main
        The first variant.
    settle_tol : float
        Closure error below which a joint is settled.
    """

    name: str
    created: str
    joint: Joint
    cases: tuple[str, ...]
    variants: tuple[Variant, ...]
    variant: NDArray[np.int32]
    case: NDArray[np.int32]
    alpha: Array
    results: NDArray[np.void]
    gamma: Array
    main: Main
    settle_tol: float

    @cached_property
    def matches(self) -> list[paper.Match]:
        """Nearest direction of each printed case, rows counted in `main`."""
        return paper.nearest(self.main.gamma, self.main.case, self.main.alpha, self.cases)

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
        return int(np.flatnonzero((self.main.case == 0) & (np.abs(self.main.alpha - alpha) < paper.SAME_ALPHA))[0])

    def answers(self) -> list[paper_statements.Answer]:
        """Sentences of the paper, tested on the first variant."""
        main = self.main
        evidence = paper_statements.Evidence(
            tuple(self.cases[i] for i in main.case),
            main.alpha,
            main.gamma,
            main.results["contact_max"],
            main.results["psi_max"],
            paper_spectra.amplitudes(main.moduli),
            revolutions(main.results),
            revolutions(self.results[self.as_printed()]),
        )
        return paper_statements.answers(evidence)

    def contradictions(self) -> list[paper_statics.Contradiction]:
        """Test of Table 4 by statics, with the first variant's ideal joint."""
        row = self.ideal(0.0)
        force, torque = (float(self.main.results[name][row, :4].max()) for name in ("F_max", "T_max"))
        resisting = float(self.main.errors["operation.torque"][row])
        return paper_statics.contradictions(paper_statics.Loads(force, torque, resisting, self.joint.cross.r_b))


def revolutions(results: NDArray[np.void]) -> Array:
    """Revolutions until settled, (n,); infinite where a joint did not settle."""
    return np.where(results["status"] == Status.OK, results["revolutions"], np.inf)


def matching(store: ResultStore) -> bool:
    """Whether a file is a complete study of the paper's cases with the histories that the page draws."""
    if not store.case_names or not store.complete or not {"loads", "contact", "tau"} <= set(store.history_specs):
        return False
    first = store.design()["variant"] == 0
    whole = bool(np.all(store.status()[first] == Status.OK))
    return whole and paper.covers(store.case_names, store.errors()["operation.alpha"][first])


def read(store: ResultStore) -> PaperStudy:
    """Take the study from its file; see `matching`."""
    design, errors, results = store.design(), store.errors(), store.results()
    gamma = paper.gamma(results, design["group"])
    alpha = errors["operation.alpha"].copy()
    joint = Joint.model_validate(store.joint)
    rows = np.flatnonzero(design["variant"] == 0)
    loads = store.histories("loads", rows).astype(np.float64)
    main = Main(
        design["case"][rows],
        alpha[rows],
        errors[rows],
        results[rows],
        gamma[rows],
        paper_spectra.moduli(loads),
        (joint.cross.r_b * loads[:, :, :2, 1] + loads[:, :, :2, 5]).sum(axis=2),
        store.histories("contact", rows).astype(np.float64),
        store.histories("tau", rows),
    )
    return PaperStudy(
        store.study_name,
        store.created,
        joint,
        store.case_names,
        store.variants,
        design["variant"],
        design["case"],
        alpha,
        results,
        gamma,
        main,
        float(store.options["settle_tol"]),
    )
