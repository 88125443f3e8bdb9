"""Parameters, and waiting for messages and services, as in rospy.

Source:
    rospy.client for names, arguments and exceptions.
"""

from __future__ import annotations

from typing import Any, Final, NoReturn

from actionlib_core.node import get_node
from actionlib_core.pubsub.service_proxy import wait_for_service as _wait_for_service
from actionlib_core.pubsub.topic import wait_for_message as _wait_for_message
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import list_endpoints
from smachpy.ros1.names.rospy.core import init_node as init_node
from smachpy.ros1.names.rospy.core import myargv as myargv
from smachpy.ros1.names.rospy.core import on_shutdown as on_shutdown
from smachpy.ros1.names.rospy.core import spin as spin
from smachpy.ros1.names.rospy.exceptions import ROSException, ROSInterruptException, as_rospy
from smachpy.ros1.names.rospy.names import get_name, get_namespace, resolve_name
from smachpy.ros1.session import session
from smachpy.ros1.until_end import until_end

_NO_DEFAULT: Final = object()


def get_param(param_name: str, default: Any = _NO_DEFAULT) -> Any:
    """Return a parameter's value.

    Raises:
        KeyError: it has no value, and there is no default.
    """
    name = resolve_name(param_name)
    now = session()
    try:
        return now.parameters.get(name)
    except KeyError as error:
        if default is not _NO_DEFAULT:
            return default
        if now.stub_missing:
            from smachpy.ros1.stubs import Anything

            now.stand_in(f"parameter {name}")
            return Anything(name)
        ways = "Try --params FILE.yaml, or _NAME:=VALUE for a private one."
        raise KeyError(f"{error.args[0]} {ways}") from None


def get_param_cached(param_name: str, default: Any = _NO_DEFAULT) -> Any:
    """Return a parameter's value, as `get_param`."""
    return get_param(param_name, default)


def set_param(param_name: str, param_value: Any) -> None:
    """Set a parameter; a dict becomes a namespace."""
    session().parameters.set(resolve_name(param_name), param_value)


def has_param(param_name: str) -> bool:
    """Return whether a parameter has a value."""
    return session().parameters.has(resolve_name(param_name))


def delete_param(param_name: str) -> None:
    """Delete a parameter.

    Raises:
        KeyError: it has no value.
    """
    session().parameters.delete(resolve_name(param_name))


def search_param(param_name: str) -> str | None:
    """Return the full name of a parameter, searched from the node's namespace upwards, or None."""
    return session().parameters.search(get_name(), param_name)


def get_param_names() -> list[str]:
    """Return the full names of all parameters."""
    return session().parameters.names()


def wait_for_message(topic: str, topic_type: Any, timeout: Any = None) -> Any:
    """Return the next message of a topic.

    Args:
        topic: Its name.
        topic_type: Class of the messages.
        timeout: Longest wait, seconds or `Duration`; None waits until the program is to end.

    Raises:
        ROSException: none came in time.
        ROSInterruptException: the program is to end.

    Blocks: see `timeout`.
    """
    now = session()
    now.check_time()
    if now.dry:
        return topic_type()
    if topic_type.__name__ == "AnyMsg":
        from smachpy.ros1.names.rospy.topics import wait_for_any

        limit = _limit(timeout)
        return until_end(
            f"a message on topic {topic!r}", lambda: wait_for_any(topic, limit), _interrupted
        )
    limit = _limit(timeout)
    with as_rospy(f"message on topic {topic}"):
        return until_end(
            f"a message on topic {topic!r}",
            lambda: _wait_for_message(topic, topic_type, limit),
            _interrupted,
        )


def wait_for_service(service: str, timeout: Any = None) -> None:
    """Wait until a service has a server.

    Args:
        service: Its name.
        timeout: Longest wait, seconds or `Duration`; None waits until the program is to end.

    Raises:
        ROSException: there is none in time.
        ROSInterruptException: the program is to end.

    Blocks: see `timeout`.
    """
    now = session()
    now.check_time()
    if not now.dry:
        limit = _limit(timeout)
        with as_rospy(f"service {resolve_name(service)}"):
            until_end(
                f"service {service!r}", lambda: _wait_for_service(service, limit), _interrupted
            )


def _interrupted() -> NoReturn:
    raise ROSInterruptException("rospy shutdown")


def _limit(timeout: Any) -> float | None:
    """Return a limit in seconds. In rospy 0 is no wait at all; here it is a very short one."""
    return None if timeout is None else max(float(timeout), 1e-3)


def get_published_topics(namespace: str = "/") -> list[list[str]]:
    """Return [topic, type] of all published topics below `namespace`.

    Those of a real robot (`--ros1-robot`) are included, even if they are not bridged.
    """
    prefix = namespace if namespace.endswith("/") else f"{namespace}/"
    ends = list_endpoints(get_node().transport, kind=Kind.PUBLISHER)
    found = {(f"/{end.name}", end.type) for end in ends}
    robot = session().parameters.robot
    if robot is not None:
        with as_rospy():
            found |= set(robot.published_topics().items())
    return [list(pair) for pair in sorted(found) if pair[0].startswith(prefix)]


class MasterProxy:
    """The calls to a ROS master that work without one."""

    target = "http://localhost:11311"

    def getSystemState(self) -> tuple[int, str, list[list[list[Any]]]]:
        """Return publishers, subscribers and services like ROS's master, including a robot's."""
        found: dict[Kind, dict[str, list[str]]] = {
            kind: {} for kind in (Kind.PUBLISHER, Kind.SUBSCRIBER, Kind.SERVICE)
        }
        for end in list_endpoints(get_node().transport):
            if end.kind in found:
                found[end.kind].setdefault(f"/{end.name}", []).append(f"/{end.node}")
        robot = session().parameters.robot
        if robot is not None:
            with as_rospy():
                there = robot.state()
            parts = there.publishers, there.subscribers, there.services
            for kind, part in zip(found, parts, strict=True):
                for name, nodes in part.items():
                    found[kind].setdefault(name, []).extend(nodes)
        state = [
            [[n, sorted(set(nodes))] for n, nodes in sorted(ends.items())]
            for ends in found.values()
        ]
        return 1, "current system state", state

    def getPublishedTopics(self, subgraph: str = "") -> tuple[int, str, list[list[str]]]:
        """Return [topic, type] of all published topics."""
        return 1, "current topics", get_published_topics(subgraph or "/")

    getTopicTypes = getPublishedTopics  # noqa: N815

    def getPid(self) -> tuple[int, str, int]:
        """Return this process's id."""
        import os

        return 1, "", os.getpid()

    def __getattr__(self, name: str) -> Any:
        raise ROSException(
            f"master: got a call of {name!r}; expected getSystemState, getPublishedTopics, "
            "getTopicTypes or getPid: there is no ROS master here."
        )


def get_master(env: Any = None) -> MasterProxy:
    """Return the replacement for a ROS master."""
    del env
    return MasterProxy()


__all__ = [
    "MasterProxy",
    "delete_param",
    "get_master",
    "get_name",
    "get_namespace",
    "get_param",
    "get_param_cached",
    "get_param_names",
    "get_published_topics",
    "has_param",
    "search_param",
    "set_param",
    "wait_for_message",
    "wait_for_service",
]
