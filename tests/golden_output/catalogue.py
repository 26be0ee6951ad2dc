"""Campaigns, the commands that make them, and the commands about them; each set of commands has one golden file."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import pytest

MADE = "run"
"""Name of the golden file with what making a campaign said."""
FORMS = ("", " --wide", " --json")
COMMANDS = (
    *("new", "show", "simulate", "plan"),
    *("run", "extend", "merge", "status", "verify", "replay", "evaluate", "report"),
    *(
        "assumptions",
        "capability",
        "worst",
        "causes",
        "fatigue",
        "bearing-life",
        "orders",
    ),
    *("change", "allocate", "compare", "rare", "export", "docs", "cache"),
)


@dataclass(frozen=True)
class Campaign:
    """A folder with the studies and the files that `make` leaves there.

    Commands in `asked` run in copies of it; the keys are names of golden files.
    """

    name: str
    make: list[str]
    asked: dict[str, list[str]] = field(default_factory=dict)


def cases(*campaigns: Campaign) -> list[Any]:
    """Parameters of a test for each golden file of these campaigns, that of making the campaign first."""
    names = [(campaign, name) for campaign in campaigns for name in (MADE, *campaign.asked)]
    return [pytest.param(campaign, name, id=f"{campaign.name}-{name}") for campaign, name in names]


def forms(*commands: str) -> list[str]:
    """Each command as text, with all columns, and as JSON."""
    return [command + form for command in commands for form in FORMS]


def plain(*commands: str) -> list[str]:
    """Each command as text and as JSON: of those that always show all columns."""
    return [command + form for command in commands for form in ("", " --json")]


def usual(file: str, kind: str = "") -> dict[str, list[str]]:
    """Commands that are asked of every campaign; `kind` stands before those that show loads or numerical errors."""
    return {
        "status": plain(f"status {file}"),
        "report": [f"{kind}report {file} --wide --accept '5 %' --out wide"],
        "page": [f"{kind}report {file} --out page.html --accept '10 %' --replay 20"],
        "capability": forms(f"{kind}capability {file}"),
        "worst": forms(f"{kind}worst {file} --top 4"),
        "orders": forms(f"{kind}orders {file}"),
        "export": [f"{kind}export {file} --csv - --nominal", f"{kind}export {file} --statistics statistics.json"],
    }


MAIN = Campaign(
    "iso2768_f",
    ["process: run iso2768_f.toml --n 64 --workers 2", "run rigid_shafts.toml --n 64"],
    usual("iso2768_f.h5")
    | {
        "pictures": ["orders iso2768_f.h5 --orbits --out orders", "report iso2768_f.h5 --out report --accept '50 %'"],
        "again": ["run iso2768_f.toml --n 64 --out iso2768_f.h5", "process: run iso2768_f.toml --n 64"],
        "capability_rare": plain("capability iso2768_f.h5 --one-in 100 --delivery 50"),
        "compare": [*forms("compare iso2768_f.h5 rigid_shafts.h5"), "compare iso2768_f.h5 rigid_shafts.h5 --by psi"],
        "worst_by": ["worst iso2768_f.h5 --by psi --top 3", "worst iso2768_f.h5 --by revolutions --top 3"],
        "show": ["show iso2768_f.h5 --row 3", "show iso2768_f.h5 --out joint.png", "show iso2768_f.h5 --errors"],
        "replay": ["replay iso2768_f.h5 --row 17 --out trace.csv", "replay iso2768_f.h5 --row 0 --json"],
        "verify": [
            "rough: verify iso2768_f.h5 --joints 1 --out errors.csv",
            "status iso2768_f.h5",
            "rough: report iso2768_f.h5",
        ],
        "verify_near": [
            "verify iso2768_f.h5 --near 'any limit' --joints 4",
            *plain("verify iso2768_f.h5 --near 'cross1.F > 700 N' --joints 3"),
            "report iso2768_f.h5 --wide",
            "capability iso2768_f.h5 --json",
        ],
        "limits": [
            'sed \'|"60 N*m"|"40 N*m"|\' iso2768_f.toml',
            "run iso2768_f.toml --n 64",
            'sed \'|[limits]|[limits]\\npsi = 0.0001\\n"input.lateral" = "20 N"|\' iso2768_f.toml',
            "run iso2768_f.toml --n 64 --no-report",
            *plain("status iso2768_f.h5"),
            "capability iso2768_f.h5",
        ],
        "extend": [
            "extend iso2768_f.h5 --n 80",
            "status iso2768_f.h5",
            "export iso2768_f.h5 --csv -",
            "extend iso2768_f.h5 --n 70",
        ],
        "exports": [
            "export iso2768_f.h5 --csv joints.csv --statistics - --accept '10 %'",
            "export iso2768_f.h5 --pylife cycles.csv",
            "export iso2768_f.h5",
        ],
        "refused": [
            "causes iso2768_f.h5",
            "causes iso2768_f.h5 --by cross1.X",
            "fatigue iso2768_f.h5",
            "bearing-life iso2768_f.h5",
            "change iso2768_f.h5 --set sampling.seed=3 --set pin1.offset_x.cpk=1",
            "allocate iso2768_f.h5 --target 'P(cross1.X > 1 N) < 0.1'",
            "replay iso2768_f.h5 --row 900",
            "report iso2768_f.h5 --point cruise",
            "report iso2768_f.h5 --accept '300 %'",
            "run iso2768_f.toml --n 65",
            "run rigid_shafts.toml --n 64 --out iso2768_f.h5",
            "run iso2768_f.toml --n 64 --retry newton_failed",
            "run iso2768_f.toml --n 64 --rows 0:10",
            "merge iso2768_f.h5 --out whole.h5",
            "status missing.h5",
            "status iso2768_f.toml",
        ],
    },
)

PENDING = Campaign(
    "pending",
    ["run iso2768_f.toml --n 96 --until 'P(any limit) width < 0.4'"],
    usual("iso2768_f.h5")
    | {
        "resumed": ["run iso2768_f.toml --n 96", "status iso2768_f.h5", "export iso2768_f.h5 --csv -"],
        "refused": [
            "extend iso2768_f.h5 --n 100",
            "run iso2768_f.toml --n 96 --until 'P(any limit) width < 0.4'",
            "run iso2768_f.toml --n 96 --until 'P(any limit) wide'",
            "replay iso2768_f.h5 --row 95",
        ],
    },
)

SLICED = Campaign(
    "sliced",
    [
        "run iso2768_f.toml --n 64 --rows 0:20 --out part1.h5",
        "run iso2768_f.toml --n 64 --rows 20:50 --out part2.h5 --no-report",
        "run iso2768_f.toml --n 64 --rows 45:65 --out part3.h5 --no-verify",
        "merge part3.h5 part1.h5 part2.h5 --out iso2768_f.h5",
    ],
    usual("iso2768_f.h5")
    | {f"slice_{name}": commands for name, commands in usual("part2.h5").items()}
    | {
        "slices": [
            "merge part1.h5 part3.h5 --out gap.h5",
            "merge part1.h5 part1.h5 --out twice.h5",
            "compare part1.h5 part2.h5",
            "compare iso2768_f.h5 part2.h5",
            "replay part2.h5 --row 30",
            "replay part2.h5 --row 3",
            "extend part2.h5 --n 80",
            "run iso2768_f.toml --n 64 --rows 0:20 --out part2.h5",
            "run iso2768_f.toml --n 64 --rows 7:7 --out none.h5",
            "run iso2768_f.toml --n 64 --rows 30:50 --out part4.h5 --until 'P(any limit) width < 0.9'",
            "status part4.h5 --json",
        ],
    },
)

HELP = Campaign(
    "commands",
    ["process: --version"],
    {
        "help": ["process: --help", "--help", "", "nothing", *(f"{word} --help" for word in COMMANDS)],
        "simulate": [
            "simulate tilted_pin.toml",
            "simulate tilted_pin.toml --out loads.csv",
            "simulate tilted_pin.toml --json",
            "simulate iso2768_f.toml",
        ],
        "new": ["new first", "new gear --joint own", "new first", "run first.toml --n 4", "simulate first.toml"],
        "new_shaft": [
            "new truck --shaft --size '30.2 x 92'",
            "new plain --shaft",
            "new other --shaft --size '30 x 92'",
            "new other --shaft --joint own",
            "new other --size '30.2 x 92'",
        ],
        "new_linkage": [
            "new flap --kind hinge",
            "show flap.toml",
            "new other --kind slider",
            "new other --kind hinge --shaft",
        ],
        "spectrum": [
            "new cycle --signal drive_cycle.csv",
            "new other --signal drive_cycle.csv --base iso2768_f.toml --exponent 5",
            "new none --signal overnight.csv",
            "new cycle --signal drive_cycle.csv --joint own",
            "new none --exponent 5",
        ],
        "schema": ["docs study.schema.json", "docs joint.schema.json", "docs case.schema.json"],
        "show": ["show cirelli2021", "show tilted_pin.toml --columns 1", "show duty_cycle.toml --errors"],
        "plan": [
            "plan iso2768_f.toml --pilot 4",
            "plan iso2768_f.toml --n 100 --pilot 4",
            "plan overnight.toml --pilot 4",
            "plan duty_cycle.toml --pilot 4",
            "plan line_bored.toml --pilot 4",
            "plan lots.toml --pilot 4",
            "plan clearance.toml --pilot 4",
        ],
        "docs": ["docs causes", "docs nothing"],
        "evaluate": [
            *(
                f'sed \'|"{old}"|"{new}"|\' iso2768_f.toml'
                for old, new in {
                    "pin*.offset_[etz]": "pin1.offset_t",
                    "hole*.offset_[etz]": "hole1.offset_t",
                    "pin*.tilt_[tz]": "pin1.tilt_t",
                    "hole*.tilt_[tz]": "hole1.tilt_t",
                    "pin*.diameter": "pin1.diameter",
                    "hole*.diameter": "hole1.diameter",
                }.items()
            ),
            "sed '|speed_rpm,torque_Nm|pin1.tilt_t,hole1.tilt_t,pin1.offset_t,hole1.offset_t,part|' rattle.csv",
            "evaluate iso2768_f.toml --in rattle.csv --out -",
            "sed '|,part|,pin1.diameter,hole1.diameter\\ndeg,deg,mm,mm,um,um|' rattle.csv",
            "sed '|-250,-90|0,0,0,0,0,0|' rattle.csv",
            "sed '|0,-70|0.4,-0.4,0.05,0.05,-10,10|' rattle.csv",
            "sed '|500,0|0,0,0,0,900,0|' rattle.csv",
            "sed '|1500,200|0,0,0.1,0,x|' rattle.csv",
            "evaluate iso2768_f.toml --in rattle.csv --out y.csv",
            "sed '|0.1,0,x|0.1,0,1,1|' rattle.csv",
            "sed '|2500,900|0,0,0,0.1,0,0|' rattle.csv",
            "evaluate iso2768_f.toml --in rattle.csv --out y.csv --load 'cross*.F' --load psi",
            "evaluate iso2768_f.toml --in rattle.csv --out - --load cross1.G",
        ],
        "wrong": [
            "sed '|15 deg|15 rpm|' iso2768_f.toml",
            "sed '|cpk = 1.0|cpk = -1.0|' iso2768_f.toml",
            "run iso2768_f.toml",
            "plan iso2768_f.toml",
            "run rigid_shafts.toml --set joint.shaft.axial=loose --out other.h5",
            "run rigid_shafts.toml --set nothing=1 --out other.h5",
            "run rigid_shafts.toml --n 0",
            "run missing.toml",
        ],
        "verify_study": ["rough: verify line_bored.toml --joints 1 --json"],
    },
)
