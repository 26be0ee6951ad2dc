"""Share of the joints above the limits with other values of what is assumed of the joint, from the same joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tolstat.analysis.sample import total_interval
from tolstat.campaign import what_if as sets
from tolstat.common.errors import InputError, TolstatError
from tolstat.common.loads import FloatArray
from tolstat.display.table import Row, Rows
from tolstat.display.verdict import side_of
from tolstat.questions.shares import ChangedJoints, Estimate, check_sample, own_joints, unusable, with_ends
from tolstat.store import error_budget
from tolstat.store import what_if as kept
from tolstat.store.view import View
from tolstat.study.assumptions import OF_JOINT2, Assumption, assumptions, given, is_drawn, together, with_value
from tolstat.study.study import Study
from tolstat.study.widths import lines

JOINTS = 1000
"""Default number of joints of each variation: the first of the campaign, or all if it has fewer."""
LEAST = 100
"""Number of joints from which on a variation is shown; a smaller campaign needs all of its joints."""
ALL = "all assumptions"
"""Name of the variations of all assumptions together."""
BETTER, WORSE = "all at better values", "all at worse values"
"""What the variations of all assumptions together are called."""

AXIAL, LAW = "shaft.axial", "contact.law"
SHAFT = {"free": ("shaft slides", "if the shaft slides"), "rigid": ("shaft rigid", "if the shaft is held rigidly")}
"""Mounting of the shafts: as a label, and as a condition."""
_LONGEST = 12
"""Number of letters of a name up to which a label has it beside the key."""


class Variation(NamedTuple):
    """Other values of what is assumed.

    Attributes
    ----------
    name : str
        Name of the assumption, or `ALL`.
    label : str
        The values in words.
    keys : mapping
        Dotted keys of the joint, or of what measured parts leave open, and their values as written.
    because : str
        Why the value is not known; of all assumptions together, what the variation consists of.
    """

    name: str
    label: str
    keys: Mapping[str, Any]
    because: str


@dataclass(frozen=True)
class Standing:
    """Shares of the joints above the limits as drawn, and with other values of what is assumed.

    Attributes
    ----------
    n : int
        Smallest number of joints that a variation and the joints as drawn are compared on.
    confidence : float
        Of the intervals of `rows`: 1 - 0.05 / number of intervals. These are the variations, counted twice where some
        have more joints than others, as joints may have been added for what the first ones left open.
    accepted : float
        Accepted share; NaN if none is given.
    drawn : tuple of float
        Share of the joints as drawn, and its total interval of 95 %.
    side : str
        ``yes``, ``no`` or ``open``: where that interval lies of the accepted share; empty without one.
    rows : sequence of mapping
        One row per variation, by the size of its effect: ``name``, ``label``, ``keys`` (text), ``because``, ``n``,
        ``n_failed``, ``drawn`` (share of the same joints as drawn), ``share`` and ``change`` (from ``drawn``) with
        ``_lower`` and ``_upper``, which
        cover sampling and joints without a valid load; ``moves``, whether the interval of the change excludes zero;
        ``side``, as above, of the variation; ``turns``, whether it turns the verdict: it moves the share, and its
        interval lies on the other side of the accepted share.
    names : tuple of str
        Names of the assumptions of `rows`, in the order of the joint file and the study.
    missing : tuple of str
        Names of assumptions without joints in the file.
    fixed : tuple of Assumption
        Assumptions that are not varied.
    given : tuple of str
        Names of assumptions of the joint file that the study gives.
    without_other : tuple of str
        Names of assumptions of which only the values as drawn are listed.
    idle : tuple of str
        Labels of the variations on which the axial forces of the study have no effect.
    """

    n: int
    confidence: float
    accepted: float
    drawn: Estimate
    side: str
    rows: Rows
    names: tuple[str, ...]
    missing: tuple[str, ...]
    fixed: tuple[Assumption, ...]
    given: tuple[str, ...] = ()
    without_other: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()

    @property
    def turning(self) -> list[Row]:
        """Variations of one assumption that turn the verdict, in the order of the file; else those of all together."""
        rows = [row for row in self.rows if row["turns"]]
        alone = [row for row in rows if row["name"] != ALL]
        return sorted(alone, key=lambda row: self.names.index(row["name"])) or rows

    @property
    def undecided(self) -> list[Row]:
        """Variations whose share lies on the other side of the accepted share, which their joints do not decide."""
        other = {"yes": 1.0, "no": -1.0}.get(self.side, np.nan)
        return [row for row in self.moving if row["side"] == "open" and other * (row["share"] - self.accepted) > 0.0]

    @property
    def moving(self) -> list[Row]:
        """Variations that move the share."""
        return [row for row in self.rows if row["moves"]]

    @property
    def still(self) -> list[str]:
        """Names of varied assumptions none of whose values moves the share."""
        moving = {row["name"] for row in self.moving}
        return list(dict.fromkeys(row["name"] for row in self.rows if row["name"] not in moving | {ALL}))


def evaluate(view: View, accepted: float = np.nan) -> Standing:
    """Evaluate the joints with other values of what is assumed that a file holds.

    Parameters
    ----------
    view : View
        A campaign of a study with limits whose joints are drawn from tolerances.
    accepted : float
        Accepted share; NaN if none is given.

    Returns
    -------
    Standing
        Without rows where the file holds no such joints (`answer.simulate` adds them).

    Raises
    ------
    InputError
        When the study can no longer be read.
    StoreError
        As `check`.
    """
    return view.kept(("assumptions", str(accepted)), lambda: _evaluate(view, accepted))


def _evaluate(view: View, accepted: float) -> Standing:
    check(view)
    study, joints = view.study, _Joints(view)
    simulated = joints.simulated(singles(study))
    in_file = [variation.keys for variation, _ in simulated]
    missing = tuple(dict.fromkeys(each.name for each in singles(study) if each.keys not in in_file))
    if not missing:
        combined = all_together(view)
        together_in_file = joints.simulated(combined)
        simulated += together_in_file
        missing = (ALL,) if len(together_in_file) < len(combined) else ()
    looks = 2 if len({len(loads) for _, loads in simulated}) > 1 else 1
    confidence = 1.0 - 0.05 / max(looks * len(simulated), 1)
    load = joints.load
    interval = total_interval(error_budget.with_error(view, load), joints.level, 0.95)
    drawn, side = (load.above(joints.level).estimate, *interval), side_of(interval, accepted)
    rows = [_row(variation, joints, loads, confidence) for variation, loads in simulated]
    for row in rows:
        row["side"] = side_of((row["share_lower"], row["share_upper"]), accepted)
        row["turns"] = row["moves"] and {row["side"], side} == {"yes", "no"}
    names = tuple(dict.fromkeys(variation.name for variation, _ in simulated))
    rows.sort(key=lambda row: -abs(np.nan_to_num(row["change"])))
    fixed = tuple(assumption for assumption in assumptions(study) if not assumption.varied)
    others = {variation.name for variation in singles(study)}
    drawn_only = tuple(each.name for each in assumptions(study) if each.varied and each.name not in others)
    idle = tuple(variation.label for variation, _ in simulated if with_value(study, variation.keys).idle_forces)
    n = min((len(loads) for _, loads in simulated), default=0)
    return Standing(n, confidence, accepted, drawn, side, rows, names, missing, fixed, given(study), drawn_only, idle)


def applicable(view: View, accepted: float = np.nan) -> Standing | None:
    """Evaluate as `evaluate`; None where the question does not apply, or the study can no longer be read."""
    with suppress(TolstatError):
        return evaluate(view, accepted)
    return None


def check(view: View) -> None:
    """Refuse a file whose joints are no sample of one joint's production, or have no limits to be judged by.

    Raises
    ------
    StoreError
        The hint names what can be used.
    """
    if view.store.variants or view.method in ("sweep", "cases"):
        remedy = "give the file of a study with tolerances and one joint"
        raise unusable(view, "holds several joints: a share stands on the values of one", remedy)
    check_sample(view)
    if not view.limits:
        remedy = "write [limits] and run the study again, which simulates nothing anew"
        raise unusable(view, "has no limits: nothing stands on what is assumed", remedy)


def joints_of(view: View) -> int:
    """Number of joints of each variation unless more are asked for."""
    return min(JOINTS, own_joints(view) or view.n)


def all_together(view: View) -> list[Variation]:
    """Variations of all assumptions at their better, and at their worse values, of a file that holds those of each.

    There is none where fewer than two assumptions have a better, or a worse, value than as drawn, or values exclude
    each other.
    """
    study, joints, variations = view.study, _Joints(view), list[Variation]()
    for label, sign in ((BETTER, 1.0), (WORSE, -1.0)):
        best: dict[str, tuple[float, Variation]] = {}
        for variation, loads in joints.simulated(singles(study)):
            effect = sign * (_share(loads, joints.level) - _share(joints.base[: len(loads)], joints.level))
            if effect < best.get(variation.name, (0.0, variation))[0]:
                best[variation.name] = effect, variation
        chosen = [variation for _, variation in best.values()]
        if len(chosen) > 1:
            with suppress(InputError):
                keys = together(study, [variation.keys for variation in chosen])
                because = ", ".join(variation.label for variation in chosen)
                variations.append(Variation(ALL, label, keys, because))
    return variations


def singles(study: Study) -> list[Variation]:
    """Variations of one assumption each: every value of those that are varied, except the values as drawn."""
    return [
        Variation(assumption.name, label_of(assumption.name, keys), keys, assumption.because)
        for assumption in assumptions(study)
        if assumption.varied
        for keys in assumption.values
        if not is_drawn(study, keys)
    ]


def widths(view: View) -> dict[str, list[tuple[str, float, str]]]:
    """Share above the limits with another width of a tolerance, by step: entry, share, and the step in words.

    Of fewer joints than are known as drawn, it is the share of all as drawn plus the change, as `causes` gives it.
    """
    shares: dict[str, list[tuple[str, float, str]]] = {}
    entries = {line.label for line in lines(view.study)}
    joints = _Joints(view)
    for about, loads in joints.changes(sets.WIDTH):
        if about["label"] in entries:
            base = joints.base[: len(loads)]
            change = _share(loads[: len(base)], joints.level) - _share(base, joints.level)
            share = _share(joints.base, joints.level) + change
            shares.setdefault(about["step"], []).append((about["label"], max(share, 0.0), about["words"]))
    return shares


class _Joints(ChangedJoints):
    """Loads of the joints that are compared: as drawn, and with other values."""

    def __init__(self, view: View) -> None:
        super().__init__(view, view.decisive, view.altered)
        self._least = max(min(LEAST, joints_of(view)), 1)
        self._loads = {kept.key(about): loads[: len(self.base)] for about, loads in self.changes(sets.JOINT)}

    def simulated(self, variations: Sequence[Variation]) -> list[tuple[Variation, FloatArray]]:
        """Variations that the file has enough joints of, with the load of each joint, NaN without a valid one, (n,)."""
        each = [(one, self._loads.get(kept.key(sets.about_joint(self._study, one.keys)))) for one in variations]
        return [(one, loads) for one, loads in each if loads is not None and len(loads) >= self._least]


def _row(variation: Variation, joints: _Joints, loads: FloatArray, confidence: float) -> dict[str, Any]:
    row: dict[str, Any] = variation._asdict() | {"keys": written(variation.keys)}
    row |= {"n": len(loads), "n_failed": int(np.isnan(loads).sum())}
    row |= {"drawn": _share(joints.base[: len(loads)], joints.level)}
    share, change = joints.share(loads, confidence), (np.nan,) * 3
    with suppress(ValueError):  # no joint has a load both as drawn and with the other values
        change = joints.difference(joints.base, loads, confidence)
    row |= with_ends("share", share) | with_ends("change", change)
    return row | {"moves": bool(change[1] > 0.0 or change[2] < 0.0)}


def _share(loads: FloatArray, level: float) -> float:
    """Share of the joints with a valid load that are above a level; zero where there is none."""
    valid = loads[~np.isnan(loads)]
    return float(np.mean(valid > level)) if valid.size else 0.0


def label_of(name: str, values: Mapping[str, Any]) -> str:
    """Label of a value of an assumption: ``shaft slides``, ``law sliced``, ``clearance 0.05 mm``, ``fork (l_f 30 mm)``.

    Where the name is long it is the key alone, ``r_b 30 mm``; of joint 2 ``joint 2: law sliced``. Of measured parts
    ``spread of pin*.tilt_t × 1.28``, and ``mean of pin*.tilt_t +0.31 σ``.

    Parameters
    ----------
    name : str
        Name of the assumption.
    values : mapping
        Dotted keys of the joint, and their values as written; the first is the one that the assumption is about.
    """
    if all(key.startswith(OF_JOINT2) for key in values):
        own = {key.removeprefix(OF_JOINT2): value for key, value in values.items()}
        return f"joint 2: {label_of(name.removesuffix(' of joint 2'), own)}"
    if AXIAL in values:
        return SHAFT.get(values[AXIAL], (f"shaft held with {_written(values[AXIAL])}", ""))[0]
    if LAW in values:
        return f"law {values[LAW]}"
    key, value = next(iter(values.items()))
    if key == "{2}.{0}".format(*name.partition(" of ")):  # of measured parts
        return f"{name} × {value:.3g}" if name.startswith("spread") else f"{name} {value:+.2g} σ".replace(" -", " −")
    last = key.rpartition(".")[2]
    if last in name.split():
        return f"{name} {_written(value)}"
    symbol = f"{last} {_written(value)}"
    return symbol if len(name) > _LONGEST else f"{name} ({symbol})"


def written(keys: Mapping[str, Any]) -> str:
    """Keys and values as a joint file has them: ``contact.law = sliced``."""
    return ", ".join(f"{key} = {_written(value)}" for key, value in keys.items())


def _written(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text.replace("*", " ").replace("^2", "²").replace("^3", "³")
