"""Ready-made states over the bridge to a real ROS 1."""

from __future__ import annotations

import pytest

from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy import ServiceState, SimpleActionState, StateMachine
from smachpy.states import AwaitMessage, Publish, clear_costmaps

pytestmark = [pytest.mark.ros1, pytest.mark.zenoh]

WAIT_S = 60.0


@pytest.mark.slow
def test_a_mission_publishes_waits_calls_and_acts_in_ros_1(ros, bridge, node):
    topics = ros.start("topics", "listener")
    ros.start("services", "gripper", "move_base/clear_costmaps")
    ros.start("action_server", "lift", "lift_worker")
    topics.ask("subscribe /command")
    topics.ask("advertise /done latch")
    topics.ask("publish /done yes")
    bridge(
        topics=["/command", "/done"],
        services=["/gripper", "/move_base/clear_costmaps"],
        actions=["lift"],
    )

    sm = StateMachine(["succeeded", "aborted", "preempted", "timeout"], name="OVER")
    go = Publish("/command", String, String("go"), timeout=WAIT_S)
    sm.add("SAY", go, {"succeeded": "HEAR"})
    hear = AwaitMessage(
        "/done", String, lambda text: text.data == "yes", key="said", timeout=WAIT_S
    )
    sm.add("HEAR", hear, {"came": "GRIP"})
    grip = ServiceState("gripper", SetBool, request_slots=["data"], timeout=WAIT_S)
    sm.add("GRIP", grip, {"succeeded": "LIFT"})
    lift = SimpleActionState("lift", TestAction, goal=TestGoal(2), cancel_on_client_lost=True)
    sm.add("LIFT", lift, {"succeeded": "CLEAR"})
    sm.add("CLEAR", clear_costmaps(navigation="move_base", timeout=WAIT_S))
    sm.userdata.data = True
    assert sm.execute() == "succeeded"
    assert sm.userdata.said == String("yes")
    assert topics.ask("heard /command 1") == "go"
