"""Ready-made states over the bridge to a real ROS 1."""

from __future__ import annotations

import pytest

from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal
from actionlib_core.interfaces.bags import read_bag
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from smachpy import CBState, ServiceState, SimpleActionState, StateMachine
from smachpy.states import (
    AwaitMessage,
    LookUpTransform,
    Publish,
    RecordBag,
    RestoreParameters,
    SetParameters,
    clear_costmaps,
)

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


@pytest.mark.slow
def test_a_mission_looks_up_transforms_of_ros_1_and_records_them(ros, bridge, node, tmp_path):
    ros.start("robot_states")
    bridge(topics=["/tf", "/tf_static"])

    sm = StateMachine(["succeeded", "aborted", "preempted"], name="SEE")
    look = LookUpTransform("seen", "camera", timeout=WAIT_S)
    sm.add("LOOK", look, {"succeeded": "RECORD"})
    # They come ten times a second: a busy computer may record for longer until there is one.
    record = RecordBag(tmp_path / "tf.mcap", {"/tf": TFMessage}, seconds=1.0, key="bag")
    sm.add("RECORD", record, {"done": "ENOUGH"})
    enough = CBState(
        lambda userdata: "yes" if any(read_bag(userdata.bag)) else "no",
        outcomes=["yes", "no"],
        input_keys=["bag"],
    )
    sm.add("ENOUGH", enough, {"yes": "succeeded", "no": "RECORD"})
    assert sm.execute() == "succeeded"
    assert (sm.userdata.seen.header.frame_id, sm.userdata.seen.pose.position.x) == ("map", 3.5)
    first = next(read_bag(sm.userdata.bag))
    assert (first.topic, first.message.transforms[0].child_frame_id) == ("tf", "base_link")


@pytest.mark.slow
def test_a_mission_reconfigures_a_node_of_ros_1_and_sets_it_back(ros, bridge, node):
    planner = ros.start("robot_states")
    bridge(
        services=["/planner/set_parameters"],
        topics=["/planner/parameter_descriptions", "/planner/parameter_updates"],
    )

    sm = StateMachine(["succeeded", "aborted", "preempted"], name="SLOWLY")
    slow = SetParameters("planner", {"speed": 0.2, "samples": 7}, ros1=True, timeout=WAIT_S)
    sm.add("SLOW", slow, {"succeeded": "WORK"})
    seen = []
    work = CBState(lambda _: seen.append(planner.ask("?")) or "done", outcomes=["done"])
    sm.add("WORK", work, {"done": "BACK"})
    sm.add("BACK", RestoreParameters(timeout=WAIT_S))
    assert sm.execute() == "succeeded"
    assert [*seen, planner.ask("?")] == ["0.2 7", "0.5 3"]
    beyond = SetParameters("planner", {"speed": 9.0}, ros1=True, timeout=WAIT_S)
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="TOO_FAST")
    sm.add("FAST", beyond)
    sm.add_cleanup("BACK", RestoreParameters(timeout=WAIT_S))
    assert sm.execute() == "aborted"
    assert planner.ask("?") == "0.5 3"
