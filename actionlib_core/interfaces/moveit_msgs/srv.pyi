# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.moveit_msgs.srv import (
    GetPositionFK as GetPositionFK,
    GetPositionFK_Request as GetPositionFK_Request,
    GetPositionFK_Response as GetPositionFK_Response,
    GetPositionIK as GetPositionIK,
    GetPositionIK_Request as GetPositionIK_Request,
    GetPositionIK_Response as GetPositionIK_Response,
)
