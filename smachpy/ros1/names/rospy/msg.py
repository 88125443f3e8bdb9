"""`AnyMsg`: a message of any type, as bytes."""

from __future__ import annotations

from typing import Any

__all__ = ["AnyMsg"]


class AnyMsg:
    """A received message that is not deserialised.

    Attributes:
        _buff: Its bytes, as serialised in ROS 1.
        _connection_header: `type`, `md5sum`, `topic` and `callerid`, as strings.
    """

    _type = "*"
    _md5sum = "*"
    _has_header = False
    _full_text = ""
    __slots__ = ("_buff", "_connection_header")
    _slot_types: tuple[str, ...] = ()

    def __init__(self, *args: Any) -> None:
        if args:
            raise ValueError("AnyMsg: got arguments; expected none: it only receives.")
        self._buff: bytes | None = None
        self._connection_header: dict[str, str] = {}

    def serialize(self, buff: Any) -> None:
        """Write the bytes to a file."""
        buff.write(self._buff or b"")

    def deserialize(self, str_data: bytes) -> AnyMsg:
        """Store the bytes of a message."""
        self._buff = str_data
        return self
