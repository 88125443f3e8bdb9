# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.builtin_interfaces.msg import (
    Duration as Duration,
    Time as Time,
)
