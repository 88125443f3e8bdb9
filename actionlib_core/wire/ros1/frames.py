"""The bytes of TCPROS: lengths, connection headers, answers of services. No sockets.

Source:
    https://wiki.ros.org/ROS/TCPROS and https://wiki.ros.org/ROS/Connection%20Header.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

LENGTH = struct.Struct("<I")
LARGEST_HEADER = 1 << 20  # message definitions are in it; the largest of ROS's own has 25 kB
LARGEST_MESSAGE = 256 << 20  # a colour image of 80 megapixels

Header = dict[str, str]


def read_length(raw: bytes, limit: int) -> int:
    """Return the length that four bytes announce.

    Raises:
        ValueError: they are fewer than four, or announce more than `limit` bytes.
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


def pack_header(fields: Mapping[str, str]) -> bytes:
    """Return a connection header with its length in front."""
    return pack_frame(b"".join(pack_frame(f"{k}={v}".encode()) for k, v in fields.items()))


def unpack_header(raw: bytes) -> Header:
    """Read a connection header, without the length in front.

    Raises:
        ValueError: a field is cut short, is no text, or has no `=`.
    """
    fields: Header = {}
    at = 0
    while at < len(raw):
        length = read_length(raw[at : at + LENGTH.size], LARGEST_HEADER)
        at += LENGTH.size
        field = raw[at : at + length]
        if len(field) < length:
            raise ValueError(f"header field: got {len(field)} bytes; expected {length}")
        key, equals, value = field.decode().partition("=")  # a UnicodeDecodeError is a ValueError
        if not (key and equals):
            raise ValueError(f"header field: got {key[:80]!r}; expected key=value")
        fields[key] = value
        at += length
    return fields


def pack_service_answer(payload: bytes, *, good: bool) -> bytes:
    """Return what a service sends back: a byte that says whether it is a response, or an error."""
    return bytes([good]) + pack_frame(payload)
