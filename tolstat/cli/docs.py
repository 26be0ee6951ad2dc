"""``tolstat docs``: the documentation site of a clone."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import typer

from tolstat.cli._talk import say

BUILT = Path("build", "docs", "docs", "index.html")
"""First page of the built site, from the root of a clone."""
BUILD = (
    'python3 -m venv .venv && .venv/bin/pip install --quiet -e ".[docs,fatigue]"',
    ".venv/bin/sphinx-build -q -c docs . build/docs",
)


def docs() -> None:
    """Open the documentation in the browser.

    Opens the site that was built in a clone of the repository: the clone that tolstat was installed from with -e, or
    that around the current folder. Prints its path, or else the two commands that build it.

    Example: tolstat docs
    """
    clone = find_clone([Path(__file__).parents[2], Path.cwd(), *Path.cwd().parents])
    if clone is None:
        say("the documentation is the folder docs/ of the repository, not part of the installed package")
        say("next: call tolstat docs inside a clone of it, to open the pages or to see how to build them")
        return
    page = clone / BUILT
    if page.exists():
        typer.echo(page)
        if not webbrowser.open(page.as_uri()):
            say("no browser was found: open this file in one")
        return
    say(f"the pages are not built yet; they can be read as text from {clone / 'docs' / 'index.md'}")
    say(f"next, in {clone}: these two commands (some minutes), then tolstat docs")
    for command in BUILD:
        typer.echo(command)


def find_clone(folders: list[Path]) -> Path | None:
    """Return the first folder that is a clone of the repository.

    Parameters
    ----------
    folders : list of Path
        Folders to look at.

    Returns
    -------
    Path or None
    """
    return next((folder for folder in folders if _is_clone(folder)), None)


def _is_clone(folder: Path) -> bool:
    return (folder / "docs" / "conf.py").is_file() and (folder / "tolstat" / "cli" / "docs.py").is_file()
