"""Between Dakota and tolstat: joints from a parameters file of a batch, their loads into a results file.

The variables are all `cube_names` of study.toml, independent and uniform between 0 and 1.
"""

import csv
import subprocess
import sys

LOADS = ["cross1.F"]

parameters, results = sys.argv[1:]
with open(parameters, encoding="utf-8") as file:
    lines = [line.split() for line in file]
starts = [i for i, line in enumerate(lines) if line[-1:] == ["variables"]]
joints = [{name: value for value, name in lines[i + 1 : i + 1 + int(lines[i][0])]} for i in starts]
with open("x.csv", "w", encoding="utf-8", newline="") as file:
    table = csv.DictWriter(file, list(joints[0]))
    table.writeheader()
    table.writerows(joints)
loads = [word for load in LOADS for word in ("--load", load)]
command = ["tolstat", "evaluate", "study.toml", "--uniform", "--in", "x.csv", "--out", "y.csv"]
subprocess.run([*command, *loads], check=True)
with open("y.csv", encoding="utf-8", newline="") as file:
    _, _, *found = csv.reader(file)
with open(results, "w", encoding="utf-8") as file:
    for _, *values in found:
        failed = "" in values
        file.write("#\n")
        file.writelines(
            ["fail\n"] if failed else [f"{value} {load}\n" for value, load in zip(values, LOADS, strict=True)]
        )
