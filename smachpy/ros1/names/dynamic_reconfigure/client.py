"""dynamic_reconfigure.client: changes the parameters of another node while it runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy.ros1.names.dynamic_reconfigure import (
    Config,
    DynamicReconfigureParameterException,
    Reconfigure,
)
from smachpy.ros1.names.dynamic_reconfigure.encoding import decode_config, encode_config
from smachpy.ros1.names.rospy.client import wait_for_message
from smachpy.ros1.names.rospy.exceptions import ROSException, ROSInterruptException
from smachpy.ros1.names.rospy.service import ServiceProxy
from smachpy.ros1.names.rospy.topics import Subscriber
from smachpy.ros1.session import session
from smachpy.ros1.stubs import Anything

if TYPE_CHECKING:
    from collections.abc import Callable


FIRST_S = 5.0  # longest wait for the configuration that a node latches


class Client:
    """Changes the parameters of a node.

    Args:
        name: The node's name.
        timeout: Longest wait for the node, seconds or `Duration`; None: until the program is to
            end.
        config_callback: Called with the configuration whenever it changes.
        description_callback: Ignored; descriptions are not read.

    Raises:
        ROSException: the node is not there in time.

    Blocks: see `timeout`.
    """

    def __init__(
        self,
        name: str,
        timeout: Any = None,
        config_callback: Callable[[dict[str, Any]], object] | None = None,
        description_callback: Callable[..., object] | None = None,
    ) -> None:
        del description_callback
        self.name = name
        self._config: dict[str, Any] | None = None
        self._callback = config_callback
        self._proxy = ServiceProxy(f"{name}/set_parameters", Reconfigure)
        if not session().dry:
            self._proxy.wait_for_service(timeout)
        self._updates = Subscriber(f"{name}/parameter_updates", Config, self._on_config)
        self.closed = False

    def get_configuration(self, timeout: Any = None) -> dict[str, Any]:
        """Return the last configuration that was received; if there was none, wait for one.

        Args:
            timeout: Longest wait, seconds or `Duration`; None: 5 s. Then the node is asked for it,
                which calls the node's callback.

        Raises:
            ROSInterruptException: the program is to end.
            ServiceException: the node did not answer.
        """
        if self._config is None:
            limit = FIRST_S if timeout is None else timeout
            try:
                self._config = decode_config(
                    wait_for_message(f"{self.name}/parameter_updates", Config, limit)
                )
            except ROSInterruptException:
                raise
            except ROSException:  # it latches none
                self._config = decode_config(self._proxy(Config()).config)
        return dict(self._config)

    def update_configuration(self, changes: dict[str, Any]) -> dict[str, Any]:
        """Change parameters, and return the node's new configuration.

        Values are converted to the types that the node has: it ignores any other.

        Raises:
            DynamicReconfigureParameterException: the node does not have one of them, or a value
                cannot be converted.
            ServiceException: the node did not answer.

        Blocks: until the answer.
        """
        known = self.get_configuration()
        values = {
            name: _as_known(name, value, known)
            for name, value in changes.items()
            if name != "groups"  # of the descriptions, which are not read
        }
        self._config = decode_config(self._proxy(encode_config(values)).config)
        return dict(self._config)

    def set_config_callback(self, value: Callable[[dict[str, Any]], object] | None) -> None:
        """Set the callback."""
        self._callback = value

    def close(self) -> None:
        """Stop receiving updates."""
        self.closed = True
        self._updates.unregister()
        self._proxy.close()

    def _on_config(self, message: Any) -> None:
        self._config = decode_config(message)
        if self._callback is not None:
            self._callback(dict(self._config))


def _as_known(name: str, value: Any, known: dict[str, Any]) -> Any:
    """Return a value as dynamic_reconfigure's client converts it."""
    if not known or isinstance(value, Anything):  # in a dry program nobody has answered
        return value
    if name not in known:
        raise DynamicReconfigureParameterException(f"don't know parameter: {name}")
    kind = type(known[name])
    if kind is bool and isinstance(value, str):
        return value.lower() in {"yes", "true", "t", "1"}
    try:
        return kind(value)
    except (TypeError, ValueError) as error:
        problem = f"can't set parameter '{name}' of type {kind.__name__}: {error}"
        raise DynamicReconfigureParameterException(problem) from error


__all__ = ["Client", "ROSException"]
