"""Services with rospy's arguments and exceptions.

Source:
    rospy.impl.tcpros_service for names, arguments and exceptions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.pubsub.service import Service as _Service
from actionlib_core.pubsub.service_proxy import ServiceProxy as _ServiceProxy
from smachpy.ros1.names.rospy.client import wait_for_service as wait_for_service
from smachpy.ros1.names.rospy.exceptions import ServiceException as ServiceException
from smachpy.ros1.names.rospy.exceptions import as_rospy
from smachpy.ros1.names.rospy.names import Named
from smachpy.ros1.session import session

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Service", "ServiceException", "ServiceProxy", "wait_for_service"]


class Service(Named, _Service):
    """Offers a service: an `actionlib_core.Service` with rospy's arguments."""

    def __init__(
        self,
        name: str,
        service_class: Any,
        handler: Callable[[Any], Any],
        buff_size: int = 65536,
        error_handler: Callable[..., object] | None = None,
    ) -> None:
        del buff_size, error_handler
        with as_rospy():
            super().__init__(name, service_class, handler)

    def spin(self) -> None:
        """Answer until the service is closed or the program is to end."""
        session().stop()
        with as_rospy():
            super().spin()


class ServiceProxy(Named, _ServiceProxy):
    """Calls a service: an `actionlib_core.ServiceProxy` with rospy's arguments.

    As in rospy, a call has no time limit; it ends with an error when the server dies.
    """

    def __init__(
        self,
        name: str,
        service_class: Any,
        persistent: bool = False,
        headers: dict[str, str] | None = None,
    ) -> None:
        with as_rospy():
            super().__init__(name, service_class, persistent, headers, timeout=None)

    def call(self, *args: Any, **kwds: Any) -> Any:
        """Send a request, given or made from the arguments, and return the response.

        Raises:
            ServiceException: there is no server, it has another type or died, or its handler
                raised.
            ROSSerializationException: a value does not fit its field.

        Blocks: until the answer.
        """
        if session().dry:
            return self.response_class()
        with as_rospy():
            try:
                return super().call(*args, **kwds)
            except TypeMismatchError as error:
                raise ServiceException(str(error)) from error

    def close(self) -> None:
        """Do nothing, as there is no connection: in rospy too a later call works."""

    def wait_for_service(self, timeout: Any = None) -> None:
        """Wait until there is a server; as `rospy.wait_for_service`."""
        wait_for_service(self.resolved_name, timeout)
