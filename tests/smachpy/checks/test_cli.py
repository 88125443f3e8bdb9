"""`smachpy check`."""

from __future__ import annotations

import json

import pytest

from smachpy.command import main

MISSION = """
import smachpy

def mission():
    sm = smachpy.StateMachine(["done", "failed"], name="M")
    with sm:
        sm.add("A", smachpy.CBState(lambda ud: "ok", outcomes=["ok"]), {"ok": "done"})
        sm.add("B", smachpy.CBState(lambda ud: "ok", outcomes=["ok"]), {"ok": "failed"})
    return sm
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.py").write_text(MISSION)
    return tmp_path


def test_problems_give_exit_code_1(folder, capsys):
    assert main(["check", "m.py"]) == 1
    assert "no run gets to /M/B. [unreachable-state]" in capsys.readouterr().out


def test_pyproject_switches_off_with_a_reason_and_adds_properties(folder, capsys):
    (folder / "pyproject.toml").write_text(
        """
        [tool.smachpy.check]
        ignore = [
            {rule = "unreachable-state", path = "/M/B", reason = "an operator sends it there"},
            {rule = "impossible-outcome", reason = "as above"},
        ]
        properties = {M = ["never(B)"]}
        """
    )
    assert main(["check", "m.py"]) == 0
    assert "an operator sends it there" in capsys.readouterr().out
    assert main(["check", "m.py", "--property", "never(A)", "--format", "json"]) == 1
    assert json.loads(capsys.readouterr().out)[0]["problems"][0]["rule"] == "property"


def test_a_rule_that_is_off_is_switched_on_here_or_in_pyproject(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "go.py").write_text(
        "import smachpy\n"
        "from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction\n"
        "def mission():\n"
        "    sm = smachpy.StateMachine(['succeeded', 'aborted', 'preempted'], name='M')\n"
        "    with sm:\n"
        "        sm.add('GO', smachpy.SimpleActionState('move_base', MoveBaseAction))\n"
        "    return sm\n"
    )
    assert main(["check", "go.py"]) == 0
    assert main(["check", "go.py", "--enable", "no-timeout"]) == 1
    (tmp_path / "pyproject.toml").write_text('[tool.smachpy.check]\nenable = ["no-timeout"]\n')
    capsys.readouterr()
    assert main(["check", "go.py", "--format", "json"]) == 1
    assert json.loads(capsys.readouterr().out)[0]["problems"][0]["rule"] == "no-timeout"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('ignore = [{rule = "unreachable-state"}]', "reason"),
        ('ignore = [{rule = "unreachable-stat", reason = "x"}]', "unreachable-state"),
        ("ignore = [1]", "ignore[0]: got 1; expected a mapping"),
        ("ignored = []", "ignored: got an unknown field"),
        ('enable = "no-timeout"', "enable: got 'no-timeout'; expected a list of texts. Try ['no"),
        ('enable = ["no-timeouts"]', "Did you mean 'no-timeout'?"),
        ("enable = [[]]", "enable[0]: got []"),
        ('properties = "never(B)"', "properties: got 'never(B)'; expected a mapping"),
        ('properties = {M = "never(B)"}', "M: got 'never(B)'; expected a list of texts. Try ['ne"),
        ("properties = {M = [1]}", "M[0]: got 1; expected a text"),
    ],
)
def test_a_pyproject_that_makes_no_sense(folder, capsys, text, said):
    (folder / "pyproject.toml").write_text(f"[tool.smachpy.check]\n{text}\n")
    assert main(["check", "m.py"]) == 2
    assert said in capsys.readouterr().err


def test_properties_of_a_machine_that_is_not_checked_are_named(folder, capsys):
    (folder / "pyproject.toml").write_text(
        """
        [tool.smachpy.check]
        ignore = [
            {rule = "unreachable-state", reason = "an operator sends it there"},
            {rule = "impossible-outcome", reason = "as above"},
        ]
        properties = {MM = ["never(A)"]}
        """
    )
    assert main(["check", "m.py", "--format", "json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)[0]["problems"] == []
    assert "properties of 'MM' were not looked at; checked M. Did you mean 'M'?" in err


def test_pictures(folder, capsys):
    assert main(["check", "m.py", "--property", "never(A)", "--pictures", "out"]) == 1
    assert [file.name for file in (folder / "out").iterdir()] == ["M-3-property.svg"]
