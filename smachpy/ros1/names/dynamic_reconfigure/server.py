"""dynamic_reconfigure.server: lets other nodes change parameters of this node while it runs."""

from __future__ import annotations

import string
import threading
from typing import TYPE_CHECKING, Any

from smachpy.ros1.names.dynamic_reconfigure import (
    Config,
    DynamicReconfigureCallbackException,
    Reconfigure,
)
from smachpy.ros1.names.dynamic_reconfigure.encoding import Config as Values
from smachpy.ros1.names.dynamic_reconfigure.encoding import decode_config, encode_config
from smachpy.ros1.names.rospy.client import get_param, set_param
from smachpy.ros1.names.rospy.names import resolve_name
from smachpy.ros1.names.rospy.service import Service
from smachpy.ros1.names.rospy.topics import Publisher
from smachpy.ros1.stubs import Anything

if TYPE_CHECKING:
    from collections.abc import Callable


class Server:
    """Lets other nodes change this node's parameters; as in ROS, but descriptions are not sent.

    Args:
        type: The module of the configuration, `pkg.cfg.NameConfig`.
        callback: Called with the configuration and the levels that changed, at first with all
            levels; returns the configuration to use.
        namespace: Namespace of the parameters, below the node's name.
    """

    def __init__(
        self,
        type: Any,
        callback: Callable[[dict[str, Any], int], dict[str, Any] | None],
        namespace: str = "",
    ) -> None:
        self.mutex = threading.Lock()
        self.type = type
        self.callback = callback
        self.ns_name = resolve_name(f"~{namespace}").rstrip("/")
        self.config = Values(_defaults(type, callback))
        for name, value in self.config.items():
            self.config[name] = get_param(f"{self.ns_name}/{name}", value)
        self._clamp(self.config)
        self.update_topic = Publisher(
            f"{self.ns_name}/parameter_updates", Config, latch=True, queue_size=10
        )
        self._change_config(self.config, 0xFFFFFFFF)  # as in ROS, the first call has all levels
        self.set_service = Service(
            f"{self.ns_name}/set_parameters", Reconfigure, self._set_callback
        )

    def update_configuration(self, changes: dict[str, Any]) -> dict[str, Any]:
        """Change parameters, and return the configuration that the callback returns.

        Raises:
            DynamicReconfigureCallbackException: the callback returned None.

        Threads: any, one at a time.
        """
        with self.mutex:
            new = Values(self.config)
            new.update(changes)
            self._clamp(new)
            level = 0
            for name, value in new.items():
                if value != self.config.get(name):
                    level |= self._of("level").get(name, 0)
            return self._change_config(new, level)

    def _of(self, what: str) -> dict[str, Any]:
        found = getattr(self.type, what)
        return found if isinstance(found, dict) else {}  # the module may be a stand-in

    def _clamp(self, config: dict[str, Any]) -> None:
        least, most = self._of("min"), self._of("max")
        for name, kind in self._of("type").items():
            if kind in {"int", "double"} and name in config:
                config[name] = max(least[name], min(most[name], config[name]))

    def _change_config(self, config: dict[str, Any], level: int) -> dict[str, Any]:
        wanted = self.callback(config, level)
        if wanted is None:
            raise DynamicReconfigureCallbackException(
                "Reconfigure callback should return a possibly updated configuration."
            )
        self.config = Values(wanted)
        for name, value in self.config.items():
            set_param(f"{self.ns_name}/{name}", value)
        self.update_topic.publish(encode_config(self.config))
        return self.config

    def _set_callback(self, request: Any) -> Any:
        return encode_config(self.update_configuration(decode_config(request.config)))


def _defaults(kind: Any, callback: Any) -> dict[str, Any]:
    """Return the default values.

    A stand-in has none. But callbacks often log their configuration with a format string, which
    contains its names.
    """
    if isinstance(kind.defaults, dict):
        return kind.defaults
    code = getattr(getattr(callback, "__func__", callback), "__code__", None)
    texts = [each for each in getattr(code, "co_consts", ()) if isinstance(each, str)]
    names = [name for text in texts for _, name, _, _ in string.Formatter().parse(text) if name]
    return {name: Anything(name) for name in names}


__all__ = ["Server"]
