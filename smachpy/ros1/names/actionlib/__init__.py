"""actionlib's public names, and the others that `from actionlib import *` gives in the original.

In a dry program servers seem to be there, goals succeed at once and nothing is sent.
"""

import threading
import time
import traceback

from actionlib_core import (
    ActionException,
    ClientGoalHandle,
    CommState,
    GoalIDGenerator,
    GoalManager,
    HandleTrackerDeleter,
    ServerGoalHandle,
    StatusTracker,
    TerminalState,
    get_name_of_constant,
    nop_cb,
)
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.interfaces.std_msgs.msg import Header
from smachpy.ros1.names import rospy
from smachpy.ros1.names.actionlib.action_client import ActionClient, CommStateMachine
from smachpy.ros1.names.actionlib.action_server import ActionServer
from smachpy.ros1.names.actionlib.simple_action_client import SimpleActionClient, SimpleGoalState
from smachpy.ros1.names.actionlib.simple_action_server import SimpleActionServer
