"""The attachment of 33 bytes on every message, request and reply of ROS 2 over Zenoh.

A real node aborts when the attachment of a request is missing, too short, negative or repeated, and
likewise for replies and messages. So invalid attachments are refused here before they are sent, and
each endpoint numbers its messages with its own `Numbering`.

Source:
    rmw_zenoh_cpp 0.6.7, as measured: int64 sequence number from 1, int64 time of sending [ns since
    1970], the length 16, the sender's gid; all little-endian.
"""

from __future__ import annotations

import itertools
import struct
from typing import NamedTuple

SIZE = 33
GID_BYTES = 16
_LAYOUT = struct.Struct(f"<qqB{GID_BYTES}s")
_LARGEST = 2**63 - 1


class Attachment(NamedTuple):
    """The content of an attachment.

    Attributes:
        sequence: Counts the messages or requests of the sender, from 1.
        time_ns: When it was sent [ns since 1970], by the sender's clock.
        gid: Identifies the publisher or service client, 16 bytes.
    """

    sequence: int
    time_ns: int
    gid: bytes


def pack_attachment(attachment: Attachment) -> bytes:
    """Return the 33 bytes of an attachment.

    Raises:
        ValueError: a real node would abort on it: a negative sequence number or time, a gid without
            16 bytes, a number that does not fit into 64 bits.
    """
    sequence, time_ns, gid = attachment
    for what, number in (("sequence", sequence), ("time_ns", time_ns)):
        if not 0 <= number <= _LARGEST:
            raise ValueError(f"attachment: {what}: got {number}; expected 0 to 2**63 - 1.")
    if len(gid) != GID_BYTES:
        raise ValueError(f"attachment: gid: got {len(gid)} bytes; expected {GID_BYTES}.")
    return _LAYOUT.pack(sequence, time_ns, GID_BYTES, gid)


def unpack_attachment(raw: bytes | None) -> Attachment:
    """Return the content of an attachment; bytes after the 33 are ignored, as in ROS 2.

    Raises:
        ValueError: there is none, or it is not one of ROS 2.
    """
    if raw is None or len(raw) < SIZE:
        got = "none" if raw is None else f"{len(raw)} bytes"
        raise ValueError(f"attachment: got {got}; expected {SIZE} bytes.")
    sequence, time_ns, length, gid = _LAYOUT.unpack_from(raw)
    if length != GID_BYTES:
        raise ValueError(f"attachment: gid: got a length of {length}; expected {GID_BYTES}.")
    if sequence < 0 or time_ns < 0:
        raise ValueError(
            f"attachment: got sequence number {sequence}, time {time_ns} ns; expected 0 or more."
        )
    return Attachment(sequence, time_ns, gid)


def answer_to(request: Attachment, time_ns: int) -> bytes:
    """Return the attachment of the reply to a request.

    It carries the request's number and gid, by which the client finds the request, and a new time.
    """
    return pack_attachment(request._replace(time_ns=max(0, time_ns)))


class Numbering:
    """Numbers the messages of one publisher or service client, so that no attachment is repeated.

    Args:
        gid: Identifies that endpoint, 16 bytes.

    Raises:
        ValueError: the gid has another length.

    Threads: any; no number is given out twice.
    """

    def __init__(self, gid: bytes) -> None:
        self.gid = bytes(gid)
        self._numbers = itertools.count(1)  # needs no lock: next() on it is atomic in CPython
        pack_attachment(Attachment(0, 0, self.gid))  # raises for a bad gid now, not while sending

    def take(self, time_ns: int) -> tuple[int, bytes]:
        """Return the next sequence number and its attachment.

        Args:
            time_ns: Current time [ns since 1970]; times before 1970 count as 1970.
        """
        sequence = next(self._numbers)
        return sequence, pack_attachment(Attachment(sequence, max(0, time_ns), self.gid))
