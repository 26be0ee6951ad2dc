"""Campaigns of every sampling method, and the questions that lead to decisions."""

from __future__ import annotations

from tests.golden_output.catalogue import Campaign, forms, plain, usual
from tests.golden_output.catalogue_studies import HISTORIES, cheap

PROPOSAL = '|[limits]|[[proposal]]\\nshare = 0.4\\nwiden = 1.3\\nshift = { "pin1.tilt_z" = 1.0 }\\n\\n[limits]|'
CASES = (
    '|[sweep]|[[case]]\\nname = "tilt"\\nerrors.pin1.tilt_z = "0.4 deg"\\n\\n[[variant]]\\nname = "family"\\n'
    'points = 3\\nvary.contact.clearance = { from = "0.05 mm", to = "0.15 mm" }\\nnote = "narrower and wider"\\n\\n'
    '[grid]\\n"operation.alpha" = ["5 deg", "20 deg"]|'
)
"""Edit of a sweep: cases, a family of joints, a grid."""

SOBOL = Campaign(
    "sobol",
    [
        cheap("iso2768_f"),
        "run iso2768_f.toml --n 96 --set sampling.method=sobol --set sampling.replicates=8 --out sobol.h5",
        "run iso2768_f.toml --n 64 --set sampling.method=sobol --out one.h5",
    ],
    usual("sobol.h5")
    | {
        "one": ["report one.h5", "capability one.h5 --json", "extend one.h5 --n 128"],
        "extend": ["extend sobol.h5 --n 192", "extend sobol.h5 --n 100"],
    },
)
LHS = Campaign(
    "lhs",
    [
        cheap("iso2768_f"),
        "run iso2768_f.toml --n 64 --set sampling.method=lhs --set sampling.replicates=8 --out lhs.h5",
    ],
    usual("lhs.h5") | {"extend": ["extend lhs.h5 --n 128"], "compare": ["compare lhs.h5 lhs.h5 --json"]},
)
IMPORTANCE = Campaign(
    "importance",
    [
        cheap("iso2768_f"),
        f"sed '{PROPOSAL}' iso2768_f.toml",
        "run iso2768_f.toml --n 96 --set sampling.method=importance",
    ],
    usual("iso2768_f.h5"),
)
PARTS = Campaign(
    "known_parts",
    ["run known_parts.toml --n 96"],
    usual("known_parts.h5")
    | {
        "more_parts": [
            "sed '|known_from = 30|known_from = 200|' known_parts.toml",
            "run known_parts.toml --n 96",
            "capability known_parts.h5",
        ]
    },
)
LOTS = Campaign(
    "lots",
    [cheap("lots"), "lots lots.toml --lots 30 --joints 3"],
    usual("lots_lots.h5")
    | {
        "lots": [
            *forms("lots lots_lots.h5"),
            "lots lots_lots.h5 --delivery 60 --from-lots 3 --accept '20 %'",
            "lots lots.toml --lots 30 --joints 4",
        ],
        "drawn": [
            "sed '|joints_per_lot = 20|joints_per_lot = 3|' lots.toml",
            "run lots.toml --n 90 --out drawn.h5",
            "status drawn.h5",
            "compare drawn.h5 lots_lots.h5",
        ],
    },
)
FITTED = Campaign(
    "selective",
    [cheap("selective"), "selective selective.toml --classes 1 --classes 3 --n 64"],
    usual("selective_k3.h5")
    | {
        "selective": plain("selective selective.toml --classes 1 --classes 3 --n 64"),
        "one": ["report selective_k1.h5"],
    },
)
SORTING = Campaign(
    "sorting",
    [f"sed '{HISTORIES}' sorting.toml", "run sorting.toml --n 480"],
    usual("sorting.h5")
    | {
        "sorting": forms("sorting sorting.h5"),
        "capability_rare": plain("capability sorting.h5 --one-in 1000 --delivery 50"),
        "causes": [
            *forms("causes sorting.h5 --by cross1.T --top 5"),
            "causes sorting.h5 --logarithm",
            "angles sorting.h5 --by cross1.F --joints 200 --out angles",
            "pairs sorting.h5",
        ],
        "reweight": forms("reweight sorting.h5 --set 'pin*.tilt_[tz].cpk=0.6' --set 'hole*.diameter.cpk=1.2'"),
        "reweight_out": ["reweight sorting.h5 --set 'pin*.tilt_[tz].cpk=0.6' --out changed"],
        "time_above": [
            *forms("time-above sorting.h5"),
            "time-above sorting.h5 --by cross1.T --level '30 N*m' --curves --out above",
        ],
        "fatigue": forms("fatigue sorting.h5"),
    },
)
FROZEN = Campaign(
    "pick_freeze",
    [cheap("iso2768_f"), "causes iso2768_f.toml --points 50 --by cross1.F"],
    {
        "causes": forms("causes iso2768_f_causes.h5 --by cross1.F"),
        "status": ["status iso2768_f_causes.h5", "report iso2768_f_causes.h5", "capability iso2768_f_causes.h5"],
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
        cheap("selective"),
        'sed \'|selective = { classes = 3, gauge = "2 um", split = "width" }||\' selective.toml',
        'sed \'|"hole*.tilt_[tz]" = { plus_minus = "0.25|"hole*.tilt_t" = { plus_minus = "0.05|\' selective.toml',
        "sed '|60 N*m|34 N*m|' selective.toml",
        "run selective.toml --n 240",
        "causes selective.h5 --run --budget '20 min'",
    ],
    {
        "causes": forms("causes selective.h5", "causes selective.h5 --by cross1.T"),
        "page": ["status selective.h5", "report selective.h5 --out page.html"],
        "assumptions": [
            "assumptions selective.h5",
            "assumptions selective.h5 --run --accept '50 %'",
            *forms("assumptions selective.h5 --accept '50 %'"),
            "report selective.h5 --accept '50 %'",
        ],
        "kept": ["extend selective.h5 --n 250 --no-report", "causes selective.h5"],
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
