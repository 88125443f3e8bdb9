"""The 33 bytes that go with every message, request and reply of ROS 2 over Zenoh.

A real node dies of a request whose attachment is missing, short, negative or a repetition, and of
a reply or message likewise. So nothing is packed here that is not exactly right, and every end
numbers what it sends with one `Numbering` of its own.

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
    """What an attachment says.

    Attributes:
        sequence: From 1, one more with every message or request of its sender.
        time_ns: When it was sent [ns since 1970], by the sender's clock.
        gid: Sixteen bytes that only this publisher or service client has.
    """

    sequence: int
    time_ns: int
    gid: bytes


def pack_attachment(attachment: Attachment) -> bytes:
    """Return the 33 bytes of an attachment.

    Raises:
        ValueError: a real node would die of it: a sequence number below 0, a negative time, a gid
            that is not 16 bytes, a number that 64 bits do not hold.
    """
    sequence, time_ns, gid = attachment
    for what, number in (("sequence", sequence), ("time_ns", time_ns)):
        if not 0 <= number <= _LARGEST:
            raise ValueError(f"attachment: {what}: got {number}; expected 0 to 2**63 - 1.")
    if len(gid) != GID_BYTES:
        raise ValueError(f"attachment: gid: got {len(gid)} bytes; expected {GID_BYTES}.")
    return _LAYOUT.pack(sequence, time_ns, GID_BYTES, gid)


def unpack_attachment(raw: bytes | None) -> Attachment:
    """Return what an attachment says; bytes after the 33 are ignored, as ROS 2 does.

    Raises:
        ValueError: there is none, or it is none of ROS 2's.
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
    """Return the attachment of the reply to a request: its number and gid, and a new time."""
    return pack_attachment(request._replace(time_ns=max(0, time_ns)))


class Numbering:
    """Numbers what one publisher or service client sends, so that no two attachments are equal.

    Args:
        gid: Of that end, 16 bytes.

    Raises:
        ValueError: the gid has another length.

    Threads: any; two of them never get the same number.
    """

    def __init__(self, gid: bytes) -> None:
        self.gid = bytes(gid)
        self._numbers = itertools.count(1)  # taking one is a single step of the interpreter
        pack_attachment(Attachment(0, 0, self.gid))

    def take(self, time_ns: int) -> tuple[int, bytes]:
        """Return the next sequence number and the attachment with it.

        Args:
            time_ns: Time now [ns since 1970]; a clock that stands before 1970 counts as 1970.
        """
        sequence = next(self._numbers)
        return sequence, pack_attachment(Attachment(sequence, max(0, time_ns), self.gid))
