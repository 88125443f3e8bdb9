"""No text of a mission, a file or the network moves the cursor of whoever looks on."""

from __future__ import annotations

import io
import logging
import subprocess
import sys

import pytest
from rich.console import Console

import smachpy.command
from smachpy import CBState, InvalidUserCodeError, StateMachine, describe
from smachpy_viz import TerminalView

BAD = "\x1b[31mred\x07\x9b2J\u202e"
MISSION = f"""
import smachpy
BAD = {BAD!r}
def mission(how: str = "outcome"):
    sm = smachpy.StateMachine(outcomes=["done" + BAD, "aborted"], name="M" + BAD)
    def work(userdata):
        if how == "raise":
            raise ValueError(BAD)
        if how == "log":
            smachpy.logerr(BAD)
        userdata.x = BAD
        return "done" + BAD
    with sm:
        sm.add("A" + BAD, smachpy.CBState(work, outcomes=["done" + BAD], output_keys=["x"]))
    return sm
"""
SMACHPY = "import sys; from smachpy.command import main; sys.exit(main())"
ACTIONLIB = "import sys; from actionlib_core.cli import main; sys.exit(main())"


def bad_characters(text):
    return {c for c in text if not c.isprintable() and c not in "\n\t"}


@pytest.fixture
def mission_file(tmp_path):
    path = tmp_path / "mission.py"
    path.write_text(MISSION)
    return str(path)


@pytest.mark.parametrize(
    "words",
    [
        ["run", "{}", "--plain"],
        ["run", "{}", "--json"],
        ["run", "{}", "--plain", "--", "raise"],
        ["run", "{}", "--plain", "--debug", "--", "raise"],
        ["run", "{}", "--plain", "--", "log"],
        ["run", "{}", "--plain", "--", "too", f"many{BAD}"],
        ["run", f"nothing{BAD}"],
        ["run", "{}", f"--nothing{BAD}"],
        ["run", "{}", "--plain", "--success", BAD],
        ["check", "{}"],
        ["list"],
    ],
)
def test_a_command_of_smachpy_writes_none(words, mission_file):
    done = subprocess.run(
        [sys.executable, "-c", SMACHPY, *(word.format(mission_file) for word in words)],
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert bad_characters(done.stdout) == set()
    assert bad_characters(done.stderr) == set()


@pytest.mark.parametrize(
    "words",
    [["interface", "show", BAD], [BAD], ["topic", "pub", "-1", "a", "std_msgs/String", BAD]],
)
def test_a_command_of_actionlib_writes_none(words):
    done = subprocess.run(
        [sys.executable, "-c", ACTIONLIB, *words], capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 2
    assert bad_characters(done.stdout) == set()
    assert bad_characters(done.stderr) == set()


def test_recorded_runs_are_listed_without(mission_file, tmp_path, capsys):
    recording = str(tmp_path / "run.jsonl")
    run = ["run", mission_file, "--plain", "--time", "virtual", "--record", recording]
    assert smachpy.command.main(run) == 0
    capsys.readouterr()
    for what in ("list", "show"):
        assert smachpy.command.main(["runs", what, recording]) == 0
        assert bad_characters(capsys.readouterr().out) == set()


def machine(text):
    sm = StateMachine(outcomes=["done"], name="M")

    def work(_userdata):
        raise ValueError(text)

    with sm:
        sm.add("A", CBState(work, outcomes=["done"]))
    return sm


@pytest.mark.parametrize("panel", [False, True])
def test_a_terminal_view_writes_none_of_a_mission_s(clock, panel):
    out = io.StringIO()
    console = Console(file=out, force_terminal=panel, width=100, color_system=None)
    sm = machine(BAD)
    with TerminalView(describe(sm), console=console, plain=not panel) as view:
        forget = sm.subscribe(view.on_event)
        with pytest.raises(InvalidUserCodeError):
            sm.execute()
        forget()
    view.print_summary(None)
    assert "[31m" in out.getvalue()
    assert "\x1b[31m" not in out.getvalue()
    assert not {"\x07", "\x9b", "\u202e"} & set(out.getvalue())


def test_plain_lines_cut_no_reason(clock):
    reason = " ".join(f"word{n}" for n in range(200))
    out = io.StringIO()
    sm = machine(reason)
    with TerminalView(describe(sm), console=Console(file=out, width=80), plain=True) as view:
        forget = sm.subscribe(view.on_event)
        with pytest.raises(InvalidUserCodeError):
            sm.execute()
        forget()
    assert reason in out.getvalue()


def test_logging_of_a_program_is_left_alone():
    assert logging.lastResort is not None
    assert logging.lastResort.formatter is None
