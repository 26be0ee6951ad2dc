"""Campaigns of the other studies in studies/, and the questions that each of them is for."""

from __future__ import annotations

from tests.golden_output.catalogue import Campaign, forms, usual
from tests.golden_output.transcript import ROUGH

CHEAP = '|[sampling]|[solver]\\nfidelity = "quasistatic"\\nsteps_per_rev = 24\\n\\n[sampling]|'
"""Edit of a study: quasi-static, with few steps."""
HISTORIES = '|[sampling]|[output]\\nhistories = "harmonics+cycles"\\nharmonics = 6\\n\\n[sampling]|'


def cheap(*studies: str) -> str:
    """Edit of studies that makes them cheap."""
    return f"sed '{CHEAP}' " + " ".join(f"{study}.toml" for study in studies)


SWEEP = Campaign(
    "clearance", ["run clearance.toml"], usual("clearance.h5", ROUGH) | {"show": ["show clearance.h5 --row 2"]}
)
BORED = Campaign("line_bored", ["rough: run line_bored.toml --n 48"], usual("line_bored.h5", ROUGH))
OVERNIGHT = Campaign("overnight", ["run overnight.toml --n 64"], usual("overnight.h5"))
RATTLE = Campaign("rattle", ["run rattle.toml --n 12"], usual("rattle.h5"))
FUZZ = Campaign(
    "fuzz",
    [f"sed '{CHEAP}' fuzz.toml", "run fuzz.toml --n 64 --no-verify"],
    usual("fuzz.h5")
    | {
        "retry": [
            "run fuzz.toml --n 64 --retry newton_failed,not_resolved --set solver.steps_per_rev=48",
            "run fuzz.toml --n 64 --retry outside_model --no-report",
            "run fuzz.toml --n 64 --retry nothing",
            "status fuzz.h5 --json",
            "worst fuzz.h5 --by revolutions",
        ],
        "dynamic": [
            "run fuzz.toml --n 64 --retry newton_failed --set solver.fidelity=dynamic --set solver.max_revs=3",
            "report fuzz.h5 --out page.html",
        ],
    },
)
HARD = Campaign(
    "hard_cases",
    [
        "variants hard_cases.toml nominal overdamped 'clearance 0' '10 kN m' '45 deg' "
        "'85 deg, 5 revolutions' '12 steps'",
        'sed \'|, "tilt of 5 deg", "E x 1e-3", "E x 1e3",|,|\' hard_cases.toml',
        "run hard_cases.toml",
    ],
    usual("hard_cases.h5")
    | {
        "retry": [
            "run hard_cases.toml --retry newton_failed --set solver.steps_per_rev=24",
            "status hard_cases.h5 --json",
            "show hard_cases.h5 --row 3",
            "replay hard_cases.h5 --row 3",
            "extend hard_cases.h5 --n 40",
        ]
    },
)
POINTS = Campaign(
    "duty_cycle",
    ["run duty_cycle.toml --n 48"],
    usual("duty_cycle.h5")
    | {
        "fatigue": [*forms("fatigue duty_cycle.h5"), "fatigue duty_cycle.h5 --point start --out equivalent.csv"],
        "bearing_life": forms("bearing-life duty_cycle.h5"),
        "point": [
            "report duty_cycle.h5 --point start --out start.html",
            "report duty_cycle.h5 --point drive+climb",
            "capability duty_cycle.h5 --point drive",
            "worst duty_cycle.h5 --point start --top 3",
            "worst duty_cycle.h5 --by 'cross1.F at drive' --top 3 --json",
            "orders duty_cycle.h5 --point climb --json",
            "export duty_cycle.h5 --csv start.csv --point start",
            "export duty_cycle.h5 --csv all.csv",
            "export duty_cycle.h5 --statistics statistics.json --point climb",
            "replay duty_cycle.h5 --row 5 --point climb",
            "replay duty_cycle.h5 --row 5",
            "report duty_cycle.h5 --point nowhere",
        ],
        "verify": ["verify duty_cycle.h5 --near 'cross1.F at drive > 2 kN' --joints 2", "report duty_cycle.h5"],
    },
)
NEEDLES = Campaign(
    "needle_bearings",
    ["run needle_bearings.toml --n 48"],
    usual("needle_bearings.h5", ROUGH)
    | {
        "bearing_life": [
            *forms(f"{ROUGH}bearing-life needle_bearings.h5"),
            'sed \'|C = "33 kN"|C = "35 kN"|\' needle_bearings.toml',
            "run needle_bearings.toml --n 48 --no-report",
            "bearing-life needle_bearings.h5",
            "sed '|needles = 32|needles = 30|' needle_bearings.toml",
            "run needle_bearings.toml --n 48",
        ]
    },
)
WELDED = Campaign(
    "welded_fork",
    [f"sed '{HISTORIES}' welded_fork.toml", "run welded_fork.toml --n 48"],
    usual("welded_fork.h5")
    | {
        "fatigue": [
            *forms("fatigue welded_fork.h5", "fatigue welded_fork.h5 --by 'cross*.F_t'"),
            "fatigue welded_fork.h5 --joints 20 --out equivalent.csv --delivery 50",
        ],
        "cycles": ["export welded_fork.h5 --pylife cycles.csv", "export welded_fork.h5 --csv joints.csv"],
    },
)
ORDER = Campaign(
    "engine_order",
    ["run engine_order.toml --n 24"],
    {"page": ["report engine_order.h5 --out page.html --accept '30 %' --replay 20"]},
)
TRUCK = Campaign(
    "shaft",
    ["run shaft.toml --n 24"],
    {
        "report": ["report shaft.h5 --wide --accept '30 %'"],
        "page": ["report shaft.h5 --out page.html --accept '30 %' --replay 20"],
        "worst": ["worst shaft.h5 --top 3"],
        "bearing_life": ["bearing-life shaft.h5"],
    },
)
UNLIKE = Campaign(
    "unlike_joints",
    ["run unlike_joints.toml --n 24"],
    {
        "show": ["show unlike_joints.toml"],
        "page": ["report unlike_joints.h5 --out page.html --accept '60 %'"],
        "change": ["change unlike_joints.h5 --set shaft.joint2.base=cirelli2021"],
    },
)
RINGS = Campaign(
    "snap_rings",
    ["run snap_rings.toml --n 24"],
    {
        "report": ["report snap_rings.h5 --wide --accept '30 %'"],
        "page": ["report snap_rings.h5 --out page.html --accept '30 %'"],
        "orders": [f"{ROUGH}orders snap_rings.h5"],
        "export": [f"{ROUGH}export snap_rings.h5 --csv - --nominal"],
    },
)
FLAP = Campaign(
    "hinge_line",
    ["run hinge_line.toml --n 24"],
    {
        "show": ["show hinge_line.toml"],
        "row": ["show hinge_line.h5 --row 3 --out row3.svg"],
        "page": ["report hinge_line.h5 --out page.html --accept '30 %'"],
    },
)
FOURBAR = Campaign(
    "four_bar",
    ["run four_bar.toml --n 24"],
    {
        "show": ["show four_bar.toml"],
        "page": [f"{ROUGH}report four_bar.h5 --out page.html --accept '30 %' --replay 20"],
        "worst": ["worst four_bar.h5 --top 3"],
    },
)
CRANKS = Campaign(
    "parallel_cranks",
    ["run parallel_cranks.toml --n 24"],
    {
        "plan": ["plan parallel_cranks.toml --pilot 4"],
        "report": [f"{ROUGH}report parallel_cranks.h5 --wide --accept '30 %'"],
        "orders": [f"{ROUGH}orders parallel_cranks.h5"],
    },
)
