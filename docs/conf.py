"""Settings of the documentation site: ``sphinx-build -W -c docs . build/docs`` from the root of a checkout."""

from __future__ import annotations

import os
import re
import runpy
import shutil
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))
os.environ["PYTHONPATH"] = str(ROOT)  # for the commands that notebooks start
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"

project = "tolstat"
author = "The tolstat developers"
root_doc = "docs/index"
include_patterns = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "docs/**"]
exclude_patterns = ["**.ipynb_checkpoints"]
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.viewcode", "numpydoc"]

html_theme = "furo"
html_title = "tolstat"

autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # numpydoc's sections name the types
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_merge_streams = True


def setup(app: Any) -> None:
    """Connect the hook that makes the tree of pages; make the folder for pages of notebooks and README's drawing."""
    app.connect("source-read", add_tree)
    app.connect("source-read", add_estimators)
    pages = Path(app.outdir, "docs")
    pages.mkdir(parents=True, exist_ok=True)
    os.environ["SITE_PAGES"] = str(pages)
    for drawing in (ROOT / "docs").glob("joint*.svg"):  # in HTML of the README, where Sphinx does not see it
        shutil.copy(drawing, pages)
    list_questions(ROOT / "docs" / "api")


def list_questions(folder: Path) -> None:
    """Write the page of the functions of the questions, from their registry, where autosummary writes its pages."""
    public = runpy.run_path(str(ROOT / "tolstat" / "questions" / "__init__.py"))["PUBLIC"]  # autodoc imports tolstat
    folder.mkdir(exist_ok=True)
    listed = "\n".join(f"   tolstat.{name}" for name in public)
    text = f"# Questions\n\n```{{eval-rst}}\n.. autosummary::\n   :toctree: .\n\n{listed}\n```\n"
    (folder / "questions.md").write_text(text, encoding="utf-8", newline="\n")


def add_tree(app: Any, docname: str, source: list[str]) -> None:
    """Add a tree of pages to the index: one branch a heading, with the pages that the section links to."""
    if docname != root_doc:
        return
    branches = []
    for section in re.split(r"^## ", source[0], flags=re.MULTILINE)[1:]:
        caption = section.partition("\n")[0]
        linked = dict.fromkeys(re.findall(r"\]\(([^()\s#]+\.(?:md|ipynb))", section))
        pages = [os.path.normpath(f"docs/{page}").rpartition(".")[0] for page in linked]
        listed = "\n".join(f"/{page}" for page in pages if page in app.env.found_docs)
        branches.append(f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{listed}\n```")
    source[0] += "\n\n" + "\n\n".join(branches) + "\n"


def add_estimators(app: Any, docname: str, source: list[str]) -> None:
    """Add to the page of the estimators a section for each module of `tolstat.analysis`."""
    if docname != "docs/estimators":
        return
    names = sorted(path.stem for path in (ROOT / "tolstat" / "analysis").glob("[!_]*.py"))
    directive = "```{{eval-rst}}\n.. automodule:: tolstat.analysis.{0}\n   :members:\n   :exclude-members: Ends\n```"
    listed = "\n\n".join(f"## analysis.{name}\n\n{directive.format(name)}" for name in names)
    source[0] = source[0].replace("<!-- modules of tolstat.analysis -->", listed)
