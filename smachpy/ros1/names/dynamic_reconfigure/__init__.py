"""dynamic_reconfigure: the parts that mission scripts use; here the messages and exceptions."""

from __future__ import annotations

from typing import Any

from actionlib_core.interfaces import define_message, define_service


def _parameter(name: str, kind: str) -> Any:
    return define_message(f"dynamic_reconfigure/{name}", f"string name\n{kind} value\n")


BoolParameter = _parameter("BoolParameter", "bool")
IntParameter = _parameter("IntParameter", "int32")
StrParameter = _parameter("StrParameter", "string")
DoubleParameter = _parameter("DoubleParameter", "float64")
define_message(
    "dynamic_reconfigure/GroupState", "string name\nbool state\nint32 id\nint32 parent\n"
)
Config: Any = define_message(
    "dynamic_reconfigure/Config",
    "BoolParameter[] bools\nIntParameter[] ints\nStrParameter[] strs\nDoubleParameter[] doubles\n"
    "GroupState[] groups\n",
)
Reconfigure: Any = define_service(
    "dynamic_reconfigure/Reconfigure", "Config config\n---\nConfig config\n"
)


class DynamicReconfigureException(Exception):  # noqa: N818  ROS's name
    """Base of the exceptions of dynamic_reconfigure."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """A parameter has a wrong value."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """A server's callback failed."""
