"""Durations are checked where they are given: NaN ended threads, a text failed far away."""

from __future__ import annotations

import math

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.exceptions import DurationTypeError, InvalidDurationError, WaitTimeoutError
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.std_msgs.msg import Int32
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.pubsub.service_proxy import ServiceProxy, wait_for_service
from actionlib_core.pubsub.topic import Publisher, wait_for_message
from actionlib_core.time import Duration
from tests.two_nodes import TwoNodes


class World(TwoNodes):
    def __init__(self):
        super().__init__()
        self.taken = []
        self.server = SimpleActionServer("do", Action, self.drive, False, node=self.robot)
        self.server.start()
        self.simple = SimpleActionClient("do", Action, node=self.mission)
        self.client = ActionClient("do", Action, node=self.mission)
        assert self.simple.wait_for_server(5.0)
        self.proxy = ServiceProxy("lamp", Trigger, node=self.mission)
        self.publisher = Publisher("counter", Int32, node=self.mission)

    def drive(self, goal):
        self.taken.append(goal)
        self.server.wait_preempt(5.0)
        self.server.set_succeeded()


@pytest.fixture
def world():
    with World() as world:
        yield world


WAITS = {
    "wait_for_server": lambda w, t: w.simple.wait_for_server(t),
    "wait_for_result": lambda w, t: w.simple.wait_for_result(t),
    "execute_timeout": lambda w, t: w.simple.send_goal_and_wait(Goal(1), t),
    "preempt_timeout": lambda w, t: w.simple.send_goal_and_wait(Goal(1), 1.0, t),
    "ack_timeout": lambda w, t: w.client.send_goal(Goal(1), ack_timeout=t),
    "send": lambda w, t: w.client.send(Goal(1), timeout=t),
    "attach": lambda w, t: w.client.attach("id", ack_timeout=t),
    "connections": lambda w, t: w.publisher.wait_for_connections(1, t),
    "message": lambda w, t: wait_for_message("counter", Int32, t, node=w.mission),
    "proxy": lambda w, t: ServiceProxy("lamp", Trigger, timeout=t, node=w.mission),
    "wait_for_service": lambda w, t: wait_for_service("lamp", t, node=w.mission),
    "proxy.wait_for_service": lambda w, t: w.proxy.wait_for_service(t),
}


SETTINGS = ("ack_timeout", "send", "attach", "proxy")  # the others wait themselves


@pytest.mark.parametrize(
    ("wait", "value"),
    [
        *((wait, math.nan) for wait in WAITS),
        *((wait, value) for wait in SETTINGS for value in (-1.0, -math.inf, Duration(-1))),
    ],
)
def test_duration_that_cannot_be_waited_is_a_value_error(world, wait, value):
    with pytest.raises(ValueError, match="timeout") as caught:
        WAITS[wait](world, value)
    assert isinstance(caught.value, InvalidDurationError)
    assert caught.value.argument.endswith("timeout")
    assert caught.value.value is value
    world.clock.sleep(1.0)
    assert not world.taken, "a goal was sent although nobody would wait for it"


@pytest.mark.parametrize("wait", WAITS)
@pytest.mark.parametrize("value", ["5", b"5", [5], {}, object])
def test_duration_that_is_no_number_is_a_type_error(world, wait, value):
    with pytest.raises(TypeError, match="timeout") as caught:
        WAITS[wait](world, value)
    assert isinstance(caught.value, DurationTypeError)
    world.clock.sleep(1.0)
    assert not world.taken


@pytest.mark.parametrize("past", [-1.0, -math.inf, Duration(-1)])
def test_a_wait_whose_time_is_over_looks_once(world, past):
    started = world.clock.now()
    assert world.simple.wait_for_server(past)
    assert not SimpleActionClient("nobody", Action, node=world.mission).wait_for_server(past)
    assert not world.publisher.wait_for_connections(1, past)
    for wait in ("message", "wait_for_service", "proxy.wait_for_service"):
        with pytest.raises(WaitTimeoutError):
            WAITS[wait](world, past)
    assert not world.client.send_goal(Goal(1)).wait(past)
    assert world.clock.now() == started


@pytest.mark.parametrize("past", [-1.0, -math.inf, Duration(-1)])
def test_a_goal_is_waited_for_without_a_limit_by_a_negative_one_as_in_actionlib(
    world, caplog, past
):
    world.simple.send_goal(Goal(1))
    assert world.simple.wait_for_result(past)
    assert world.simple.send_goal_and_wait(Goal(1), past, past) == GoalStatus.SUCCEEDED
    assert len(world.taken) == 2
    warned = [r.args[1] for r in caplog.records if r.name.endswith("simple_client")]
    assert warned == ["timeout", "execute_timeout", "preempt_timeout"]


def test_goal_handles_check_their_timeouts(world):
    handle = world.client.send_goal(Goal(1))
    sent = world.client.send(Goal(1))
    for wait in (handle.wait, sent.wait, sent.result):
        with pytest.raises(InvalidDurationError):
            wait(math.nan)
        with pytest.raises(DurationTypeError):
            wait("5")
    assert handle.wait(math.inf)


def test_server_waits_no_time_for_what_is_left_of_one_but_refuses_what_is_none(world):
    for wait in (world.server.wait_preempt, world.server.wait):
        assert not wait(-1.0)
        with pytest.raises(InvalidDurationError):
            wait(math.nan)
        with pytest.raises(DurationTypeError):
            wait("5")


@pytest.mark.parametrize("forever", [0, 0.0, None, math.inf, Duration(0)])
def test_zero_waits_for_ever_where_actionlib_says_so(world, forever):
    world.simple.send_goal(Goal(1))
    assert world.simple.wait_for_result(forever)
    assert world.simple.get_state() == GoalStatus.SUCCEEDED
