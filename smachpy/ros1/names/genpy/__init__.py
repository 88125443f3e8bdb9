"""genpy: times, messages and their errors under the names that generated messages had."""

from actionlib_core.exceptions import ActionlibError as MessageException
from actionlib_core.exceptions import DeserializationError
from actionlib_core.exceptions import FieldError as SerializationError
from actionlib_core.interfaces import Message
from smachpy.ros1.names.rospy.rostime import Duration, Time

__all__ = [
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "SerializationError",
    "Time",
]
