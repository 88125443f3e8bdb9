# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces.ros2.lifecycle_msgs.msg import (
    State as State,
    Transition as Transition,
    TransitionDescription as TransitionDescription,
    TransitionEvent as TransitionEvent,
)
