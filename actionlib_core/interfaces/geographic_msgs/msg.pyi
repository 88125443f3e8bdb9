# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.geographic_msgs.msg import (
    GeoPoint as GeoPoint,
    GeoPointStamped as GeoPointStamped,
    GeoPose as GeoPose,
    GeoPoseStamped as GeoPoseStamped,
)
