"""`smachpy run --ros1-robot`: missions with a real robot of ROS 1."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros1, pytest.mark.zenoh]

SMACHPY = Path(sys.executable).parent / "smachpy"
WAIT_S = 60.0

MISSION = """
import smachpy
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

def mission():
    sm = smachpy.StateMachine(["succeeded", "aborted", "preempted"])
    with sm:
        goal = MoveBaseGoal()
        smachpy.StateMachine.add(
            "GO", smachpy.SimpleActionState("move_base", MoveBaseAction, goal), {"succeeded": "BACK"}
        )
        smachpy.StateMachine.add("BACK", smachpy.SimpleActionState("move_base", MoveBaseAction, goal))
    return sm
"""

OLD_SCRIPT = """
import rospy, smach, smach_ros
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

rospy.init_node("old")
print "odom", rospy.get_published_topics("/odom")
import rosnode, rosservice
print "nodes", "/base" in rosnode.get_node_names(), "/base/get_loggers" in rosservice.get_service_list()
print "planner", rospy.get_param("/move_base/planner"), rospy.get_param("/move_base/none", 7)
sm = smach.StateMachine(["succeeded", "aborted", "preempted"])
with sm:
    smach.StateMachine.add("GO", smach_ros.SimpleActionState("move_base", MoveBaseAction, MoveBaseGoal()))
print sm.execute()
"""

ERRAND_OF_EVERYTHING = """
import xmlrpc.client

import smachpy
from actionlib_core import ServiceProxy, wait_for_message
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import SetBool

@smachpy.cb_interface(outcomes=["succeeded"])
def look(userdata):
    ServiceProxy("used_service", SetBool)(True)
    wait_for_message("used_topic", String, 30.0)
    with xmlrpc.client.ServerProxy(MASTER) as master:
        _, _, state = master.getSystemState("/test")
    for names in state:
        print("CARRIED", *sorted(
            name for name, nodes in names if any(n.startswith("/smachpy_bridge") for n in nodes)
        ))
    return "succeeded"

def mission():
    sm = smachpy.StateMachine(["succeeded", "aborted", "preempted"])
    with sm:
        state = smachpy.SimpleActionState("used_action", TestAction, TestGoal(1))
        smachpy.StateMachine.add("GO", state, {"succeeded": "LOOK"})
        smachpy.StateMachine.add("LOOK", smachpy.CBState(look))
    return sm
"""


def run(*arguments):
    environment = {k: v for k, v in os.environ.items() if k != "SMACHPY_DOMAIN"}
    done = subprocess.run(
        [SMACHPY, "run", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        timeout=4 * WAIT_S,
    )
    return done.returncode, done.stdout, done.stderr


def test_a_mission_drives_the_robot(ros, tmp_path):
    ros.start("move_base")
    (tmp_path / "errand.py").write_text(MISSION)
    code, out, err = run(f"{tmp_path / 'errand.py'}", "--json", "--ros1-robot", ros.uri)
    assert code == 0, err
    events = [json.loads(line) for line in out.splitlines()]
    assert events
    assert ros.names_of("/smachpy_bridge") == []


def test_what_the_mission_does_not_use_is_not_carried(ros, tmp_path):
    for name in ("used_action", "other_action"):
        ros.start("action_server", name, name)
    ros.start("services", "used_service", "other_service")
    topics = ros.start("topics", "talker")
    for name in ("used_topic", "other_topic"):
        assert topics.ask(f"advertise {name} latch") == "ok"
        assert topics.ask(f"publish {name} hello") == "ok"
    text = f"MASTER = {ros.uri!r}\n{ERRAND_OF_EVERYTHING}"
    (tmp_path / "errand.py").write_text(text)
    code, out, err = run(f"{tmp_path / 'errand.py'}", "--plain", "--ros1-robot", ros.uri)
    assert code == 0, err
    published, subscribed, served = [
        set(line.split()[1:]) for line in out.splitlines() if line.startswith("CARRIED")
    ]
    viewed = {f"/errand/smach/container_{word}" for word in ("status", "structure")}
    assert published == {"/used_action/goal", "/used_action/cancel", *viewed}
    spoken = {f"/used_action/{word}" for word in ("status", "feedback", "result")}
    assert subscribed == {*spoken, "/used_topic", "/errand/smach/container_init"}
    assert served == set()


def test_a_script_for_ros_1_drives_the_robot_and_reads_its_parameters(ros, tmp_path):
    ros.start("move_base")
    topics = ros.start("topics", "base")
    assert topics.ask("advertise /odom/text latch") == "ok"
    (tmp_path / "old.py").write_text(OLD_SCRIPT)
    code, out, err = run("--ros1", f"{tmp_path / 'old.py'}", "--plain", "--ros1-robot", ros.uri)
    assert code == 0, err
    assert "planner none 7" in out
    assert "nodes True True" in out
    assert "odom [['/odom/text', 'std_msgs/String']]" in out


@pytest.mark.parametrize(
    "options",
    [
        ("--ros1-robot", "http://127.0.0.1:1", "--server-timeout", "0.5"),
        ("--ros1-robot", "http://127.0.0.1:1", "--start-robot"),
        ("--ros1-robot", "http://127.0.0.1:1", "--time", "virtual"),
        ("--ros1-robot", "ftp://robot"),
    ],
)
def test_a_robot_that_cannot_be_had_is_bad_input(options):
    code, _, err = run("there_and_back", *options)
    assert code == 2
    assert "Traceback" not in err
    assert "ros1-robot" in err or "ftp" in err
