"""What the commands write, and Ctrl-C while they start; real processes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from actionlib_core.process.output import printable, run_program

FULL = "/dev/full"
RUN = ("run", "countdown", "--time", "virtual")
SMACHPY = "import sys; from smachpy.command import main; sys.exit(main())"
ACTIONLIB = "import sys; from actionlib_core.cli import main; sys.exit(main())"
COMMANDS = [
    (SMACHPY, (*RUN, "--json")),
    (SMACHPY, (*RUN, "--plain")),
    (SMACHPY, ("list",)),
    (SMACHPY, ("check", "countdown")),
    (SMACHPY, ("--help",)),
    (ACTIONLIB, ("interface", "list")),
]
# Asks the process to end, as Ctrl-C does, in the middle of the import of a module.
INTERRUPT = """
import os, signal, sys
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
sys.argv[1:] = {words!r}
import smachpy_programs
sys.exit(smachpy_programs.{program}())
"""


def python(code, *words, **options):
    return subprocess.run(
        [sys.executable, "-c", code, *words],
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
        timeout=100,
        **options,
    )


@pytest.mark.parametrize(("program", "words"), COMMANDS)
def test_a_full_disk_is_told(program, words):
    with open(FULL, "w") as disk:
        done = python(program, *words, stdout=disk)
    assert done.returncode == 2
    assert "standard output: got 'No space left on device'" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(("program", "words"), COMMANDS)
def test_a_reader_that_has_seen_enough_is_no_error(program, words):
    reading, writing = os.pipe()
    os.close(reading)
    with open(writing, "w") as pipe:
        done = python(program, *words, stdout=pipe)
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    assert "rror" not in done.stderr


def test_a_closed_output_is_told():
    done = subprocess.run(
        ["sh", "-c", '"$0" -c "$1" list >&-', sys.executable, SMACHPY],
        stderr=subprocess.PIPE,
        text=True,
        timeout=100,
    )
    assert done.returncode == 2
    assert "standard output: it is closed" in done.stderr


@pytest.mark.parametrize(
    ("program", "words", "module"),
    [
        ("smachpy", ["list"], "smachpy"),
        ("smachpy", ["list"], "smachpy.machines.container"),
        ("smachpy", ["run", "countdown"], "smachpy.command.run"),
        ("actionlib", ["topic", "list"], "actionlib_core.names"),
        ("actionlib", ["topic", "list"], "actionlib_core.cli.topic"),
    ],
)
def test_ctrl_c_during_an_import_ends_it_with_130(program, words, module):
    code = INTERRUPT.format(module=module, words=words, program=program)
    done = python(code, stdout=subprocess.PIPE)
    assert done.returncode == 130
    assert done.stderr == ""


def test_output_of_another_kind_stays_as_it_is(capsys):
    before = sys.stdout
    assert run_program("test", lambda: print("said") or 1) == 1
    assert sys.stdout is before
    assert capsys.readouterr().out == "said\n"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain é 🤖\n\ttext", "plain é 🤖\n\ttext"),
        ("\x1b[31mred\x07\r", "\\x1b[31mred\\x07\\r"),
        ("\x9b2J\u202e\u2028", "\\x9b2J\\u202e\\u2028"),
        (ValueError("\x1b]0;title\x07"), "\\x1b]0;title\\x07"),
    ],
)
def test_no_text_moves_the_cursor(text, shown):
    assert printable(text) == shown


TALKS = """
print("imported")
from smachpy import CBState, StateMachine

def mission():
    print("built")
    sm = StateMachine(["done"])
    with sm:
        sm.add("A", CBState(lambda _: "done", outcomes=["done"]))
    return sm
"""


@pytest.mark.parametrize(
    ("words", "begins"),
    [
        ("check m.py --format json", "["),
        ("check m.py --format sarif", "{"),
        ("simulate m.py --runs 1 --jobs 1 --json", '{"run": 1'),
        ("render m.py -o -", "<?xml"),
    ],
)
def test_what_a_mission_prints_is_not_in_the_data(words, begins, tmp_path):
    (tmp_path / "m.py").write_text(TALKS)
    done = python(SMACHPY, *words.split(), stdout=subprocess.PIPE, cwd=tmp_path)
    assert (done.returncode, done.stdout[: len(begins)]) == (0, begins)
    assert {"imported", "built"} <= {*done.stderr.splitlines()}
