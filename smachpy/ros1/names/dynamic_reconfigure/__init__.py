"""dynamic_reconfigure: the parts that mission scripts use; here the messages and exceptions."""

from __future__ import annotations

from actionlib_core.interfaces.dynamic_reconfigure.msg import (
    BoolParameter,
    Config,
    DoubleParameter,
    IntParameter,
    StrParameter,
)
from actionlib_core.interfaces.dynamic_reconfigure.srv import Reconfigure


class DynamicReconfigureException(Exception):  # noqa: N818  ROS's name
    """Base of the exceptions of dynamic_reconfigure."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """A parameter has a wrong value."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """A server's callback failed."""


__all__ = [
    "BoolParameter",
    "Config",
    "DoubleParameter",
    "DynamicReconfigureCallbackException",
    "DynamicReconfigureException",
    "DynamicReconfigureParameterException",
    "IntParameter",
    "Reconfigure",
    "StrParameter",
]
