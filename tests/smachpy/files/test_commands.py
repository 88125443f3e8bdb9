"""The commands that take, list, write and begin mission files."""

from __future__ import annotations

import subprocess
import sys
from functools import partial

import pytest

from smachpy.command import main
from smachpy.files import MissionFileError, load
from tests.smachpy.files.test_reading import GOOD


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_new_begins_a_file_that_check_finds_good(folder, capsys):
    assert main(["new", "first.yaml"]) == 0
    assert load(folder / "first.yaml").name == "FIRST"
    assert main(["check", "first.yaml"]) == 0
    assert main(["new", "first.yaml"]) == 2
    assert "is there already" in capsys.readouterr().err


def test_run_takes_its_parameters(folder, capsys):
    (folder / "rounds.yaml").write_text(GOOD)
    words = ["run", "rounds.yaml", "--time", "virtual", "--plain", "--input", "seconds=5.0"]
    assert main(words) == 0
    assert "done after 9.00 s" in capsys.readouterr().out


def test_mistakes_are_told_all_at_once_with_their_lines(folder, capsys):
    (folder / "bad.yaml").write_text("outcomes: [done]\nstates: {A: {state: wat}}\nnam: x\n")
    assert main(["run", "bad.yaml"]) == 2
    said = capsys.readouterr().err
    assert "bad.yaml:2:14: states.A.state" in said
    assert "bad.yaml:3:1: nam" in said


def test_a_file_that_is_not_there_names_the_nearest(folder, capsys):
    (folder / "rounds.yaml").write_text(GOOD)
    assert main(["check", "round.yaml"]) == 2
    assert "Did you mean 'rounds.yaml'?" in capsys.readouterr().err


def test_check_refuses_the_code_that_a_run_would_refuse(folder, capsys, monkeypatch):
    (folder / "code.yaml").write_text(
        "outcomes: [done]\nstates:\n  A: {state: 'antigravity:geohash', on: {done: done}}\n"
    )
    monkeypatch.delitem(sys.modules, "antigravity", raising=False)
    assert main(["check", "code.yaml"]) == 2
    assert "code.yaml:3:7: states.A.state: got 'antigravity'" in capsys.readouterr().err
    assert main(["check", "code.yaml", "--allow", "antigravity"]) == 0
    assert main(["render", "code.yaml", "-o", "code.svg"]) == 0  # it is only looked at
    assert "antigravity" not in sys.modules


def test_simulate_takes_a_file_and_the_packages_that_it_may_name(folder, capsys):
    (folder / "code.yaml").write_text(
        "outcomes: [done, preempted]\nstates:\n  A: {state: 'smachpy.states:Wait', with: {seconds: 3}, on: {done: done}}\n"
    )
    words = ["simulate", "code.yaml", "--runs", "2", "--jobs", "1"]
    assert main(words) == 2
    assert "Try --allow smachpy" in capsys.readouterr().err
    assert main([*words, "--allow", "smachpy"]) == 0
    assert "done x2" in capsys.readouterr().out


NAMES_CODE = """\
outcomes: [done, preempted]
states:
  A: {state: 'smachpy.states:Wait', with: {seconds: 0.0}, on: {done: done}}
"""


def test_submit_and_its_runner_take_the_packages_that_a_file_may_name(folder, capsys):
    (folder / "code.yaml").write_text(NAMES_CODE)
    words = ["submit", "code.yaml", "--db", "queue.db"]
    assert main(words) == 2
    assert "Try --allow smachpy" in capsys.readouterr().err
    assert main([*words, "--mission", "m1", "--allow", "smachpy"]) == 0
    capsys.readouterr()
    # What the computer that runs it allows counts there, and the row does not say it.
    queued = ["run", "x", "--queued", "--durable", "queue.db", "--mission", "m1", "--plain"]
    assert main([*queued, f"--allow={folder}"]) == 2
    assert "Try --allow smachpy" in capsys.readouterr().err
    assert main([*queued, f"--allow={folder}", "--allow=smachpy"]) == 0


@pytest.mark.slow
def test_test_takes_the_packages_that_a_file_may_name(folder):
    (folder / "code.yaml").write_text(NAMES_CODE)
    command = [sys.executable, "-m", "smachpy.command", "test", "-q", "code.yaml"]
    refused = subprocess.run(command, capture_output=True, text=True, check=False)
    assert refused.returncode == 1
    assert "Try --allow smachpy" in refused.stdout
    allowed = [*command, "--allow", "smachpy"]
    assert subprocess.run(allowed, capture_output=True, check=False).returncode == 0


def test_a_file_with_a_required_parameter_is_checked_drawn_and_exported(folder, capsys):
    text = GOOD.replace("seconds: {type: number, default: 2.0", "seconds: {type: number")
    assert text != GOOD
    (folder / "rounds.yaml").write_text(text)
    for words in (["check"], ["render", "-o", "a.svg"], ["export", "-o", "b.yaml"]):
        assert main([words[0], "rounds.yaml", *words[1:]]) == 2
        assert "Try --input seconds=VALUE" in capsys.readouterr().err
        assert main([words[0], "rounds.yaml", *words[1:], "--input", "seconds=3"]) == 0
    assert main(["check", "rounds.yaml", "--input", "seconds=long"]) == 2
    assert "--input seconds: got 'long'" in capsys.readouterr().err


def test_export_keeps_the_parameters_that_the_file_still_names(folder):
    (folder / "rounds.yaml").write_text(
        "outcomes: [done, preempted]\nuserdata: {rounds: '${rounds}'}\n"
        "parameters: {rounds: {type: whole}, pause: {type: number, default: 1.0}}\n"
        "states: {A: {state: wait, with: {seconds: '${pause}'}}}\n"
    )
    assert main(["export", "rounds.yaml", "-o", "other.yaml", "--input", "rounds=3"]) == 0
    machine = load(folder / "other.yaml", pause=5.0)  # without rounds, which has its value
    assert machine.userdata.rounds == 3
    assert "pause" in (folder / "other.yaml").read_text()
    with pytest.raises(MissionFileError, match="rounds"):
        load(folder / "other.yaml", rounds=4)


def test_states_are_listed_and_shown(capsys):
    assert main(["states", "list"]) == 0
    assert "drive_to" in capsys.readouterr().out
    assert main(["states", "show", "wait"]) == 0
    assert "seconds: How long [s]" in capsys.readouterr().out
    assert main(["states", "show", "wayt"]) == 2
    assert "Did you mean 'wait'?" in capsys.readouterr().err


def test_export_writes_a_file_and_says_what_it_cannot(folder, capsys):
    (folder / "rounds.yaml").write_text(GOOD)
    assert main(["export", "rounds.yaml", "-o", "other.yaml"]) == 0
    assert load(folder / "other.yaml").name == "ROUNDS"
    assert main(["export", "patrol", "-o", "patrol.yaml"]) == 2
    assert "/PATROL/ROUND" in capsys.readouterr().err
    assert not (folder / "patrol.yaml").exists()


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"a: [b\n c: {", "not YAML: line 2"),
        (b"\xff\xfe", "not YAML: "),
        (b"- 1\n", "no mission"),
        (b"network: {mode: peer}\n", "no mission"),
        (b"a: !!python/object/apply:os.system [ls]", "not YAML: line 1"),
    ],
)
def test_export_leaves_a_file_that_is_no_mission_as_it_is(folder, capsys, content, problem):
    (folder / "rounds.yaml").write_text(GOOD)
    (folder / "other.yaml").write_bytes(content)
    assert main(["export", "rounds.yaml", "-o", "other.yaml"]) == 2
    assert f"other.yaml: the file that is there is {problem}" in capsys.readouterr().err
    assert (folder / "other.yaml").read_bytes() == content
    assert sorted(path.name for path in folder.iterdir()) == ["other.yaml", "rounds.yaml"]


def test_export_writes_through_a_link_and_into_an_empty_file(folder):
    (folder / "rounds.yaml").write_text(GOOD)
    (folder / "real.yaml").touch()
    (folder / "link.yaml").symlink_to("real.yaml")
    assert main(["export", "rounds.yaml", "-o", "link.yaml"]) == 0
    assert (folder / "link.yaml").is_symlink()
    assert load(folder / "real.yaml").name == "ROUNDS"


ROUNDS = """\
outcomes: [done, preempted]
parameters: {rounds: {type: whole, default: 2}}
userdata: {count: 0, rounds: "${rounds}"}
states:
  GO: {state: 'steps:go', on: {done: COUNT}, outcomes: [preempted]}
  COUNT:
    state: compute
    with: {count: count + 1 / rounds}
    on: {done: [{when: count > 1, to: done}, {to: GO}]}
"""


def test_explore_finds_what_breaks_a_mission_without_its_code(folder, capsys):
    (folder / "steps.py").write_text("raise SystemExit\ngo = None\n")
    (folder / "rounds.yaml").write_text(ROUNDS)
    assert main(["explore", "rounds.yaml", "--max-runs", "100"]) == 0
    assert "all there are: no counterexample" in capsys.readouterr().out
    assert main(["explore", "rounds.yaml", "--input", "rounds=0", "--pictures", "drawn"]) == 1
    said = capsys.readouterr().out
    assert said.startswith("/ROUNDS: 1 runs in")
    assert "division by zero" in said
    assert (folder / "drawn" / "ROUNDS-counterexample.svg").is_file()
    assert main(["explore", "rounds.yaml", "--input", "round=1"]) == 2


@pytest.mark.slow
def test_test_takes_the_parameters_of_a_file(folder):
    (folder / "rounds.yaml").write_text(
        "outcomes: [done, preempted]\nparameters: {pause: {type: number}}\n"
        "states: {A: {state: wait, with: {seconds: '${pause}'}}}\n"
    )
    words = [sys.executable, "-m", "smachpy", "test", "-q", "-p", "no:cacheprovider"]
    run = partial(subprocess.run, cwd=folder, capture_output=True, text=True)
    assert "Try --input pause=VALUE" in run([*words, "rounds.yaml"]).stdout
    found = run([*words, "rounds.yaml", "--input", "pause=2"])
    assert found.returncode == 0, found.stdout
    found = run([*words, "rounds.yaml", "--input", "pause=2", "--input", "pose=2"])
    assert "--input pose: mission 'rounds' has no such input" in found.stdout


@pytest.mark.slow
def test_test_checks_and_explores_a_file(folder):
    (folder / "steps.py").write_text("raise SystemExit\ngo = None\n")
    (folder / "rounds.yaml").write_text(ROUNDS)
    (folder / "bad.yaml").write_text("outcomes: [done]\nstates: {A: {state: wat}}\n")
    words = [sys.executable, "-m", "smachpy", "test", "-v", "-p", "no:cacheprovider"]
    run = partial(subprocess.run, cwd=folder, capture_output=True, text=True)
    found = run([*words, "bad.yaml", "rounds.yaml"])
    assert found.returncode == 1
    assert "rounds.yaml::check PASSED" in found.stdout
    assert "rounds.yaml::explore PASSED" in found.stdout
    assert "bad.yaml:2:14: states.A.state: got 'wat'" in found.stdout
    assert run([*words, "."]).returncode == 5  # no tests: they are not named


def test_list_shows_the_mission_files_of_a_folder(folder, capsys):
    (folder / "rounds.yaml").write_text(GOOD)
    (folder / "bad.yaml").write_text("states: {A: 1}\nparameters: 3\n")
    (folder / "other.yaml").write_text("a: 1\n")
    (folder / "none.yaml").mkdir()
    assert main(["list"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "rounds.yaml Counts, then waits." in said
    assert "bad.yaml not available: bad.yaml:2:1: parameters" in said
    assert "other.yaml" not in said
    assert "none.yaml" not in said
