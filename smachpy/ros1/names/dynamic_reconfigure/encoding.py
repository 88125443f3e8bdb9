"""dynamic_reconfigure.encoding: configurations as messages, and the parameters of a description."""

from __future__ import annotations

from typing import Any

from actionlib_core.pubsub.remote_node import add_to_config
from smachpy.ros1.names.dynamic_reconfigure import Config as ConfigMsg
from smachpy.ros1.names.dynamic_reconfigure import DynamicReconfigureParameterException
from smachpy.ros1.stubs import Anything


class Config(dict[str, Any]):
    """A configuration; its values are also attributes."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


def decode_config(msg: Any, description: Any = None) -> Config:
    """Return the values of a message."""
    del description
    parts = (*msg.bools, *msg.ints, *msg.strs, *msg.doubles)
    return Config({part.name: part.value for part in parts})


def encode_config(config: dict[str, Any], flat: bool = True) -> Any:
    """Return a message with these values.

    Raises:
        DynamicReconfigureParameterException: a value is not a bool, number or text.
    """
    del flat
    msg = ConfigMsg()
    for name, value in config.items():
        try:
            add_to_config(msg, name, str(value) if isinstance(value, Anything) else value)
        except ValueError as error:
            raise DynamicReconfigureParameterException(f"{name}: {error}") from error
    return msg


def extract_params(group: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the parameters of a group and of its subgroups."""
    found = list(group["parameters"])
    for inner in group["groups"]:
        found += extract_params(inner)
    return found


__all__ = ["Config", "decode_config", "encode_config", "extract_params"]
