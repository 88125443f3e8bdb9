"""dynamic_reconfigure, as far as mission scripts use it: the client."""

from __future__ import annotations


class DynamicReconfigureException(Exception):  # noqa: N818  ROS's name
    """Base of its exceptions."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """A parameter has a wrong value."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """A server's callback failed."""
