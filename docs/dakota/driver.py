"""Between Dakota and tolstat: one joint from a parameters file, its loads into a results file.

The variables are all `cube_names` of study.toml, independent and uniform between 0 and 1.
"""

import csv
import subprocess
import sys

LOADS = ["cross1.F"]

parameters, results = sys.argv[1:]
with open(parameters, encoding="utf-8") as file:
    lines = [line.split() for line in file]
values, names = zip(*(line[:2] for line in lines[1 : int(lines[0][0]) + 1]), strict=True)
with open("x.csv", "w", encoding="utf-8", newline="") as file:
    csv.writer(file).writerows([names, values])
loads = [word for load in LOADS for word in ("--load", load)]
command = ["tolstat", "evaluate", "study.toml", "--uniform", "--in", "x.csv", "--out", "y.csv", "--workers", "1"]
subprocess.run([*command, *loads], check=True)
with open("y.csv", encoding="utf-8", newline="") as file:
    _, _, (_, *found) = csv.reader(file)
with open(results, "w", encoding="utf-8") as file:
    file.write(
        "fail\n" if "" in found else "".join(f"{value} {load}\n" for value, load in zip(found, LOADS, strict=True))
    )
