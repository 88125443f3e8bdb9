"""The states that talk to the network, on ROS 2's wire: a mission in a process beside its robot's."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import pytest

from tests.free_port import free_port

pytestmark = pytest.mark.zenoh
WAIT_S = 60

ROBOT = """
import sys
from actionlib_core import Publisher, Service, SimpleActionServer, init
from actionlib_core.interfaces.ros2.std_msgs.msg import Int32, String
from actionlib_core.interfaces.ros2.std_srvs.srv import SetBool
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci

init("robot")
lamp = Service("lamp", SetBool, lambda request: (True, "on" if request.data else "off"))
level = Publisher("battery", Int32, latch=True)
level.publish(80)
door = Publisher("door", String, latch=True)
door.publish("open")

def count(goal):
    for number in range(goal.order):
        server.publish_feedback(Fibonacci.Feedback(sequence=[number]))
    if goal.order < 0:
        if server.wait_preempt(30.0):
            server.set_preempted()
        return
    server.set_succeeded(Fibonacci.Result(sequence=list(range(goal.order))))

server = SimpleActionServer("count", Fibonacci, count)
print("ready", flush=True)
sys.stdin.read()
"""

MISSION = """
import smachpy
from actionlib_core import init
from actionlib_core.interfaces.ros2.std_msgs.msg import Int32, String
from actionlib_core.interfaces.ros2.std_srvs.srv import SetBool
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci

init("mission")
sm = smachpy.StateMachine(["done", "failed"])
failed = {"preempted": "failed", "aborted": "failed"}
with sm:
    smachpy.StateMachine.add(
        "LAMP",
        smachpy.ServiceState(
            "lamp", SetBool, request=SetBool.Request(data=True), response_key="lamp"
        ),
        {"succeeded": "COUNT", **failed},
    )
    smachpy.StateMachine.add(
        "COUNT",
        smachpy.SimpleActionState(
            "count", Fibonacci, goal=Fibonacci.Goal(order=4), result_key="numbers"
        ),
        {"succeeded": "BATTERY", **failed},
    )
    smachpy.StateMachine.add(
        "BATTERY",
        smachpy.MonitorState("battery", Int32, lambda ud, message: message.data < 50),
        {"invalid": "DOOR", "valid": "failed", "preempted": "failed"},
    )
    smachpy.StateMachine.add(
        "DOOR",
        smachpy.ConditionState(
            lambda ud: ud.numbers.sequence[-1] == 3, ["numbers"], wake_on=[("door", String)]
        ),
        {"true": "LONG", "false": "failed", "preempted": "failed"},
    )
    smachpy.StateMachine.add(
        "LONG",
        smachpy.SimpleActionState(
            "count", Fibonacci, goal=Fibonacci.Goal(order=-1), exec_timeout=0.3
        ),
        {"succeeded": "failed", "aborted": "done", "preempted": "failed"},
    )
outcome = sm.execute()
print(outcome, sm.userdata.lamp.message, list(sm.userdata.numbers.sequence))
"""


def start(code, config):
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "SMACHPY_CONFIG": str(config)},
    )


@pytest.mark.parametrize("mode", ["client", "peer"])
def test_mission_of_every_talking_state_runs_with_a_robot_behind_a_router(tmp_path, mode):
    from actionlib_core.config import Config
    from actionlib_core.transport.zenoh import ZenohTransport

    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = tmp_path / "ros2.yaml"
    config.write_text(
        f"discovery: 'off'\nros2: {{router: {endpoint}, domain: 42, namespace: robot1, mode: {mode}}}\n"
    )
    router = ZenohTransport(Config(mode="router", listen=(endpoint,), discovery="off"))
    robot = start(ROBOT, config)
    try:
        assert robot.stdout.readline() == "ready\n"
        with start(MISSION, config) as mission:
            out, errors = mission.communicate(timeout=WAIT_S)
        assert out.splitlines()[-1:] == ["done on [0, 1, 2, 3]"], errors
    finally:
        robot.communicate("", timeout=WAIT_S)
        router.close()


READY_MADE_ROBOT = """
import sys
from actionlib_core import Publisher, Service, Subscriber, init
from actionlib_core.interfaces.nav2_msgs.srv import ClearEntireCostmap
from actionlib_core.interfaces.ros2.std_msgs.msg import String
from actionlib_core.interfaces.ros2.tf2_msgs.msg import TFMessage

init("robot")
cleared = [
    Service(
        f"{which}_costmap/clear_entirely_{which}_costmap",
        ClearEntireCostmap,
        lambda request: ClearEntireCostmap.Response(),
    )
    for which in ("global", "local")
]
echo = Publisher("echo", String, latch=True)
word = Subscriber("word", String, echo.publish)
frames = Publisher("/tf_static", TFMessage, latch=True)
frame = {"header": {"frame_id": "map"}, "child_frame_id": "base"}
frame["transform"] = {"translation": {"x": 2.0}, "rotation": {"w": 1.0}}
frames.publish(TFMessage.from_dict({"transforms": [frame]}))
print("ready", flush=True)
sys.stdin.read()
"""

READY_MADE_MISSION = """
import smachpy
from actionlib_core import init
from actionlib_core.interfaces.ros2.std_msgs.msg import String
from smachpy.states import *

init("mission")
sm = smachpy.StateMachine(["succeeded", "aborted", "preempted", "timeout"])
same = SetParameters("robot", {"use_sim_time": False}, timeout=60.0)
sm.add("SET", same, {"succeeded": "SAY"})
sm.add("SAY", Publish("word", String, {"data": "hello"}, timeout=60.0), {"succeeded": "HEAR"})
sm.add("HEAR", AwaitMessage("echo", String, key="said", timeout=60.0), {"came": "LOOK"})
sm.add("LOOK", LookUpTransform("at", "base", timeout=60.0), {"succeeded": "CLEAR"})
sm.add("CLEAR", clear_costmaps(timeout=60.0))
sm.add_cleanup("RESTORE", RestoreParameters(timeout=60.0))
outcome = sm.execute()
said, at = sm.userdata.said.data, sm.userdata.at.pose.position.x
print(outcome, said, at, sm.userdata.parameters_before)
"""


@pytest.mark.slow
def test_mission_of_ready_made_states_runs_with_a_robot_behind_a_router(tmp_path):
    from actionlib_core.config import Config
    from actionlib_core.transport.zenoh import ZenohTransport

    endpoint = f"tcp/127.0.0.1:{free_port()}"
    config = tmp_path / "ros2.yaml"
    config.write_text(
        f"discovery: 'off'\nros2: {{router: {endpoint}, domain: 42, names: ['**']}}\n"
    )
    router = ZenohTransport(Config(mode="router", listen=(endpoint,), discovery="off"))
    robot = start(READY_MADE_ROBOT, config)
    try:
        assert robot.stdout.readline() == "ready\n"
        with start(READY_MADE_MISSION, config) as mission:
            out, errors = mission.communicate(timeout=WAIT_S)
        assert out.splitlines()[-1:] == ["succeeded hello 2.0 {}"], errors
    finally:
        robot.communicate("", timeout=WAIT_S)
        router.close()
