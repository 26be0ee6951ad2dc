"""Options of commands: what a type does not say of an argument, and the options that several commands share.

The help of an option is its entry under ``Parameters`` in the docstring of the command, or else that of its `Opt`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple


class Opt(NamedTuple):
    """How an argument of a function is written on the command line.

    Attributes
    ----------
    metavar : str
        The word that stands for its value in help.
    least, most : float, optional
        Range of numbers.
    unit : str, optional
        Unit of the value in Python; on the command line it is text with a unit, ``"0.1 %"``, ``"5 min"``.
    name : str
        Name of the option if it is not that of the argument.
    help : str
        Its help, where the docstring of the function says nothing of it.
    writes : bool
        Whether it names a file to write, which is refused where it is an input or cannot be written; ``-`` is
        standard output.
    """

    metavar: str = ""
    least: float | None = None
    most: float | None = None
    unit: str | None = None
    name: str = ""
    help: str = ""
    writes: bool = False


ResultPath = Annotated[Path, Opt("FILE", help="Result file (HDF5) of a campaign.")]
FirstPath = Annotated[Path, Opt("A", help="Result file (HDF5) of the first campaign.")]
SecondPath = Annotated[Path, Opt("B", help="Result file (HDF5) of the second campaign.")]
SimulatedPath = Annotated[Path, Opt("STUDY", help="Study file (TOML) to simulate.")]
EitherPath = Annotated[Path, Opt("STUDY|FILE", help="Study file (TOML) to simulate, or a result file (HDF5).")]
StudyPath = Annotated[Path, Opt("STUDY", help="Study file (TOML).")]
Load = Annotated[str | None, Opt("LOAD")]
Loads = Annotated[list[str] | None, Opt("LOAD")]
Top = Annotated[int, Opt("N", least=1)]
Joints = Annotated[int | None, Opt("N", least=1, help="Number of joints; default: that of the study.")]
Delivery = Annotated[int, Opt("N", least=1, most=10**9)]
Accepted = Annotated[
    float,
    Opt(
        *("SHARE", 0.0, 1.0, "1", "accept"),
        help='Accepted share of the joints, all limits together, for the verdict: "0.1 %", "1000 ppm" or 0.001.',
    ),
]
Costs = Annotated[Path | None, Opt("TABLE")]
Point = Annotated[
    str | None,
    Opt("POINT", help="Operating point, such as cruise, or the worst of some: cruise+start; default: all."),
]
OtherStudy = Annotated[
    Path | None,
    Opt("STUDY", name="study", help="Study file (TOML) to read instead of the study text stored in FILE."),
]
Workers = Annotated[int | None, Opt("W", least=1, help="Number of worker processes; default: one per core.")]
Report = Annotated[bool, Opt(help="Print the report at the end and write its files.")]
Folder = Annotated[Path | None, Opt("DIR", help="Write tables as CSV and pictures to this folder, created if missing.")]
FolderOrStudy = Annotated[
    Path | None,
    Opt(
        "DIR|STUDY.toml",
        help="Write tables as CSV and the study to this folder, or with a name in .toml the study alone.",
    ),
]
Budget = Annotated[float, Opt("TIME", unit="s")]
Settings = Annotated[list[str], Opt("KEY=VALUE", name="set")]
Results = Annotated[
    Path | None,
    Opt(
        "DIR",
        help="Folder of result files, created if missing; tables as CSV and pictures are written to it, too; "
        "default: result files only, to the current one.",
    ),
]
Run = Annotated[bool, Opt(help="Simulate what the answer needs, and keep it in FILE.")]
Trace = Annotated[Path | None, Opt("CSV", help="Write the load histories of the last revolution as CSV.", writes=True)]
Wide = Annotated[bool, Opt(help="Print all columns; default: those that fit 80 characters.")]
AsJson = Annotated[bool, Opt(name="json", help="Print JSON instead of text.")]
