"""The one place that makes commands of functions: arguments and options from a signature, help from its docstring.

Under ``python -OO`` there are no docstrings: commands run, and their help has no texts.

Parameters that can be given by position are arguments, keyword-only ones are options; what a type does not say of them
is their `Opt`. A parameter that is true by default can be switched off: ``--report / --no-report``.

The first parameters of a question say what its command reads: a `View` is FILE, two are A and B. Where the question's
file has a function ``simulate(source, work, ...)``, its first parameter says what is simulated: a path is FILE, behind
``--run`` unless the question simulates ``at_once``; of ``Study | Path`` a `Study` is STUDY, whose campaigns the answer
is about.

Exit codes: 0 success (failed and unsettled joints are results); 1 internal error, dead worker processes, or results
that `replay` does not reproduce; 2 input that cannot be used; 128 + N stopped by signal N (130 after Ctrl-C).
"""

from __future__ import annotations

import errno
import gc
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import typer

from tolstat.cli._library import points, stores, units
from tolstat.cli._shared import deliver, fail, loaded, opened, progress, session, work
from tolstat.common.errors import Fault, InputError, TolstatError, gather, raise_all
from tolstat.common.files import check_target, reason
from tolstat.common.memory import limit_bytes
from tolstat.display import options
from tolstat.questions import Question

WHAT = {"1": "a share between 0 and 1", "s": "a time above zero"}
"""What a value with a unit is, by its unit."""
WRITTEN = {"1": '"0.1 %", "1000 ppm" or 0.001', "s": '"5 min", "90 s" or "2 h"'}
"""How such a value is written, by its unit."""


@contextmanager
def exit_codes() -> Iterator[None]:
    """Turn errors that a user can mend into a message and an exit code."""
    try:
        yield
    except (TolstatError, MemoryError, OSError, ImportError) as error:
        reason = error if isinstance(error, TolstatError) else shortage(error)
        if reason is None:
            raise
        fail(f"error: {reason}")
        raise typer.Exit(2) from error
    except KeyboardInterrupt as error:
        fail("interrupted")
        raise typer.Exit(130) from error


def command_of(function: Callable[..., None]) -> Callable[..., None]:
    """Make the function of a command: with the options of `_shared.session`, and values with a unit as text."""
    parameters_of_function, common = _parameters(function), _parameters(session)

    def run(**arguments: Any) -> None:
        gc.enable()  # see `cli.main`
        shared = {name: arguments.pop(name) for name in common}
        with exit_codes(), session(**shared), exit_codes():  # those inside are written to the log, too
            function(**_values(parameters_of_function, arguments))

    command: Any = run
    command.__name__, command.__doc__ = function.__name__, prose(inspect.getdoc(function) or "")
    texts = entries(inspect.getdoc(session) or "") | entries(inspect.getdoc(function) or "")
    parameters = [*parameters_of_function.values(), *common.values()]
    command.__signature__ = Signature([_typed(p, texts.get(p.name)) for p in parameters])
    command.__annotations__ = {p.name: p.annotation for p in command.__signature__.parameters.values()}
    return run


def prose(docstring: str) -> str:
    """Text of a docstring before its first section."""
    return re.split(r"^[A-Z][a-z]+\n---+$", docstring, maxsplit=1, flags=re.MULTILINE)[0].strip()


def entries(docstring: str) -> dict[str, str]:
    """Texts of the entries under ``Parameters`` of a docstring, by name."""
    section = re.search(r"^Parameters\n---+\n(.*?)(?=^[A-Z][a-z]+\n---+$|\Z)", docstring, re.DOTALL | re.MULTILINE)
    parts = re.split(r"^\*?(\w+(?:, \w+)*) : .*\n", section[1] if section else "", flags=re.MULTILINE)
    texts = zip(parts[1::2], parts[2::2], strict=True)
    return {name: " ".join(text.split()) for names, text in texts for name in names.split(", ")}


def flag_of(parameter: Parameter) -> str:
    """Option of a parameter, such as ``--one-in``."""
    return f"--{(opt_of(parameter)[1].name or parameter.name).replace('_', '-')}"


def opt_of(parameter: Parameter) -> tuple[Any, options.Opt]:
    """Type and `Opt` of a parameter."""
    annotation = parameter.annotation
    if get_origin(annotation) is not Annotated:
        return annotation, options.Opt()
    base, *extra = get_args(annotation)
    return base, next((opt for opt in extra if isinstance(opt, options.Opt)), options.Opt())


def quantity(text: str, opt: options.Opt, flag: str) -> float:
    """Parse the value of an option that has a unit, such as ``"0.1 %"`` or ``"5 min"``; returns SI.

    Raises
    ------
    InputError
        When the text is no such value, or not between the limits of the option.
    """
    unit = opt.unit or "1"
    low, high = 0.0 if opt.least is None else opt.least, float("inf") if opt.most is None else opt.most
    try:
        value, found = units.to_si(text, unit), ""
    except ValueError as error:
        value, found = float("nan"), str(error) if unit != "1" else ""
    if not low < value < high:
        remedy = f"write {flag} " + WRITTEN.get(unit, f'"{units.EXAMPLES[unit]}"')
        raise InputError([Fault(flag, found or f"{text!r} is not {WHAT.get(unit, f'a value in {unit}')}", remedy)])
    return value


def _parameters(function: Callable[..., Any]) -> Mapping[str, Parameter]:
    return inspect.signature(function, eval_str=True).parameters


def _typed(parameter: Parameter, text: str | None) -> Parameter:
    """Parameter of a command as typer reads it; `text` is its entry in a docstring."""
    base, opt = opt_of(parameter)
    shown: Any = {"metavar": opt.metavar or None, "help": text or opt.help}
    default = parameter.default
    if opt.unit is None:
        shown |= {"min": opt.least, "max": opt.most}
    elif default is Parameter.empty:
        base = str
    else:
        base, default = str | None, None
    if parameter.kind is not Parameter.KEYWORD_ONLY:
        info: Any = typer.Argument(**shown)
    else:
        info = typer.Option(*(() if default is True else (flag_of(parameter),)), **shown)
    return parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=Annotated[base, info], default=default)


def _values(parameters: Mapping[str, Parameter], arguments: dict[str, Any]) -> dict[str, Any]:
    """Arguments of the function: in SI where they have a unit.

    Raises
    ------
    InputError
        With each value that cannot be used, and each file that cannot be written.
    """
    faults: list[Fault] = []
    inputs = [arguments[name] for name, p in parameters.items() if p.kind is not Parameter.KEYWORD_ONLY]
    paths = [Path(value) for value in inputs if isinstance(value, str | Path)]
    for name, parameter in parameters.items():
        opt, value = opt_of(parameter)[1], arguments[name]
        with gather(faults):
            if opt.writes and value not in (None, "-"):
                check_target(Path(value), *paths)
            elif opt.unit is not None:
                arguments[name] = parameter.default if value is None else quantity(value, opt, flag_of(parameter))
    raise_all(faults)
    return arguments


DISK = {
    *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM),
    *(errno.EISDIR, errno.ENOTDIR, errno.ENAMETOOLONG),
}
"""Numbers of the errors that say that a file cannot be written here."""
LIBRARIES_MB = 700
"""Address space that a process takes before it has any joints, MB: libraries and kernels."""


def check_memory() -> None:
    """Refuse to simulate in a process that may not even load the libraries; it would end with any error.

    Raises
    ------
    InputError
        When a process may use less than `LIBRARIES_MB`.
    """
    if 0 < limit_bytes() < LIBRARIES_MB * 10**6:
        raise InputError([_memory("libraries cannot be loaded")])


def shortage(error: MemoryError | OSError | ImportError) -> Fault | None:
    """Describe an error that another machine, or another folder, would not have had; None for any other error."""
    unloaded = isinstance(error, ImportError) or (isinstance(error, OSError) and error.errno is None)
    if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM or (unloaded and limit_bytes()):
        return _memory("libraries cannot be loaded" if unloaded else str(error) or "no more could be allocated")
    if isinstance(error, OSError) and error.errno in DISK:
        remedy = "check that the folder is writable and the disk has space"
        return Fault(str(error.filename or "a file"), f"cannot be written: {reason(error)}", remedy)
    return None


def _memory(short: str) -> Fault:
    limit = limit_bytes() // 10**6
    remedy = "use fewer workers (--workers 1), keep fewer results ([output]), or end other programs"
    if not limit:
        return Fault("memory", short, remedy)
    allowed = f"a process may use {limit} MB (ulimit -v) and needs {LIBRARIES_MB} MB before any joints"
    return Fault("memory", f"{short}; {allowed}", f"{remedy}, or raise ulimit -v")


READS: dict[str, dict[str, Any]] = {
    "view": {"file": options.ResultPath},
    "pair": {"a": options.FirstPath, "b": options.SecondPath},
    "either": {"source": options.EitherPath},
}
"""Arguments of a command by what its question reads."""


def function_of(question: Question) -> Callable[..., None]:
    """Make the function of a command that answers a question."""
    answer_of, simulate = question.functions()
    of_answer, simulated, only_simulated = _parameters(answer_of), list[Parameter](), list[Parameter]()
    views = [p for p in of_answer.values() if p.annotation is stores.View]
    options_of_answer = [p for p in of_answer.values() if p not in views]
    takes_study = False
    if simulate is not None:
        source, _, *simulated = _parameters(simulate).values()
        only_simulated = [p for p in simulated if p.name not in of_answer]
        takes_study = source.annotation is not Path
    reads = "pair" if len(views) == 2 else "either" if takes_study else "view"

    def run(**arguments: Any) -> None:
        sources: list[Path] = [arguments[name] for name in READS[reads]]
        stem = f"{'_'.join(path.stem for path in sources[:2])}_{question.name}"
        point, study_file, out = arguments.get("point") or "", arguments.get("study_file"), arguments["out"]
        only_study = question.study and out is not None and out.suffix.lower() == ".toml"
        if out is not None:
            check_target(out if only_study else out / stem, *sources)
        is_study = simulate is not None and sources[0].suffix.lower() == ".toml"
        if simulate is not None and (is_study or question.at_once or arguments.get("run")):
            what: Any = sources[0]
            if is_study:
                what = loaded(sources[0])
                points.names_of(point, [at.name for at in what.points], str(sources[0]))
            else:
                opened(sources[0]).close()  # its joints, or shafts, are told of from the first message on
            workers, folder = arguments["workers"], out or Path()
            with work(workers=workers, folder=folder, study_file=study_file, point=point) as running:
                sources = simulate(what, running, **{p.name: arguments[p.name] for p in simulated})
        elif used := [flag_of(p) for p in only_simulated if arguments[p.name] not in (None, p.default)]:
            remedy = f"add --run{', or give a study (TOML)' * takes_study}"
            holds = f"about a simulation, and {sources[0]} holds its joints already"
            raise InputError([Fault(", ".join(used), f"{'are' if len(used) > 1 else 'is'} {holds}", remedy)])
        with ExitStack() as stack:
            files = [stack.enter_context(opened(path)) for path in sources]
            point = "" if is_study and len(files[0].points) == 1 else point  # the one that was simulated
            seen = [store.view(study_file).at(point) for store in files]
            with progress(question.name):
                answer = answer_of(*seen, **{p.name: arguments[p.name] for p in options_of_answer})
            target = out and (out if only_study else out / stem)
            deliver(answer, arguments["wide"], arguments["as_json"], target, "documents" if only_study else "all")

    out_option = options.FolderOrStudy if question.study else options.Results if takes_study else options.Folder
    texts = entries(inspect.getdoc(simulate) or "") | entries(inspect.getdoc(answer_of) or "")
    command: Any = run
    command.__name__, command.__doc__ = question.name, prose(inspect.getdoc(answer_of) or "")
    parameters = [_parameter(name, kind, Parameter.empty) for name, kind in READS[reads].items()]
    for p in (*options_of_answer, *only_simulated):
        base, opt = opt_of(p)
        parameters.append(_parameter(p.name, Annotated[base, opt._replace(help=texts.get(p.name, ""))], p.default))
    for name, (annotation, default, applies) in {
        "point": (options.Point, None, reads != "pair"),
        "study_file": (options.OtherStudy, None, reads != "pair"),
        "run": (options.Run, False, simulate is not None and not question.at_once),
        "workers": (options.Workers, None, simulate is not None),
        "out": (out_option, None, True),
        "wide": (options.Wide, False, True),
        "as_json": (options.AsJson, False, True),
    }.items():
        if applies:
            parameters.append(_parameter(name, annotation, default))
    command.__signature__ = Signature(parameters)
    return run


def _parameter(name: str, annotation: Any, default: Any) -> Parameter:
    is_argument = any(name in arguments for arguments in READS.values())
    kind = Parameter.POSITIONAL_OR_KEYWORD if is_argument else Parameter.KEYWORD_ONLY
    return Parameter(name, kind, default=default, annotation=annotation)
