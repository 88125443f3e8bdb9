"""`ConditionState`: counted exactly, bounded, woken by topics, ended by a preempt at once."""

from __future__ import annotations

import pytest

from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.topic import Publisher
from actionlib_core.time import Duration
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import InvalidStateError, StateMachine, UserData, cb_interface
from smachpy.actions.condition_state import ConditionState


class Answers:
    """A condition that gives these answers, the last for ever."""

    def __init__(self, *answers):
        self.answers = answers
        self.calls = 0

    def __call__(self, userdata):
        self.calls += 1
        return self.answers[min(self.calls, len(self.answers)) - 1]


@pytest.mark.parametrize(("max_checks", "expected"), [(0, 1), (1, 1), (2, 2), (5, 5)])
def test_smach_checked_once_too_often(clock, max_checks, expected):
    never = Answers(False)
    assert ConditionState(never, max_checks=max_checks).execute(UserData()) == "false"
    assert never.calls == expected
    assert clock.now() == pytest.approx(0.05 * (expected - 1))


def test_it_ends_with_the_first_true_answer(clock):
    third = Answers(0, "", [1])
    state = ConditionState(third, poll_rate=Duration(2.0), max_checks=-1)
    assert state.execute(UserData()) == "true"
    assert (third.calls, clock.now()) == (3, 4.0)


def test_the_timeout_ends_it(clock):
    never = Answers(False)
    state = ConditionState(never, poll_rate=0.4, timeout=Duration(1.0), max_checks=-1)
    assert state.execute(UserData()) == "false"
    assert (never.calls, clock.now()) == (3, 1.0)


def test_a_timeout_of_zero_looks_once(clock):
    assert ConditionState(Answers(True), timeout=0, max_checks=-1).execute(UserData()) == "true"
    assert ConditionState(Answers(False), timeout=0, max_checks=-1).execute(UserData()) == "false"
    assert clock.now() == 0.0


def test_a_preempt_ends_it_at_once(clock):
    state = ConditionState(Answers(False), poll_rate=10.0, max_checks=-1)
    clock.call_later(12.5, state.request_preempt)
    assert state.execute(UserData()) == "preempted"
    assert clock.now() == 12.5
    assert not state.preempt_requested()


def test_a_preempt_before_it_checks_nothing(clock):
    answers = Answers(True)
    state = ConditionState(answers)
    state.request_preempt()
    assert state.execute(UserData()) == "preempted"
    assert answers.calls == 0


def test_a_poll_rate_of_nothing_still_lets_others_run(clock):
    state = ConditionState(Answers(False), poll_rate=0, max_checks=-1)
    clock.call_later(0.5, state.request_preempt)
    assert state.execute(UserData()) == "preempted"


def test_what_the_condition_raises_goes_through(clock):
    def broken(userdata):
        raise LookupError("no map")

    with pytest.raises(LookupError, match="no map"):
        ConditionState(broken).execute(UserData())


def test_it_reads_its_keys_and_those_of_the_interface(clock):
    @cb_interface(input_keys=["limit"])
    def low(userdata):
        return userdata.level < userdata.limit

    machine = StateMachine(["true", "false", "preempted"])
    with machine:
        machine.add("LOW", ConditionState(low, ["level"]))
    machine.userdata.level, machine.userdata.limit = 1, 2
    assert machine.execute() == "true"


def test_a_message_wakes_it(clock):
    network = MemoryNetwork(clock)
    robot = Node("robot", transport=network.session(), clock=clock)
    with Node("mission", transport=network.session(), clock=clock) as node, use_node(node):
        doors = Publisher("door", Bool, node=robot)
        answers = Answers(False, False, True)
        state = ConditionState(answers, poll_rate=None, max_checks=-1, wake_on=[("door", Bool)])
        for moment in (3.0, 7.0):
            clock.call_later(moment, lambda: doors.publish(True))
        assert state.execute(UserData()) == "true"
        assert (answers.calls, clock.now()) == (3, 7.0)
        clock.sleep(0.1)
        assert doors.get_num_connections() == 0
        doors.unregister()
    robot.close()


def test_arguments_without_a_meaning_are_refused():
    with pytest.raises(InvalidStateError, match=r"max_checks: got -2; expected -1"):
        ConditionState(Answers(True), max_checks=-2)
    with pytest.raises(
        InvalidStateError, match=r"poll_rate: got None without topics.* Try wake_on"
    ):
        ConditionState(Answers(True), poll_rate=None)
    with pytest.raises(InvalidStateError, match="cond_cb: got 3"):
        ConditionState(3)
    for topic in ("two words", "", 3, None):
        with pytest.raises(InvalidStateError, match="wake_on"):
            ConditionState(Answers(True), wake_on=[(topic, Bool)])


def test_it_describes_itself():
    kind, details = ConditionState(Answers(True), timeout=3, max_checks=2).describe_details()
    assert kind == "condition"
    assert dict(details) == {"condition": "Answers", "timeout": "3 s -> false", "checks": "2"}
