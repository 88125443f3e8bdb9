"""`smachpy run --log-level, --log-file`: what a mission logs is shown and kept."""

from __future__ import annotations

import logging
import re
import stat
import subprocess
import sys

import pytest

from smachpy.command import main
from smachpy.ros1.port import port

TALKS = """
import logging
import smachpy

logger = logging.getLogger("talks")

def talk(userdata):
    logger.debug("a detail")
    logger.info("the door is %s", "open\\x1b[2J")
    logger.warning("the light is off")
    return "done"

def mission():
    sm = smachpy.StateMachine(["done"], name="TALKS")
    sm.add("TALK", smachpy.CBState(talk, outcomes=["done"]))
    return sm
"""
OLD = """import rospy
import smach

class Foo(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=['a'])

    def execute(self, userdata):
        rospy.loginfo('Executing state FOO')
        rospy.logwarn('with care')
        return 'a'

def main():
    rospy.init_node('x')
    sm = smach.StateMachine(outcomes=['b'])
    with sm:
        smach.StateMachine.add('FOO', Foo(), transitions={'a': 'b'})
    sm.execute()

if __name__ == '__main__':
    main()
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Run the mission with options; return its standard error."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "talks.py").write_text(TALKS)

    def run(*words, target="talks.py", expected=0):
        # pytest's own handlers would count as the program's.
        monkeypatch.setattr(logging.getLogger(), "handlers", [])
        assert main(["run", target, "--time", "virtual", "--plain", *words]) == expected
        return capsys.readouterr().err

    return run


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ([], ["the light is off"]),
        (["--log-level", "error"], []),
        (["--log-level", "warning"], ["WARNING talks: the light is off"]),
        (
            ["--log-level", "info"],
            [r"INFO talks: the door is open\x1b[2J", "WARNING talks: the light is off"],
        ),
    ],
)
def test_a_level_says_what_is_shown(run, words, shown):
    lines = [line for line in run(*words).splitlines() if " smachpy" not in line]

    assert lines == shown


def test_the_transitions_are_log_messages_too(run):
    assert "INFO smachpy" in run("--log-level", "info")
    assert "DEBUG talks: a detail" in run("--log-level", "debug")


def test_a_file_gets_the_messages_of_each_run_with_their_time(run, tmp_path):
    for _ in range(2):
        assert "the door" not in run("--log-file", "talks.log")

    lines = [x for x in (tmp_path / "talks.log").read_text().splitlines() if " talks: " in x]
    assert len(lines) == 4
    assert re.fullmatch(
        r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3} INFO talks: the door is open\\x1b\[2J", lines[0]
    )
    assert stat.S_IMODE((tmp_path / "talks.log").stat().st_mode) == 0o600


def test_handlers_and_level_are_as_before_after_the_run(run):
    root = logging.getLogger()
    before = root.level, [], list(logging.getLogger("rosout").handlers)

    run("--log-level", "debug", "--log-file", "talks.log")

    assert (root.level, list(root.handlers), list(logging.getLogger("rosout").handlers)) == before


def test_a_file_that_cannot_be_written_is_an_error_before_the_run(run):
    before = logging.getLogger().level

    said = run("--log-file", "nowhere/talks.log", expected=2)

    assert "--log-file nowhere/talks.log: got no file to write to (No such file" in said
    assert logging.getLogger().level == before


@pytest.mark.skipif(sys.platform != "linux", reason="needs a disk that is always full")
def test_a_full_disk_is_told_once_and_the_mission_goes_on(run):
    said = run("--log-file", "/dev/full")

    assert said.count("--log-file /dev/full: got a failed write") == 1


@pytest.mark.slow
def test_an_old_script_keeps_what_it_logs_in_the_file(tmp_path):
    (tmp_path / "old.py").write_text(OLD)
    words = ["run", "--ros1", "old.py", "--time", "virtual", "--plain", "--log-file", "old.log"]

    # A process of its own: the names of ROS 1 and their leniency stay in a process.
    subprocess.run([sys.executable, "-m", "smachpy", *words], cwd=tmp_path, check=True, timeout=250)

    assert "INFO rosout: Executing state FOO" in (tmp_path / "old.log").read_text()


def test_a_ported_script_shows_what_it_logs_and_port_says_how(run, tmp_path):
    ported = port(OLD.encode(), "old.py")
    (tmp_path / "new.py").write_text(ported.text)

    said = run("--log-level", "info", target="new.py")

    assert "INFO new: Executing state FOO" in said
    assert [(n, text) for n, text in ported.notes if "--log-level info" in text] == [
        (
            9,
            "rospy.loginfo: shown by `smachpy run --log-level info`, or with logging.basicConfig in the script",
        )
    ]
