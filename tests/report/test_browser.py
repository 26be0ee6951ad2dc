"""The page in a browser: nothing runs over the edge, nothing is complained of, the reader reads what Python counts."""

import json
import re
import shutil
import subprocess
from html import escape, unescape

import pytest

from tests.report.test_page import TEXT
from tests.support import exceedance, synthetic
from tolstat.display import html
from tolstat.report import page
from tolstat.store import ResultFile

BROWSER = next(
    (found for name in ("chromium", "chromium-browser", "google-chrome") if (found := shutil.which(name))), ""
)
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage"),
)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not BROWSER, reason="no Chromium here: .ci/extras installs it"),
]

PROBE = """
<script>
(() => {
  const part = (name) => document.getElementById("reader-" + name);
  const said = () => part("said").textContent;
  const found = { width: innerWidth, page: document.documentElement.scrollWidth, start: said(), readings: {} };
  const choose = (element, value, kind) => { element.value = value; element.dispatchEvent(new Event(kind)); };
  for (const [name, x] of ASKED) {
    choose(part("load"), name, "change");
    choose(part("x"), x, "change");
    found.readings[name] = [Number(part("x").value), said()];
  }
  choose(part("slider"), 0, "input");
  found.first = said();
  found.cursors = [...document.querySelectorAll(".cursor")].filter((line) => line.style.display !== "none").length;
  const svg = document.querySelector("figure[data-reads^='cross1.F,'] svg"), box = svg.getBoundingClientRect();
  svg.dispatchEvent(new PointerEvent("pointermove", { clientX: box.left + 0.6 * box.width, clientY: box.top + 50 }));
  found.hovered = said();
  found.kept = document.querySelector("#limits td").getBoundingClientRect().right;
  const others = document.querySelector(".show-others"), line = document.querySelector(".others");
  found.others = [getComputedStyle(line).display];
  others.click();
  found.others.push(getComputedStyle(line).display);
  parent.document.getElementById("probe").textContent = JSON.stringify(found);
})();
</script>
"""


def dump(path, folder):
    """Document after its scripts have run, and what the console says."""
    command = [BROWSER, *QUIET, f"--user-data-dir={folder}", "--window-size=1400,900", "--enable-logging=stderr"]
    done = subprocess.run(
        [*command, "--virtual-time-budget=5000", "--dump-dom", path.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def probe(text, asked, folder, width=1280):
    """Put a page into a frame, since windows have a least width; what the probe found in it, and the console.

    The page's policy is kept; it lets the probe run, too.
    """
    script = PROBE.replace("ASKED", json.dumps(asked))
    own = escape(html.allowed(script.partition("<script>")[2].partition("</script>")[0]))
    inside = text.replace("script-src ", f"script-src {own} ").replace("</body>", script + "</body>")
    assert own in inside
    frame = f'<iframe style="border: 0; width: {width}px; height: 900px" srcdoc="{escape(inside)}"></iframe>'
    (folder / "frame.html").write_text(f'<meta charset="utf-8">{frame}<pre id="probe"></pre>', encoding="utf-8")
    document, console = dump(folder / "frame.html", folder / "profile")
    return json.loads(unescape(re.search(r'<pre id="probe">(.*?)</pre>', document)[1])), console


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("browser")
    path = synthetic.store(folder, TEXT, failed=15, unsettled=12)
    page.write_page(path, folder / "page.html", accepted=0.05, replay=0)
    with ResultFile.open(path) as store:
        yield folder / "page.html", store.view()


@pytest.mark.parametrize("width", [1280, 400])
def test_reader_reads_what_is_counted_and_the_page_keeps_its_width(made, tmp_path, width):
    source, view = made
    asked = [["cross1.F", 741.3], ["fork3.T", 18], ["cross2.T", 0]]
    found, console = probe(source.read_text(encoding="utf-8"), asked, tmp_path, width)
    assert console == []
    assert found["width"] == width
    assert found["page"] <= width
    assert found["kept"] <= width
    assert found["others"] == ["none", "inline"]
    status = view.status
    for name, wanted in asked:
        x, said = found["readings"][name]
        load = view.load(name)
        share = exceedance.exceedance(load.values, status, x)
        assert abs(x - wanted) < 5 or wanted == 0
        assert said.startswith(
            f"{100 * share.estimate:.3g} % of the joints exceed {x:g} {load.unit.replace('*', ' ')} on {name}"
        )
        assert f": {share.count} of {share.n - 27}." in said
        assert f"95 % interval {100 * share.lower:.3g} % to {100 * share.upper:.3g} %" in said
        assert f"below and above: {100 * share.outer_lower:.3g} % to {100 * share.outer_upper:.3g} %" in said
    first = view.load(view.most_exceeded)
    assert found["start"].startswith(f"{100 * first.above(first.limit).estimate:.3g} %")
    assert found["first"].startswith("100 % ")
    assert found["cursors"] == 1
    assert "on cross1.F" in found["hovered"]
    assert found["hovered"] != found["start"]


def test_page_without_its_scripts_shows_all_but_the_reader(made, tmp_path):
    bare = tmp_path / "bare.html"
    text = made[0].read_text(encoding="utf-8")
    bare.write_text(re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL), encoding="utf-8")
    document, _ = dump(bare, tmp_path / "profile")
    assert re.search(r'id="reader"[^>]*hidden', document)
    assert document.count("<svg") == text.count("<svg")


def test_the_checks_see_a_page_that_is_too_wide_and_an_error(made, tmp_path):
    wide = '<div style="width: 4000px">x</div><script>missing();</script>'
    text = made[0].read_text(encoding="utf-8").replace("</main>", f"{wide}</main>")
    found, console = probe(text, [], tmp_path)
    assert found["page"] > found["width"]
    assert len(console) == 1
    assert "Content Security Policy" in console[0]


def test_names_with_markup_are_text_and_run_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("tolstat.report.page.sections_of", lambda view, asked: [])
    named = """<img src=x onerror="missing()"> '\u202e<script>missing();"""
    path = synthetic.store(tmp_path, name=named)
    page.write_page(path, tmp_path / "page.html", replay=0)
    document, console = dump(tmp_path / "page.html", tmp_path / "profile")
    assert console == []
    assert re.search(r"<h1><bdi>(.*?)</bdi>", document)[1] == escape(named.replace("\u202e", "[U+202E]"), quote=False)
