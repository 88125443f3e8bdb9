# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.action_msgs.srv import (
    CancelGoal as CancelGoal,
    CancelGoal_Request as CancelGoal_Request,
    CancelGoal_Response as CancelGoal_Response,
)
