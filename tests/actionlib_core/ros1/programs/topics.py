"""Topics of ROS 1. Each line of standard input is a command, answered with one line."""

import struct
import sys

import rospy
from roscpp.msg import Logger
from std_msgs.msg import String

LONG_S = 60
rospy.init_node(sys.argv[1])
publishers = {}
subscribers = {}
heard = {}
print("ready", flush=True)


def hear(message, name):
    heard[name].append(message.data)


def last_number(message):
    """Return the last field of a message of any type, as the number that it is in a goal."""
    return str(struct.unpack("<i", message._buff[-4:])[0])


for line in sys.stdin:
    word, *arguments = line.split()
    answer = "ok"
    if word == "advertise":
        name, latch = arguments
        publishers[name] = rospy.Publisher(name, String, latch=latch == "latch", queue_size=1000)
    elif word == "advertise_logger":
        (name,) = arguments
        publishers[name] = rospy.Publisher(name, Logger, latch=True, queue_size=1)
        publishers[name].publish(Logger("rosout", "info"))
    elif word == "publish":
        name, text = arguments
        publishers[name].publish(String(text))
    elif word == "subscribe":
        (name,) = arguments
        heard[name] = []
        subscribers[name] = rospy.Subscriber(name, String, hear, name)
    elif word == "record":
        (name,) = arguments
        heard[name] = []
        subscribers[name] = rospy.Subscriber(
            name, rospy.AnyMsg, lambda message, name=name: heard[name].append(last_number(message))
        )
    elif word == "connections":
        (name,) = arguments
        end = publishers[name]
        deadline = rospy.get_time() + LONG_S
        while not end.get_num_connections() and rospy.get_time() < deadline:
            rospy.sleep(0.01)
        answer = str(end.get_num_connections())
    elif word == "heard":
        texts, count = heard[arguments[0]], int(arguments[1])
        deadline = rospy.get_time() + LONG_S
        while len(texts) < count and rospy.get_time() < deadline:
            rospy.sleep(0.01)
        answer = " ".join(texts)
    elif word == "until":
        texts, last = heard[arguments[0]], arguments[1]
        deadline = rospy.get_time() + LONG_S
        while last not in texts and rospy.get_time() < deadline:
            rospy.sleep(0.01)
        answer = " ".join(texts)
    print(answer, flush=True)
