"""`ActionServerWrapper`: a machine behind an action, from a client's point of view."""

from __future__ import annotations

import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestFeedback as Feedback
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib.msg import TestResult as Result
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from smachpy import CBState, InvalidStateError, State, StateMachine
from smachpy.actions.action_server_wrapper import ActionServerWrapper
from tests.two_nodes import TwoNodes

ALL = ["done", "failed", "stopped"]


class Count(State):
    """Counts up to the goal, one a second."""

    def __init__(self):
        super().__init__(ALL, ["action_goal"], ["action_feedback", "action_result", "count"])

    def execute(self, ud):
        for number in range(1, ud.action_goal.goal + 1):
            if self.sleep(1.0):
                self.service_preempt()
                return "stopped"
            ud.action_feedback = Feedback(number)
            ud.count = number * 10
        ud.action_result = Result(ud.action_goal.goal)
        return "done" if ud.action_goal.goal < 100 else "failed"


class World(TwoNodes):
    def __init__(self, seed=None):
        super().__init__(seed)
        self.feedback = []

    def wrap(self, machine, **kwargs):
        outcomes = {
            "succeeded_outcomes": ["done"],
            "aborted_outcomes": ["failed"],
            "preempted_outcomes": ["stopped"],
        }
        wrapper = ActionServerWrapper("do", Action, machine, node=self.robot, **(outcomes | kwargs))
        wrapper.run_server()
        return wrapper

    def client(self):
        client = SimpleActionClient("do", Action, node=self.mission)
        assert client.wait_for_server(5.0)
        return client

    def send(self, client, number):
        self.feedback.clear()
        client.send_goal(
            Goal(number),
            feedback_cb=lambda f: self.feedback.append((self.clock.now(), f.feedback)),
        )


@pytest.fixture
def world():
    with World() as world:
        yield world


def machine_of(state, **kwargs):
    defaults = {"input_keys": ["action_goal"], "output_keys": ["action_result"]}
    machine = StateMachine(ALL, **(defaults | kwargs))
    with machine:
        machine.add("COUNT", state)
    return machine


def test_goal_feedback_and_result_go_through(world):
    world.wrap(machine_of(Count()))
    client = world.client()
    start = world.clock.now()
    world.send(client, 3)
    assert client.wait_for_result(60.0)
    assert client.get_state() == GoalStatus.SUCCEEDED
    assert client.get_result() == Result(3)
    assert client.get_goal_status_text() == "the machine ended with 'done'"
    assert [(t - start, f) for t, f in world.feedback] == [(1.0, 1), (2.0, 2), (3.0, 3)]


@pytest.mark.parametrize(
    ("kwargs", "number", "status"),
    [
        ({}, 2, GoalStatus.SUCCEEDED),
        ({}, 100, GoalStatus.ABORTED),
        ({"aborted_outcomes": []}, 100, GoalStatus.ABORTED),
        ({"succeeded_outcomes": []}, 2, GoalStatus.ABORTED),
        ({"succeeded_outcomes": [], "preempted_outcomes": ["done"]}, 2, GoalStatus.PREEMPTED),
    ],
)
def test_outcomes_are_mapped(world, kwargs, number, status):
    world.wrap(machine_of(Count()), **kwargs)
    client = world.client()
    world.send(client, number)
    assert client.wait_for_result(200.0)
    assert client.get_state() == status


def test_a_cancel_preempts_the_machine(world):
    world.wrap(machine_of(Count()))
    client = world.client()
    world.send(client, 50)
    world.clock.sleep(2.5)
    start = world.clock.now()
    client.cancel_goal()
    assert client.wait_for_result(5.0)
    assert client.get_state() == GoalStatus.PREEMPTED
    assert world.clock.now() == start
    world.send(client, 1)  # and the next goal runs
    assert client.wait_for_result(5.0)
    assert client.get_state() == GoalStatus.SUCCEEDED


def test_a_newer_goal_preempts_the_machine(world):
    world.wrap(machine_of(Count()))
    one, two = world.client(), world.client()
    world.send(one, 50)
    world.clock.sleep(2.5)
    world.send(two, 2)
    assert one.wait_for_result(5.0)
    assert one.get_state() == GoalStatus.PREEMPTED
    assert two.wait_for_result(5.0)
    assert (two.get_state(), two.get_result()) == (GoalStatus.SUCCEEDED, Result(2))


@pytest.mark.parametrize("seed", range(40))
def test_a_cancel_at_any_moment_ends_this_goal_and_no_other(seed):
    with World(seed) as world:
        world.wrap(machine_of(Count()))
        client = world.client()
        for moment in (0.0, 0.0, 1.0, 2.0, 3.0):
            world.send(client, 2)
            world.clock.sleep(moment)
            client.cancel_goal()
            assert client.wait_for_result(5.0)
            ended = {GoalStatus.PREEMPTED, GoalStatus.RECALLED}
            assert client.get_state() in (ended if moment < 2.0 else {*ended, GoalStatus.SUCCEEDED})
            world.send(client, 2)
            assert client.wait_for_result(5.0)
            assert client.get_state() == GoalStatus.SUCCEEDED


def test_an_exception_aborts_the_goal_with_its_text(world, caplog):
    def broken(ud):
        raise LookupError("no map")

    world.wrap(machine_of(CBState(broken, outcomes=ALL)))
    client = world.client()
    world.send(client, 1)
    assert client.wait_for_result(5.0)
    assert client.get_state() == GoalStatus.ABORTED
    assert "/SM_ROOT/COUNT: CBState raised LookupError: no map" in client.get_goal_status_text()


def test_fields_are_mapped_to_keys(world):
    seen = []

    class Copy(State):
        def __init__(self):
            super().__init__(ALL, ["wanted", "goal"], ["progress", "got"])

        def execute(self, ud):
            seen.append((ud.wanted, ud.goal))
            ud.progress = 5
            ud.got = ud.wanted + 1
            return "done"

    machine = machine_of(
        Copy(), input_keys=["wanted", "goal"], output_keys=["got", "action_result"]
    )
    world.wrap(
        machine,
        goal_slots_map={"goal": "wanted"},
        feedback_slots_map={"feedback": "progress"},
        result_slots_map={"result": "got"},
        expand_goal_slots=True,
    )
    client = world.client()
    world.send(client, 7)
    assert client.wait_for_result(5.0)
    assert client.get_result() == Result(8)
    assert seen == [(7, 7)]
    assert [f for _, f in world.feedback] == [5]


class Once(State):
    """Writes a result, and feedback, for the goal 1 only; waits a second before that."""

    def __init__(self):
        super().__init__(ALL, ["action_goal"], ["got", "result", "progress", "log"])

    def execute(self, ud):
        if self.sleep(1.0):
            return "stopped"
        if ud.action_goal.goal == 1:
            ud.got = ud.result = 42
            ud.progress = 7
        return "done"


KEPT = {
    "map": {"result_slots_map": {"result": "got"}, "feedback_slots_map": {"feedback": "progress"}},
    "packed": {"pack_result_slots": True, "feedback_slots_map": {"feedback": "progress"}},
}


@pytest.mark.parametrize("at_first", [None, 0, 3], ids=["no value", "zero", "three"])
@pytest.mark.parametrize("ended", ["finished", "cancelled", "never begun"])
@pytest.mark.parametrize("options", KEPT.values(), ids=KEPT)
def test_values_of_the_former_goal_do_not_reach_the_next_client(world, options, ended, at_first):
    machine = machine_of(Once(), output_keys=["got", "result"])
    if at_first is not None:
        machine.userdata.got = machine.userdata.result = at_first
    world.wrap(machine, **options)
    client = world.client()
    world.send(client, 1)
    assert client.wait_for_result(5.0)
    assert client.get_result() == Result(42)
    assert [number for _, number in world.feedback] == [7]
    world.send(client, 2)
    if ended == "cancelled":
        world.clock.sleep(0.5)
    if ended != "finished":
        client.cancel_goal()
    assert client.wait_for_result(5.0)
    begun = ended != "never begun"
    assert client.get_result() == Result((at_first or 0) if begun else 0)
    assert world.feedback == []
    without = ended == "finished" and at_first is None and "result_slots_map" in options
    expected = {
        "finished": GoalStatus.ABORTED if without else GoalStatus.SUCCEEDED,
        "cancelled": GoalStatus.PREEMPTED,
        "never begun": GoalStatus.RECALLED,
    }
    assert client.get_state() == expected[ended]


def test_cancel_before_the_result_is_written_is_no_error(world):
    """The first goal, whose result key has no value yet, was aborted."""
    options = KEPT["map"]
    world.wrap(machine_of(Once(), output_keys=["got"]), **options)
    client = world.client()
    for wait in (0.0, 0.5):
        world.send(client, 1)
        world.clock.sleep(wait)
        client.cancel_goal()
        assert client.wait_for_result(5.0)
        assert client.get_state() in {GoalStatus.PREEMPTED, GoalStatus.RECALLED}
        assert client.get_result() == Result(0)


def test_result_that_is_never_written_is_named_after_a_success(world):
    world.wrap(machine_of(Once(), output_keys=["got"]), **KEPT["map"])
    client = world.client()
    world.send(client, 2)
    assert client.wait_for_result(5.0)
    assert client.get_state() == GoalStatus.ABORTED
    assert "got" in client.get_goal_status_text()


def test_what_a_state_changes_in_place_is_as_before_for_the_next_goal(world):
    class Append(State):
        def __init__(self):
            super().__init__(ALL, ["action_goal"], io_keys=["seen"])

        def execute(self, ud):
            ud.seen.append(ud.action_goal.goal)
            return "done"

    machine = machine_of(Append(), output_keys=["seen"])
    machine.userdata.seen = []
    world.wrap(machine, feedback_slots_map={"feedback": "seen"})
    kept = []
    machine.register_start_cb(lambda userdata, _: kept.append(list(userdata.seen)))
    client = world.client()
    for number in (1, 2):
        world.send(client, number)
        assert client.wait_for_result(5.0)
    assert kept == [[], []]


def test_results_of_an_earlier_goal_do_not_leak(world):
    class Once(State):
        def __init__(self):
            super().__init__(ALL, ["action_goal"], ["action_result"])

        def execute(self, ud):
            if ud.action_goal.goal == 1:
                ud.action_result = Result(42)
            return "done"

    world.wrap(machine_of(Once()))
    client = world.client()
    for number, expected in ((1, 42), (2, 0)):
        world.send(client, number)
        assert client.wait_for_result(5.0)
        assert client.get_result() == Result(expected)


def test_feedback_of_a_machine_with_a_slash_in_its_name_is_sent_at_once(world):
    """Only what a state wrote last arrived, when it had ended."""

    class Counts(State):
        def __init__(self):
            super().__init__(ALL, output_keys=["action_feedback"])

        def execute(self, ud):
            for number in (1, 2):
                ud.action_feedback = Feedback(number)
                self.sleep(1.0)
            return "done"

    machine = machine_of(Counts())
    machine.name = "r1/do"
    world.wrap(machine)
    client = world.client()
    world.send(client, 1)
    assert client.wait_for_result(5.0)
    assert [f for _, f in world.feedback] == [1, 2]


def test_feedback_changed_in_place_is_sent_at_the_transition(world):
    class Change(State):
        def __init__(self):
            super().__init__(ALL, io_keys=["action_feedback"])

        def execute(self, ud):
            ud.action_feedback.feedback = 9
            return "done"

    world.wrap(machine_of(Change()))
    client = world.client()
    world.send(client, 1)
    assert client.wait_for_result(5.0)
    assert [f for _, f in world.feedback] == [9]


def test_stop_preempts_and_leaves_the_name(world):
    wrapper = world.wrap(machine_of(Count()))
    client = world.client()
    world.send(client, 50)
    world.clock.sleep(1.5)
    wrapper.stop()
    wrapper.stop()
    assert client.wait_for_result(5.0)
    assert not wrapper.wrapped_container.is_running()
    assert client.get_state() in {GoalStatus.PREEMPTED, GoalStatus.LOST}


def test_wrong_arguments_are_all_named_at_once(world):
    with pytest.raises(InvalidStateError) as raised:
        world.wrap(
            machine_of(Count()),
            succeeded_outcomes=["don", "failed"],
            result_slots_map={"reslt": "x"},
        )
    text = str(raised.value)
    assert "ActionServerWrapper 'do': succeeded_outcomes: got 'don'" in text
    assert "Did you mean 'done'?" in text
    assert "aborted_outcomes: got 'failed', which is in succeeded_outcomes too" in text
    assert "result_slots_map: got field 'reslt'" in text


def test_keys_that_nobody_uses_are_not_made(world):
    machine = StateMachine(["done"])
    with machine:
        machine.add("A", CBState(lambda ud: "done", outcomes=["done"]))
    world.wrap(machine, aborted_outcomes=[], preempted_outcomes=[])
    client = world.client()
    world.send(client, 1)
    assert client.wait_for_result(5.0)
    assert client.get_state() == GoalStatus.SUCCEEDED
    assert machine.userdata.keys() == []
