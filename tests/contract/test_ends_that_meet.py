"""A server that is stopped while its goals end: no call of the program fails because of that."""

from __future__ import annotations

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer
from actionlib_core.exceptions import TransportError
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.ros2.example_interfaces.action import Fibonacci
from tests.two_nodes import TwoNodes

TYPES = {"own": (msg.TestAction, msg.TestGoal), "ros2": (Fibonacci, Fibonacci.Goal)}


class World(TwoNodes):
    def __init__(self, wire):
        self.action, self.goal = TYPES[wire]
        self.handles, self.errors = [], []
        super().__init__()

    def serve(self):
        def on_goal(handle):
            handle.set_accepted()
            self.handles.append(handle)

        self.server = ActionServer("dig", self.action, on_goal, node=self.robot)
        self.client = ActionClient("dig", self.action, node=self.mission)
        self.client.wait_for_server()
        sent = self.client.send(self.goal())
        self.clock.sleep(0.1)
        return sent

    def stop_after(self, name):
        """Stop the server in another thread after it has called this method of its port."""
        port = self.server.keeper.port
        method = getattr(port, name)

        def call_and_stop(*args, **kwargs):
            setattr(port, name, method)
            method(*args, **kwargs)
            self.clock.spawn(self.server.stop, name="stop").join()

        setattr(port, name, call_and_stop)


@pytest.fixture(params=TYPES)
def world(request):
    with World(request.param) as world:
        yield world


@pytest.mark.parametrize("end", ["set_succeeded", "set_aborted", "set_canceled"])
def test_goal_that_ends_as_the_server_is_stopped(world, end):
    """`set_succeeded()` raised TransportError between its result and its status list."""
    sent = world.serve()
    world.stop_after("send_result")
    getattr(world.handles[0], end)()
    assert sent.wait(5.0)
    expected = {
        "set_succeeded": Status.SUCCEEDED,
        "set_aborted": Status.ABORTED,
        "set_canceled": Status.PREEMPTED,
    }
    assert sent.status is expected[end]


def test_feedback_after_the_stop_is_an_error(world):
    """It ends the loop of code that has not noticed the stop."""
    world.serve()
    world.server.stop()
    with pytest.raises(TransportError, match="the server is stopped"):
        world.handles[0].publish_feedback(None)


def test_goal_that_comes_again_as_the_server_is_stopped_raises_nothing(world, caplog):
    world.serve()
    keeper, record = world.server.keeper, world.handles[0].record
    world.handles[0].set_succeeded()
    world.server.stop()
    keeper.stopped = False  # as for a thread that has looked just before
    assert not keeper.on_goal(record.id, record.stamp_ns, world.goal(), "somebody")
    assert not caplog.records


def test_session_that_the_program_closed_is_told(world):
    world.serve()
    world.robot.transport.close()
    with pytest.raises(TransportError):
        world.handles[0].set_succeeded()


def test_goals_of_a_session_that_the_program_closed_are_lost_with_the_reason(world, caplog):
    """Each question about a goal raised an error in the clock's thread, for ever."""
    sent = [world.serve(), world.client.send(world.goal())]
    world.clock.sleep(1.0)
    world.mission.transport.close()
    world.clock.sleep(60.0)
    assert [each.status for each in sent] == [Status.LOST] * 2
    own = world.action is msg.TestAction  # on ROS 2 the silence of the server is noticed first
    assert all(("closed" if own else "not been heard") in each.text for each in sent)
    world.client.stop()
