"""The bytes of TCPROS: lengths, connection headers, service responses. No sockets.

Source:
    https://wiki.ros.org/ROS/TCPROS and https://wiki.ros.org/ROS/Connection%20Header.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

LENGTH = struct.Struct("<I")
LARGEST_HEADER = 1 << 18  # it contains the message definition; ROS's own have 25 kB at most
LARGEST_MESSAGE = 256 << 20  # a colour image of 80 megapixels

Header = dict[str, str]


def read_length(raw: bytes, limit: int) -> int:
    """Return the length in the four bytes before a message or field.

    Raises:
        ValueError: there are fewer than four bytes, or the length exceeds `limit`.
    """
    if len(raw) < LENGTH.size:
        raise ValueError(f"length: got {len(raw)} bytes; expected {LENGTH.size}")
    length = int(LENGTH.unpack(raw)[0])
    if length > limit:
        raise ValueError(f"length: got {length} bytes; expected at most {limit}")
    return length


def pack_frame(payload: bytes) -> bytes:
    """Return `payload` with its length in front."""
    return LENGTH.pack(len(payload)) + payload


def pack_fields(fields: Mapping[str, str]) -> bytes:
    """Return a connection header without the length in front."""
    return b"".join(pack_frame(f"{k}={v}".encode()) for k, v in fields.items())


def pack_header(fields: Mapping[str, str]) -> bytes:
    """Return a connection header with its length in front."""
    return pack_frame(pack_fields(fields))


def unpack_header(raw: bytes) -> Header:
    """Read a connection header without the length in front.

    Raises:
        ValueError: a field is incomplete or has no `=`.
    """
    fields: Header = {}
    at = 0
    while at < len(raw):
        length = read_length(raw[at : at + LENGTH.size], LARGEST_HEADER)
        at += LENGTH.size
        field = raw[at : at + length]
        if len(field) < length:
            raise ValueError(f"header field: got {len(field)} bytes; expected {length}")
        # The comments of a message definition may be in Latin-1: no reason to refuse its sender.
        key, equals, value = field.decode(errors="replace").partition("=")
        if not (key and equals):
            raise ValueError(f"header field: got {key[:80]!r}; expected key=value")
        fields[key] = value
        at += length
    return fields


def pack_service_answer(payload: bytes, *, good: bool) -> bytes:
    """Return a service's answer: 1 and the response, or with `good=False` 0 and an error text."""
    return bytes([good]) + pack_frame(payload)
