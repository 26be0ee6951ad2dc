"""Campaigns with invented results: loads of a plausible size without running the solver."""

import numpy as np

from tests.support.of_cardan import ERROR, LOAD_KINDS, RESULT
from tolstat.common.load_kinds import JOINT
from tolstat.common.tables import Status
from tolstat.solver import stationary

BASE = {
    "F": [640, 640, 655, 655, 655, 655, 640, 640],
    "T": [12, 12, 22, 22, 24, 24, 15, 15],
    "contact": 600.0,
    "psi": 1e-4,
}
"""Loads of the nominal joint; 100 of other kinds."""
RISE = {"T": 2.5, "contact": np.array([1.0, 0.5, 1.0])}
"""Factors on the relative rise of loads; 1 for other kinds."""


def errors(n, seed=7):
    """Draw normal errors on all geometry; row 0 is the nominal joint."""
    rng = np.random.default_rng(seed)
    table = np.zeros(n, ERROR)
    for name in ERROR.names:
        if name.startswith(("pin", "hole")):
            table[name][1:] = rng.normal(0.0, 5e-5 if "tilt" not in name else 3e-3, n - 1)
    table["material.E_factor"] = 1.0
    return table


def results(n, seed=8, failed=0, unsettled=0):
    """Invent results: loads rise with a gamma variate, the last rows failed or did not settle."""
    rng = np.random.default_rng(seed)
    table = np.zeros(n, RESULT)
    table["status"], table["settled"] = Status.OK, 1
    scatter = rng.gamma(3.0, 0.03, (n, 8)) * np.array([1, 1, 0.15, 0.15, 0.15, 0.15, 1, 1])
    scatter[0] = 0.0
    for kind in LOAD_KINDS:
        places = kind.shape[:1] if kind.places != JOINT else ()
        own = scatter[:, : len(kind.places)].reshape(n, *places, *(1 for _ in kind.shape[len(places) :]))
        own = own * RISE.get(kind.key, 1.0)
        table[f"{kind.key}_max"] = np.array(BASE.get(kind.key, 100.0)) * (1.0 + own)
        if kind.averaged:
            table[f"{kind.key}_mean"] = 0.9 * table[f"{kind.key}_max"]
            table[f"{kind.key}_range"] = 0.2 * table[f"{kind.key}_max"]
    table["mode_share"][:, :, 1] = 1.0
    table["equivalent_load"] = 600.0 * (1.0 + scatter[:, :4])
    table["tilt"], table["line_load"] = 1e-3 * (1.0 + scatter[:, :4]), 5e4 * (1.0 + scatter[:, :4])
    table["revolutions"], table["steps"], table["closure"] = 2.0, 360, 2e-5
    table["status"][n - unsettled :] = Status.NOT_SETTLED
    table["settled"][n - unsettled :] = 0
    bad = slice(n - unsettled - failed, n - unsettled)
    for name in RESULT.names:
        if RESULT[name].base.kind == "f":
            table[name][bad] = np.nan
    table["status"][bad], table["settled"][bad] = Status.NEWTON_FAILED, 0
    stationary.fill_intervals(table)
    return table


HEAD = """
[joint]
base = "cirelli2021"
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
"""
"""The paper's joint at one operating point: how most studies of the tests begin."""

WHOLE = (
    HEAD
    + """[tolerances]
"pin*.offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }

[sampling]
n = 60
seed = 2021

[limits]
"cross1.F" = "700 N"
"fork*.T" = "40 N*m"
"pin1.contact" = "800 N"
"psi" = 0.01
"""
)
"""A study that keeps all columns of the results."""
KEPT = '["*.[FT]_max", "pin1.contact_*", "psi_max"]'
"""Columns that its limits need."""
STUDY = WHOLE.replace("[limits]", f"[output]\nresults = {KEPT}\n\n[limits]")
"""The study with these alone: a result file is made and read in half the time."""

SOLVER = '[solver]\nfidelity = "quasistatic"\nsteps_per_rev = 15\n'
"""Cheapest settings: joints of a campaign that is really simulated."""
REAL = STUDY.replace("[sampling]", f"{SOLVER}\n[sampling]")
"""The study with these settings."""
SWEEP = (
    HEAD
    + """[errors]
pin1.tilt_z = "0.5 deg"

[sampling]
method = "sweep"

[sweep]
"pin*.diameter" = { from = "-0.1 mm", to = "0.1 mm", points = 11 }
"""
)

TILTS = (
    HEAD
    + """[tolerances]
"pin*.tilt_t" = { iso2768 = "f", nominal = "36.4 mm", distribution = "normal", cpk = 1.0 }
"pin*.offset_z" = { iso2768 = "f", nominal = "72.8 mm", distribution = "normal", cpk = 1.0 }

[sampling]
n = 400
seed = 3

[output]
results = ["*.F_max"]

[limits]
"cross1.F" = "700 N"
"""
)
"""A study of the two errors that `two_errors.stand_in` knows."""


CONTENTS = {}
"""Small files that were made already, by what they were made from: to write one anew takes a tenth of a second."""


def store(folder, text=STUDY, name="small", simulated=None, **kwargs):
    """Make a result file without running the solver; `simulated` rows of it have invented results."""
    path, key = folder / f"{name}.h5", (text, name, simulated, *kwargs.items())
    if key in CONTENTS:
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
        path.write_bytes(CONTENTS[key])
        return path
    write(folder, text, name, simulated, **kwargs)
    if path.stat().st_size < 1e6:
        CONTENTS[key] = path.read_bytes()
    return path


def load(folder, text, name="made"):
    """Write a study to a folder and load it."""
    from tolstat import study

    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return study.load(folder / f"{name}.toml")


def simulated_by(solver, folder, text, name="made"):
    """Make a result file of joints that a stand-in for the solver simulates."""
    from tolstat import sampling
    from tolstat.joint import perturb
    from tolstat.store import Writer

    plan, path = load(folder, text, name), folder / f"{name}.h5"
    errors = sampling.draw(plan)
    with Writer.create(path, plan, [errors]) as file:
        file.write(np.arange(plan.rows), solver(perturb(plan.joint, plan.operation, errors), None))
    return path


def write(folder, text, name, simulated, **kwargs):
    """Write a study and its result file to a folder."""
    from tolstat import sampling
    from tolstat.common.tables import Simulation
    from tolstat.store import Writer

    plan, path = load(folder, text, name), folder / f"{name}.h5"
    table = results(plan.rows, **kwargs)
    rows = np.arange(plan.rows if simulated is None else simulated)
    origin = sampling.origin_blocks(plan, range(plan.rows))
    with Writer.create(path, plan, [sampling.draw(plan)], origin=origin) as file:
        if rows.size:
            file.write(rows, Simulation(table[rows], {}))
