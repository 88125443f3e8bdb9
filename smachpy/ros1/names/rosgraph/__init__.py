"""rosgraph: the calls to a ROS master that work without one; see `rospy.client.MasterProxy`."""

from __future__ import annotations

import os
from typing import Any

from smachpy.ros1.names.rospy.client import MasterProxy

__all__ = ["Master", "MasterException", "get_master_uri", "is_master_online"]


class MasterException(Exception):  # noqa: N818  rosgraph's name
    """The master cannot be asked."""


class Master:
    """The calls to a ROS master that work without one; they return only the value.

    Args:
        caller_id: Kept as an attribute.
        master_uri: Kept as an attribute; None: see `get_master_uri`.
    """

    def __init__(self, caller_id: str = "", master_uri: str | None = None) -> None:
        self.caller_id = caller_id
        self.master_uri = master_uri or get_master_uri()

    def is_online(self) -> bool:
        """Return True: no master is needed."""
        return True

    def __getattr__(self, name: str) -> Any:
        method = getattr(MasterProxy(), name)
        return lambda *args: method(*args)[2]


def is_master_online(master_uri: str | None = None) -> bool:
    """Return True: no master is needed."""
    del master_uri
    return True


def get_master_uri(env: Any = None, argv: Any = None) -> str:
    """Return the address in the environment, else rosgraph's default."""
    del argv
    return str((env or os.environ).get("ROS_MASTER_URI", MasterProxy.target))
