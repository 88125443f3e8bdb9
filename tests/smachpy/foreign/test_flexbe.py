"""Behaviours of FlexBE: what becomes of them, and by what they are refused; none is executed."""

from __future__ import annotations

import pytest

from smachpy import load
from smachpy.checks import check
from smachpy.files.others import not_kept
from smachpy.foreign import is_behavior
from smachpy.states import set_autonomy
from smachpy.testing import mission_kit
from tests.smachpy.foreign.places import ROUNDS, refused, save

STATES = """
import smachpy


class DriveState(smachpy.State):
    def __init__(self, place, speed):
        super().__init__(["arrived", "blocked"], io_keys=["count"])
        self.place, self.speed = place, speed

    def execute(self, userdata):
        if self.speed > 0:
            userdata.count = [*self.place, self.speed]
        return "arrived"


class LogState(smachpy.State):
    def __init__(self, text, severity):
        super().__init__(["done"])
        assert (text, severity) == ("done", "REPORT_HINT")

    def execute(self, userdata):
        return "done"
"""
ADD = "            OperatableStateMachine.add('A', {state}, transitions={{'x': 'e'}}{more})\n"


def behavior(body, init="pass"):
    """A file with a behaviour of these lines."""
    lines = "".join(f"        {line}\n" for line in body)
    return (
        "from flexbe_core import *\nclass S(Behavior):\n    def __init__(self, node):\n"
        f"        {init}\n    def create(self):\n{lines}        return m\n"
    )


def one(state="Foo()", more="", before=()):
    """A behaviour with one state."""
    return behavior(
        [
            *before,
            "m = OperatableStateMachine(outcomes=['e'])",
            "with m:",
            f"    OperatableStateMachine.add('A', {state}, transitions={{'x': 'e'}}{more})",
        ]
    )


@pytest.fixture
def autonomy():
    """Sets the autonomy of the process for one test."""
    yield set_autonomy
    set_autonomy(0)


def test_a_behaviour_with_all_its_parts_runs_with_states_beside_it(tmp_path, monkeypatch, autonomy):
    monkeypatch.chdir(tmp_path)
    save(tmp_path, STATES, "smachpy_states.py")
    path = save(tmp_path, ROUNDS["py"], "rounds_sm.py")
    autonomy(3)  # FlexBE's Full
    with mission_kit() as mission:
        run = mission(load(path, speed=2.0))
    run.assert_outcome("finished")
    assert run.userdata["seen"] == ["hall", "lab", 2.0]
    assert not (tmp_path / "executed").exists()


def test_a_level_of_autonomy_is_confirmed_by_a_person(tmp_path, autonomy):
    machine = load(save(tmp_path, ROUNDS["py"], "rounds_sm.py"))
    assert "CONFIRM_Say_done" in machine.get_children()
    for label in machine["Both"].get_children():
        assert not label.startswith("CONFIRM")
    autonomy(2)  # FlexBE's High, at which a transition with High is asked for
    with mission_kit() as mission:
        mission.replace("/Rounds/Both", ["finished"])
        mission.replace("/Rounds/Say", ["done"])
        mission(machine).assert_outcome("preempted")  # nobody answers


def test_what_is_lost_is_noted_with_its_line(tmp_path):
    machine = load(save(tmp_path, ROUNDS["py"], "rounds_sm.py"))
    assert check(machine).ok
    assert [text.partition("not kept: ")[2] for text in not_kept(machine)] == [
        "the stop of the other states when A ends with 'blocked'",
        "the stop of the other states when B ends with 'blocked'",
    ]
    text = one("Foo(a=make(), b=1, c=lambda x: x)", before=["n = other()", "print('x')"])
    text += "    def helper(self):\n        pass\n"
    lost = list(not_kept(load(save(tmp_path, text, "b.py"))))
    assert [one.partition(": not kept: ") for one in lost] == [
        (f"{tmp_path}/b.py:6", ": not kept: ", "code: n = other()"),
        (f"{tmp_path}/b.py:7", ": not kept: ", "code: print('x')"),
        (f"{tmp_path}/b.py:10", ": not kept: ", "the argument a: make()"),
        (f"{tmp_path}/b.py:10", ": not kept: ", "the argument c: lambda x: x"),
        (f"{tmp_path}/b.py:12", ": not kept: ", "the method helper"),
    ]


def test_the_first_condition_that_holds_decides_as_in_flexbe(tmp_path):
    text = behavior(
        [
            "c = ConcurrencyContainer(outcomes=['one', 'two'], conditions=[",
            "    ('one', [('A', 'x')]), ('two', [('B', 'x')])])",
            "with c:",
            "    OperatableStateMachine.add('A', Foo(), transitions={'x': 'one'})",
            "    OperatableStateMachine.add('B', Foo(), transitions={'x': 'two'})",
            "m = OperatableStateMachine(outcomes=['one', 'two'])",
            "with m:",
            "    OperatableStateMachine.add('C', c, transitions={'one': 'one', 'two': 'two'})",
        ]
    )
    with mission_kit() as mission:
        mission.replace("C/A", ["x"])
        mission.replace("C/B", ["x"])
        mission(load(save(tmp_path, text, "b.py"))).assert_outcome("one")


def test_a_behaviour_in_a_behaviour_is_the_file_beside_it(tmp_path):
    save(
        tmp_path,
        one(before=["self.add_parameter"]).replace("pass", "self.add_parameter('n', 1)"),
        "in_sm.py",
    )
    use = "self.use_behavior(InSM, 'A', parameters={'n': 5}, default_keys=['k'])"
    text = "from x.in_sm import InSM\n" + one(use).replace("'x': 'e'", "'e': 'e'")
    machine = load(save(tmp_path, text, "out_sm.py"))
    assert machine["A"]["A"].name == "smachpy_states:Foo"
    assert [text.partition(": not kept: ")[2] for text in not_kept(machine)] == [
        "the argument default_keys of use_behavior",
        "code: self.add_parameter",
    ]


def test_only_a_file_with_a_behaviour_is_taken_for_one(tmp_path):
    assert is_behavior(save(tmp_path, ROUNDS["py"], "a.py"))
    assert not is_behavior(save(tmp_path, "import flexbe_core\nclass A: pass\n", "b.py"))
    assert not is_behavior(save(tmp_path, "import flexbe_core\nclass (", "c.py"))
    assert not is_behavior(tmp_path / "none.py")
    assert not is_behavior(save(tmp_path, ROUNDS["py"], "a.txt"))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            "x = 1",
            "1:1: got no behaviour of FlexBE; expected a class with the base Behavior and a method create.",
        ),
        (
            behavior(["m = 1"]),
            "2:1: create: got 'm'; expected `return` with an OperatableStateMachine.",
        ),
        (
            behavior(["with m:", "    pass"]),
            "6:9: got `with m`; expected a machine that is made above.",
        ),
        (one("Foo"), "8:45: got Foo; expected a state, a machine or use_behavior."),
        (one("m"), "2:1: create: got 'm'; expected `return` with an OperatableStateMachine."),
        (
            one(more=", remapping=5"),
            "8:45: states.A.remapping: got 5; expected a mapping of names to values.",
        ),
        (
            behavior(["m = ConcurrencyContainer(outcomes=['e'], conditions=5)", "with m: pass"]),
            "6:13: conditions: got something else; expected [(outcome, [(label, outcome), ...]), ...].",
        ),
        (
            behavior(["m = OperatableStateMachine(outcomes=5)"]),
            "6:13: outcomes: got 5; expected a list of texts.",
        ),
    ],
)
def test_a_wrong_file_is_refused_with_line_and_column(tmp_path, text, problem):
    assert refused(save(tmp_path, text, "b.py")).startswith(problem)


@pytest.mark.parametrize("text", ["class A(", "x = 1\0", "x = " + "[" * 9000, "\tx"])
def test_what_is_no_python_is_refused(tmp_path, text):
    assert refused(save(tmp_path, text, "b.py")).startswith("1:")  # the words are Python's
