"""The documents: links and anchors resolve, every page is in the index, every question has a page, examples run."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path

import pytest

import tolstat
from tests.support.environment import ROOT
from tolstat import cli
from tolstat.cli import LISTED
from tolstat.common.cardan import MECHANISMS
from tolstat.questions import PUBLIC, QUESTIONS

DOCS = ROOT / "docs"
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(path for path in DOCS.rglob("*.md") if path.parent.name != "api"),
]
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
IN_PYTHON = [DOCS / "python.md", DOCS / "further.md"]
OF_QUESTIONS = sorted(path.stem for path in (DOCS / "questions").glob("*.md"))
PARTS = ["Intervals", "From Python", "On the page", "Limits of validity"]
"""Headings that each page of a question has, after its commands."""
README = (ROOT / "README.md").read_text(encoding="utf-8")
FENCE = re.compile(r"^```([^\n]*)\n(.*?)^```$", flags=re.DOTALL | re.MULTILINE)
LINK = re.compile(r"\]\(([^()\s]+)\)")


def name(path: Path) -> str:
    """Path of a page from the root of the checkout."""
    return path.relative_to(ROOT).as_posix()


def plain(text: str) -> str:
    """Text of a page without blocks of code and code within lines."""
    return re.sub(r"`[^`\n]*`", "", FENCE.sub("", text))


def anchors(text: str) -> set[str]:
    """Anchors of the headings of a page, as GitHub makes them."""
    found: dict[str, int] = {}
    for heading in re.findall(r"^#+ (.*)$", FENCE.sub("", text), flags=re.MULTILINE):
        title = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        slug = re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")
        found[slug] = found.get(slug, -1) + 1
        if found[slug]:
            found[f"{slug}-{found[slug]}"] = 0
    return set(found)


def blocks(path: Path, language: str) -> list[str]:
    """Blocks of code of a page in one language."""
    return [code for kind, code in FENCE.findall(path.read_text(encoding="utf-8")) if kind == language]


@pytest.mark.parametrize("path", PAGES, ids=name)
def test_links_resolve(path: Path) -> None:
    missing = []
    for link in LINK.findall(plain(path.read_text(encoding="utf-8"))):
        if re.match(r"\w+:", link):
            continue
        file, _, anchor = link.partition("#")
        target = (path.parent / file).resolve() if file else path
        if not target.exists() or (anchor and anchor not in anchors(target.read_text(encoding="utf-8"))):
            missing.append(link)
    assert missing == []


def test_anchors_are_those_of_headings() -> None:
    page = "# One `two` – (three)\n\n```sh\n# no heading\n```\n\n## A [link](b.md)\n## A link\n"
    assert anchors(page) == {"one-two--three", "a-link", "a-link-1"}


def test_pages_that_code_and_studies_name_are_there() -> None:
    files = [path for folder in ("tolstat", "tests", "studies") for path in (ROOT / folder).rglob("*.*")]
    texts = {path: path.read_text(encoding="utf-8") for path in files if path.suffix in (".py", ".toml")}
    named = {(path, page) for path, text in texts.items() for page in re.findall(r"docs/[\w/]+\.md", text)}
    assert [f"{name(path)}: {page}" for path, page in named if not (ROOT / page).exists()] == []


def test_every_page_is_in_the_index() -> None:
    listed = {
        (DOCS / link.partition("#")[0]).resolve() for link in LINK.findall((DOCS / "index.md").read_text("utf-8"))
    }
    assert [
        name(path)
        for path in (*PAGES, *NOTEBOOKS)
        if path.is_relative_to(DOCS) and path != DOCS / "index.md" and path not in listed
    ] == []


def test_every_command_is_in_the_index_and_every_heading_of_the_help_in_the_readme() -> None:
    commands = set(LISTED)
    named = set(re.findall(r"`tolstat ([a-z-]+)[^`]*`", (DOCS / "index.md").read_text("utf-8")))
    assert named - {"COMMAND"} == commands
    headings = re.findall(r"^\| \*\*(.*?)\*\* \|", README, flags=re.MULTILINE)
    assert headings == [*cli.PLAIN]


def test_every_public_name_is_in_the_reference() -> None:
    """Names of questions are listed when the site is built, from their registry."""
    listed = re.findall(r"^   tolstat\.(\w+)$", (DOCS / "api.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert set(tolstat.__all__) - {"__version__"} == {*listed, *PUBLIC}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
def test_a_notebook_is_stored_without_outputs(path: Path) -> None:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    ran = [cell for cell in cells if cell["cell_type"] == "code"]
    assert ran
    assert [cell["id"] for cell in ran if cell["outputs"] or cell["execution_count"] is not None] == []


def test_every_study_is_in_the_gallery_with_a_picture() -> None:
    text = (DOCS / "gallery.md").read_text(encoding="utf-8")
    studies = [path for path in (ROOT / "studies").iterdir() if path.suffix == ".toml" or path.is_dir()]
    sections = text.split("\n## ")[1:]
    assert [
        name(path) for path in studies if f"](../studies/{path.name}" not in text and path.name != "__pycache__"
    ] == []
    assert [section.partition("\n")[0] for section in sections if "\n![" not in section] == []


def test_every_question_has_a_page() -> None:
    """Its own, or that of its file's other questions."""
    names = [{question.name, (question.file or question.name).partition(".")[0]} for question in QUESTIONS]
    assert [of_question for of_question in names if not of_question & set(OF_QUESTIONS)] == []
    assert set(OF_QUESTIONS) <= set().union(*names)


@pytest.mark.parametrize("question", OF_QUESTIONS)
def test_page_of_a_question_has_all_parts(question: str) -> None:
    text = FENCE.sub("", (DOCS / "questions" / f"{question}.md").read_text(encoding="utf-8"))
    headings = re.findall(r"^## (.*)$", text, flags=re.MULTILINE)
    assert headings[0].startswith("Command")
    assert [heading for heading in headings if heading in PARTS] == PARTS


@pytest.mark.parametrize("path", sorted((DOCS / "notes").glob("*.md")), ids=name)
def test_a_note_says_that_it_is_a_record(path: Path) -> None:
    assert path.read_text(encoding="utf-8").startswith("Record of ")


@pytest.mark.parametrize(("page", "added"), [("tolerances.md", "joint"), ("study.md", "sampling")])
def test_blocks_of_the_study_make_a_study(tmp_path: Path, page: str, added: str) -> None:
    """Each block of [tolerances] with all other blocks; correlation and [errors] go with the first one."""
    study = tmp_path / "study.toml"
    sections = {"joint": 'base = "cirelli2021"', "sampling": "n = 8"}
    operation = '[operation]\nalpha = "15 deg"\nspeed = "500 rpm"\ntorque = "100 N*m"\n'
    written = [block for block in blocks(DOCS / page, "toml") if not block.startswith("[shaft")]
    operation = "" if any(block.startswith("[[operation]]") for block in written) else operation
    own = [operation, *written, f"[{added}]\n{sections[added]}"]
    tables = [block for block in own if block.startswith("[tolerances]")]
    for table in tables:
        left_out = "[tolerances]" if table == tables[0] else ("[tolerances]", "[[correlation]]", "[errors]")
        rest = [block for block in own if not block.startswith(left_out)]
        study.write_text("\n".join([table, *rest]), encoding="utf-8")
        assert tolstat.load(study).sampling.n in (8, 1024)
    assert len(tables) >= (3 if page == "tolerances.md" else 1)


def test_the_blocks_of_a_drive_shaft_make_a_study() -> None:
    shaft, joint2 = (block for block in blocks(DOCS / "study.md", "toml") if block.startswith("[shaft"))
    study = tomllib.loads((ROOT / "studies" / "shaft.toml").read_text(encoding="utf-8"))
    for block, radius in ((shaft, None), (f"{shaft}\n{joint2}", 0.05)):
        made = tolstat.load(study | tomllib.loads(block))
        assert made.mechanism == MECHANISMS["splined shaft+thrust+friction+input_bearings+output_bearings"]
        assert (made.operation.joint2 and made.operation.joint2.cross.R) == radius


@pytest.fixture(scope="module")
def folder(example_files: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the study and the files that the examples name, where they may write."""
    made = Path(shutil.copytree(example_files, tmp_path_factory.mktemp("docs") / "examples"))
    shutil.copy(made / "iso2768_f.h5", made / "histories.h5")
    for name in ("clearance", "hard_cases"):
        text = (made / "studies" / f"{name}.toml").read_text(encoding="utf-8")
        head, *variants = text.split("[[variant]]")
        study = made / f"{name}.toml"
        study.write_text("[[variant]]".join([head, *variants[:1]]), encoding="utf-8")
        tolstat.run(tolstat.load(study), made / f"{name}.h5", workers=1, check=False)
    rings = tolstat.load(made / "studies" / "snap_rings.toml", n=8)
    tolstat.run(rings, made / "snap_rings.h5", workers=1, check=False)
    return made


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", [DOCS / "python.md", DOCS / "further.md", *sorted((DOCS / "questions").glob("*.md"))], ids=name
)
def test_examples_run(path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    names: dict[str, object] = {}
    ran = [code for code in blocks(path, "python") if "pylife." not in code]  # pyLife is an optional package
    for code in ran:
        exec(code, names)
    assert ran
