# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.composition_interfaces.srv import (
    ListNodes as ListNodes,
    ListNodes_Request as ListNodes_Request,
    ListNodes_Response as ListNodes_Response,
    LoadNode as LoadNode,
    LoadNode_Request as LoadNode_Request,
    LoadNode_Response as LoadNode_Response,
    UnloadNode as UnloadNode,
    UnloadNode_Request as UnloadNode_Request,
    UnloadNode_Response as UnloadNode_Response,
)
