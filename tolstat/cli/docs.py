"""``tolstat docs``, ``cache``, ``new``, ``schema``, ``spectrum``: documents, compiled kernels, studies to edit."""

from __future__ import annotations

import re
import sys
import textwrap
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from tolstat.cli._library import np, schemas, spectra, starter, strict, studies, text
from tolstat.cli._shared import WIDTH, json_of, say
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import docs_dir
from tolstat.common.strict import did_you_mean
from tolstat.display.options import Opt
from tolstat.kernel.simd import cache_folder

PAGE_WIDTH = 100
"""Maximum width of a page in the terminal, characters."""


def docs(page: Annotated[str | None, Opt("PAGE")] = None) -> None:
    """Print a page of the documents, or the names of all.

    With PAGE, prints this page: study (all keys of study and joint files), tolerances, tutorial, model, report, or the
    name of a command, such as causes.

    Example: tolstat docs study

    Parameters
    ----------
    page : str, optional
        Page to read, such as study; without it: the names of all pages, with their titles.
    """
    if page is not None:
        _print_page(page)
        return
    width = max(map(len, pages()))
    for name, file in pages().items():
        lines = _plain(file.read_text(encoding="utf-8")).splitlines()
        title = next(line for line in lines if line.startswith("# "))[2:]
        indent = " " * (width + 2)
        typer.echo(textwrap.fill(title, WIDTH, initial_indent=f"{name:{width}}  ", subsequent_indent=indent))
    say("next: tolstat docs study")


def pages() -> dict[str, Path]:
    """Text of each page by its name; pages of questions have the name of their command."""
    folder = docs_dir()
    files = [*sorted(folder.glob("*.md")), *sorted((folder / "questions").glob("*.md"))]
    return {page_name(file.name): file for file in files}


def page_name(file: str) -> str:
    """Name of a page: that of its file without the ending, as commands are spelt."""
    return file.removesuffix(".md").replace("_", "-")


def _print_page(name: str) -> None:
    known = pages()
    file = known.get(page_name(name))
    if file is None:
        raise InputError([Fault(name, "is not a page", did_you_mean(name, list(known)))])
    text = _plain(file.read_text(encoding="utf-8"))
    if not sys.stdout.isatty():
        typer.echo(text)
        return
    from rich.console import Console
    from rich.markdown import Markdown

    console = Console()
    console.width = min(console.width, PAGE_WIDTH)
    with console.pager():
        console.print(Markdown(text))


def _plain(text: str) -> str:
    """Text of a page without what only builds the site: settings at its top, code that the site does not show."""
    text = re.sub(r"\A---\n.*?\n---\n+", "", text, flags=re.DOTALL)
    hidden = r"```\{code-cell\}\n:tags: \[remove-(?:input|cell)\]\n.*?\n```\n+"
    text = re.sub(hidden, "", text, flags=re.DOTALL)
    return re.sub(r"```\{code-cell\}\n(?::tags: .*\n)?", "```\n", text)


def cache(*, clear: bool = False) -> None:
    """Show where compiled kernels are kept, or remove them.

    Prints the folders with compiled kernels, one for each version of tolstat and Numba that was used, and their sizes.
    Kernels are compiled at the first use, about half a minute; a file that is damaged is compiled anew by itself. The
    environment variable NUMBA_CACHE_DIR names another folder for them.

    Example: tolstat cache

    Parameters
    ----------
    clear : bool
        Remove the compiled kernels of all versions.
    """
    if clear:
        say(f"removed {cache_folder.clear() / 1e6:.1f} MB of compiled kernels")
        return
    for folder in cache_folder.folders():
        files, size = cache_folder.size(folder)
        typer.echo(f"{folder}: {files} kernels, {size / 1e6:.1f} MB")
    say(f"in use: {cache_folder.CACHE_DIRECTORY}")


def new(
    name: Annotated[Path, Opt("NAME")] = Path("study"), *, joint: Annotated[str, Opt("JOINT")] = "cirelli2021"
) -> None:
    """Write a study with comments that runs as it stands.

    The schema by which editors complete keys is written beside it. Existing studies and joints are not replaced.

    Example: tolstat new shaft --joint own

    Parameters
    ----------
    name : Path
        Name of the study, with or without .toml; may begin with a folder.
    joint : str
        own: write a joint file, too; or a joint that comes with tolstat.
    """
    path = name if name.suffix == ".toml" else name.with_name(f"{name.name}.toml")
    for file in starter.write(path, joint):
        say(f"wrote {file}")
    say(f"next: tolstat plan {quote(str(path))}")


def schema(
    kind: Annotated[str, Opt("study|joint|case")], *, out: Annotated[Path | None, Opt("JSON", writes=True)] = None
) -> None:
    """Print the JSON schema of a file, for editors.

    Editors with Taplo or Tombi complete and check keys by the schema that a TOML file names in its first line:
    #:schema ./study.schema.json

    Example: tolstat schema study --out study.schema.json

    Parameters
    ----------
    kind : str
        File that the schema is for.
    out : Path, optional
        Write the schema to a file instead of standard output.
    """
    if kind not in schemas.KINDS:
        remedy = strict.did_you_mean(kind, list(schemas.KINDS))
        raise InputError([Fault("tolstat schema", f"no file is called {kind!r}", remedy)])
    content = json_of(schemas.schema(kind))
    if out is None:
        typer.echo(content)
        return
    say(f"wrote {text.write(content + chr(10), out)}")


def spectrum(
    signal: Annotated[Path, Opt("CSV")],
    *,
    out: Annotated[Path, Opt("STUDY", writes=True)],
    exponent: Annotated[float, Opt("M", least=1.0, most=20.0)] = 3.0,
    base: Annotated[Path | None, Opt("STUDY")] = None,
) -> None:
    """Write a study of the duty cycle in a measured signal.

    The signal has columns time, torque, speed of the input shaft and misalignment alpha, with units in the header: time
    [s], torque [N*m], speed [rpm], alpha [deg]. Samples are sorted in classes; the 12 classes that do most of the
    damage, by revolutions and by changes of the torque, become operating points with their shares of the time. The
    order of their visits is written, too, for tolstat fatigue. Prints the points; what is left out is told.

    Example: tolstat spectrum studies/drive_cycle.csv --out drive_cycle.toml

    Parameters
    ----------
    signal : Path
        Measured signal (CSV).
    out : Path
        Study file (TOML) to write.
    exponent : float
        Wöhler exponent: damage of a revolution is proportional to the torque to this power.
    base : Path, optional
        Study file (TOML) whose operating points are replaced; default: the study of tolstat new.
    """
    cycle = spectra.read(signal, exponent)
    content = spectra.text(cycle, signal, out, base)
    studies.load(out, text=content)  # its faults, before anything is written
    text.write(content, out)
    rows = [("point", "alpha", "speed", "torque", "time", "damage")]
    values = (cycle.alpha, cycle.speed, cycle.torque, cycle.time, cycle.damage)
    for name, alpha, speed, torque, time, damage in zip(spectra.names(cycle), *values, strict=True):
        operation = f"{np.degrees(alpha):.4g} deg", f"{speed * 30 / np.pi:.4g} rpm", f"{torque:.4g} N m"
        rows.append((name, *operation, text.percent(time), text.percent(damage)))
    typer.echo(text.align(rows))
    share, rest = text.percent(1.0 - cycle.time.sum()), text.percent(max(0.0, 1.0 - cycle.damage.sum()))
    what = f"{rest} of the damage by revolutions (exponent {exponent:g})"
    say(f"left out: {share} of the time in which the shaft turns, with {what}")
    say(f"shares in the study are of the time at the points; the shaft stands still for {text.percent(cycle.standing)}")
    changes = f"their cycles of the torque do {text.percent(cycle.changes)} of the damage of those in the signal"
    others = f", {cycle.left_out} with smaller changes of the torque left out" if cycle.left_out else ""
    say(f"{len(cycle.visits)} visits of the points in {cycle.turns:.4g} revolutions{others}; {changes}")
    say(f"wrote {out}")
    say(f"next: tolstat run {quote(str(out))}")
