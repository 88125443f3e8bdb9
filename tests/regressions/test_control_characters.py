"""No text of a mission, a file or the network moves the cursor of whoever looks on."""

from __future__ import annotations

import io
import logging
import re
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
# Executes commands one after another; each ends with its exit code on a line of both outputs.
PROGRAM = """
import sys
from {module} import main
for words in {commands!r}:
    try:
        code = main(words)
    except SystemExit as ended:
        code = ended.code
    for output in (sys.stdout, sys.stderr):
        print(f"ended with {{code}}", file=output, flush=True)
"""


def bad_characters(text):
    return {c for c in text if not c.isprintable() and c not in "\n\t"}


@pytest.fixture
def mission_file(tmp_path):
    path = tmp_path / "mission.py"
    path.write_text(MISSION)
    return str(path)


def execute(module, commands):
    """Execute commands in a process of their own; what each wrote, and its exit code."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(module=module, commands=commands)],
        capture_output=True,
        text=True,
        timeout=280,
    )
    assert done.returncode == 0, done.stderr
    out, err = (re.split(r"ended with (\d+)\n", text)[:-1] for text in (done.stdout, done.stderr))
    assert out[1::2] == err[1::2]
    codes = [int(code) for code in out[1::2]]
    return list(zip(commands, out[::2], err[::2], codes, strict=True))


def test_the_commands_of_smachpy_write_none(mission_file):
    commands = [
        ["run", mission_file, "--plain"],
        ["run", mission_file, "--json"],
        ["run", mission_file, "--plain", "--", "raise"],
        ["run", mission_file, "--plain", "--debug", "--", "raise"],
        ["run", mission_file, "--plain", "--", "log"],
        ["run", mission_file, "--plain", "--", "too", f"many{BAD}"],
        ["run", f"nothing{BAD}"],
        ["run", mission_file, f"--nothing{BAD}"],
        ["run", mission_file, "--plain", "--success", BAD],
        ["check", mission_file],
        ["list"],
    ]
    for words, out, err, _ in execute("smachpy.command", commands):
        assert out or err, words
        assert bad_characters(out + err) == set(), words


def test_the_commands_of_actionlib_write_none():
    commands = [
        ["interface", "show", BAD],
        [BAD],
        ["topic", "pub", "-1", "a", "std_msgs/String", BAD],
    ]
    for words, out, err, code in execute("actionlib_core.cli", commands):
        assert code == 2, words
        assert bad_characters(out + err) == set(), words


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
