# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.service_msgs.msg import (
    ServiceEventInfo as ServiceEventInfo,
)
