"""The one place that makes commands of questions: arguments and options from a signature, help from its docstring.

The first parameters of a question say what its command reads: a `View` is FILE, two are A and B, ``*views`` are several
files. Where the question's file has a function ``simulate(source, work, ...)``, its first parameter says what is
simulated: a `Study` is STUDY, whose campaigns the answer is about, a path is FILE, behind ``--run``; it may be either.
"""

from __future__ import annotations

import inspect
import json
import re
import textwrap
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

import typer

from tolstat.cli._app import (
    AsJson,
    AtPoints,
    StudyOption,
    Wide,
    Workers,
    make_folder,
    output_folder,
    print_table,
)
from tolstat.cli._talk import WIDTH, progress, say, warn, wrapped
from tolstat.common.errors import Fault, InputError
from tolstat.display.options import Opt
from tolstat.questions import Question

if TYPE_CHECKING:
    from tolstat.display.answer import Answer

OutFolder = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Write tables as CSV and pictures to this folder, created if missing."),
]
OutResults = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        help="Folder of result files, created if missing; tables as CSV and pictures are written to it, too; "
        "default: result files only, to the current one.",
    ),
]
Run = Annotated[bool, typer.Option("--run", help="Simulate what the answer needs, and keep it in FILE.")]
READS = {
    "view": [("file", "FILE", "Result file (HDF5) of a campaign.")],
    "views": [("files", "FILE...", "Result file (HDF5) of all operating points, or several of one each.")],
    "pair": [
        ("a", "A", "Result file (HDF5) of the first campaign."),
        ("b", "B", "Result file (HDF5) of the second campaign."),
    ],
    "study": [("source", "STUDY", "Study file (TOML) to simulate.")],
    "either": [("source", "STUDY|FILE", "Study file (TOML) to simulate, or a result file (HDF5).")],
}
"""Arguments of a command by what its question reads: name, word in the help, and help."""


class _Asked:
    """What a question asks for: its arguments, its options, and what it simulates.

    Attributes
    ----------
    reads : str
        A key of `READS`.
    options, simulated : list of inspect.Parameter
        Options of the question, and of its simulation; both may have the same.
    into_file : bool
        Whether it simulates into the result file that it reads.
    """

    def __init__(self, question: Question) -> None:
        from tolstat.store.view import View
        from tolstat.study import Study

        self.name = question.name
        self.answer, self.simulate = question.functions()
        found = inspect.signature(self.answer, eval_str=True).parameters.values()
        views = [p for p in found if p.annotation is View]
        several = views[0].kind is inspect.Parameter.VAR_POSITIONAL
        self.options = [p for p in found if p.annotation is not View]
        self.reads = "pair" if len(views) == 2 else "views" if several else "view"
        self.simulated, self.into_file = [], False
        if self.simulate is not None:
            source, _, *self.simulated = inspect.signature(self.simulate, eval_str=True).parameters.values()
            self.into_file = source.annotation is not Study
            if source.annotation is Study:
                self.reads = "study" if several else "either"
            elif source.annotation is not Path:
                self.reads = "either"

    @property
    def only_simulated(self) -> list[inspect.Parameter]:
        """Options of the simulation that the question itself has not."""
        names = {p.name for p in self.options}
        return [p for p in self.simulated if p.name not in names]

    @property
    def docstring(self) -> str:
        return inspect.getdoc(self.answer) or ""

    @property
    def help(self) -> dict[str, str]:
        """Help of the options by name, from the docstrings."""
        simulation = entries(inspect.getdoc(self.simulate) or "") if self.simulate else {}
        return simulation | entries(self.docstring)


def command_of(question: Question) -> Callable[..., None]:
    """Make the function of a command that answers a question."""
    asked = _Asked(question)
    arguments, shared = READS[asked.reads], _shared(asked)

    def run(**given: Any) -> None:
        from tolstat.store import ResultFile

        options = {p.name: _value(p, given[p.name]) for p in asked.options}
        sources = [path for name, _, _ in arguments for path in _listed(given[name])]
        stem, point, is_study = "_".join(path.stem for path in sources[:2]), given.get("point") or "", False
        if asked.simulate is not None:
            is_study = sources[0].suffix == ".toml"
            sources = _simulated(asked, sources[0], given)
        with ExitStack() as stack:
            opened = [stack.enter_context(ResultFile.open(path)) for path in sources]
            point = "" if is_study and len(opened[0].points) == 1 else point  # the one that was simulated
            views = [store.view(given.get("study_file")).at(point) for store in opened]
            with progress(question.name):
                answer = asked.answer(*views, **options)
            _deliver(answer, f"{stem}_{question.name}", given)

    made: Any = run
    made.__name__, made.__doc__ = question.name, prose(asked.docstring)
    listed = asked.reads == "views"
    parameters = [_argument(*entry, listed) for entry in arguments]
    parameters += [_option(p, asked.help[p.name]) for p in (*asked.options, *asked.only_simulated)]
    made.__signature__ = inspect.Signature([*parameters, *shared])
    return run


def show(answer: Answer, wide: bool) -> None:
    """Print an answer: tables and leading sentences on standard output, notes and warnings on standard error."""
    from tolstat.display.answer import Sentence, Table
    from tolstat.display.blocks import Listing

    first = True
    for part in answer.parts:
        if isinstance(part, Table) and part.columns:
            if not first:
                typer.echo(f"\n{part.title}")
            print_table(part.columns, part.for_people, wide)
            first = False
        elif isinstance(part, Listing):
            typer.echo(f"\n{part.title}\n{part.text}")
        elif isinstance(part, Sentence) and part.place == "lead":
            typer.echo(part.text if wide else textwrap.fill(part.text, WIDTH))
            first = False
        elif isinstance(part, Sentence) and part.place == "warning":
            warn(wrapped(f"warning: {part.text}"))
        elif isinstance(part, Sentence):
            say(part.text)


def prose(docstring: str) -> str:
    """Text of a docstring before its first section."""
    return re.split(r"^[A-Z][a-z]+\n---+$", docstring, maxsplit=1, flags=re.MULTILINE)[0].strip()


def entries(docstring: str) -> dict[str, str]:
    """Texts of the entries under ``Parameters`` of a docstring, by name."""
    section = re.search(r"^Parameters\n---+\n(.*?)(?=^[A-Z][a-z]+\n---+$|\Z)", docstring, re.DOTALL | re.MULTILINE)
    parts = re.split(r"^\*?(\w+) : .*\n", section[1] if section else "", flags=re.MULTILINE)
    return {name: " ".join(text.split()) for name, text in zip(parts[1::2], parts[2::2], strict=True)}


def _deliver(answer: Answer, stem: str, given: dict[str, Any]) -> None:
    if given["as_json"]:
        typer.echo(json.dumps(answer.values(), indent=2, allow_nan=False))
    else:
        show(answer, given["wide"])
    folder = given["out"]
    if folder is None:
        return
    make_folder(folder)
    with progress("files"), output_folder(folder):
        files = answer.write(folder / stem)
    for path in files:
        say(f"wrote {path}")


def _simulated(asked: _Asked, source: Path, given: dict[str, Any]) -> list[Path]:
    """Simulate what a question needs; returns the result files that it is about."""
    is_study = source.suffix == ".toml"
    if not (is_study or given.get("run")):
        _refuse_unused(asked, source, given)
        return [source]
    from tolstat import study
    from tolstat.cli._work import work
    from tolstat.study.points import names_of

    options = {p.name: _value(p, given[p.name]) for p in asked.simulated}
    folder = given["out"] or Path()
    if is_study:
        make_folder(folder)
    what: Any = study.load(source) if is_study else source
    if is_study:
        names_of(given.get("point") or "", [one.name for one in what.points], str(source))
    settings = {"workers": given["workers"], "folder": folder, "study_file": given.get("study_file")}
    with work(**settings, point=given.get("point") or "") as running:
        return asked.simulate(what, running, **options)  # type: ignore[misc]


def _refuse_unused(asked: _Asked, source: Path, given: dict[str, Any]) -> None:
    """Refuse options of a simulation where nothing is simulated.

    Raises
    ------
    InputError
        When there are any.
    """
    used = [_flag(p) for p in asked.only_simulated if given[p.name] not in (None, p.default)]
    if used:
        ways = {"add --run": asked.into_file, "give a study (TOML)": asked.reads != "view"}
        remedy = ", or ".join(way for way, is_open in ways.items() if is_open)
        found = f"{'are' if len(used) > 1 else 'is'} about a simulation, and {source} holds its joints already"
        raise InputError([Fault(", ".join(used), found, remedy)])


def _listed(given: Path | list[Path]) -> list[Path]:
    return given if isinstance(given, list) else [given]


def _shared(asked: _Asked) -> list[inspect.Parameter]:
    """Options that commands of questions have in common."""
    found: list[tuple[str, Any, Any]] = []
    if asked.reads != "pair":
        found.append(("point", AtPoints, None))
        found += [] if asked.reads == "study" else [("study_file", StudyOption, None)]
    if asked.into_file:
        found.append(("run", Run, False))
    if asked.simulate is not None:
        found.append(("workers", Workers, None))
    out = OutResults if asked.reads in ("study", "either") else OutFolder
    found += [("out", out, None), ("wide", Wide, False), ("as_json", AsJson, False)]
    return [_parameter(*entry) for entry in found]


def _parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _argument(name: str, word: str, text: str, listed: bool) -> inspect.Parameter:
    annotation: Any = list[Path] if listed else Path
    argument = typer.Argument(metavar=word.removesuffix("..."), help=text)
    return _parameter(name, Annotated[annotation, argument], inspect.Parameter.empty)


def _option(parameter: inspect.Parameter, text: str) -> inspect.Parameter:
    """Option of a command for a keyword argument of a question."""
    base, opt = _typed(parameter)
    if opt.unit is not None:
        base = str if parameter.default is inspect.Parameter.empty else str | None
    default = None if opt.unit is not None and parameter.default is not inspect.Parameter.empty else parameter.default
    limits = {"min": opt.least, "max": opt.most} if opt.unit is None else {}
    made = typer.Option(_flag(parameter), metavar=opt.metavar or None, help=text, **limits)  # type: ignore[arg-type]
    return _parameter(parameter.name, Annotated[base, made], default)


def _typed(parameter: inspect.Parameter) -> tuple[Any, Opt]:
    """Type and `Opt` of a keyword argument."""
    annotation = parameter.annotation
    if get_origin(annotation) is not Annotated:
        return annotation, Opt()
    base, *extra = get_args(annotation)
    return base, next((own for own in extra if isinstance(own, Opt)), Opt())


def _flag(parameter: inspect.Parameter) -> str:
    return f"--{(_typed(parameter)[1].name or parameter.name).replace('_', '-')}"


def _value(parameter: inspect.Parameter, given: Any) -> Any:
    """Value of a keyword argument from that of its option: SI where it has a unit."""
    _, opt = _typed(parameter)
    if opt.unit is None:
        return given
    return parameter.default if given is None else quantity(given, opt, _flag(parameter))


def quantity(text: str, opt: Opt, flag: str) -> float:
    """Parse the value of an option that has a unit, such as ``"0.1 %"`` or ``"5 min"``; returns SI.

    Raises
    ------
    InputError
        When the text is no such value, or not between the limits of the option.
    """
    from pydantic_core import PydanticCustomError

    from tolstat.common.units import EXAMPLES, to_si

    unit = opt.unit or "1"
    try:
        value = to_si(text, unit)
    except PydanticCustomError:
        value = float("nan")
    low, high = 0.0 if opt.least is None else opt.least, float("inf") if opt.most is None else opt.most
    if not low < value < high:
        remedy = f'write {flag} "{EXAMPLES[unit]}"'
        raise InputError([Fault(flag, f"{text!r} is not {_WHAT.get(unit, f'a value in {unit}')}", remedy)])
    return value


_WHAT = {"1": "a share between 0 and 1", "s": "a time above zero"}
