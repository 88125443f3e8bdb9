"""Servers of one process that need the same resource run one goal at a time."""

from __future__ import annotations

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.decorated import server
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.exceptions import ActionException
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from smachpy import Concurrence, SimpleActionState, State, StateMachine
from tests.two_nodes import TwoNodes

LONG_S = 60.0


class World(TwoNodes):
    """Servers that take as many seconds as the goal says; `ran` has name, begin and end of each goal."""

    def __init__(self):
        super().__init__()
        self.ran = []

    def serve(self, name, resource, **options):
        def run(goal):
            began = self.clock.now()
            stopped = made.wait_preempt(goal.goal)
            self.ran.append((name, began - self.began, self.clock.now() - self.began))
            (made.set_preempted if stopped else made.set_succeeded)()

        made = SimpleActionServer(
            name, Action, run, False, node=self.robot, resource=resource, **options
        )
        made.start()
        return made

    def client(self, name):
        client = ActionClient(name, Action, node=self.mission)
        assert client.wait_for_server(LONG_S)
        self.began = self.clock.now()
        return client

    def state(self, name, seconds, **options):
        state = SimpleActionState(name, Action, goal=Goal(seconds), node=self.mission, **options)
        self.began = self.clock.now()
        return state


@pytest.fixture
def world():
    with World() as world:
        yield world


def rounded(ran):
    return [(name, round(begin), round(end)) for name, begin, end in ran]


def test_the_goal_of_one_waits_for_that_of_the_other(world):
    for name in ("drive", "dock"):
        world.serve(name, "base")
    drive, dock = world.client("drive"), world.client("dock")
    first, second = drive.send(Goal(3)), dock.send(Goal(2))
    world.clock.sleep(2.0)
    assert (first.status, second.status) == (Status.ACTIVE, Status.PENDING)
    assert first.wait(LONG_S)
    assert second.wait(LONG_S)
    assert rounded(world.ran) == [("drive", 0, 3), ("dock", 3, 5)]
    assert {first.status, second.status} == {Status.SUCCEEDED}


def test_others_run_at_once(world):
    world.serve("drive", "base")
    world.serve("lift", "arm")
    world.serve("look", None)
    sent = [world.client(name).send(Goal(3)) for name in ("drive", "lift", "look")]
    assert all(one.wait(LONG_S) for one in sent)
    assert sorted(rounded(world.ran)) == [("drive", 0, 3), ("lift", 0, 3), ("look", 0, 3)]


def test_a_goal_is_refused_with_the_holder(world):
    world.serve("drive", "base")
    world.serve("dock", ("base", "refuse"))
    first, second = world.client("drive").send(Goal(3)), world.client("dock").send(Goal(2))
    assert second.wait(LONG_S)
    assert second.status == Status.REJECTED
    assert second.text == f"goal {first.id} of action 'drive' holds base"
    assert first.wait(LONG_S)
    again = world.client("dock").send(Goal(2))
    assert again.wait(LONG_S)
    assert again.status == Status.SUCCEEDED


def test_a_goal_stops_the_holder(world):
    world.serve("drive", "base")
    world.serve("dock", ("base", "preempt"))
    first = world.client("drive").send(Goal(30))
    world.clock.sleep(1.0)
    second = world.client("dock").send(Goal(2))
    assert first.wait(LONG_S)
    assert second.wait(LONG_S)
    assert (first.status, second.status) == (Status.PREEMPTED, Status.SUCCEEDED)


@pytest.mark.parametrize("how", ["cancel", "newer goal", "stop"])
def test_a_goal_that_waits_can_be_stopped(world, how):
    world.serve("drive", "base")
    dock = world.serve("dock", "base")
    first = world.client("drive").send(Goal(30))
    client = world.client("dock")
    second = client.send(Goal(2))
    world.clock.sleep(1.0)
    assert second.status == Status.PENDING
    if how == "cancel":
        second.cancel()
    elif how == "stop":
        dock.stop()
    else:
        third = client.send(Goal(2))
    assert second.wait(LONG_S)
    assert world.clock.now() - world.began < 3.0
    assert second.status in {Status.RECALLED, Status.REJECTED}
    assert first.status == Status.ACTIVE
    if how == "newer goal":
        assert third.wait(LONG_S)
        assert third.status == Status.SUCCEEDED
    assert first.wait(LONG_S)
    assert [name for name, *_ in world.ran].count("drive") == 1


def test_a_goal_whose_code_raises_frees_it(world):
    @server("dock", Action, resource="base")
    def dock(_goal, _context):
        raise RuntimeError("no bay")

    with dock.start(node=world.robot):
        client = world.client("dock")
        for _ in range(2):
            sent = client.send(Goal(1))
            assert sent.wait(LONG_S)
            assert (sent.status, "no bay" in sent.text) == (Status.ABORTED, True)


def test_states_and_servers_of_a_process_have_the_same_resources(world):
    class Wash(State):
        def execute(self, userdata):
            self.sleep(4.0)
            return "done"

    world.serve("drive", "base")
    both = Concurrence(["done", "preempted"], "done")
    both.add("WASH", Wash(["done", "preempted"], resource="base"))
    both.add("DRIVE", world.state("drive", 2))
    assert both.execute() == "done"
    assert rounded(world.ran)[0][2] - rounded(world.ran)[0][1] == 2
    assert round(world.clock.now() - world.began) == 6


@pytest.mark.parametrize("policy", ["preempt", "refuse"])
def test_a_state_stops_a_goal_or_is_refused(world, policy):
    class Wash(State):
        def execute(self, userdata):
            self.sleep(1.0)
            return "done"

    world.serve("drive", "base")
    goal = world.client("drive").send(Goal(30))
    world.clock.sleep(1.0)
    sm = StateMachine(["done", "refused", "preempted"])
    sm.add("WASH", Wash(["done", "preempted"], resource=("base", policy)))
    assert sm.execute() == ("done" if policy == "preempt" else "refused")
    assert goal.status == (Status.PREEMPTED if policy == "preempt" else Status.ACTIVE)


def test_the_goal_of_a_state_that_holds_it_does_not_wait_for_that_state(world):
    world.serve("drive", "base")
    sm = StateMachine(["succeeded", "aborted", "preempted"], resource="base")
    sm.add("DRIVE", world.state("drive", 2, resource="base"))
    assert sm.execute() == "succeeded"
    assert rounded(world.ran) == [("drive", 0, 2)]


def test_a_machine_inside_of_a_goal_has_it_too(world):
    class Turn(State):
        def execute(self, userdata):
            return "preempted" if self.sleep(1.0) else "done"

    def run(_goal, _context):
        sm = StateMachine(["done", "preempted"])
        sm.add("TURN", Turn(["done", "preempted"], resource="base"))
        assert sm.execute() == "done"

    drive = server("drive", Action, resource="base")(run)
    with drive.start(node=world.robot):
        sent = world.client("drive").send(Goal(1))
        assert sent.wait(LONG_S)
        assert sent.status == Status.SUCCEEDED, sent.text


@pytest.mark.parametrize(
    ("given", "part"),
    [
        (7, "got 7; expected a name, or (name, policy)"),
        (("base", "queue"), "expected a name, or (name, policy) with one of ['wait', "),
        (("base",), "expected a name"),
        ("my base", "my base"),
    ],
)
def test_a_wrong_resource_is_an_error_at_once(world, given, part):
    with pytest.raises(ActionException, match="action 'drive': ") as caught:
        SimpleActionServer("drive", Action, print, node=world.robot, resource=given)
    assert part in str(caught.value)


def test_a_server_without_code_for_goals_can_hold_nothing(world):
    with pytest.raises(ActionException, match="without execute_cb"):
        SimpleActionServer("drive", Action, node=world.robot, resource="base")


def test_a_goal_that_would_wait_for_its_sender_in_a_circle_is_rejected(world, caplog):
    """It never ended, and so did its mission."""

    class Wash(State):
        def __init__(self, seconds, **options):
            super().__init__(["done", "preempted"], **options)
            self.seconds = seconds

        def execute(self, userdata):
            return "preempted" if self.sleep(self.seconds) else "done"

    def chain(resource, seconds, last, ends):
        sm = StateMachine(["done", "aborted", "preempted"], resource=resource)
        sm.add("FIRST", Wash(seconds), {"done": "LAST"})
        sm.add("LAST", last, ends)
        return sm

    world.serve("drive", "base")
    ends = {}
    both = Concurrence(
        ["done", "preempted"], "done", outcome_cb=lambda found: ends.update(found) or "done"
    )
    drive = world.state("drive", 1)
    both.add("ARM", chain("arm", 1.0, drive, {"succeeded": "done"}))
    both.add("BASE", chain("base", 0.5, Wash(1.0, resource="arm"), {"done": "done"}))
    assert both.execute() == "done"
    assert ends == {"ARM": "aborted", "BASE": "done"}
    assert "closes a circle" in caplog.text
    assert world.ran == []
