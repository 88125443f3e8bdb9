"""Which command executes code of which file: the table in docs/security.md, row by row.

Each file notes its name when it is executed. Beside those of the table there are files with names
of modules that the commands import themselves.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from smachpy.command import main
from smachpy.command.targets import TargetError, load_target
from tests.places import DOCS

PAGE = DOCS / "security.md"
ROWS = re.findall(
    r"^\| `((?:smachpy|actionlib) [^`]*)` \| ([^|]*) \|$", PAGE.read_text(), re.MULTILINE
)
REFUSED = "--until-empty", "resume one --durable queue.db", "reproduce run.jsonl"  # exit with 2

NOTE = "open({log!r}, 'a').write({name!r} + chr(10))\n"
MISSION = """
import helper
import smachpy

@smachpy.state(outcomes=["done"])
def work(userdata):
    return "done"

@smachpy.mission
def mission():
    machine = smachpy.StateMachine(["done"], name="M")
    machine.add("A", work)
    return machine
"""
# A script for ROS 1 that is only checked can write no file.
SCRIPT = """
print("executed script.py")
import rospy
import smach

class Work(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"])
    def execute(self, userdata):
        return "done"

rospy.init_node("script")
sm = smach.StateMachine(outcomes=["done"])
with sm:
    smach.StateMachine.add("A", Work())
sm.execute()
"""
BEHAVIOR = """
from flexbe_core import Behavior, OperatableStateMachine
from my_flexbe_states import Go

class RoundsSM(Behavior):
    def create(self):
        _state_machine = OperatableStateMachine(outcomes=["done"])
        with _state_machine:
            OperatableStateMachine.add("GO", Go(), transitions={"done": "done"})
        return _state_machine
"""
FILES = {
    "mission.py": MISSION,
    "helper.py": "",
    "script.py": SCRIPT,
    "beside.py": "def go(userdata, *parameters):\n    pass\n",
    "steps.py": "import smachpy\n@smachpy.state(['done'])\ndef go(userdata):\n    return 'done'\n",
    "smachpy_states.py": "import smachpy\n@smachpy.state(['done'])\ndef Go(userdata):\n    return 'done'\n",
    "rounds_sm.py": BEHAVIOR,
    "test_mission.py": "import mission\ndef test_it():\n    assert mission.mission().execute()\n",
    "conftest.py": "",
    # Names of modules that commands import, and those that Python imports by itself.
    **dict.fromkeys(
        ["argparse.py", "json.py", "sqlite3.py", "logging.py", "sitecustomize.py", "rich.py"], ""
    ),
    **dict.fromkeys(["usercustomize.py", "zenoh.py", "numpy.py", "starlette.py", "smach.py"], ""),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with all files, and what smachpy makes of the mission."""
    made = tmp_path_factory.mktemp("folder")
    (made / "mission.py").write_text(MISSION)
    (made / "helper.py").write_text("")
    for words in (
        ["render", "mission.py", "-o", "machine.json"],
        ["run", "mission.py", "--plain", "--record", "run.jsonl", "--time", "virtual"],
        ["submit", "mission.py", "--db", "queue.db", "--mission", "one"],
    ):
        assert run(["smachpy", *words], made).returncode == 0
    for name, text in FILES.items():
        (made / name).write_text(NOTE.format(log=str(made / "log"), name=name) + text)
    (made / "plan.plan").write_text("goto_kitchen;\n")
    (made / "file.yaml").write_text(
        "outcomes: [done]\nstates: {GO: {state: 'steps:go', on: {done: done}}}\n"
    )
    (made / "rounds.xml").write_text(
        '<StateMachine outcomes="done"><State name="GO" class="Go"><Transition from="done" to="done"/>'
        "</State></StateMachine>"
    )
    (made / "rounds.scxml").write_text(
        '<scxml><state id="Go"><transition target="done"/></state><final id="done"/></scxml>'
    )
    (made / "actions.yaml").write_text('actions:\n  goto: {run: "beside:go"}\n')
    return made


def run(words, folder):
    program, *rest = words
    environment = {**os.environ, "XDG_STATE_HOME": str(folder / "state")}
    environment.pop("PYTHONPATH", None)
    return subprocess.run(
        [Path(sys.executable).parent / program, *rest],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=100,
        stdin=subprocess.DEVNULL,
    )


def test_the_table_has_rows():
    assert len(ROWS) > 25


@pytest.mark.slow
@pytest.mark.parametrize(("command", "files"), ROWS)
def test_a_command_executes_what_the_table_says(folder, command, files):
    (folder / "log").unlink(missing_ok=True)
    done = run(shlex.split(command), folder)
    assert done.returncode == (2 if command.endswith(REFUSED) else 0), done.stdout + done.stderr
    executed = set((folder / "log").read_text().split()) if (folder / "log").exists() else set()
    executed |= set(re.findall("executed (.*)", done.stdout + done.stderr))
    assert executed == set(re.findall(r"`([^`]*)`", files))


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("open('mark', 'w')\n", ""),
        ("import os\n", ":mission"),
        ("def deliver():\n    open('mark', 'w')\n", ":delivr"),
    ],
)
def test_a_file_that_cannot_have_the_machine_is_not_executed(tmp_path, monkeypatch, text, name):
    monkeypatch.chdir(tmp_path)
    Path("file.py").write_text(f"open('mark', 'w')\n{text}")
    with pytest.raises(TargetError, match="not executed"):
        load_target(f"file.py{name}")
    assert not Path("mark").exists()


@pytest.mark.parametrize(
    "text",
    [
        "from smachpy_missions.patrol import *\npatrol = patrol\n",
        "globals()['mission'] = __import__('smachpy').StateMachine(['a'])\n",
        "import smachpy\ndef f():\n    global sm\n    sm = smachpy.StateMachine(['a'])\nf()\n",
        "import smachpy\nfor mission in [smachpy.StateMachine(['a'])]: pass\n",
        "import smachpy\nif (sm := smachpy.StateMachine(['a'])): pass\n",
    ],
)
def test_a_file_that_may_have_it_is(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    Path("file.py").write_text(text)
    name = ":patrol" if "patrol" in text else ""
    assert load_target(f"file.py{name}").thing


def test_a_plan_that_is_looked_at_says_what_it_did_not_look_at(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("p.plan").write_text("goto_kitchen; fetch_cup;\n")
    Path("actions.yaml").write_text(
        'actions:\n  goto: {run: "nowhere:go"}\n  fetch: {run: "nowhere:fetch"}\n'
        'conditions:\n  seen: {run: "nowhere:seen", every: 0.5}\n'
    )
    assert main(["check", "p.plan"]) == 0
    said = capsys.readouterr().out
    assert "nowhere:fetch, nowhere:go, nowhere:seen, which were not imported" in said
    assert main(["render", "p.plan", "-o", "p.mmd"]) == 0
    assert "goto_kitchen" in Path("p.mmd").read_text()
    assert main(["check", "p.plan", "--import"]) == 2
    assert "nowhere" in capsys.readouterr().err
