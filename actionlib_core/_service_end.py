"""What the two ends of a service share: the name, the type, and the words that errors travel in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core._arguments import check_class
from actionlib_core._name_watch import NameWatch
from actionlib_core.exceptions import ServiceException
from actionlib_core.node import get_node
from actionlib_core.presence import Kind

if TYPE_CHECKING:
    from typing import Self

    from actionlib_core.interfaces import ServiceType
    from actionlib_core.node import Node

NAME_KIND = "service name"


class ServiceEnd:
    """What server and proxy share."""

    def __init__(self, name: str, service_class: type[ServiceType], node: Node | None) -> None:
        kind = "service class, such as SetBool"
        check_class(f"service {name!r}", service_class, "_request_class", kind)
        self.node = get_node() if node is None else node
        self.resolved_name = self.node.resolve(name, NAME_KIND)
        self.service_class = service_class
        self.request_class = service_class._request_class
        self.response_class = service_class._response_class
        self.type = service_class._type
        self.md5sum = service_class._md5sum
        self._own = self.node.endpoint(Kind.SERVICE, self.resolved_name, self.type, self.md5sum)
        self._closed = False

    def _watch(self) -> NameWatch:
        return NameWatch(self.node, self._own, {Kind.SERVICE})

    def close(self) -> None:
        """Leave the service; a second call does nothing."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} /{self.resolved_name} [{self.type}]>"


def is_from(name: str, text: str) -> bool:
    """Tell whether `text` is that of an error of the service `name`."""
    return text.startswith(f"service /{name}: ")


def handler_raised(name: str, remote_type: str, remote_text: str) -> ServiceException:
    """Return the error for a handler that raised."""
    return ServiceException(
        name,
        f"the handler raised {remote_type or 'an error'}: {remote_text}",
        remote_type=remote_type,
        remote_text=remote_text,
    )
