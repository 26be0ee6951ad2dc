"""The command line: help, streams, exit codes, and files of every state."""

import inspect
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest

from tests.support import fakes, synthetic
from tests.support.reports import call
from tolstat import cli
from tolstat.campaign import run as campaign
from tolstat.campaign.pool import WorkerDied
from tolstat.cli import LISTED
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import kinds
from tolstat.common.tables import Simulation, Status
from tolstat.display.answer import Answer
from tolstat.store import ResultFile

COMMANDS = tuple(LISTED)
HEAVY = {"numpy", "numba", "pandas", "pint", "matplotlib", "h5py", "scipy"}


def unwrapped(text):
    """Prose with lines that were broken at 80 characters put together again."""
    return re.sub(r"\n {4,}", " ", text)


def shell(*args, **env):
    """Run the command as a user does."""
    command = [sys.executable, "-m", "tolstat", *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, env=os.environ | env, check=False)


def simulate(params, options, **given):
    return Simulation(synthetic.results(len(params)), {})


@pytest.fixture
def study(tmp_path, monkeypatch):
    """Write a study into the current folder and put a solver in place that invents its results."""
    monkeypatch.chdir(tmp_path)
    fakes.replace_functions(monkeypatch, **fakes.SOLVER | {"simulate_rows": simulate})
    path = tmp_path / "small.toml"
    path.write_text(synthetic.STUDY, encoding="utf-8")
    return path


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_every_option_explained(command):
    done = call(*command.split(), "--help")
    assert done.exit_code == 0
    text, options = done.stdout.split("Options:")
    lines = [line for line in options.splitlines() if line.startswith("  --")]
    for line in lines:
        assert re.search(r"--[\w-]+( \S+)?( / --[\w-]+)?\s{2,}\S", line + "  ." * line.endswith("report")), line
    assert text.startswith(f"Usage: tolstat {command} [OPTIONS]")
    assert len(text.strip().splitlines()) >= 3
    (example,) = re.findall(rf"^  Example: tolstat {command}\b(.*)$", text, flags=re.MULTILINE)
    assert set(re.findall(r"--[\w-]+", example)) <= set(re.findall(r"--[\w-]+", options))


@pytest.mark.parametrize("command", COMMANDS)
def test_the_line_of_a_command_in_the_help_is_the_first_of_its_docstring(command):
    summary = inspect.getdoc(cli.function_of(command)).partition("\n")[0]
    assert LISTED[command] in (summary, "")


def test_help_is_light():
    code = (
        "import sys\nfrom tolstat.cli import app\n"
        "try:\n    app(['--help'])\nexcept SystemExit:\n    pass\n"
        f"print(sorted({HEAVY!r} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.strip() == "[]"
    assert "Monte Carlo" in done.stdout


@pytest.mark.parametrize("args", [["--help"], ["run", "--help"], ["bogus"]])
def test_no_color_is_respected(args):
    done = shell(*args, NO_COLOR="1", FORCE_COLOR="", TERM="xterm-256color")
    assert "\x1b" not in done.stdout + done.stderr


@pytest.mark.parametrize("args", [["bogus"], ["status"], ["run", "x.toml", "--n", "few"], ["export", "x.h5"]])
def test_wrong_usage_is_exit_code_2_on_stderr(args):
    done = call(*args)
    assert done.exit_code == 2
    assert done.stdout == ""
    assert "Error" in done.stderr


@pytest.mark.parametrize("args", [["status"], ["report"], ["export", "--csv", "-"]])
@pytest.mark.parametrize("content", [None, "not HDF5"])
def test_unusable_file_is_exit_code_2_with_a_remedy(tmp_path, args, content):
    path = tmp_path / "file.h5"
    if content is not None:
        path.write_text(content)
    done = call(args[0], path, *args[1:])
    assert done.exit_code == 2
    assert done.stdout == ""
    assert done.stderr.startswith(f"error: {path}")
    assert "hint: " in done.stderr


@pytest.mark.parametrize("command", ["run", "simulate"])
def test_malformed_input_is_exit_code_2_and_leaves_no_file(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    text = synthetic.STUDY.replace('"15 deg"', '"15 kg"').replace("speed", "sped")
    if command == "simulate":
        text = text.split("[tolerances]")[0]
    Path("bad.toml").write_text(text, encoding="utf-8")
    done = call(command, "bad.toml")
    assert done.exit_code == 2
    assert "operation.alpha" in done.stderr
    assert done.stderr.count("hint: ") >= 2
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]


@pytest.mark.parametrize(("simulated", "pending"), [(0, 61), (21, 40), (None, 0)])
def test_status_of_a_file_in_any_state(tmp_path, simulated, pending):
    path = synthetic.store(tmp_path, simulated=simulated, failed=2, unsettled=1)
    done = call("status", path, "--json")
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert (found["study"], found["joints"], found["pending"]) == ("small", 61, pending)
    assert sum(found[state.label] for state in Status) == 61
    if simulated is None:
        assert (found["newton_failed"], found["not_settled"]) == (2, 1)
    head, _, table = call("status", path).stdout.partition("\n\n")
    shares = found.pop("exceedance")
    head = unwrapped(head)
    lines = head.splitlines()
    counts = [f"{state.label}: {found[state.label]}" for state in Status if found[state.label]]
    assert lines[: 2 + len(counts)] == ["study: small", "joints: 61", *counts]
    assert lines[2 + len(counts)] == "running: no"
    assert found["running"] is False
    assert "damaged" not in found
    if simulated is None:
        assert set(found["causes"]) == {"newton_failed", "not_settled"}
        assert "2 joints newton_failed: a step failed" in head
        assert f"  hint, for row 58: {found['causes']['newton_failed']['remedy']}" in lines
    lines_of = {name: line for line in table.splitlines()[1:] for name in line.split("  ")[0].split(", ")}
    assert lines_of.keys() == {share["load"] for share in shares}
    for share in shares:
        valid = share["n"] - share["n_failed"] - share["n_unsettled"]
        assert f" {share['count']} of {valid} " in lines_of[share["load"]]
        assert share["count"] / valid == pytest.approx(share["estimate"], rel=1e-2)
        assert share["lower"] <= share["estimate"] <= share["upper"]
    assert bool(shares) == (simulated != 0)


def test_missing_folders_are_made_for_files_and_not_inside_a_file(tmp_path):
    path, new = synthetic.store(tmp_path), tmp_path / "new" / "folder"
    assert call("export", path, "--csv", new / "all.csv").exit_code == 0
    assert (new / "all.csv").is_file()
    done = call("export", path, "--csv", path / "all.csv")
    assert done.exit_code == 2
    assert f"cannot be written: {path} is no folder" in done.stderr
    assert "hint: " in done.stderr


@pytest.mark.slow
def test_export_into_a_pipe_that_closes_early(tmp_path):
    path = synthetic.store(tmp_path)
    command = f"{sys.executable} -m tolstat export {path} --csv - | head -n 1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert done.stdout.startswith("row,pin1.offset_e")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("simulated", [0, 40])
@pytest.mark.slow
def test_page_of_an_interrupted_campaign_simulates_nothing(tmp_path, monkeypatch, simulated):
    def refuse(*_, **__):
        raise AssertionError("simulated")

    monkeypatch.setattr("tolstat.store.revolutions.simulate_rows", refuse)
    out = tmp_path / "new" / "page.html"
    done = call("report", synthetic.store(tmp_path, simulated=simulated), "--out", out)
    assert done.exit_code == 0, done.stderr
    assert "has pending joints" in done.stderr
    assert f"{max(simulated - 1, 0)} joints (random sampling)" in out.read_text(encoding="utf-8")


def test_what_a_command_tells(tmp_path):
    path, log = synthetic.store(tmp_path, simulated=40), tmp_path / "logs" / "tolstat.log"
    quiet = call("export", path, "--csv", tmp_path / "a.csv", "--quiet", "--log", log)
    assert (quiet.exit_code, quiet.stdout, quiet.stderr) == (0, "", "")
    lines = log.read_text(encoding="utf-8").splitlines()
    assert all(re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ (INFO|DEBUG) ", line) for line in lines)
    assert lines[-2].endswith(f" INFO wrote {tmp_path / 'a.csv'}: 60 joints")
    assert re.search(r" DEBUG export: \d+\.\d\d s$", lines[-1])
    loud = call("export", path, "--csv", tmp_path / "a.csv", "--verbose", "--log", log)
    assert re.search(r"^export: \d+\.\d\d s$", loud.stderr, flags=re.MULTILINE)
    assert len(log.read_text(encoding="utf-8").splitlines()) == 2 * len(lines)
    failed = call("status", tmp_path / "none.h5", "--quiet", "--log", log)
    assert failed.exit_code == 2
    assert failed.stderr.startswith(f"error: {tmp_path / 'none.h5'}")
    assert " ERROR error: " in log.read_text(encoding="utf-8")


def test_options_of_every_command_are_refused_with_a_remedy(tmp_path):
    path = synthetic.store(tmp_path)
    for options in (["--quiet", "--verbose"], ["--log", path / "a.log"]):
        done = call("status", path, *options)
        assert (done.exit_code, done.stdout) == (2, "")
        assert "hint: " in done.stderr


def test_an_option_means_the_same_in_all_commands():
    meaning = {}
    for command in COMMANDS:
        options = call(*command.split(), "--help").stdout.split("Options:")[1]
        for name, metavar in re.findall(r"^  (--[\w-]+)(?: ([A-Z|a-z.:=]+))?  ", options + "  ", flags=re.MULTILINE):
            meaning.setdefault(name, set()).add(metavar)
    for name in ("--by", "--workers", "--seed", "--study", "--json", "--wide", "--quiet", "--verbose", "--log"):
        assert len(meaning[name]) == 1, (name, meaning[name])
    assert meaning["--by"] == {"LOAD"}
    assert meaning["--json"] == {""}
    assert meaning["--out"] <= {
        "CSV",
        "FILE",
        "DIR",
        "STUDY",
        "OUT",
        "PICTURE",
        "JSON",
        "DIR|PAGE.html",
        "DIR|STUDY.toml",
        "",
    }


@pytest.mark.slow
def test_commands_run_without_docstrings_or_say_why_not(tmp_path):
    path = synthetic.store(tmp_path)
    done = shell("capability", path, PYTHONOPTIMIZE="2")
    assert (done.returncode, done.stdout) == (0, shell("capability", path).stdout)
    for command in ("causes", "plan", "rare", "compare"):
        assert shell(command, "--help", PYTHONOPTIMIZE="2").returncode == 0
    done = shell("new", tmp_path / "a.toml", PYTHONOPTIMIZE="2")
    assert (done.returncode, list(tmp_path.glob("a.*"))) == (2, [])
    assert "python -OO: leaves out the texts" in done.stderr
    done = shell("docs", "study.schema.json", PYTHONOPTIMIZE="2")
    assert (done.returncode, done.stdout) == (2, "")
    assert "python -OO: leaves out the texts" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["latin-1", "cp1252", "ascii"])
def test_output_in_an_encoding_without_some_characters(encoding):
    done = subprocess.run(
        [sys.executable, "-m", "tolstat", "docs", "study"],
        capture_output=True,
        check=True,
        env=os.environ | {"PYTHONIOENCODING": encoding},
    )
    assert not done.stderr
    shown = done.stdout.decode(encoding)
    assert len(shown) > 1000
    assert re.search(r"\\u[0-9a-f]{4}", shown)


def test_completion_knows_the_commands_and_loads_nothing_heavy():
    code = (
        "import sys\nfrom tolstat.cli import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        f"print(sorted({HEAVY!r} & set(sys.modules)), file=sys.stderr)"
    )
    asked = {"_TOLSTAT_COMPLETE": "complete_bash", "COMP_WORDS": "tolstat re", "COMP_CWORD": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ | asked
    )
    assert done.stdout.split() == ["replay", "report"]
    assert done.stderr.strip() == "[]"


def test_run_says_why_joints_have_no_load_and_how_to_try_again(study, monkeypatch):
    """As `run` sees a finished campaign with two kinds of joints without a load."""
    path = synthetic.store(study.parent, failed=3, unsettled=1)
    with ResultFile.open(path) as store:
        counts = store.counts()
    monkeypatch.setattr(campaign, "run", lambda *_, **__: counts)
    first, exact, *told = unwrapped(call("run", "small.toml", "--no-report").stderr).splitlines()
    assert first == "small: shafts rigid along their axes; contact law mode"
    assert exact.startswith("no tolerance, taken as exact: pin positions along e and z, pin angles")
    assert told[0] == "small.h5: 61 joints, 3 failed, 1 not settled"
    assert told[1].startswith("3 joints newton_failed: ")
    assert told[2].startswith("  hint, for row 57: failed at step 0 (")
    assert told[3].startswith("1 joint not_settled: ")
    again = "again: tolstat run small.toml --out small.h5 --retry"
    assert told[5] == f"{again} newton_failed --set solver.steps_per_rev=720"
    assert told[6].startswith(f"{again} not_settled --set solver.max_revs=")
    assert told[7] == "next: tolstat report small.h5 --out small.html"


@pytest.mark.parametrize(("option", "checks"), [("--verify", True), ("--no-verify", False)])
def test_run_checks_the_numerical_error_by_default(study, monkeypatch, option, checks):
    told, run = [], campaign.run
    monkeypatch.setattr(campaign, "run", lambda *a, check=True, **k: told.append(check) or run(*a, **k))
    assert call("run", study, "--workers", 1, "--no-report", option).exit_code == 0
    assert told == [checks]


@pytest.mark.slow
def test_another_number_of_joints_is_an_extension_of_the_file(study):
    call("run", study, "--n", 5, "--workers", 1, "--no-report")
    before = Path("small.h5").read_bytes()
    more = call("run", study, "--workers", 1)
    assert more.exit_code == 2
    assert more.stderr == (
        "small: shafts rigid along their axes; contact law mode\n"
        "no tolerance, taken as exact: pin positions along e and z, pin angles, pin\n"
        "    diameters, hole positions, hole angles, hole diameters\n"
        "error: small.h5: is the result file of this study with 5 joints, not 60\n"
        "  hint: simulate more of its joints: tolstat extend small.h5 --n 60\n"
    )
    fewer = call("run", study, "--n", 3, "--workers", 1)
    assert "hint: read it as it is: tolstat report small.h5, or give another file: --out OTHER.h5" in fewer.stderr
    assert Path("small.h5").read_bytes() == before


def test_interrupted_run_says_how_to_resume(study, monkeypatch):
    path = synthetic.store(study.parent, simulated=20)
    with ResultFile.open(path) as store:
        counts = store.counts()

    def stopped(*_, **__):
        raise campaign.Interrupted(path, counts)

    monkeypatch.setattr(campaign, "run", stopped)
    done = call("run", study)
    assert (done.exit_code, done.stdout) == (130, "")
    assert "small.h5 holds the results of 20 of 61 joints" in done.stderr


def test_ctrl_c_anywhere_else_is_130(study, monkeypatch):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(campaign, "run", stopped)
    assert call("run", study).exit_code == 130


def test_dead_worker_is_no_fault_of_the_input(study, monkeypatch):
    def died(*_, **__):
        raise WorkerDied("a worker was killed")

    monkeypatch.setattr(campaign, "run", died)
    done = call("run", study)
    assert done.exit_code == 1
    assert "a worker was killed" in done.stderr


def simulated(status, load):
    """Make a stand-in for a simulated case."""
    change = None if load is None else 0.5
    loads = {
        name: {"unit": "N", "joint": load, "without_errors": 1.0, "change": change}
        for name in kinds(CARDAN)["F"].places
    }
    facts = {"status": status, "status_without_errors": "ok", "closure": load, "max": loads}
    trace = pd.DataFrame({"theta": [0.0, 180.0], "tau": [1.0, 0.1 + 0.2]})
    return SimpleNamespace(summary=lambda: facts, to_pandas=lambda: trace, remedy=lambda: "try more")


@pytest.fixture
def case(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(synthetic.STUDY.partition("[tolerances]")[0], encoding="utf-8")
    return path


def test_simulate_of_a_joint_that_fails_is_data_with_a_warning(case, monkeypatch):
    monkeypatch.setattr("tolstat.campaign.replay.simulate_case", lambda _: simulated("newton_failed", None))
    monkeypatch.setattr("tolstat.report.parts.of_case", lambda *_: Answer("simulate", "Joint", []))
    done = call("simulate", case)
    assert done.exit_code == 0
    assert done.stdout.splitlines()[-1].split() == ["fork4", "N", "-", "1", "-"]
    assert "warning: newton_failed: a step failed" in done.stderr
    assert "hint: try more" in done.stderr


@pytest.mark.parametrize("command", ["simulate", "plan", "run"])
@pytest.mark.slow
def test_probable_mistakes_are_warnings(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tolstat.campaign.replay.simulate_case", lambda _: simulated("ok", 1.5))
    monkeypatch.setattr("tolstat.report.parts.of_case", lambda *_: Answer("simulate", "Joint", []))
    text = synthetic.STUDY.replace("n = 60", "n = 2").replace("[operation]", 'cross.r_b = "10 mm"\n[operation]')
    if command == "simulate":
        text = text.partition("[tolerances]")[0]
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    done = call(command, "own.toml", *(["--no-verify", "--no-report", "--workers", 1] if command == "run" else []))
    assert done.exit_code == 0, done.stderr
    assert done.stderr.count("warning: own.toml: joint.cross.r_b: 10 mm is less than half of pin.d") == 1
    assert "hint: give pin.l, from the hub" in done.stderr


@pytest.mark.parametrize("arguments", [("simulate", "--out"), ("export", "--csv")])
def test_no_output_replaces_its_input(tmp_path, arguments):
    command, option = arguments
    path = tmp_path / "given"
    path.write_text("precious")
    ended = call(command, path, option, path)
    assert ended.exit_code == 2
    assert "it is the input" in ended.stderr
    assert path.read_text() == "precious"


def test_a_folder_as_output_is_refused_before_the_work(tmp_path):
    (tmp_path / "file").touch()
    for target, word in ((tmp_path, "is a folder"), (tmp_path / "file" / "t.csv", "is no folder")):
        ended = call("simulate", tmp_path / "case.toml", "--out", target)
        assert ended.exit_code == 2
        assert word in ended.stderr
