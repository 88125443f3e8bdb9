"""None is no limit, 0 is no time: the table of docs/time_limits.md."""

from __future__ import annotations

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.node import Node, use_node
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import CBState, ConditionState, MonitorState, ServiceState, SimpleActionState
from smachpy.states import AwaitMessage

ENDS = ("succeeded", "aborted", "preempted", "valid", "invalid", "true", "false", "came", "timeout")


class Work(smachpy.State):
    """Sleeps, as long as nobody asks it to stop."""

    def __init__(self, seconds, **options):
        super().__init__(["succeeded", "preempted"], **options)
        self.seconds = seconds

    def execute(self, _userdata):
        return "preempted" if self.sleep(self.seconds) else "succeeded"


class Deaf(Work):
    def execute(self, _userdata):
        self.clock().sleep(self.seconds)
        return "succeeded"


def run(make, *, ask_at=None):
    """Return the outcome of one state, and when it ended [s]."""
    with VirtualClock() as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        with Node("robot", transport=network.session(), clock=clock) as node, use_node(node):
            machine = smachpy.StateMachine(ENDS)
            machine.add("A", make())
            if ask_at is not None:
                clock.call_later(ask_at, machine.request_preempt)
            return machine.execute(), round(clock.now(), 3)


def goal(**limits):
    return lambda: SimpleActionState("act", TestAction, TestGoal(1), **limits)


@pytest.mark.parametrize(
    ("make", "outcome", "seconds"),
    [
        (lambda: Work(5.0, timeout=0), "aborted", 0.0),
        (lambda: Work(5.0, timeout=None), "succeeded", 5.0),
        (goal(server_wait_timeout=0), "aborted", 1.0),
        (goal(server_wait_timeout=5), "aborted", 5.0),
        (lambda: ServiceState("svc", Trigger, timeout=0), "aborted", 0.0),
        (lambda: MonitorState("top", Bool, lambda *_: True, timeout=0), "aborted", 0.0),
        (lambda: ConditionState(lambda _: False, timeout=0), "false", 0.0),
        (lambda: ConditionState(lambda _: True, timeout=0), "true", 0.0),
        (lambda: AwaitMessage("top", Bool, lambda _: True, timeout=0), "timeout", 0.0),
    ],
    ids=lambda value: None if callable(value) else str(value),
)
def test_zero_does_not_wait_and_none_has_no_limit(make, outcome, seconds):
    assert run(make) == (outcome, seconds)


@pytest.mark.parametrize(("grace", "seconds"), [(0, 1.1), (2, 3.1), (None, 20.0)])
def test_a_grace_of_zero_is_none_at_all_and_none_is_no_limit(grace, seconds):
    def make():
        return CBState(wait, outcomes=["succeeded"], preempt_timeout=grace)

    def wait(_userdata):
        smachpy.current_state().clock().event().wait(20.0)
        return "succeeded"

    _, ended = run(make, ask_at=1.0)
    assert ended == pytest.approx(seconds, abs=0.11)


@pytest.mark.parametrize("given", [-1, "5", float("nan"), [1]])
@pytest.mark.parametrize("name", ["timeout", "preempt_timeout"])
def test_what_is_no_time_is_an_error_that_names_the_argument(name, given):
    with pytest.raises(smachpy.InvalidStateError, match=f"{name}: got .*expected seconds >= 0"):
        Work(1.0, **{name: given})


@pytest.mark.parametrize(
    ("given", "kept"), [("inherit", "inherit"), (60.0, 60.0), (60, 60.0), (None, None), (0, 0.0)]
)
def test_a_given_preempt_timeout_of_an_action_state_is_kept_also_the_usual_one(given, kept):
    state = goal(preempt_timeout=given)()
    assert smachpy.get_options(state).preempt_timeout == kept


def test_the_preempt_timeout_of_an_action_state_is_inherited_by_default():
    assert smachpy.get_options(goal()()).preempt_timeout == "inherit"
