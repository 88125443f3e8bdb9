"""The attributes of a user's subclass are the user's, also of containers and of the ready-made states."""

from __future__ import annotations

import contextlib
import copy
import inspect

import pytest

import smachpy
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.std_msgs.msg import Int32
from actionlib_core.interfaces.std_srvs.srv import Trigger, TriggerResponse
from actionlib_core.node import use_node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import Publisher
from smachpy import actions  # noqa: F401
from smachpy.engine.options import NAMES as OPTIONS
from smachpy.machines.state import FunctionState
from smachpy.states import AskOperator, AwaitMessage, Serve, Wait
from tests.regressions.test_attributes_of_states import NAMES, VALUES
from tests.two_nodes import TwoNodes

# What the documentation says of a class: setting it is meant.
DOCUMENTED = {"name", "userdata"}


class Work(smachpy.State):
    def __init__(self):
        super().__init__(["done", "preempted"])

    def execute(self, userdata):
        return "done"


def fill_machine(machine):
    machine.add("A", Work(), {"done": "B"})
    machine.add("B", Work())


def fill_sequence(machine):
    machine.add("A", Work())
    machine.add("B", Work())


def fill_concurrence(machine):
    machine.add("A", Work())
    machine.add("B", Work())


def fill_iterator(machine):
    machine.set_contained_state("A", Work(), ["done"])


# Class -> its arguments, how to fill it, and the outcome of a run.
CONTAINERS = {
    smachpy.StateMachine: ((["done", "preempted"],), {}, fill_machine, "done"),
    smachpy.Sequence: ((["done", "preempted"], "done"), {}, fill_sequence, "done"),
    smachpy.Concurrence: (
        (["done", "preempted"], "preempted"),
        {
            "outcome_map": {"done": {"A": "done"}},
            "child_termination_cb": lambda _: False,
            "outcome_cb": lambda _: None,
        },
        fill_concurrence,
        "done",
    ),
    smachpy.Iterator: (
        (["done", "preempted"], [], []),
        {"it": [1, 2], "exhausted_outcome": "done"},
        fill_iterator,
        "done",
    ),
}
LEAVES = {
    smachpy.CBState: ((lambda ud: "done",), {"outcomes": ["done"]}, "done"),
    FunctionState: ((lambda ud: "done",), {"outcomes": ["done"]}, "done"),
    smachpy.SimpleActionState: (
        ("do", Action, Goal(1)),
        {
            "feedback_cb": lambda ud, f: None,
            "result_cb": lambda ud, s, r: None,
            "exec_timeout": 9.0,
        },
        "succeeded",
    ),
    smachpy.ServiceState: (("lamp", Trigger), {"response_cb": lambda ud, r: None}, "succeeded"),
    smachpy.MonitorState: (("counter", Int32, lambda ud, m: False), {"timeout": 5.0}, "invalid"),
    smachpy.ConditionState: ((lambda ud: True,), {"timeout": 5.0}, "true"),
    AwaitMessage: (("counter", Int32, lambda message: True), {"timeout": 5.0}, "came"),
    Wait: ((1.0,), {}, "done"),
}


def names_of(kind, made):
    """Return every private name of a class and its instance, and every argument's."""
    private = {name for name in (*vars(made), *dir(kind)) if name.startswith("_")}
    private = {
        name
        for name in private
        if not name.startswith(("__", "_smachpy"))
        and "__" not in name  # names that Python itself keeps apart: _Class__name
        and name
        not in {"_preempt_requested", "_repr_svg_"}  # SMACH's, which programs set; Jupyter's
    }
    arguments = {
        name
        for base in kind.__mro__[:-1]
        for name in inspect.signature(base.__init__).parameters
        if name not in {"self", "options", "args", "kwargs"}
    }
    return sorted((private | arguments | {*NAMES} | {*OPTIONS}) - DOCUMENTED)


def subclass(kind, names, value):
    """Return a subclass that sets all `names`, before and after `super().__init__`."""

    class Users(kind):
        def __init__(self, *args, **kwargs):
            for name in names:
                setattr(self, name, value)
            super().__init__(*args, **kwargs)
            for name in names:
                assert vars(self)[name] is value, name
                setattr(self, name, value)

    return Users


def still_the_users(state, names, value):
    assert {name: vars(state)[name] for name in names} == dict.fromkeys(names, value)


@pytest.fixture
def world():
    with TwoNodes() as world, contextlib.ExitStack() as ends:
        server = SimpleActionServer(
            "do", Action, lambda goal: server.set_succeeded(), False, node=world.robot
        )
        server.start()
        ends.enter_context(
            Service("lamp", Trigger, lambda r: TriggerResponse(success=True), node=world.robot)
        )
        publisher = Publisher("counter", Int32, node=world.robot, latch=True)
        publisher.publish(Int32(1))
        yield world


USERS_VALUES = VALUES[:-1]  # not NaN, which is no equal of itself


@pytest.mark.parametrize("value", USERS_VALUES, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("kind", CONTAINERS, ids=lambda kind: kind.__name__)
def test_attributes_of_a_container_are_the_users(kind, value, clock):
    args, kwargs, fill, outcome = CONTAINERS[kind]
    plain = kind(*args, **kwargs)
    names = names_of(kind, plain)
    assert len(names) > len(NAMES)
    made = subclass(kind, names, value)(*args, **kwargs)
    with made:
        fill(made)
    for call in (made.register_start_cb, made.register_transition_cb, made.register_termination_cb):
        call(lambda *_: None)
    assert made.execute() == outcome
    top = smachpy.StateMachine(["done", "preempted"])
    top.add("INNER", made)
    heard = []
    top.subscribe(heard.append)
    assert top.execute() == "done"
    assert heard
    top.check_consistency()
    assert smachpy.describe(top)
    clock.call_later(0.0, top.request_preempt)
    top.execute()
    still_the_users(made, names, value)
    twin = copy.copy(made)
    assert twin.execute() == outcome
    assert list(twin.get_children()) == list(made.get_children())


@pytest.mark.parametrize("value", USERS_VALUES, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("kind", LEAVES, ids=lambda kind: kind.__name__)
def test_attributes_of_a_ready_made_state_are_the_users(kind, value, world):
    args, kwargs, outcome = LEAVES[kind]
    if issubclass(kind, (smachpy.SimpleActionState, smachpy.ServiceState, smachpy.MonitorState)):
        kwargs = {**kwargs, "node": world.mission}
    names = names_of(kind, kind(*args, **kwargs))
    made = subclass(kind, names, value)(*args, **kwargs)
    machine = smachpy.StateMachine(["done", "other"])
    ends = {one: "done" if one == outcome else "other" for one in made.get_registered_outcomes()}
    machine.add("A", made, ends)
    heard = []
    machine.subscribe(heard.append)
    with use_node(world.mission):
        for _ in range(2):
            assert machine.execute() == "done"
    machine.check_consistency()
    assert smachpy.describe(machine)
    smachpy.check(machine)
    still_the_users(made, names, value)


@pytest.mark.parametrize("kind", [AskOperator, Serve])
def test_states_with_more_around_them_keep_nothing_under_names_of_the_users(kind):
    made = kind("Go?", patience=5.0) if kind is AskOperator else kind()
    own = {
        n
        for n in vars(made)
        if n.startswith("_") and not n.startswith(("_smachpy", f"_{kind.__name__}__"))
    }
    assert own == {"_preempt_requested"}  # SMACH's own name, on every state
