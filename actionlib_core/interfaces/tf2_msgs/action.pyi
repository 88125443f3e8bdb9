# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.tf2_msgs.action import (
    LookupTransform as LookupTransform,
    LookupTransform_Goal as LookupTransform_Goal,
    LookupTransform_Result as LookupTransform_Result,
    LookupTransform_Feedback as LookupTransform_Feedback,
)
