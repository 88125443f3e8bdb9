# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.object_recognition_msgs.msg import (
    ObjectType as ObjectType,
)
