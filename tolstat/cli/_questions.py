"""The functions of commands that answer a question.

The first parameters of a question say what its command reads: a `View` is FILE, two are A and B, ``*views`` are several
files. Where the question's file has a function ``simulate(source, work, ...)``, its first parameter says what is
simulated: a `Study` is STUDY, whose campaigns the answer is about, a path is FILE, behind ``--run``; it may be either.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from contextlib import ExitStack
from inspect import Parameter
from pathlib import Path
from typing import Annotated, Any

from tolstat import study
from tolstat.cli._command import entries, flag_of, opt_of, prose
from tolstat.cli._output import deliver
from tolstat.cli._talk import progress, say
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import check_target
from tolstat.display import options
from tolstat.questions import Question
from tolstat.store import ResultFile, View
from tolstat.study import Study, points

READS: dict[str, dict[str, Any]] = {
    "view": {"file": options.ResultPath},
    "views": {"files": options.PointPaths},
    "pair": {"a": options.FirstPath, "b": options.SecondPath},
    "study": {"source": options.SimulatedPath},
    "either": {"source": options.EitherPath},
}
"""Arguments of a command by what its question reads."""


class _Asked:
    """What a question asks for: its arguments, its options, and what it simulates.

    Attributes
    ----------
    reads : str
        A key of `READS`.
    options, simulated : list of inspect.Parameter
        Options of the question, and of its simulation; both may have the same.
    only_simulated : list of inspect.Parameter
        Options of the simulation that the question itself has not.
    into_file : bool
        Whether it simulates into the result file that it reads.
    """

    def __init__(self, question: Question) -> None:
        self.answer, self.simulate = question.functions()
        parameters = inspect.signature(self.answer, eval_str=True).parameters.values()
        views = [p for p in parameters if p.annotation is View]
        several = views[0].kind is Parameter.VAR_POSITIONAL
        self.options = [p for p in parameters if p.annotation is not View]
        self.reads = "pair" if len(views) == 2 else "views" if several else "view"
        self.simulated, self.into_file = [], False
        if self.simulate is not None:
            source, _, *self.simulated = inspect.signature(self.simulate, eval_str=True).parameters.values()
            self.into_file = source.annotation is not Study
            if source.annotation is Study:
                self.reads = "study" if several else "either"
            elif source.annotation is not Path:
                self.reads = "either"
        names = {p.name for p in self.options}
        self.only_simulated = [p for p in self.simulated if p.name not in names]

    def parameters(self) -> list[Parameter]:
        """Parameters of the command: what is read, own options, then those that commands of questions share."""
        docstrings = [inspect.getdoc(function) or "" for function in (self.simulate, self.answer) if function]
        texts = {name: text for docstring in docstrings for name, text in entries(docstring).items()}
        made = [_parameter(name, kind, Parameter.empty) for name, kind in READS[self.reads].items()]
        for p in (*self.options, *self.only_simulated):
            base, opt = opt_of(p)
            made.append(_parameter(p.name, Annotated[base, opt._replace(help=texts[p.name])], p.default))
        if self.reads != "pair":
            made.append(_parameter("point", options.Point, None))
        if self.reads not in ("pair", "study"):
            made.append(_parameter("study_file", options.OtherStudy, None))
        if self.into_file:
            made.append(_parameter("run", options.Run, False))
        if self.simulate is not None:
            made.append(_parameter("workers", options.Workers, None))
        made.append(_parameter("out", options.Results if self.reads in ("study", "either") else options.Folder, None))
        return [*made, _parameter("wide", options.Wide, False), _parameter("as_json", options.AsJson, False)]


def _parameter(name: str, annotation: Any, default: Any) -> Parameter:
    arguments = {argument for kinds in READS.values() for argument in kinds}
    kind = Parameter.POSITIONAL_OR_KEYWORD if name in arguments else Parameter.KEYWORD_ONLY
    return Parameter(name, kind, default=default, annotation=annotation)


def function_of(question: Question) -> Callable[..., None]:
    """Make the function of a command that answers a question."""
    asked = _Asked(question)

    def run(**given: Any) -> None:
        named = [given[name] for name in READS[asked.reads]]
        sources: list[Path] = named[0] if asked.reads == "views" else named
        stem = f"{'_'.join(path.stem for path in sources[:2])}_{question.name}"
        point, is_study = given.get("point") or "", False
        if given["out"] is not None:
            check_target(given["out"] / stem)
        if asked.simulate is not None:
            is_study = sources[0].suffix == ".toml"
            sources = _simulated(asked, sources[0], given)
        with ExitStack() as stack:
            opened = [stack.enter_context(ResultFile.open(path)) for path in sources]
            point = "" if is_study and len(opened[0].points) == 1 else point  # the one that was simulated
            views = [store.view(given.get("study_file")).at(point) for store in opened]
            with progress(question.name):
                answer = asked.answer(*views, **{p.name: given[p.name] for p in asked.options})
            deliver(answer, given["wide"], given["as_json"])
            if given["out"] is not None:
                with progress("files"):
                    files = answer.write(given["out"] / stem)
                for path in files:
                    say(f"wrote {path}")

    made: Any = run
    made.__name__, made.__doc__ = question.name, prose(inspect.getdoc(asked.answer) or "")
    made.__signature__ = inspect.Signature(asked.parameters())
    return run


def _simulated(asked: _Asked, source: Path, given: dict[str, Any]) -> list[Path]:
    """Simulate what a question needs; returns the result files that it is about."""
    is_study = source.suffix == ".toml"
    if not (is_study or given.get("run")):
        _refuse_unused(asked, source, given)
        return [source]
    from tolstat.cli._work import work

    point, folder = given.get("point") or "", given["out"] or Path()
    what: Any = source
    if is_study:
        what = study.load(source)
        points.names_of(point, [own.name for own in what.points], str(source))
    settings = {"workers": given["workers"], "folder": folder, "study_file": given.get("study_file"), "point": point}
    with work(**settings) as running:
        return asked.simulate(what, running, **{p.name: given[p.name] for p in asked.simulated})  # type: ignore[misc]


def _refuse_unused(asked: _Asked, source: Path, given: dict[str, Any]) -> None:
    """Refuse options of a simulation where nothing is simulated.

    Raises
    ------
    InputError
        When there are any.
    """
    used = [flag_of(p) for p in asked.only_simulated if given[p.name] not in (None, p.default)]
    if used:
        ways = {"add --run": asked.into_file, "give a study (TOML)": asked.reads != "view"}
        remedy = ", or ".join(way for way, is_open in ways.items() if is_open)
        found = f"{'are' if len(used) > 1 else 'is'} about a simulation, and {source} holds its joints already"
        raise InputError([Fault(", ".join(used), found, remedy)])
