# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.example_interfaces.srv import (
    AddTwoInts as AddTwoInts,
    AddTwoInts_Request as AddTwoInts_Request,
    AddTwoInts_Response as AddTwoInts_Response,
    SetBool as SetBool,
    SetBool_Request as SetBool_Request,
    SetBool_Response as SetBool_Response,
    Trigger as Trigger,
    Trigger_Request as Trigger_Request,
    Trigger_Response as Trigger_Response,
)
