"""What rows of a store may make a computer run: missions, and only those that are allowed there."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import pytest

import smachpy
import smachpy_missions.pnp
from smachpy.command import main
from smachpy.command.durable import whole_target
from smachpy.command.queued import Allowed, arguments_of, check_is_mission
from smachpy.command.targets import TargetError, load_target
from smachpy.durable.mission import new_mission
from smachpy.durable.opening import open_store
from smachpy.durable.processes import this_runner
from smachpy.durable.store import for_child, store_name

MISSION = """
import subprocess
from subprocess import getoutput as sm
from pathlib import Path

import smachpy
from smachpy import StateMachine

Path("imported").touch()


def _machine(text=""):
    Path(f"called{text}").touch()
    made = StateMachine(["done"], name="M")
    made.add("A", smachpy.CBState(lambda ud: "done", outcomes=["done"]))
    return made


@smachpy.mission
def deliver(text: str = ""):
    return _machine(text)


def mission(text: str = ""):
    return _machine(text)


def other(text: str = "") -> StateMachine:
    return _machine(text)


def cleanup(text: str = ""):
    Path("cleaned").touch()
    return _machine(text)


class Machine(StateMachine):
    def __init__(self):
        super().__init__(["done"])


ready = _machine("_at_import")
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("errand.py").write_text(MISSION)
    return tmp_path


def queued(target, *argv, mission="m1"):
    machine = smachpy.StateMachine(["done"], name="M")
    machine.add("A", smachpy.CBState(lambda _: "done", outcomes=["done"]))
    row = dataclasses.replace(
        new_mission(machine, mission=mission, target=target, argv=argv, robot=None)
    )
    with contextlib.closing(open_store("q.db")) as store:
        store.create(row)
    return row


def left():
    """What the missions of this test have touched."""
    return {path.name for path in Path().iterdir()} - {"errand.py", "q.db", "__pycache__"}


def run(*words):
    return subprocess.run(
        [sys.executable, "-P", "-m", "smachpy.command", *words],
        capture_output=True,
        text=True,
        timeout=250,
    )


# -- places ----------------------------------------------------------------------------------------


def test_rows_name_installed_missions_and_what_is_allowed(folder):
    (folder / "sub").mkdir()
    (folder / "away").symlink_to("/etc")
    here = Allowed([str(folder), "my_robot.missions"])
    for target in (
        "patrol",
        "smachpy_missions.patrol:patrol",
        f"{folder}/errand.py",
        f"{folder}/errand.py:other",
        f"{folder}/sub/plan.pnml",
        f"{folder}/rounds.yaml",
        "my_robot.missions",
        "my_robot.missions:deliver",
        "my_robot.missions.night:deliver",
    ):
        assert here.problem(target) == "", target
    for target in (
        "",
        ":",
        "patrol:machine",
        "subprocess:getoutput",
        "smachpy_missions.patrol:smachpy",
        "my_robot.missions_of_others:deliver",
        "my_robot:deliver",
        "errand.py",
        "sub/plan.pnml",
        "rounds.yaml",
        f"{folder}-other/rounds.yaml",
        f"{folder}-other/errand.py",
        f"{folder}/../errand.py",
        f"{folder}/away/x.py",
        "/proc/self/cwd/../errand.py",
        "--record=/etc/x",
        "--debug",
        f"{folder}/\x00.py/../../x.py",
    ):
        assert here.problem(target), target
    assert Allowed().problem("patrol") == ""
    assert "--allow" in Allowed().problem(f"{folder}/errand.py")


# -- targets ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["", ":deliver", ":mission", ":other", ":ready"])
def test_a_mission_is_taken(name):
    check_is_mission(load_target(f"errand.py{name}"))


def test_files_that_are_data_are_missions(folder):
    (folder / "rounds.yaml").write_text("outcomes: [done]\nstates: {A: {state: wait}}\n")
    (folder / "look.pnml").write_bytes(
        Path(smachpy_missions.pnp.__file__).with_name("look.pnml").read_bytes()
    )
    for name in ("rounds.yaml", "look.pnml", str(folder / "rounds.yaml")):
        check_is_mission(load_target(name))
        assert Path(whole_target(name)).is_absolute()


def test_a_mission_file_is_resumed_from_another_folder(folder, monkeypatch, capsys):
    (folder / "rounds.yaml").write_text(
        "name: M\noutcomes: [done]\nstates: {A: {state: set, with: {x: 1}, on: {done: done}}}\n"
    )
    words = ["--db", f"{folder}/q.db", "--mission", "m1"]
    assert main(["submit", "rounds.yaml", *words]) == 0
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    resume = ["missions", "resume", "m1", "--durable", f"{folder}/q.db", "--plain"]
    assert main(resume) == 2
    assert f"Try --allow {folder}/rounds.yaml" in capsys.readouterr().err
    assert main([*resume, "--allow", str(folder)]) == 0
    assert "M: done" in capsys.readouterr().out


@pytest.mark.parametrize("name", [":cleanup", ":sm", ":_machine", ":subprocess.getoutput"])
def test_what_is_no_mission_is_refused_before_it_is_called(name):
    target = load_target(f"errand.py{name}")
    with pytest.raises(TargetError, match="expected a mission"):
        check_is_mission(target)


@pytest.mark.parametrize("target", ["subprocess:getoutput", "os:system", "pathlib:Path.unlink"])
def test_functions_of_python_are_refused_whatever_is_allowed(target, capsys):
    queued(target, "--input", "cmd=touch hit", "--", "touch hit")
    for words in (
        ["runner", "--db", "q.db", "--until-empty"],
        ["missions", "resume", "m1", "--durable", "q.db", "--plain"],
        ["missions", "resume", "m1", "--durable", "q.db", "--plain", "--allow"],
    ):
        allow = [target.partition(":")[0]] if words[-1] == "--allow" else []
        assert main([*words, *allow]) == 2
        assert "row names" in capsys.readouterr().err
    assert left() == set()


def test_a_runner_runs_what_is_allowed(folder):
    queued(f"{folder}/errand.py", "--input", "text=_once")
    queued(f"{folder}/errand.py:cleanup", mission="m2")
    refused = run("runner", "--db", "q.db", "--until-empty")
    assert refused.returncode == 2
    assert "m1, m2" in refused.stderr
    assert left() == set()
    assert run("missions", "cancel", "m2", "--durable", "q.db").returncode == 0
    done = run("runner", "--db", "q.db", "--until-empty", "--allow", ".")
    assert done.returncode == 0, done
    assert "m1: ended: done" in done.stdout
    assert "called_once" in left()
    assert "cleaned" not in left()


# -- arguments -------------------------------------------------------------------------------------


def test_arguments_of_the_mission_are_taken():
    row = queued("x", "--input", "a=1", "--input", "b=x y=z", "--", "--flag", "--record", "f")
    assert arguments_of(row) == ([("a", "1"), ("b", "x y=z")], ("--flag", "--record", "f"))
    assert arguments_of(dataclasses.replace(row, argv=())) == ([], ())


@pytest.mark.parametrize(
    "argv",
    [
        ("--record", "f"),
        ("--input", "a=1", "--out", "d"),
        ("--input", "a"),
        ("--input",),
        ("a:=b",),
        ("--input=a=1",),
        ("x", "--", "y"),
    ],
)
def test_options_of_the_command_are_refused(folder, argv, capsys):
    row = queued(f"{folder}/errand.py", *argv)
    with pytest.raises(TargetError, match="expected only arguments of the mission"):
        arguments_of(row)
    assert main(["missions", "resume", "m1", "--durable", "q.db", "--plain", "--allow", "."]) == 2
    assert "expected only arguments of the mission" in capsys.readouterr().err
    assert left() == set()


def test_a_row_says_why_its_reserved_mission_did_not_begin(folder, capsys):
    queued(f"{folder}/errand.py:gone")
    words = ["run", "x", "--queued", "--durable=q.db", "--mission=m1", "--plain"]
    with contextlib.closing(open_store("q.db")) as store:
        _, lease = store.reserve(this_runner(), seconds=3600)
        reserved = f"--reserved={lease.runner}:{lease.fence}"
        assert main([*words, reserved]) == 2
        row = store.mission("m1")
        assert (row.status, row.owner) == ("queued", None)
        assert row.note.startswith(this_runner())
        assert "Try --allow" in row.note
        _, lease = store.reserve(this_runner(), seconds=3600)
        reserved = f"--reserved={lease.runner}:{lease.fence}"
        assert main([*words, reserved, f"--allow={folder}"]) == 2
        assert "gone" in store.mission("m1").note
    capsys.readouterr()
    assert main(["missions", "list", "--durable=q.db"]) == 0
    assert "gone" in capsys.readouterr().out


def test_ids_and_robots_that_look_like_options_are_values(folder):
    queued(f"{folder}/errand.py", mission="--debug")
    done = run("runner", "--db", "q.db", "--until-empty", "--allow", str(folder))
    assert "mission --debug: ended: done" in done.stdout


# -- addresses -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("url", "shown", "command", "secret"),
    [
        ("a/b.db", "a/b.db", "a/b.db", None),
        ("postgresql://db/m", "postgresql://db/m", "postgresql://db/m", None),
        ("postgresql://u:p%20w@db/m", "postgresql://db/m", "postgresql://u@db/m", "p w"),
        ("postgresql://u@db/m?password=pw", "postgresql://db/m", "postgresql://u@db/m", "pw"),
        (
            "postgresql://db/m?sslmode=require&password=pw&port=5",
            "postgresql://db/m?sslmode=require&port=5",
            "postgresql://db/m?sslmode=require&port=5",
            "pw",
        ),
        ("postgresql://db/m?p%61ssword=pw", "postgresql://db/m", "postgresql://db/m", "pw"),
        ("postgresql://u:a@b@db/m", "postgresql://db/m", "postgresql://u@db/m", "a@b"),
    ],
)
def test_an_address_shows_no_password(url, shown, command, secret):
    assert store_name(url) == shown
    assert for_child(url) == (command, {} if secret is None else {"PGPASSWORD": secret})


@pytest.mark.parametrize("url", ["postgresql://u:p/w@db/m", "postgresql://u:p?w@db/m"])
def test_a_malformed_address_shows_no_password_either(url):
    assert "p" not in store_name(url).removeprefix("postgresql://")
    assert "w" not in store_name(url)


def test_a_password_is_on_no_command_line_of_a_child(monkeypatch):
    from smachpy_viz.live import journals

    seen = []

    class Seen(Exception):
        pass

    def popen(command, **options):
        seen.append((command, options["env"]))
        raise Seen

    monkeypatch.setattr(journals.subprocess, "Popen", popen)
    page = journals.Journals([])
    with pytest.raises(Seen):
        page._resume("postgresql://u:hunter2@db/m?sslmode=require", "m1", "")
    [(command, env)] = seen
    assert "hunter2" not in " ".join(command)
    assert env["PGPASSWORD"] == "hunter2"
    assert "PGPASSWORD" not in os.environ
