"""rostopic: the types of published topics.

Source:
    rostopic of ros_comm for names, arguments and exceptions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy.ros1.names.roslib.message import get_message_class
from smachpy.ros1.names.rospy.client import get_published_topics
from smachpy.ros1.names.rospy.core import is_shutdown
from smachpy.ros1.names.rospy.names import resolve_name
from smachpy.ros1.names.rospy.rostime import sleep

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["ROSTopicException", "find_by_type", "get_topic_class", "get_topic_type"]

LOOK_S = 0.1  # pause between two checks for a topic


class ROSTopicException(Exception):  # noqa: N818  rostopic's name
    """A topic cannot be used."""


_Found = tuple[Any, str | None, "Callable[[Any], Any] | None"]


def get_topic_type(topic: str, blocking: bool = False) -> _Found:
    """Return type, full name and None for a published topic; otherwise three times None.

    Blocks: with `blocking`, until there is one or the program is to end.
    """
    name = resolve_name(topic)
    while True:
        for there, type_name in get_published_topics():
            if there == name:
                return type_name, name, None
        if not blocking or is_shutdown():
            return None, None, None
        sleep(LOOK_S)


def get_topic_class(topic: str, blocking: bool = False) -> _Found:
    """Return class, full name and None for a published topic; as `get_topic_type`.

    Raises:
        ROSTopicException: its type is not known here.
    """
    type_name, name, rest = get_topic_type(topic, blocking)
    made = None if type_name is None else get_message_class(type_name)
    if type_name is not None and made is None:
        raise ROSTopicException(f"Cannot load message class for [{type_name}].")
    return made, name, rest


def find_by_type(topic_type: str) -> list[str]:
    """Return the topics of a type."""
    return [name for name, kind in get_published_topics() if kind == topic_type]
