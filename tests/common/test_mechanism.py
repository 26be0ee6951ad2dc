"""Mechanisms as data: the Cardan joint is the one that docs/model.md describes; numbers follow from names."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.support.graphs import cardan, free_tube
from tests.support.mechanisms import body, triads, unknown
from tests.support.of_cardan import PARAM
from tolstat.common import files
from tolstat.common.cardan import CARDAN, SHAFT, SPLINED
from tolstat.common.mechanism import Mechanism, numbering
from tolstat.common.tables import blank_params

FRAMES = {"C": "cross", "I": "input", "F": "output"}
DIRECTIONS = {"+R x": (1, 0, 0), "−R x": (-1, 0, 0), "+R y": (0, 1, 0), "−R y": (0, -1, 0), "centre O": None}


def parts() -> list[tuple[str, ...]]:
    """Rows of the table "Parts" of the model, one for each part: name, frame, reference point, what it mates with."""
    text = (files.docs_dir() / "model.md").read_text(encoding="utf-8")
    table = text[text.index("## Parts") : text.index("## Frames")]
    rows = []
    for line in table.splitlines():
        if line.startswith("|") and not line.startswith(("| lump", "|--")):
            names, frame, points, mates = (cell.strip() for cell in line.strip("|").split("|"))
            each = names.replace(" ", "").replace("arm", "hole").split(",")
            cells = (cell.split(", ") if cell else [""] * len(each) for cell in (points, mates))
            rows += [(name, frame[0], *own) for name, *own in zip(each, *cells, strict=True)]
    return rows


def test_parts_are_those_of_the_model() -> None:
    rows = parts()
    assert [name for name, *_ in rows] == [*(lump.name for lump in CARDAN.lumps), "outputshaft"]
    pair_of = {name: pair for pair in CARDAN.pairs for name in (pair.pin, pair.hole)}
    for (name, frame, point, mate), lump, triad in zip(rows, CARDAN.lumps, triads(), strict=False):
        assert lump.member == FRAMES[frame], name
        if DIRECTIONS[point] is None:
            assert (lump.quarters, mate) == (0, "")
            continue
        np.testing.assert_array_equal(triad[0], DIRECTIONS[point])
        number = re.findall(r"\d", mate)[0]
        other = f"hole{number}" if name.startswith("pin") else f"pin{number}"
        assert {pair_of[name].pin, pair_of[name].hole} == {name, other}
    (output,) = (shaft for shaft in CARDAN.shafts if shaft.turns)
    assert (output.name, output.member, CARDAN.unknowns) == ("output", "output", ("psi", "s"))


def test_unknowns_of_the_joint() -> None:
    """Nine lumps with six each, then rotation and displacement of the output shaft."""
    assert (CARDAN.dof, unknown("psi"), unknown("s")) == (56, 54, 55)
    assert CARDAN.rotations == ("psi",)


def test_bushings_carry_pins_on_the_hub_and_arms_on_their_shaft() -> None:
    for bushing in CARDAN.bushings:
        kind, number = re.fullmatch(r"(cross|fork)(\d)", bushing.name).groups()
        assert bushing.lump == ("pin" if kind == "cross" else "hole") + number
        base = "hub" if kind == "cross" else "input" if number in "12" else "output"
        assert bushing.base == base
        member = {part.name: part.member for part in (*CARDAN.lumps, *CARDAN.shafts)}
        assert member[bushing.lump] == member[base]


@pytest.fixture(params=[CARDAN, SHAFT, SPLINED], ids=["cardan", "shaft", "splined shaft"])
def mechanism(request: pytest.FixtureRequest) -> Mechanism:
    return request.param


def test_numbers_name_the_parts(mechanism: Mechanism) -> None:
    numbers, bodies = numbering(mechanism), mechanism.bodies
    members = [one.name for one in mechanism.members]
    placed = (*mechanism.lumps, *mechanism.shafts)
    assert [members[i] for i in numbers["frame"]] == [one.member for one in placed]
    for i, lump in enumerate(mechanism.lumps):
        assert mechanism.lump_kinds[numbers["lump_kind"][i]] == lump.kind
        assert numbers["quarters"][i] == lump.quarters
        touching = [one.kind for one in mechanism.bushings if lump.name in (one.lump, one.base)]
        assert mechanism.bushing_kinds[numbers["held_by"][i]] in touching
    for i, bushing in enumerate(mechanism.bushings):
        assert bodies[numbers["bushing_lump"][i]] == bushing.lump
        assert bodies[numbers["bushing_base"][i]] == bushing.base
        assert mechanism.bushing_kinds[numbers["bushing_kind"][i]] == bushing.kind
    for i, pair in enumerate(mechanism.pairs):
        assert (bodies[numbers["pin"][i]], bodies[numbers["hole"][i]]) == (pair.pin, pair.hole)
        hinge = mechanism.hinges[numbers["hinge"][i]]
        assert hinge.name == pair.hinge
        member = {one.name: one.member for one in mechanism.lumps}
        assert (member[pair.pin], member[pair.hole]) == (hinge.pin, hinge.hole)
    for i, shaft in enumerate(mechanism.shafts):
        for number, name in ((numbers["turn"][i], shaft.turns), (numbers["slide"][i], shaft.slides)):
            assert (mechanism.unknowns[number] if number >= 0 else "") == name
    assert [members[i] for i in numbers["cardan"]] == list(mechanism.cardan)


def test_parameters_hold_the_numbers(mechanism: Mechanism) -> None:
    row = blank_params(2, mechanism)[1]
    for name, values in numbering(mechanism).items():
        np.testing.assert_array_equal(row[name], values)
    assert (row.dtype == PARAM) == (mechanism == CARDAN)


def test_a_bushing_between_lumps_has_a_block_of_its_own(mechanism: Mechanism) -> None:
    numbers, lumps = numbering(mechanism), len(mechanism.lumps)
    of_pairs = list(range(lumps, lumps + len(mechanism.pairs)))
    own = [b for b in numbers["bushing_block"].tolist() if b >= 0]
    assert own == list(range(of_pairs[-1] + 1, numbers["first_filled"]))
    joins = [mechanism.bodies.index(one.base) < lumps for one in mechanism.bushings]
    assert (numbers["bushing_block"] >= 0).tolist() == joins


def test_arms_of_both_joints_hold_the_tube() -> None:
    """Psi is that of the output; tubes are lumps that the arms of the forks on them are joined to, and one another."""
    numbers, bodies = numbering(SPLINED), SPLINED.bodies
    assert numbers["turn"].tolist() == [-1, 0]
    held = {(one.lump, one.base) for one in SPLINED.bushings if one.base.startswith("tube")}
    assert held == {
        *(("joint1.hole3", "tube1"), ("joint1.hole4", "tube1"), ("joint2.hole1", "tube2"), ("joint2.hole2", "tube2")),
        ("tube2", "tube1"),
    }
    assert [SPLINED.bushings[i].name for i in numbers["pushed"]] == ["spline"]
    assert numbers["pushed"].size == 1
    assert numbering(SHAFT)["pushed"].size == 0
    assert {SHAFT.lumps[i].member for i in range(18) if bodies[i] in ("joint2.hole1", "joint2.hole2")} == {
        "joint1.output"
    }


def test_the_plan_is_that_of_the_graph() -> None:
    """Of the joint as `support.graphs` writes it: the same lumps, joined to the same ones."""
    plan, numbers = cardan().plan(), numbering(CARDAN)
    for name, values in plan.items():
        np.testing.assert_array_equal(numbers[name], values, err_msg=name)
    assert free_tube().lumps == len(SHAFT.lumps)
    assert body("hub") == 0
