# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.type_description_interfaces.srv import (
    GetTypeDescription as GetTypeDescription,
    GetTypeDescription_Request as GetTypeDescription_Request,
    GetTypeDescription_Response as GetTypeDescription_Response,
)
