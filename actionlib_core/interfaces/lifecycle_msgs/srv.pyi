# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.lifecycle_msgs.srv import (
    ChangeState as ChangeState,
    ChangeState_Request as ChangeState_Request,
    ChangeState_Response as ChangeState_Response,
    GetAvailableStates as GetAvailableStates,
    GetAvailableStates_Request as GetAvailableStates_Request,
    GetAvailableStates_Response as GetAvailableStates_Response,
    GetAvailableTransitions as GetAvailableTransitions,
    GetAvailableTransitions_Request as GetAvailableTransitions_Request,
    GetAvailableTransitions_Response as GetAvailableTransitions_Response,
    GetState as GetState,
    GetState_Request as GetState_Request,
    GetState_Response as GetState_Response,
)
