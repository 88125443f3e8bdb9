"""A move_base of ROS 1 that is there at once."""

import actionlib
import rospy
from move_base_msgs.msg import MoveBaseAction, MoveBaseResult

rospy.init_node("move_base")
rospy.set_param("~planner", "none")
goals = []


def execute(goal):
    goals.append(goal)
    server.set_succeeded(MoveBaseResult(), f"goal {len(goals)}")


server = actionlib.SimpleActionServer("move_base", MoveBaseAction, execute, auto_start=False)
server.start()
print("ready", flush=True)
rospy.spin()
