"""rosservice: lists services, and calls them by name.

Source:
    rosservice of ros_comm for names, arguments and exceptions.
"""

from __future__ import annotations

from typing import Any

from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces import get_service
from actionlib_core.node import get_node
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import list_endpoints
from smachpy.ros1.names.rospy.client import MasterProxy
from smachpy.ros1.names.rospy.names import resolve_name
from smachpy.ros1.names.rospy.service import ServiceProxy

__all__ = [
    "ROSServiceException",
    "call_service",
    "get_service_class_by_name",
    "get_service_list",
    "get_service_node",
    "get_service_type",
]


class ROSServiceException(Exception):  # noqa: N818  rosservice's name
    """A service's class is not known."""


def get_service_list(
    node: str | None = None, namespace: str | None = None, include_nodes: bool = False
) -> list[Any]:
    """Return the names of the services, if given of one node or below a namespace.

    With `include_nodes`, return [name, [node]] for each.
    """
    prefix = "/" if namespace is None else f"/{namespace.strip('/')}/".replace("//", "/")
    _, _, (_, _, services) = MasterProxy().getSystemState()
    found = {
        name: nodes
        for name, nodes in services
        if name.startswith(prefix) and (node is None or f"/{node.lstrip('/')}" in nodes)
    }
    return [[name, found[name]] if include_nodes else name for name in sorted(found)]


def get_service_type(service_name: str) -> str | None:
    """Return the type of a service; None if it is not available."""
    end = _find(service_name)
    return None if end is None else str(end.type)


def get_service_node(service_name: str) -> str | None:
    """Return the name of the node that offers a service; None if it is not available."""
    end = _find(service_name)
    return None if end is None else f"/{end.node}"


def get_service_class_by_name(service_name: str) -> Any:
    """Return the class of a service.

    Raises:
        ROSServiceException: it is not available, or its type is not known here.
    """
    end = _find(service_name)
    if end is None:
        raise ROSServiceException(f"Service [{service_name}] is not available.")
    try:
        return get_service(end.type)
    except InterfaceError as error:
        raise ROSServiceException(str(error)) from error


def call_service(
    service_name: str, service_args: Any, service_class: Any = None
) -> tuple[Any, Any]:
    """Call a service with the values of its request's fields; return request and response.

    Raises:
        ROSServiceException: its class is not known.
        ServiceException: as `rospy.ServiceProxy`.
    """
    made = service_class or get_service_class_by_name(service_name)
    request = made._request_class(*service_args)
    return request, ServiceProxy(service_name, made)(request)


def _find(name: str) -> Any:
    full = resolve_name(name).lstrip("/")
    ends = list_endpoints(get_node().transport, kind=Kind.SERVICE, name=full)
    return ends[0] if ends else None
