"""The report as one page: its figures against counts by hand, every state of a campaign, the same bytes each time."""

import base64
import hashlib
import re
from collections import Counter
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from unittest import mock

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.support import exceedance, synthetic
from tests.support.cells import body
from tolstat.cli import app
from tolstat.common.errors import StoreError
from tolstat.common.tables import Status
from tolstat.display import blocks
from tolstat.display import html as writer
from tolstat.display.answer import Asked
from tolstat.display.blocks import Section, Sentence
from tolstat.display.html import bound, grouped
from tolstat.display.table import Table
from tolstat.questions import accuracy, joints
from tolstat.questions.exceedance import rows
from tolstat.report import headline, page
from tolstat.store import Reader, ResultFile, revolutions
from tolstat.store.recorded import recall
from tolstat.store.worst import MAX_LISTED

HEAD = '# Question: how often is too much\n#   too much?\n# Run time: none.\n# <script>alert("no")</script>\n'
TEXT = HEAD + synthetic.WHOLE.replace("n = 60", "n = 400").replace("40 N*m", "18 N*m").replace(
    "offset_t", "offset_[tz]"
)
VOID = {"meta", "link", "input", "br"}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return synthetic.store(tmp_path_factory.mktemp("page"), TEXT, failed=15, unsettled=12)


@pytest.fixture(scope="module")
def view(path):
    with ResultFile.open(path) as store:
        yield store.view()


@pytest.fixture(scope="module")
def html(path):
    page.write_page(path, path.with_suffix(".html"), accepted=0.05, replay=0)
    return path.with_suffix(".html").read_text(encoding="utf-8")


class Reading(HTMLParser):
    """Checks that every element is closed where it must be; keeps names, links, and texts by element."""

    def __init__(self, text):
        super().__init__()
        self.open, self.names, self.links, self.sections, self.pictures = [], [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        own = dict(attrs)
        self.names += [own["id"]] if "id" in own else []
        self.links += [own[key] for key in ("href", "src", "xlink:href") if key in own]
        self.sections += [own["id"]] if tag == "section" else []
        self.pictures += [own] if tag == "svg" else []
        self.open += [] if tag in VOID else [tag]

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def among(sections, wanted):
    """Whether the sections wanted are there, in this order; questions may add others."""
    return [section for section in sections if section in wanted] == wanted


def test_page_is_well_formed_and_loads_nothing(html):
    read = Reading(html)
    assert len(set(read.names)) == len(read.names)
    assert all(link.startswith(("#", "data:")) for link in read.links)
    assert {link[1:] for link in read.links if link.startswith("#")} <= set(read.names)
    assert not re.search(r"@import|url\((?!#)|fetch\(|XMLHttp", html)
    assert among(
        read.sections,
        [
            "verdict",
            "limits",
            "exceedance",
            "failed",
            "quantiles",
            "capability",
            "causes",
            "worst",
            "modes",
            "provenance",
        ],
    )


def test_every_picture_has_a_title_and_a_description(html):
    pictures = Reading(html).pictures
    assert len(pictures) > 8
    for own in pictures:
        assert own["role"] == "img"
        for name in own["aria-labelledby"].split():
            assert re.search(rf'id="{name}">[^<]{{10,}}<', html), name


@pytest.mark.parametrize("replay", [pytest.param(0, marks=pytest.mark.slow), 100])
def test_each_value_of_the_file_is_read_once_for_a_page(path, tmp_path, monkeypatch, replay):
    """Reads of each dataset, in rows; joints that the page draws over the revolution are simulated again.

    Of the nominal joint and of the first twelve joints without a load all columns are read, of the others those of
    loads that the page has; each column is read together with the status.
    """
    read, plain = Counter(), Reader.column

    def counting(self, group, name, rows):
        values = plain(self, group, name, rows)
        read[f"{group}/{name}"] += len(values)
        return values

    monkeypatch.setattr(Reader, "column", counting)
    monkeypatch.setattr(revolutions, "read", drawn)
    monkeypatch.setattr(revolutions, "ahead", lambda *_: None)
    opened = mock.Mock(side_effect=Reader.open)
    monkeypatch.setattr(Reader, "open", opened)
    recalled = mock.Mock(side_effect=recall)
    monkeypatch.setattr("tolstat.store.view.recall", recalled)
    page.write_page(path, tmp_path / "page.html", accepted=0.05, replay=replay)
    tables = {name: rows for name, rows in read.items() if name.startswith(("results/", "errors/"))}
    assert len(tables) > 150
    del tables["results/status"]
    assert {
        name: rows for name, rows in tables.items() if rows not in ((400,) if "errors/" in name else (13, 413))
    } == {}
    assert (opened.call_count, recalled.call_count) == (1, 1)


def test_two_processes_give_the_same_bytes(path, html, tmp_path):
    page.write_page(path, tmp_path / "page.html", accepted=0.05, replay=0, processes=2)
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == html


@pytest.mark.slow
def test_joints_are_simulated_again_once_in_any_number_of_processes(path, tmp_path, monkeypatch):
    pages, plain = [], revolutions._simulated
    for processes in (1, 2):
        record = tmp_path / f"slots_{processes}"  # in a file, since forks of this process simulate

        def recorded(store, slots, record=record):
            with record.open("ab") as stream:
                stream.write(slots.astype(np.int64).tobytes())
            return plain(store, slots)

        monkeypatch.setattr(revolutions, "_simulated", recorded)
        page.write_page(path, tmp_path / "page.html", accepted=0.05, replay=300, processes=processes)
        slots = np.fromfile(record, np.int64)
        assert len(slots) == len(np.unique(slots)) >= 300
        pages.append((tmp_path / "page.html").read_bytes())
    assert b"simulated again" in pages[0]
    assert pages[0] == pages[1]


def drawn(store, slots, names, most_angles=60):
    """Stands for `revolutions.read`: loads without a simulation."""
    loads = {name: 600.0 + np.random.default_rng(5).normal(size=(len(slots), most_angles)) for name in names}
    angles = 2.0 * np.pi * np.arange(most_angles) / most_angles
    return revolutions.Revolutions(angles, loads, "simulated again", 0.0)


def test_colours_of_the_pictures_follow_the_scheme(html):
    pictures = re.findall(r"<svg.*?</svg>", html, flags=re.DOTALL)
    used = set(re.findall(r"var\(--(\w+)\)", "".join(pictures)))
    assert used > {"ink", "line1", "grid"}
    assert not [found for picture in pictures for found in re.findall(r"#[0-9a-fA-F]{6}", picture)]
    light, dark = html.split("prefers-color-scheme: dark")[:2]
    for name in used:
        assert f"--{name}: #" in light
        assert f"--{name}: #" in dark


def test_other_bushings_and_the_band_of_the_whole_curve_are_drawn_on_switches(view, html):
    drawn = re.search(r"<figure data-reads=\"cross1.F,.*?</figure>", html, flags=re.DOTALL)[0]
    for name, count in (("others", 7), ("curve-band", 2)):
        assert re.search(rf'<input type="checkbox" class="show-{name}" id="([^"]+)"><label for="\1">', drawn)
        assert drawn.count(f'class="{name}"') == count


def test_folded_sections_stand_below_the_others_and_open_where_all_is_asked_for(path, tmp_path, monkeypatch):
    found = [Section("one", "One", folded=True), Section("two", "Two")]
    monkeypatch.setattr("tolstat.report.page.sections_of", lambda view, asked: list(found))
    for full in (False, True):
        page.write_page(path, tmp_path / "page.html", full=full)
        made = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert Reading(made).sections == ["verdict", "two", "one", "provenance"]
        assert made.count('<details class="fold" open>') == full
        assert made.count('<details class="fold') == 1


def test_a_brief_page_has_the_verdict_and_the_line_to_change(path, tmp_path):
    page.write_page(path, tmp_path / "page.html", accepted=0.05, brief=True)
    read = Reading((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert read.sections == ["verdict", "lines", "provenance"]


def test_text_of_the_study_is_shown_and_not_run(html):
    assert '<script>alert("no")' not in html
    assert "&lt;script&gt;alert(" in html
    assert "Question: how often is too much too much?<" in html


def test_names_and_comments_are_escaped_and_unseen_characters_shown(tmp_path, monkeypatch):
    monkeypatch.setattr("tolstat.report.page.sections_of", lambda view, asked: [])
    text = "# Question: \u202ewhy</p><script>1</script>\n" + TEXT
    path = synthetic.store(tmp_path, text, name="""a"b'<script>c&\u202d""")
    page.write_page(path, tmp_path / "page.html", replay=0)
    made = (tmp_path / "page.html").read_text(encoding="utf-8")
    Reading(made)
    assert "<h1><bdi>a&#34;b&#39;&lt;script&gt;c&amp;[U+202D]</bdi>" in made
    assert "Question: [U+202E]why&lt;/p&gt;&lt;script&gt;1&lt;/script&gt;<" in made
    assert not {"\u202d", "\u202e"} & set(made)


def test_only_the_script_of_the_page_may_run(html):
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]+)"', html)[1]
    assert policy.startswith("default-src &#39;none&#39;; ")
    (script,) = re.findall(r"<script>(.*?)</script>", html, flags=re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert unescape(policy).endswith(f"script-src 'sha256-{digest}'")


def test_digits_are_grouped_in_whole_numbers_only():
    assert grouped("73310 of 999999 ppm") == "73\u202f310 of 999\u202f999 ppm"
    assert grouped("1234 0.12345 a12345 12345e3") == "1234 0.12345 a12345 12345e3"


def test_a_number_stays_with_its_unit_and_an_interval_on_one_line():
    assert bound("60 N m in 3 % (1 .. 4 %), 5 joints") == (
        "60\u00a0N\u00a0m in 3\u00a0% (1\u00a0..\u00a04\u00a0%), 5 joints"
    )
    assert bound("< 1e-07 %") == "<\u00a01e-07\u00a0%"
    assert bound("0.1 mm 5 min of 5 minutes N") == "0.1\u00a0mm 5\u00a0min of 5 minutes N"


def test_a_small_numerical_error_is_not_given_in_digits():
    assert accuracy.in_percent(9.5e-7) == "< 0.001 %"
    assert accuracy.in_percent(1.08e-3) == "0.108 %"


@pytest.mark.slow
def test_same_file_same_bytes(path, tmp_path):
    contents = []
    for k in (0, 1):
        with ResultFile.open(path) as store:
            made = page.compose(store.view(), Asked(path, 0.05))
        some = [part for part in made.sections if part.key in ("capability", "modes", "provenance")]
        writer.write(replace(made, sections=some), tmp_path / f"{k}.html")
        contents.append((tmp_path / f"{k}.html").read_bytes())
    assert contents[0] == contents[1]


def test_limits_and_their_verdicts_stand_on_the_page(view, html):
    for name, level in view.limits.items():
        share = exceedance.exceedance(view.load(name).values, view.status, level)
        assert f"{share.count} of {share.n - share.n_failed - share.n_unsettled}" in html
        assert f"{100 * share.estimate:.3g} %" in html
        if share.outer_lower > 0.05:
            assert ">not kept<" in html


@pytest.mark.parametrize(("low", "high", "answer"), [(0.01, 0.05, "yes"), (0.04, 0.06, "open"), (0.051, 0.2, "no")])
def test_a_limit_is_kept_when_the_whole_interval_is_below_what_is_accepted(low, high, answer):
    counted = {"n": 100, "n_failed": 0, "n_unsettled": 0, "count": 4, "bound_lower": 0.04, "bound_upper": 0.04}
    wide = counted | {"outer_lower": 0.03, "outer_upper": 0.04, "total_lower": low, "total_upper": high}
    assert rows.verdict(wide, 0.05) == answer
    narrow = counted | {"outer_lower": low, "outer_upper": high, "total_lower": np.nan, "total_upper": np.nan}
    assert rows.verdict(narrow, 0.05) == answer
    assert rows.verdict(narrow, np.nan) == ""
    assert rows.verdict(narrow | {"outer_lower": np.nan, "outer_upper": np.nan}, 0.05) == "none"


def test_reader_holds_the_shares_that_are_counted(view, html):
    assert f"<option selected>{headline.headline(view, 0.05).load}</option>" in html
    curves = rows.readings(view)
    assert list(curves) == [*view.bushing_loads, "pin1.contact", "psi"]
    status = view.status
    for name, curve in curves.items():
        values = view.load(name).values
        assert 100 < len(curve["x"]) <= 3 * rows.READER_LEVELS
        assert curve["x"][curve["start"]] == view.limits.get(name, curve["x"][curve["start"]])
        for i in (0, 7, curve["start"], -1):
            share = exceedance.exceedance(values, status, curve["x"][i])
            assert curve["count"][i] == share.count
            assert curve["lower"][i] == pytest.approx(share.lower, rel=5e-3, abs=1e-12)
            assert curve["outer_upper"][i] == pytest.approx(share.outer_upper, rel=5e-3)


@pytest.mark.parametrize(
    ("limits", "name"), [({"pin1.contact": 605}, "pin1.contact"), ({"cross3.F": 1000}, "cross1.F")]
)
def test_reader_begins_with_the_limit_that_the_verdict_names(tmp_path, limits, name):
    """Of a load that no table shows, or of the one limit that joints exceed."""
    lines = "".join(f'"{load}" = "{limit} N"\n' for load, limit in ({"cross1.F": 700} | limits).items())
    text = re.sub(r"(?<=\[limits\]\n)[^\[]*", f"{lines}\n", TEXT)
    path = synthetic.store(tmp_path, text)
    with ResultFile.open(path) as store:
        view = store.view()
        assert headline.headline(view, 0.05).load == name
        made = page.compose(view, Asked(path, 0.05))
    (reader,) = (block for section in made.sections for block in section.blocks if isinstance(block, blocks.Reader))
    assert reader.start == name


def test_joints_without_a_load_are_named_with_what_to_do_and_compared_with_the_others(view):
    assert view.count(Status.NEWTON_FAILED) == 15
    assert view.count(Status.NOT_SETTLED) == 12
    found = joints.without_load(view)
    assert len(found) == MAX_LISTED
    assert {joint["row"] for joint in found} <= set(range(401 - 27, 401))
    assert all(joint["remedy"] for joint in found)
    rows = joints.their_errors(view)
    assert list(rows[0])[:2] == ["error", "direction"]
    assert min(row["direction_p"] for row in rows) > 0.01  # they are the last rows: chance
    answer = joints.failed(view)
    assert answer.frame("first")["row"].tolist() == [joint["row"] for joint in found]
    assert answer.frame("states").set_index("status")["joints"][Status.NEWTON_FAILED.label] == 15


def test_leading_load_is_the_one_whose_limit_most_joints_exceed(view):
    assert view.leading[0] == "cross1.F"
    torques = {f"fork{i}.T": view.load(f"fork{i}.T").above(18.0).estimate for i in (1, 2, 3, 4)}
    assert torques[view.leading[1]] == max(torques.values()) > min(torques.values())


def words(path, accepted=np.nan):
    """Sections of a page, and its paragraphs and cells, without drawing it."""
    with ResultFile.open(path) as store:
        made = page.compose(store.view(), Asked(path, accepted))
    found = [*made.scene, made.provenance]
    for block in (block for section in made.sections for block in section.blocks):
        found += [block.text] if isinstance(block, Sentence) else []
        found += [cell for row in body(block) for cell in row] if isinstance(block, Table) else []
    return [section.key for section in made.sections], found


@pytest.mark.parametrize("simulated", [0, 31])
@pytest.mark.slow
def test_a_campaign_under_way_has_a_page_that_says_so(tmp_path, simulated):
    path = synthetic.store(tmp_path, simulated=simulated)
    (said,) = (text for text in words(path)[1] if f"{60 - max(0, simulated - 1)} still pending" in text)
    if not simulated:
        assert page.write_page(path, tmp_path / "page.html", replay=0) == tmp_path / "page.html"
        text = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert said in text
        with ResultFile.open(path) as store:
            assert page.write_page(store.view(), tmp_path / "b.html", replay=0).read_text(encoding="utf-8") == text


def test_a_campaign_without_a_valid_joint_has_a_page(tmp_path):
    page.write_page(synthetic.store(tmp_path, failed=40, unsettled=20), tmp_path / "page.html", accepted=0.1, replay=0)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert Reading(text).sections == [
        "verdict",
        "limits",
        "tolerances",
        "failed",
        "drawings",
        "histograms",
        "provenance",
    ]
    assert text.count(">no verdict<") == 6  # of loads whose numbers all agree one row


@pytest.mark.slow
def test_a_sweep_has_its_loads_against_the_swept_value(tmp_path):
    page.write_page(synthetic.store(tmp_path, synthetic.SWEEP, "sweep"), tmp_path / "page.html")
    read = Reading((tmp_path / "page.html").read_text(encoding="utf-8"))
    assert read.sections[:2] == ["verdict", "sweep"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--out", "gone/p.html", "--accept", "much"], "is not a share"),
        (["--out", "p.html", "--accept", "much"], "is not a share"),
        (["--out", "p.html", "--accept", "110 %"], "is not a share"),
        (["--accept", "110 %"], "is not a share"),
    ],
)
def test_wrong_options_write_nothing(path, tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["report", str(path), *arguments])
    assert done.exit_code == 2
    assert said in done.stderr
    assert "hint:" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_sample_has_no_page(tmp_path):
    cases = "[joint]" + synthetic.STUDY.partition("[joint]")[2].partition("[tolerances]")[0]
    cases += '[sampling]\nmethod = "cases"\n\n[[case]]\nname = "one"\nerrors = { pin1.offset_t = "0.1 mm" }\n'
    path = synthetic.store(tmp_path, cases)
    with pytest.raises(StoreError, match="lists its joints one by one"):
        page.write_page(path, tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()
