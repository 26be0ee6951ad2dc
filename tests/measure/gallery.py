"""``python -m tests.measure.gallery FOLDER``: pictures of docs/gallery that no command draws by itself.

FOLDER holds the result files ``welded_fork.h5``, ``overnight.h5``, ``fuzz.h5``, ``hard_cases.h5``,
``needle_bearings.h5``, ``duty_cycle.h5``, ``known_parts.h5``, ``lots.h5``, ``shaft.h5``, ``unlike_joints.h5``,
``engine_order.h5``, ``snap_rings.h5``, ``hinge_line.h5``, ``four_bar.h5``, ``parallel_cranks.h5``, and, compared with
``iso2768_f.h5``, ``rigid_shafts.h5`` and ``line_bored.h5``, of some joints or all, and gets a picture of each,
``tilted_pin.png`` and ``statics.png``.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path

import matplotlib as mpl
import numpy as np
from scipy.stats import binom

import tolstat
from tests.support.environment import ROOT
from tests.support.statics import on_shafts
from tolstat.analysis.binomial import clopper_pearson
from tolstat.common.loads import split
from tolstat.common.tables import Status
from tolstat.display import style
from tolstat.display.answer import Answer
from tolstat.display.blocks import Panel, Panels
from tolstat.joint import operating
from tolstat.joint.shaft import PLANES
from tolstat.questions.shares import with_ends
from tolstat.store import recorded

mpl.use("Agg")
from matplotlib import pyplot as plt

COLOURS = {"ok": "#0072B2", "stationary": "#D55E00", "other": "#333333"}
RPM = np.pi / 30


def save(figure: plt.Figure, target: Path) -> None:
    """Write a picture."""
    figure.savefig(target, dpi=130)
    plt.close(figure)
    print(target)


def panel_of(answer: Answer) -> Panel:
    """First picture of an answer."""
    return next(panel for part in answer.parts if isinstance(part, Panels) for panel in part.panels)


def as_on_page(answer: Answer, size: tuple[float, float], target: Path) -> None:
    """Write the first picture of an answer in another size, without its title."""
    with style.settings():
        figure, ax = plt.subplots(figsize=size, layout="constrained")
        panel_of(answer).draw(ax)
        save(figure, target)


def tilted_pin(folder: Path) -> None:
    """Draw a bushing's torque and a pin's contact force over a revolution, with the tilt and without it."""
    case = tolstat.load_case(ROOT / "studies" / "tilted_pin.toml")
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    for errors, label in ((case.errors, "pin 1 tilted by 0.5°"), ({}, "without errors")):
        trace = tolstat.simulate_case(replace(case, errors=errors)).to_pandas()
        torque = np.linalg.norm(trace[["cross1.T_e", "cross1.T_t", "cross1.T_z"]], axis=1)
        contact = trace[["pin1.contact_outer", "pin1.contact_inner"]].max(axis=1)
        for ax, values in zip(panels, (torque, contact), strict=True):
            ax.plot(np.degrees(trace["theta"]), values, label=label)
    for ax, label in zip(panels, ("torque of cross1 (N m)", "larger contact force of pin 1 (N)"), strict=True):
        ax.set(xlabel="angle of the input shaft (°)", ylabel=label, xticks=range(0, 361, 90), ylim=(0, None))
        ax.grid(alpha=0.3)
    panels[0].legend()
    save(figure, folder / "tilted_pin.png")


def welded_fork(folder: Path) -> None:
    """Draw the share of the joints with a failed part against revolutions, as the page does."""
    with tolstat.open(folder / "welded_fork.h5") as store:
        panel = panel_of(tolstat.fatigue(store.view()))
    with style.settings():
        figure, ax = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
        panel.draw(ax)
        save(figure, folder / "welded_fork.png")


def known_parts(folder: Path) -> None:
    """Draw the share as drawn, and with each spread and mean that the parts leave open, after `assumptions --run`."""
    with tolstat.open(folder / "known_parts.h5") as store:
        answer = tolstat.assumptions(store.view())
    rows = [row for row in answer.tables["assumptions"].rows if row["because"].endswith("parts measured")]
    drawn = [answer.facts[key] for key in ("share", "lower", "upper")]
    rows = [{"label": "as the parts show", **with_ends("share", drawn)}, *rows]
    with style.settings():
        figure, ax = plt.subplots(figsize=(6.5, 3.6), layout="constrained")
        for y, row in enumerate(rows):
            share, *ends = (100.0 * row[f"share{end}"] for end in ("", "_lower", "_upper"))
            ax.plot(ends, [y, y], color=style.INK, lw=1.6)
            ax.plot(share, y, "o", color=style.COLOURS[0], ms=6.0)
        ax.set_yticks(range(len(rows)), [row["label"] for row in rows])
        ax.invert_yaxis()
        ax.set_xlabel("share of the joints that exceed a limit, per cent")
        save(figure, folder / "known_parts.png")


def overnight(folder: Path) -> None:
    """Draw the share of joints above a limit, with 95 % intervals, against their mean clearance."""
    with tolstat.open(folder / "overnight.h5") as store:
        view = store.view()
        over = np.zeros(len(view.status), dtype=bool)
        for name in store.limits:
            load = view.load(name)
            over |= load.values > load.limit
        errors = store.errors()[store.first_sample :]
        nominal = tolstat.load(ROOT / "studies" / "overnight.toml").joint.contact.clearance
    holes, pins = (np.mean([errors[f"{what}{i}.diameter"] for i in range(1, 5)], axis=0) for what in ("hole", "pin"))
    clearance = (nominal + 0.5 * (holes - pins)) * 1e3
    edges = np.arange(0.05, 0.26, 0.02)
    place = np.digitize(clearance, edges)
    figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
    for i in range(1, len(edges)):
        here = over[place == i]
        if here.size < 20:
            continue
        lower, upper = clopper_pearson(here.sum(), here.size)
        middle = 0.5 * (edges[i - 1] + edges[i])
        ax.plot([middle, middle], 100 * np.array([lower, upper]), color="#0072B2", lw=5, alpha=0.35)
        ax.plot(middle, 100 * here.mean(), "o", color="#0072B2")
    ax.axhline(1.0, color="#D55E00", ls="--", label="accepted: 1 %")
    ax.set(xlabel="radial clearance, mean of the pins (mm)", ylabel="joints above a limit (%)", yscale="symlog")
    ax.set_yticks([0, 1, 10, 100], ["0", "1", "10", "100"])
    ax.set_ylim(0, 110)
    ax.grid(alpha=0.3)
    ax.legend()
    save(figure, folder / "overnight.png")


def needle_bearings(folder: Path) -> None:
    """Draw the share of joints whose bearings have a shorter life."""
    with tolstat.open(folder / "needle_bearings.h5") as store:
        panel = panel_of(tolstat.bearing_life(store.view()))
    figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
    panel.draw(ax)
    ax.grid(alpha=0.3)
    save(figure, folder / "needle_bearings.png")


def duty_cycle(folder: Path) -> None:
    """Draw the share of joints above a force of cross1 at each operating point, with 95 % intervals, and its limits."""
    figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
    with tolstat.open(folder / "duty_cycle.h5") as store:
        view = store.view()
        limits = {split(name)[1]: level for name, level in view.limits.items() if split(name)[0] == "cross1.F"}
        for point, colour in zip(view.points, ("#0072B2", "#009E73", "#D55E00"), strict=True):
            load = view.load(f"cross1.F at {point}")
            x = np.sort(load.valid)
            count = np.arange(x.size, 0, -1)
            ax.step(x, 100 * count / x.size, color=colour, where="pre", label=point)
            lower, upper = clopper_pearson(count, x.size)
            ax.fill_between(x, 100 * lower, 100 * upper, color=colour, step="pre", alpha=0.2, lw=0)
    for where, level in limits.items():
        ax.axvline(level, color="#333333", ls="--")
        said = f"limit {where and f'at {where}'}"
        ax.annotate(said, (level, 1), (4, -4), xycoords=("data", "axes fraction"), textcoords="offset points", va="top")
    ax.set(xlabel="largest force of cross1 (N)", ylabel="joints above it (%)", yscale="log", ylim=(0.1, 150))
    ax.set_yticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    ax.grid(alpha=0.3)
    figure.legend(loc="outside right upper", frameon=False, title="operating point")
    save(figure, folder / "duty_cycle.png")


def lots(folder: Path) -> None:
    """Draw which share of the lots has at most a share of joints above a limit, and as if lots were alike."""
    with tolstat.open(folder / "lots.h5") as store:
        size = int(store.sampling["joints_per_lot"])
        above = (store.view().load("any limit").values > 1.0).reshape(-1, size).sum(axis=1)
    at = np.arange(above.max() + 2)
    alike = binom.cdf(at, size, above.mean() / size)
    figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
    own = [np.mean(above <= k) for k in at]
    for values, colour, label in ((own, "#0072B2", "lots simulated"), (alike, "#777777", "if lots were alike")):
        ax.step(100 * at / size, 100 * np.array(values), where="post", color=colour, label=label)
    ax.set(xlabel="joints of a lot above a limit (%)", ylabel="lots with at most so many (%)", ylim=(0, 104))
    ax.grid(alpha=0.3)
    ax.legend()
    save(figure, folder / "lots.png")


def of_mechanisms(folder: Path, name: str, loads: dict[str, str], words: str, what: str = "shafts") -> None:
    """Draw the share of mechanisms above the largest of some loads with one limit, by label, with 95 % intervals."""
    figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
    with tolstat.open(folder / f"{name}.h5") as store:
        view = store.view()
        for (label, pattern), colour in zip(loads.items(), ("#0072B2", "#D55E00", "#009E73"), strict=False):
            keys = [key for key in view.limits if fnmatch(key, pattern)]
            force = np.max([view.load(key).values for key in keys], axis=0)
            count = np.arange(force.size, 0, -1)
            ax.step(np.sort(force), 100 * count / force.size, color=colour, where="pre", label=label)
            lower, upper = clopper_pearson(count, force.size)
            ax.fill_between(np.sort(force), 100 * lower, 100 * upper, color=colour, step="pre", alpha=0.2, lw=0)
        ax.axvline(view.limits[keys[0]], color="#333333", ls="--", label="limit")
    ax.set(xlabel=words, ylabel=f"{what} above it (%)", yscale="log", ylim=(0.3, 150))
    ax.set_yticks([1, 10, 100], ["1", "10", "100"])
    ax.grid(alpha=0.3)
    ax.legend()
    save(figure, folder / f"{name}.png")


def shaft(folder: Path) -> None:
    """Draw the largest force of a bearing at each end."""
    ends = {"gearbox": "input.bearing_?", "axle": "output.bearing_?"}
    of_mechanisms(folder, "shaft", ends, "largest force of a bearing (N)")


def unlike_joints(folder: Path) -> None:
    """Draw the largest force of a bearing at each end."""
    ends = {"gearbox, needles": "input.bearing_?", "axle, plain bushes": "output.bearing_?"}
    of_mechanisms(folder, "unlike_joints", ends, "largest force of a bearing (N)")


def engine_order(folder: Path) -> None:
    """Draw the largest force on a pin of each joint."""
    joints = {"joint 1": "joint1.cross?.F", "joint 2": "joint2.cross?.F"}
    of_mechanisms(folder, "engine_order", joints, "largest force on a pin (N)")


def hinge_line(folder: Path) -> None:
    """Draw the largest force of the middle hinge."""
    of_mechanisms(folder, "hinge_line", {"middle hinge": "middle_eye.F"}, "largest force of the hinge (N)", "flaps")


def four_bar(folder: Path) -> None:
    """Draw the largest torque at each eye."""
    eyes = {"crank and coupler": "B_eye.T", "coupler and rocker": "C_eye.T", "rocker and ground": "D_eye.T"}
    of_mechanisms(folder, "four_bar", eyes, "largest torque at an eye (N m)", "linkages")


def parallel_cranks(folder: Path) -> None:
    """Draw the largest force on each pin of the rod."""
    pins = {"driving crank": "plate1_eye.F", "driven crank": "plate2_eye.F", "third crank": "plate3_eye.F"}
    of_mechanisms(folder, "parallel_cranks", pins, "largest force on a pin of the rod (N)", "mechanisms")


def statics(folder: Path) -> None:
    """Draw what a slow shaft without errors loads its neighbours with, in Z and in W arrangement."""
    alphas, degrees = np.radians((8.0, 6.0)), np.arange(361)
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for name, colour in (("Z", "#0072B2"), ("W", "#D55E00")):
        found = on_shafts(np.radians(degrees), alphas, PLANES[name], 0.0, 1.2, 600.0)
        axes[0].plot(degrees, np.linalg.norm(found.input_force, axis=1), color=colour, label=name)
    for moment, label, line in ((found.input_moment, "input, 8°", "-"), (found.output_moment, "output, 6°", "--")):
        axes[1].plot(degrees, np.linalg.norm(moment, axis=1), color="#333333", ls=line, label=label)
    for ax, label in zip(axes, ("force across the outer shafts (N)", "bending moment (N m)"), strict=True):
        ax.set(xlabel="angle of the input shaft (°)", ylabel=label, xticks=range(0, 361, 90))
        ax.set_ylim(0, 1.2 * ax.dataLim.ymax)
        ax.grid(alpha=0.3)
        ax.legend(loc="upper center", ncols=2)
    save(figure, folder / "statics.png")


def snap_rings(folder: Path) -> None:
    """Draw the share of joints above a load of the gearbox's bearing, by their end play, with 95 % intervals."""
    with tolstat.open(folder / "snap_rings.h5") as store:
        view, nominal = store.view(), recorded.joint_of(store, 0).thrust.end_play
        load, play = view.load("input.bearing_a"), view.errors(np.arange(view.n))["thrust.end_play"]
    play = 1e3 * (nominal + play)
    ends = np.linspace(0.0, 0.04, 4)
    figure, ax = plt.subplots(figsize=(7, 3.6), layout="constrained")
    for low, high, colour in zip(ends[:-1], ends[1:], ("#D55E00", "#009E73", "#0072B2"), strict=True):
        x = np.sort(load.values[(play >= low) & (play < high) & np.isfinite(load.values)])
        count = np.arange(x.size, 0, -1)
        lower, upper = clopper_pearson(count, x.size)
        ax.step(x, 100 * count / x.size, color=colour, where="pre", label=f"{low:.3f} to {high:.3f} mm")
        ax.fill_between(x, 100 * lower, 100 * upper, color=colour, step="pre", alpha=0.2, lw=0)
    ax.axvline(load.limit, color="#333333", ls="--", label="limit")
    ax.set(xlabel="largest load of the gearbox's nearer bearing (N)", ylabel="joints above it (%)", ylim=(0, 104))
    ax.grid(alpha=0.3)
    figure.legend(loc="outside right upper", frameon=False, title="end play")
    save(figure, folder / "snap_rings.png")


def compared(folder: Path, name: str) -> None:
    """Draw the curves of a study and of iso2768_f, and their difference, for one force and one torque."""
    with tolstat.open(folder / "iso2768_f.h5") as a, tolstat.open(folder / f"{name}.h5") as b:
        answer = tolstat.compare(a.view(), b.view(), ["cross1.F", "cross1.T"])
    pictures = next(part for part in answer.parts if isinstance(part, Panels))
    with style.settings():
        figure, axes = plt.subplots(2, 2, figsize=(9.8, 7.0))
        figure.subplots_adjust(left=0.085, right=0.985, top=0.91, bottom=0.07, hspace=0.45, wspace=0.18)
        for ax, panel in zip(axes.flat, pictures.panels, strict=True):
            panel.draw(ax)
            ax.set_title(panel.title, pad=24.0)
        save(figure, folder / f"{name}.png")


def rigid_shafts(folder: Path) -> None:
    """Draw what rigid shafts change."""
    compared(folder, "rigid_shafts")


def line_bored(folder: Path) -> None:
    """Draw what line-bored holes change."""
    compared(folder, "line_bored")


def kind(status: np.ndarray) -> np.ndarray:
    """Name of the colour of each joint."""
    names = np.full(len(status), "other", dtype="U10")
    names[status == Status.OK] = "ok"
    names[status == Status.STATIONARY] = "stationary"
    return names


def fuzz(folder: Path) -> None:
    """Draw the status of each joint by angle and speed."""
    with tolstat.open(folder / "fuzz.h5") as store:
        point, status = operating(store.operation, store.errors()[1:]), store.status()[1:]
    figure, ax = plt.subplots(figsize=(7, 3.8), layout="constrained")
    kinds = kind(status)
    for name, marker in (("ok", "o"), ("stationary", "s"), ("other", "x")):
        at = kinds == name
        speed, angle = point["speed"][at] / RPM, np.degrees(point["alpha"][at])
        label = "another status" if name == "other" else name
        ax.plot(speed, angle, marker, color=COLOURS[name], label=f"{label}: {at.sum()}", ms=5, alpha=0.8)
    ax.set(xlabel="speed of the input shaft (1/min)", ylabel="misalignment α (°)")
    ax.grid(alpha=0.3)
    figure.legend(loc="outside right upper", frameon=False)
    save(figure, folder / "fuzz.png")


def hard_cases(folder: Path) -> None:
    """Draw the largest force of any bushing of each case with errors, coloured by its status."""
    with tolstat.open(folder / "hard_cases.h5") as store:
        results, design = store.results(), store.design
        variants, cases = store.variants, store.case_names
    rows = [row for row, place in enumerate(design) if cases[place["case"]] != "ideal"]
    results, design = results[rows], design[rows]
    names = [f"{variants[place['variant']].family}: {cases[place['case']]}" for place in design]
    forces, kinds = results["F_max"].max(axis=1), kind(results["status"])
    least = np.nanmin(forces)
    figure, ax = plt.subplots(figsize=(8, 0.21 * len(names) + 1.0), layout="constrained")
    for name, colour in COLOURS.items():
        at = np.flatnonzero(kinds == name)
        label = "another status" if name == "other" else name
        ax.plot(np.nan_to_num(forces[at], nan=least), at, "x" if name == "other" else "o", color=colour, label=label)
        if name == "other":
            for i in at:
                side = -1 if np.isfinite(forces[i]) else 1
                text = {"xytext": (8 * side, 0), "textcoords": "offset points", "ha": "left" if side > 0 else "right"}
                ax.annotate(
                    Status(results["status"][i]).label, (np.nan_to_num(forces[i], nan=least), i), va="center", **text
                )
    ax.set_yticks(range(len(names)), names, fontsize=8)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.set(xscale="log", xlabel="largest force of any bushing (N)")
    ax.grid(alpha=0.3)
    figure.legend(loc="outside upper right", ncols=3, frameon=False)
    save(figure, folder / "hard_cases.png")


def main(folder: Path) -> None:
    """Draw what the folder has the results of."""
    tilted_pin(folder)
    drawn = (
        welded_fork,
        overnight,
        fuzz,
        hard_cases,
        needle_bearings,
        duty_cycle,
        known_parts,
        lots,
        shaft,
        unlike_joints,
        engine_order,
        statics,
        snap_rings,
        hinge_line,
        four_bar,
        parallel_cranks,
    )
    for draw in (*drawn, rigid_shafts, line_bored):
        if (folder / f"{draw.__name__}.h5").exists():
            draw(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
