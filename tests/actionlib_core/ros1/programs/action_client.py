"""An action client of ROS 1: `NAME`. Each line of standard input is a goal, or a command.

Answers each goal that has ended with `STATE RESULT TEXT`, but one below 0 only when `wait` is said.
"""

import sys
import threading

import actionlib
import rospy
from actionlib.msg import TestAction, TestGoal

rospy.init_node("ros_client")
begun = threading.Event()
client = actionlib.SimpleActionClient(sys.argv[1], TestAction)
print("ready" if client.wait_for_server(rospy.Duration(60)) else "no server", flush=True)
for line in sys.stdin:
    word = line.strip()
    if word == "cancel":
        client.cancel_goal()
    elif word == "server?":
        print(client.wait_for_server(rospy.Duration(0.5)), flush=True)
        continue
    elif word == "begun?":
        print("begun" if begun.wait(60) else "not begun", flush=True)
        continue
    elif word != "wait":
        begun.clear()
        client.send_goal(TestGoal(int(word)), active_cb=begun.set)
        if int(word) < 0:
            print("sent", flush=True)
            continue
    client.wait_for_result(rospy.Duration(60))
    result = client.get_result()
    value = result.result if result else None
    print(client.get_state(), value, client.get_goal_status_text(), flush=True)
