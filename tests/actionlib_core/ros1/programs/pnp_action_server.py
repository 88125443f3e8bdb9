"""What PNP's `PNPActionServer` looks like from outside, on rospy, written from its description.

Actions last until an "interrupt" or "end" goal of their id, at most 60 s, and all but `wander` at
most 0.1 s; cancels are not listened to. A condition holds while an event of its name is newer than
60 s, not 2 s as in PNP: a busy computer asks late. Each goal is a line of output; each
line of standard input is published as an event by a node of the robot.
"""

import sys
import threading

import actionlib
import genpy.dynamic
import rospy
from std_msgs.msg import String

PARTS = {
    "std_msgs/Header": "uint32 seq\ntime stamp\nstring frame_id",
    "actionlib_msgs/GoalID": "time stamp\nstring id",
    "actionlib_msgs/GoalStatus": "GoalID goal_id\nuint8 status\nstring text",
    "pnp_msgs/PNPGoal": "uint32 id\nstring robotname\nstring name\nstring params\nstring function",
    "pnp_msgs/PNPResult": "string result",
    "pnp_msgs/PNPFeedback": "string feedback",
    "pnp_msgs/PNPActionGoal": "Header header\nactionlib_msgs/GoalID goal_id\nPNPGoal goal",
    "pnp_msgs/PNPActionResult": "Header header\nactionlib_msgs/GoalStatus status\nPNPResult result",
    "pnp_msgs/PNPActionFeedback": "Header header\nactionlib_msgs/GoalStatus status\nPNPFeedback feedback",
    "pnp_msgs/PNPAction": "PNPActionGoal action_goal\nPNPActionResult action_result\nPNPActionFeedback action_feedback",
}
PARTS["actionlib_msgs/GoalStatus"] += "".join(
    f"\nuint8 {name}={number}"
    for number, name in enumerate(
        [
            "PENDING",
            "ACTIVE",
            "PREEMPTED",
            "SUCCEEDED",
            "ABORTED",
            "REJECTED",
            "PREEMPTING",
            "RECALLING",
            "RECALLED",
            "LOST",
        ]
    )
)


def message(name):
    """Return a class of ROS 1, whose package is not installed."""
    rest = "".join(
        "\n" + "=" * 80 + f"\nMSG: {part}\n{text}" for part, text in PARTS.items() if part != name
    )
    return genpy.dynamic.generate_dynamic(name, PARTS[name] + rest)


made = message("pnp_msgs/PNPAction")
Action = made["pnp_msgs/PNPAction"]


class Condition:
    """The service type pnp_msgs/PNPCondition."""

    _type = "pnp_msgs/PNPCondition"
    _md5sum = sys.argv[1]
    _request_class = genpy.dynamic.generate_dynamic("pnp_msgs/Q", "string cond")["pnp_msgs/Q"]
    _response_class = genpy.dynamic.generate_dynamic("pnp_msgs/A", "int8 truth_value")["pnp_msgs/A"]


rospy.init_node("pnp_action_server")
running, events = {}, {}


def take(handle):
    goal = handle.get_goal()
    print(goal.robotname, goal.name, goal.params, goal.function, flush=True)
    handle.set_accepted()
    if goal.function == "start":
        stop = running[goal.id] = threading.Event()
        threading.Thread(target=run, args=(handle, goal.name, stop), daemon=True).start()
        return
    if goal.id in running:
        running[goal.id].set()
    handle.set_succeeded()


def run(handle, name, stop):
    stop.wait(60.0 if name == "wander" else 0.1)
    handle.set_succeeded()


def answer(request):
    since = events.get(request.cond)
    holds = since is not None and (rospy.Time.now() - since).to_sec() < 60.0
    return Condition._response_class(int(holds))


def hear(event):
    events[event.data] = rospy.Time.now()


server = actionlib.ActionServer("PNP", Action, take, auto_start=False)
server.start()
rospy.Service("pnp/conditionEval", Condition, answer)
rospy.Subscriber("pnp/conditionEvent", String, hear)
publisher = rospy.Publisher("pnp/conditionEvent", String, queue_size=10)
print("ready", flush=True)
for line in sys.stdin:
    publisher.publish(String(line.strip()))
