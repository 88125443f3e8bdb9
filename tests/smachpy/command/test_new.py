"""`smachpy new` and `smachpy completion`; what `smachpy --help` says without importing the commands."""

from __future__ import annotations

import argparse
import importlib.util
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from smachpy.command import GROUP, SUMMARIES, full_parser, main
from smachpy.command.targets import load_target


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outcome_of_its_tests(folder):
    return subprocess.run(
        [sys.executable, "-m", "smachpy", "test", "-q", "-p", "no:cacheprovider"],
        cwd=folder, capture_output=True, text=True, timeout=110,
    )  # fmt: skip


def test_a_new_mission_passes_its_own_tests(empty_folder, capsys):
    assert main(["new", "fetch_mail"]) == 0
    assert "fetch_mail/: fetch_mail.py, test_fetch_mail.py, README.md" in capsys.readouterr().out
    done = outcome_of_its_tests(empty_folder / "fetch_mail")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 passed" in done.stdout


@pytest.mark.parametrize(
    ("robot", "line"), [("ros2", "--ros2 tcp/robot.local:7447"), ("ros1", "--ros1-robot http://")]
)
def test_the_readme_of_a_new_mission_drives_the_robot_that_was_named(empty_folder, robot, line):
    assert main(["new", "fetch", "--robot", robot]) == 0
    assert line in (empty_folder / "fetch" / "README.md").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("source", ["patrol", "door"])
def test_a_copied_mission_passes_its_test_with_its_own_map(empty_folder, source):
    assert main(["new", "--from", source]) == 0
    folder = empty_folder / source
    assert (folder / "office.pgm").exists()
    assert "smachpy.places.maps" not in (folder / f"{source}.py").read_text()
    done = outcome_of_its_tests(folder)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("source", ["mail", "asking"])
def test_a_copied_lesson_brings_its_own_test(empty_folder, source):
    assert main(["new", "copied", "--from", source]) == 0
    text = (empty_folder / "copied" / "test_copied.py").read_text()
    assert f"from copied import {source}" in text
    assert "smachpy_missions" not in text
    done = outcome_of_its_tests(empty_folder / "copied")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("source", ["there_and_back", "guided_recovery", "inspect", "delivery"])
def test_a_copy_of_a_mission_can_be_loaded(empty_folder, source):
    assert main(["new", "copied", "--from", source]) == 0
    target = load_target(f"copied/copied.py:{source}")
    assert target.name


@pytest.mark.parametrize("name", ["2-bad", "class", "a b", ""])
def test_a_name_that_python_cannot_import_is_refused(name, capsys):
    assert main(["new", name]) == 2
    assert "Try: smachpy new" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["random", "smachpy", "rich"])
def test_a_name_that_would_hide_a_module_is_refused(name, empty_folder, capsys):
    """Its own test could not run."""
    assert main(["new", name]) == 2
    assert f"Try: smachpy new my_{name}" in capsys.readouterr().err
    assert not list(empty_folder.iterdir())
    assert main(["new", "--from", "inspect"]) == 0
    assert (empty_folder / "my_inspect" / "my_inspect.py").exists()


def test_a_folder_that_cannot_be_made_is_told(monkeypatch, capsys):
    def refuse(_path, **_how):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", refuse)
    assert main(["new", "fetch"]) == 2
    assert "new: 'fetch' cannot be written: Permission denied" in capsys.readouterr().err


def test_a_folder_with_files_is_left_alone(empty_folder, capsys):
    (empty_folder / "fetch").mkdir()
    (empty_folder / "fetch" / "mine.py").write_text("mine")
    assert main(["new", "fetch"]) == 2
    assert "there already" in capsys.readouterr().err
    assert [path.name for path in (empty_folder / "fetch").iterdir()] == ["mine.py"]


def test_a_missing_file_with_the_name_of_a_shipped_mission_says_how_to_get_it(capsys):
    assert main(["run", "patrol.py"]) == 2
    said = capsys.readouterr().err
    assert "smachpy new --from patrol" in said


def test_help_says_of_each_command_what_the_command_says_itself():
    found = {command.name: command for command in entry_points(group=GROUP)}
    ours = {name for name, one in found.items() if one.value.startswith(("smachpy",))}
    assert ours == set(SUMMARIES)
    commands = argparse.ArgumentParser().add_subparsers()
    for name in SUMMARIES:
        found[name].load()(commands)
    said = {action.dest: action.help for action in commands._choices_actions}
    assert said == SUMMARIES


def test_help_imports_no_command():
    code = (
        "import sys, contextlib, io\n"
        "from smachpy.command import main\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        "    main(['--help'])\n"
        "print([m for m in sys.modules if m.startswith('smachpy.command.') or m == 'rich'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['smachpy.command.extras']"


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_the_completion_of_a_shell_knows_commands_and_options(shell, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert "simulate" in script
    assert "--start-robot" in script
    assert full_parser().prog == "smachpy"


def test_a_run_whose_page_cannot_be_served_leaves_no_recording(empty_folder, monkeypatch, capsys):
    (empty_folder / "nap.py").write_text(
        "import smachpy\ndef mission():\n    sm = smachpy.StateMachine(['done'], name='NAP')\n"
        "    sm.add('A', smachpy.CBState(lambda _: 'done', outcomes=['done']))\n    return sm\n"
    )
    monkeypatch.setenv("SMACHPY_RUNS", str(empty_folder / "kept"))

    def missing(*_arguments, **_options):
        raise ModuleNotFoundError("No module named 'starlette'", name="starlette")

    monkeypatch.setattr("smachpy.command.watching.load_view", lambda _name: missing)
    assert main(["run", "nap.py", "--view", "--plain", "--time", "virtual"]) == 2
    assert "pip install 'smachpy[web]'" in capsys.readouterr().err
    assert not list((empty_folder / "kept").glob("*"))


def test_the_list_says_what_a_mission_lacks_where_the_robot_is_not_installed(monkeypatch, capsys):
    real = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda n: None if n == "scipy" else real(n))
    assert main(["list"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "low. Its simulated robot: pip install 'smachpy[sim]' rp_action" in said
    assert "start and stop. delivery" in said
