# %%
"""From a study to a decision, cell by cell.

Any editor with "percent" cells runs this as a notebook, and `python studies/example.py [FOLDER]` as a script.
Equilibrium at each angle in place of dynamics keeps it at a few seconds, once the kernels are compiled; leave
`FIDELITY` out of the text for the real thing.
"""

import sys
from pathlib import Path

import tolstat

here = Path(__file__).parent if "__file__" in globals() else Path("studies")
folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
FIDELITY = '\n[solver]\nfidelity = "quasistatic"\n'

# %% [markdown]
# The main job, smaller: 600 joints whose holes and pins are made to ISO 2768-f.

# %%
text = (here / "iso2768_f.toml").read_text(encoding="utf-8") + FIDELITY
study = tolstat.load(here / "iso2768_f.toml", n=600, text=text)
first = folder / "example.h5"
tolstat.run(study, first, workers=1)

# %% [markdown]
# Row i is joint i: its errors, then its results. Loads have names; the joint without errors stands apart.

# %%
with tolstat.open(first) as store:
    frame = store.to_pandas()
    force, nominal = store.loads["cross1.F"], store.nominal["cross1.F"]
print(frame[["pin1.offset_t", "hole1.tilt_z", "cross1.F_max", "status"]].head())
print(
    f"cross1.F [{force.attrs['units']}]: {nominal:.0f} without errors, {force.min():.0f} to {force.max():.0f} with them"
)

# %% [markdown]
# How many joints exceed 1500 N, and which load do 99 % of them stay below?

# %%
with tolstat.open(first) as store:
    load = store.view().load("cross1.F")
above, low = load.above(1500.0), load.quantile(0.99)
print(f"P(cross1.F > 1500 N) = {above.estimate:.1%}, 95 % interval {above.lower:.1%} to {above.upper:.1%}")
print(f"99 % of the joints stay below {low.estimate:.0f} N, 95 % interval {low.lower:.0f} to {low.upper:.0f} N")

# %% [markdown]
# Which errors make the load scatter (shares of the variance of its logarithm), and which make its tail?

# %%
with tolstat.open(first) as store:
    causes = tolstat.causes_of(store.view(), "cross1.F", log=True)
print(causes.table[["error", "first", "first_lower", "first_upper", "size", "size_p"]].head(6).round(3))

# %% [markdown]
# What if tilts were held to 0.42 deg? The same joints tell, each counted as often as these tolerances would make it.

# %%
tilts = ["*.tilt_*.plus_minus=0.42 deg"]
with tolstat.open(first) as store:
    other = tolstat.reweighted(store.view(), tilts)
print(other.table[["load", "level", "before", "estimate", "lower", "upper"]].head(4).round(4))
print(other.verdict)

# %% [markdown]
# Which tolerances keep P(cross1.F > 1500 N) below 6 % at the least cost? So few joints hardly tell, and
# the verdict says so.

# %%
with tolstat.open(first) as store:
    found = tolstat.allocated(store.view(), ["P(cross1.F > 1500 N) < 0.06"])
print(found.tolerances[["tolerance", "errors", "factor", "cost_before", "cost"]].round(3))
print(found.verdict)

# %% [markdown]
# The proposal as a study of its own, with the seed of the first one, so that joints are compared one by one.

# %%
(folder / "example_next.toml").write_text(found.text, encoding="utf-8")
again = tolstat.load(here / "iso2768_f.toml", n=600, text=found.text.replace("seed = 2022", "seed = 2021"))
second = folder / "example_next.h5"
tolstat.run(again, second, workers=1)
with tolstat.open(first) as a, tolstat.open(second) as b:
    difference = tolstat.compared(a.view(), b.view(), ["cross1.F"])
print(difference.shares[["load", "level", "a", "b", "estimate", "lower", "upper"]].head(1).round(4))
print(f"{len(difference.changes)} changes in the study")
print(f"{len(difference.switched)} times only one joint of a pair is above a limit")

# %% [markdown]
# All statistics for other programs, and the pictures.

# %%
with tolstat.open(second) as store:
    print(sorted(tolstat.statistics(store.view())))
for path in tolstat.write_report(second, folder):
    print(path.name)
