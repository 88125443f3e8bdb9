# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.octomap_msgs.msg import (
    Octomap as Octomap,
    OctomapWithPose as OctomapWithPose,
)
