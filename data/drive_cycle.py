"""A made-up signal of a drive shaft's joint: torque, speed and misalignment over an hour at 100 Hz.

``python data/drive_cycle.py drive_cycle.csv`` writes it; ``--minutes 10 --rate 5`` gives ``studies/drive_cycle.csv``.
Nobody measured it: a vehicle launches, climbs, cruises, coasts and stands still in an order drawn by a seed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

MANOEUVRES = np.array(
    [  # torque N m, speed rpm, misalignment deg, mean duration s, probability
        [850.0, 250.0, 17.0, 3.0, 0.2],  # launch
        [520.0, 700.0, 15.0, 12.0, 0.15],  # climb
        [220.0, 1300.0, 11.0, 25.0, 0.35],  # cruise
        [-120.0, 1000.0, 10.0, 8.0, 0.2],  # coast
        [0.0, 0.0, 12.0, 6.0, 0.1],  # stand
    ]
)
LAG = 0.6
"""Time constant of changes, s."""
NOISE = np.array([0.06, 0.02, 0.03])
"""Standard deviation of torque, speed and misalignment in a manoeuvre, relative to their values."""


def signal(minutes: float, rate: float, seed: int = 2021) -> NDArray[np.float64]:
    """Signal of so many minutes at a rate in Hz, (n, 4): time s, torque N m, speed rpm, misalignment deg."""
    rng = np.random.default_rng(seed)
    n = round(60.0 * minutes * rate)
    goal = np.empty((0, 3))
    while len(goal) < n:
        own = MANOEUVRES[rng.choice(len(MANOEUVRES), p=MANOEUVRES[:, 4])]
        samples = 1 + int(rate * own[3] * rng.gamma(4.0, 0.25))
        goal = np.vstack([goal, np.repeat([own[:3] * (1.0 + 0.15 * rng.normal(size=3))], samples, axis=0)])
    pace, values = 1.0 / (1.0 + LAG * rate), np.empty((n, 3))
    state, drift = goal[0], np.zeros(3)
    for i in range(n):
        state = state + pace * (goal[i] - state)
        drift = drift + pace * (rng.normal(size=3) * np.sqrt(2.0 / pace) - drift)
        values[i] = state * (1.0 + NOISE * drift)
    return np.column_stack([np.arange(n) / rate, values])


def main() -> None:
    """Write the signal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=100.0)
    given = parser.parse_args()
    values = signal(given.minutes, given.rate)
    with given.out.open("w", encoding="utf-8", newline="\n") as file:
        file.write("# Made by data/drive_cycle.py, not measured.\ntime [s],torque [N*m],speed [rpm],alpha [deg]\n")
        np.savetxt(file, values, fmt=["%.2f", "%.1f", "%.1f", "%.2f"], delimiter=",")


if __name__ == "__main__":
    main()
