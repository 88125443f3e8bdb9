# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.unique_identifier_msgs.msg import (
    UUID as UUID,
)
