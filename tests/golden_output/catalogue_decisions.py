"""Campaigns of every sampling method, and the questions that lead to decisions."""

from __future__ import annotations

from tests.golden_output.catalogue import Campaign, forms, plain, usual
from tests.golden_output.catalogue_studies import HISTORIES, cheap

CASES = (
    '|[sweep]|[[case]]\\nname = "tilt"\\nerrors.pin1.tilt_z = "0.4 deg"\\n\\n[[variant]]\\nname = "family"\\n'
    'points = 3\\nvary.contact.clearance = { from = "0.05 mm", to = "0.15 mm" }\\nnote = "narrower and wider"\\n\\n'
    '[grid]\\n"operation.alpha" = ["5 deg", "20 deg"]|'
)
"""Edit of a sweep: cases, a family of joints, a grid."""
OFFSETS = '"{}*.offset_[etz]" = {{ iso2768 = "f", nominal = "72.8 mm", distribution = "normal", cpk = 1.0 }}'
FIT = (
    '|"hole*.diameter" = { lower = "0 mm", upper = "0.030 mm", distribution = "normal", cpk = 1.0 }|'
    'fit = { basic = "76 mm", code = "H9/f9", distribution = "normal", cpk = 1.0 }|'
)
"""Edits of a study: without offsets, and with a fit."""

PARTS = Campaign(
    "known_parts",
    ["run known_parts.toml --n 96"],
    usual("known_parts.h5")
    | {
        "more_parts": [
            "sed '|known_from = 30|known_from = 200|' known_parts.toml",
            "run known_parts.toml --n 96",
        ],
        "assumptions": [
            "assumptions known_parts.h5 --run --accept '20 %'",
            *forms("assumptions known_parts.h5 --accept '20 %'"),
            "report known_parts.h5 --accept '20 %'",
        ],
    },
)
LOTS = Campaign(
    "lots",
    [cheap("lots"), "sed '|joints_per_lot = 20|joints_per_lot = 3|' lots.toml", "run lots.toml --n 90"],
    usual("lots.h5")
    | {
        "delivery": plain("capability lots.h5 --delivery 60"),
        "other_seed": ["run lots.toml --n 90 --set sampling.seed=7 --out other.h5", "compare other.h5 lots.h5"],
    },
)
DECIDED = Campaign(
    "decided",
    [cheap("iso2768_f"), f"sed '{HISTORIES}' iso2768_f.toml", "run iso2768_f.toml --n 480"],
    usual("iso2768_f.h5")
    | {
        "page": ["report iso2768_f.h5 --out page.html --accept '10 %' --replay 200"],
        "capability_rare": plain("capability iso2768_f.h5 --one-in 1000 --delivery 50"),
        "causes": [
            *forms("causes iso2768_f.h5 --by cross1.T --top 5"),
            "causes iso2768_f.h5 --logarithm",
        ],
        "fatigue": forms("fatigue iso2768_f.h5"),
    },
)
RARE = Campaign(
    "rare",
    [cheap("rigid_shafts"), "rare rigid_shafts.toml --limit 'cross1.F > 4 kN' --n 60 --p0 0.2 --repeats 2"],
    {
        "rare": forms("rare rigid_shafts.toml --limit 'cross1.F > 4 kN' --n 60 --p0 0.2 --repeats 2"),
        "file": ["rare rigid_shafts_rare.h5", "status rigid_shafts_rare.h5", "report rigid_shafts_rare.h5"],
        "any": ["rare rigid_shafts.toml --limit 'any limit' --n 40 --p0 0.25 --repeats 1 --out any --json"],
    },
)
LISTED = Campaign(
    "cases",
    [
        'sed \'|contact.clearance = { from = "0.03 mm", to = "0.40 mm", points = 38 }||\' clearance.toml',
        "sed '|[errors]||' clearance.toml",
        "sed '|pin1.tilt_z = \"0.5 deg\"||' clearance.toml",
        f"sed '{CASES}' clearance.toml",
        'sed \'|"sweep"|"cases"|\' clearance.toml',
        "run clearance.toml",
    ],
    usual("clearance.h5"),
)
WHAT_IF = Campaign(
    "what_if",
    [
        cheap("iso2768_f"),
        f"sed '|{OFFSETS.format('pin')}||' iso2768_f.toml",
        f"sed '|{OFFSETS.format('hole')}||' iso2768_f.toml",
        f"sed '{FIT}' iso2768_f.toml",
        """sed '|"pin*.diameter" = { lower = "-0.030 mm", upper = "0 mm", distribution = "normal", cpk = 1.0 }||' """
        "iso2768_f.toml",
        """sed '|iso2768 = "f", nominal = "36.4 mm"|plus_minus = "0.25 deg"|' iso2768_f.toml""",
        """sed '|iso2768 = "f", nominal = "22 mm"|plus_minus = "0.05 deg"|' iso2768_f.toml""",
        "sed '|60 N*m|34 N*m|' iso2768_f.toml",
        "run iso2768_f.toml --n 240",
        "causes iso2768_f.h5 --run --budget '20 min'",
    ],
    {
        "causes": forms("causes iso2768_f.h5", "causes iso2768_f.h5 --by cross1.T"),
        "page": ["status iso2768_f.h5", "report iso2768_f.h5 --out page.html"],
        "assumptions": [
            "assumptions iso2768_f.h5",
            "assumptions iso2768_f.h5 --run --accept '50 %'",
            *forms("assumptions iso2768_f.h5 --accept '50 %'"),
            "report iso2768_f.h5 --accept '50 %'",
        ],
        "kept": ["extend iso2768_f.h5 --n 250 --no-report", "causes iso2768_f.h5"],
    },
)
CHANGE = Campaign(
    "change",
    [cheap("iso2768_f"), "run iso2768_f.toml --n 200 --no-report"],
    {
        "change": [
            *forms("change iso2768_f.h5 --set '*.tilt_*.cpk=1.2' --most 200"),
            "change iso2768_f.h5 --set joint.contact.clearance='0.15 mm' --set 'operation.alpha=12 deg' --most 200 "
            "--accept '5 %' --out changed.toml",
            "change iso2768_f.h5 --set 'pin*.offset_e=none' --most 400 --out changed",
            "change iso2768_f.h5 --set sampling.seed=3 --set pin1=2 --set pin*.offset_x.cpk=1",
        ],
        "allocate": [
            *forms("allocate iso2768_f.h5 --target 'P(any limit) < 0.2' --keep 'pin*.*' --keep 'hole*.offset_*'"),
            "allocate iso2768_f.h5 --target 'P(any limit) < 0.2' --keep 'pin*.*' --keep 'hole*.offset_*' --out a.toml",
        ],
    },
)
