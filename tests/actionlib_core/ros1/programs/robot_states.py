"""A robot of ROS 1 that sends where it is, and whose planner can be reconfigured while it runs.

Each line of standard input is answered with what the planner has: `SPEED SAMPLES`.
"""

import sys
import threading
from types import SimpleNamespace

import rospy
from dynamic_reconfigure.encoding import extract_params
from dynamic_reconfigure.server import Server
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage


def parameter(name, kind, default, highest):
    """As a `.cfg` file makes it."""
    return {
        "name": name, "type": kind, "default": default, "min": 0, "max": highest, "level": 1,
        "description": "", "edit_method": "", "ctype": kind, "cconsttype": kind,
        "srcfile": "", "srcline": 0,
    }  # fmt: skip


def generated(*parameters):
    """What the generated module of a `.cfg` file has."""
    names = ("type", "cstate", "parentname", "parentclass", "class", "field", "upper", "lower")
    about = {
        **dict.fromkeys(names, ""), "name": "Default", "state": True, "id": 0, "parent": 0,
        "groups": [], "parameters": list(parameters),
    }  # fmt: skip
    kinds = ("min", "max", "level", "type", "default")
    values = {kind: {each["name"]: each[kind] for each in extract_params(about)} for kind in kinds}
    defaults = values.pop("default")
    return SimpleNamespace(config_description=about, all_level=1, defaults=defaults, **values)


def transform(parent, child, x):
    found = TransformStamped()
    found.header.frame_id, found.child_frame_id = parent, child
    found.header.stamp = rospy.Time.now()
    found.transform.translation.x, found.transform.rotation.w = x, 1.0
    return found


def send():
    moving = rospy.Publisher("/tf", TFMessage, queue_size=10)
    while not rospy.is_shutdown():
        moving.publish(TFMessage([transform("map", "base_link", 3.0)]))
        rospy.sleep(0.1)


rospy.init_node("planner")
planner = generated(parameter("speed", "double", 0.5, 2.0), parameter("samples", "int", 3, 50))
server = Server(planner, lambda config, _level: config)
fixed = rospy.Publisher("/tf_static", TFMessage, latch=True, queue_size=1)
fixed.publish(TFMessage([transform("base_link", "camera", 0.5)]))
threading.Thread(target=send, daemon=True).start()
print("ready", flush=True)
for _line in sys.stdin:
    print(server.config["speed"], server.config["samples"], flush=True)
