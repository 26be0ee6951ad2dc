"""``tolstat docs`` and ``cache``: documents in the terminal, and compiled kernels."""

from __future__ import annotations

import re
import sys
import textwrap
from pathlib import Path
from typing import Annotated

from tolstat.cli._library import schemas
from tolstat.cli._shared import WIDTH, echo, print_json, say
from tolstat.common.errors import input_error
from tolstat.common.files import docs_dir
from tolstat.common.strict import did_you_mean
from tolstat.display.options import Opt
from tolstat.kernel.simd import cache_folder

PAGE_WIDTH = 100
"""Maximum width of a page in the terminal, characters."""


def docs(page: Annotated[str | None, Opt("PAGE")] = None) -> None:
    """Print a page of the documents, or a JSON schema.

    Without PAGE, prints the names of all. PAGE is study (all keys of study and joint files), tolerances, tutorial,
    model, report, or the name of a command, such as causes; or the schema study.schema.json, joint.schema.json or
    case.schema.json. Editors with Taplo or Tombi complete and check keys by the schema that a TOML file names in its
    first line: #:schema ./study.schema.json

    Example: tolstat docs study

    Parameters
    ----------
    page : str, optional
        Page or schema to print, such as study; without it: the names of all, with their titles.
    """
    texts = {name: _plain(file.read_text(encoding="utf-8")) for name, file in pages().items()}
    kinds = {f"{kind}.schema.json": kind for kind in schemas.KINDS}
    if page in kinds and sys.flags.optimize > 1:
        raise input_error("python -OO", "leaves out the texts of the schema", "print it without -OO")
    if page in kinds:
        print_json(schemas.schema(kinds[page]))
    elif page is not None and page_name(page) in texts:
        _print_page(texts[page_name(page)])
    elif page is not None:
        raise input_error(page, "is not a page", did_you_mean(page, [*texts, *kinds]))
    else:
        titles = {name: text[text.index("# ") + 2 :].partition("\n")[0] for name, text in texts.items()}
        titles |= {name: f"JSON schema of a {kind}, for editors" for name, kind in kinds.items()}
        width = max(map(len, titles))
        for name, title in titles.items():
            indent = " " * (width + 2)
            echo(textwrap.fill(title, WIDTH, initial_indent=f"{name:{width}}  ", subsequent_indent=indent))
        say("next: tolstat docs study")


def pages() -> dict[str, Path]:
    """Text of each page by its name; pages of questions have the name of their command."""
    folder = docs_dir()
    files = [*sorted(folder.glob("*.md")), *sorted((folder / "questions").glob("*.md"))]
    return {page_name(file.name): file for file in files}


def page_name(file: str) -> str:
    """Name of a page: that of its file without the ending, as commands are spelt."""
    return file.removesuffix(".md").replace("_", "-")


def _print_page(text: str) -> None:
    if not sys.stdout.isatty():
        echo(text)
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
        echo(f"{folder}: {files} kernels, {size / 1e6:.1f} MB")
    say(f"in use: {cache_folder.CACHE_DIRECTORY}")
