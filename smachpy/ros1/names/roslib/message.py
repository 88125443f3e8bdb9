"""roslib.message: classes of messages and services by name."""

from __future__ import annotations

from typing import Any

from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces import Message, get_message, get_service


def get_message_class(message_type: str, reload_on_error: bool = False) -> Any:
    """Return a message class by its ROS name; None when there is none."""
    del reload_on_error
    try:
        return get_message(message_type)
    except InterfaceError:
        return None


def get_service_class(service_type: str, reload_on_error: bool = False) -> Any:
    """Return a service class by its ROS name; None when there is none."""
    del reload_on_error
    try:
        return get_service(service_type)
    except InterfaceError:
        return None


__all__ = ["Message", "get_message_class", "get_service_class"]
