"""Half-open links: the cable to the robot is cut, and nobody is told."""

from __future__ import annotations

import pytest

from actionlib_core import SimpleActionClient
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.pubsub.topic import Subscriber
from tests.actionlib_core.ros1 import cable as cables
from tests.actionlib_core.ros1.conftest import impatient

pytestmark = [pytest.mark.ros1, pytest.mark.zenoh]

WAIT_S = 60.0


@pytest.fixture
def cable(monkeypatch):
    cable = cables.lay(monkeypatch)
    yield cable
    cable.close()


@pytest.mark.parametrize("broken", [False, True], ids=["it held", "connections were reset"])
def test_goals_are_lost_while_the_cable_is_cut_and_run_again_after_it(
    own_ros, cable, bridge, node, broken
):
    own_ros.start("action_server", "far", "far_worker")
    topics = own_ros.start("topics", "far_topics")
    topics.ask("advertise /far_text plain")
    made = bridge(master=own_ros.uri, actions=["far"], topics=["/far_text"])
    heard = node.clock.event()
    subscriber = Subscriber("far_text", String, lambda _message: heard.set())
    client = SimpleActionClient("far", msg.TestAction)
    assert client.wait_for_server(WAIT_S)
    begun = node.clock.event()
    client.send_goal(msg.TestGoal(-5), feedback_cb=lambda _feedback: begun.set())
    assert begun.wait(WAIT_S)

    cable.cut()
    with impatient(made, "/far"):
        assert client.wait_for_result(WAIT_S)
    assert client.get_state() == GoalStatus.LOST
    assert "far_worker" in client.get_goal_status_text()
    assert made.ended == ""

    cable.mend(broken=broken)
    assert client.wait_for_server(WAIT_S)
    client.cancel_all_goals()
    client.send_goal(msg.TestGoal(4))
    assert client.wait_for_result(WAIT_S)
    assert client.get_result() == msg.TestResult(8)
    assert subscriber.wait_for_connections(1, WAIT_S)
    while not heard.wait(0.5):
        topics.ask("publish /far_text text")
    subscriber.unregister()
    made.close()
    assert own_ros.names_of(made.name) == []
