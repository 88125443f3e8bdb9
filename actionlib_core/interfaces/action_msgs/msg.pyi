# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.action_msgs.msg import (
    GoalInfo as GoalInfo,
    GoalStatus as GoalStatus,
    GoalStatusArray as GoalStatusArray,
)
