"""The services of these missions, from the `.srv` files beside this module."""

from __future__ import annotations

import smachpy_missions.interfaces  # noqa: F401  registers the folder with the definitions
from actionlib_core.interfaces.mission_msgs.srv import (
    DemoSrv,
    DemoSrvRequest,
    DemoSrvResponse,
    Permit,
    PermitRequest,
    PermitResponse,
)

__all__ = [
    "DemoSrv",
    "DemoSrvRequest",
    "DemoSrvResponse",
    "Permit",
    "PermitRequest",
    "PermitResponse",
]
