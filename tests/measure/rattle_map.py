"""``python -m tests.measure.rattle_map rattle.h5 docs/rattle_map.png``: the picture of studies/rattle.toml."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np

from tolstat.common.tables import Status
from tolstat.joint import ideal, operating, perturb
from tolstat.store import ResultFile
from tolstat.store.recorded import joint_of

mpl.use("Agg")
RPM = np.pi / 30


def draw(source: Path, target: Path) -> None:
    """Draw shares of joints that are ok, or stationary, by speed and torque, and where the torque reverses."""
    from matplotlib import pyplot as plt

    with ResultFile.open(source) as store:
        errors, status = store.errors(), store.status()
        rows = np.arange(store.first_sample, len(errors))
        errors, status = errors[rows], status[rows]
        params = perturb(joint_of(store, 1), store.operation, errors)
        point = operating(store.operation, errors)
    speeds, torques = (np.unique(point[name].round(6)) for name in ("speed", "torque"))
    figure, ax = plt.subplots(figsize=(7.5, 5.2), layout="constrained")
    shares = np.full((len(torques), len(speeds)), np.nan)
    for i, torque in enumerate(torques):
        for k, speed in enumerate(speeds):
            here = np.isclose(point["speed"], speed) & np.isclose(point["torque"], torque)
            ok, stationary = (np.mean(status[here] == s) for s in (Status.OK, Status.STATIONARY))
            shares[i, k] = ok + stationary
            more = f"\n+ {100 * stationary:.0f} % stat." if stationary > 0 else ""
            dark = shares[i, k] > 0.6
            ax.text(
                *(k, i, f"{100 * ok:.0f} % ok{more}"),
                ha="center",
                va="center",
                fontsize=9,
                zorder=5,
                color="w" if dark else "k",
            )
    image = ax.imshow(shares, origin="lower", aspect="auto", vmin=0, vmax=1, cmap="cividis_r")
    figure.colorbar(image, label="share of joints that are ok or stationary")
    inertia = ideal.reversal_torque(params[:1])[0] / float(params["omega"][0]) ** 2
    fine = np.linspace(0, len(speeds) - 1, 200)
    speed = np.exp(np.interp(fine, np.arange(len(speeds)), np.log(speeds)))
    place = np.interp(np.log(inertia * speed**2), np.log(torques), np.arange(len(torques)), left=np.nan, right=np.nan)
    ax.plot(fine, place, color="#d55e00", lw=2, zorder=2, label="below this line the torque reverses")
    ax.set_xticks(range(len(speeds)), [f"{s / RPM:.0f}" for s in speeds])
    ax.set_yticks(range(len(torques)), [f"{t:.0f}" for t in torques])
    ax.set_xlabel("speed of the input shaft (1/min)")
    ax.set_ylabel("torque (N m)")
    ax.set_title(f"Joints to ISO 2768-f at 15°: {len(status)} joints, some {len(status) // shares.size} a field")
    figure.legend(loc="outside lower right", frameon=False)
    figure.savefig(target, dpi=150)


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
