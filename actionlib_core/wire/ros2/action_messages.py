"""The messages around the goals, results and feedback of ROS 2's actions, as bytes.

The fields before a goal or feedback are packed and read here without making objects. A goal id has
16 bytes, so the alignment of what follows it does not change: a request is `header + id + goal`.
Only a result follows a single byte (its status), and is therefore serialised together with it by
its own class. Padding is written as zeros; real nodes leave anything there.

Source:
    `action_msgs`, `unique_identifier_msgs`, and rosidl_generator's action templates; OMG CDR 1.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

CDR_HEADER = b"\x00\x01\x00\x00"  # CDR version 1, little-endian
UUID_BYTES = 16
# Both byte orders are read, as the writer chooses; only little-endian is written.
_ORDERS = {b"\x00\x01": "<", b"\x00\x00": ">"}
_NS = 1_000_000_000
_LATEST_S = 2**31 - 1  # builtin_interfaces/Time has int32 seconds

# The x are CDR's padding: each field begins at a multiple of its size, counted from the header.
_ACCEPTED = struct.Struct("<4s?3xiI")
_INFO = struct.Struct("<16siI")
_COUNT = struct.Struct("<4sI")
_CANCEL_RESPONSE = struct.Struct("<4sb3xI")
_FIRST = struct.Struct("<16siIb")
_NEXT = struct.Struct("<16s3xiIb")  # it begins behind a status of one byte: its stamp needs padding
MAX_SEARCHED = 16  # more goals than this are found sooner by reading the whole list


class GoalState(NamedTuple):
    """A goal in a status list (action_msgs/GoalStatus).

    Attributes:
        uuid: The goal's id, 16 bytes.
        stamp_ns: When it was accepted [ns since 1970].
        code: See `GoalCode`.
    """

    uuid: bytes
    stamp_ns: int
    code: int


class CancelRequest(NamedTuple):
    """A request to cancel goals (action_msgs/srv/CancelGoal); zeros stand for "any".

    Attributes:
        uuid: The goal's id, 16 bytes.
        stamp_ns: Goals accepted at or before this time are cancelled [ns since 1970].
    """

    uuid: bytes
    stamp_ns: int


class CancelResponse(NamedTuple):
    """The response to a cancel request.

    Attributes:
        code: See `CancelCode`.
        goals: Id and stamp [ns since 1970] of the goals that are now canceling.
    """

    code: int
    goals: tuple[tuple[bytes, int], ...]


def pack_with_id(uuid: bytes, body: bytes) -> bytes:
    """Write X_SendGoal_Request or X_FeedbackMessage around a serialised goal or feedback.

    Raises:
        ValueError: the id has not 16 bytes, or `body` is not little-endian CDR.
    """
    if body[:4] != CDR_HEADER:
        raise ValueError(f"body: got bytes that begin with {body[:4].hex(' ')}; expected CDR 1.")
    return b"".join((CDR_HEADER, _checked(uuid), body[4:]))


def unpack_with_id(payload: bytes) -> tuple[bytes, bytes]:
    """Return the id and the serialised goal or feedback; the inverse of `pack_with_id`.

    Raises:
        ValueError: bytes are missing, or they are not CDR of version 1.
    """
    _order(payload, 4 + UUID_BYTES)
    return payload[4:20], payload[:4] + payload[20:]


def pack_id(uuid: bytes) -> bytes:
    """Write X_GetResult_Request; errors as `pack_with_id`."""
    return CDR_HEADER + _checked(uuid)


def unpack_id(payload: bytes) -> bytes:
    """Read X_GetResult_Request; errors as `unpack_with_id`."""
    return unpack_with_id(payload)[0]


def pack_accepted(stamp_ns: int | None) -> bytes:
    """Write X_SendGoal_Response: accepted at `stamp_ns`; None: refused."""
    return _ACCEPTED.pack(CDR_HEADER, stamp_ns is not None, *_time(stamp_ns or 0))


def unpack_accepted(payload: bytes) -> int | None:
    """Read X_SendGoal_Response: the stamp [ns since 1970]; None when the goal is refused.

    Raises:
        ValueError: see `unpack_with_id`.
    """
    order = _order(payload, _ACCEPTED.size)
    accepted, seconds, nanoseconds = struct.unpack_from(f"{order}4x?3xiI", payload)
    return seconds * _NS + nanoseconds if accepted else None


def with_status(response: bytes, code: int) -> bytes:
    """Return a serialised X_GetResult_Response with another status."""
    return b"".join((response[:4], bytes((code,)), response[5:]))


def status_in(response: bytes) -> int:
    """Return the status of a serialised X_GetResult_Response; errors as `unpack_with_id`."""
    _order(response, 5)
    return int.from_bytes(response[4:5], signed=True)


def pack_cancel(asked: CancelRequest) -> bytes:
    """Write CancelGoal_Request; errors as `pack_with_id`."""
    return CDR_HEADER + _INFO.pack(_checked(asked.uuid), *_time(asked.stamp_ns))


def unpack_cancel(payload: bytes) -> CancelRequest:
    """Read CancelGoal_Request; errors as `unpack_with_id`."""
    order = _order(payload, 4 + _INFO.size)
    uuid, seconds, nanoseconds = struct.unpack_from(f"{order}4x16siI", payload)
    return CancelRequest(uuid, seconds * _NS + nanoseconds)


def pack_cancel_response(answer: CancelResponse) -> bytes:
    """Write CancelGoal_Response; errors as `pack_with_id`."""
    parts = [_CANCEL_RESPONSE.pack(CDR_HEADER, answer.code, len(answer.goals))]
    parts += [_INFO.pack(_checked(uuid), *_time(stamp_ns)) for uuid, stamp_ns in answer.goals]
    return b"".join(parts)


def unpack_cancel_response(payload: bytes) -> CancelResponse:
    """Read CancelGoal_Response; errors as `unpack_with_id`."""
    order = _order(payload, _CANCEL_RESPONSE.size)
    code, count = struct.unpack_from(f"{order}4xb3xI", payload)
    info = struct.Struct(f"{order}16siI")
    _order(payload, _CANCEL_RESPONSE.size + count * info.size)
    end = _CANCEL_RESPONSE.size + count * info.size
    found = info.iter_unpack(payload[_CANCEL_RESPONSE.size : end])
    return CancelResponse(code, tuple((uuid, sec * _NS + nsec) for uuid, sec, nsec in found))


def pack_state(goal: GoalState) -> bytes:
    """Write one element of GoalStatusArray, for `join_statuses`; errors as `pack_with_id`."""
    return _NEXT.pack(_checked(goal.uuid), *_time(goal.stamp_ns), goal.code)


def pack_statuses(goals: Iterable[GoalState]) -> bytes:
    """Write GoalStatusArray; errors as `pack_with_id`."""
    return join_statuses([pack_state(goal) for goal in goals])


def join_statuses(packed: Collection[bytes]) -> bytes:
    """Write GoalStatusArray from elements of `pack_state`."""
    body = b"".join(packed)
    # Drop the padding of the first element: there the stamp is aligned without it.
    return b"".join((_COUNT.pack(CDR_HEADER, len(packed)), body[:16], body[19:]))


def unpack_statuses(payload: bytes) -> list[GoalState]:
    """Read GoalStatusArray; errors as `unpack_with_id`."""
    order = _order(payload, _COUNT.size)
    (count,) = struct.unpack_from(f"{order}4xI", payload)
    if not count:
        return []
    _order(payload, _COUNT.size + _FIRST.size + (count - 1) * _NEXT.size)
    found: list[tuple[bytes, int, int, int]] = [
        struct.unpack_from(f"{order}16siIb", payload, _COUNT.size)
    ]
    start, size = _COUNT.size + _FIRST.size, _NEXT.size
    rest: Iterable[tuple[bytes, int, int, int]] = struct.iter_unpack(
        f"{order}16s3xiIb", payload[start : start + (count - 1) * size]
    )
    found += rest
    return [GoalState(uuid, sec * _NS + nsec, code) for uuid, sec, nsec, code in found]


def find_states(payload: bytes, wanted: Collection[bytes]) -> list[tuple[bytes, int]]:
    """Return id and status of the `wanted` goals of a GoalStatusArray; errors as `unpack_with_id`.

    A list contains every goal of the last seconds, and a client follows few of them: searching the
    bytes for those is quicker than reading the whole list.
    """
    if len(wanted) > MAX_SEARCHED:
        return [(uuid, code) for uuid, _, code in unpack_statuses(payload) if uuid in wanted]
    order = _order(payload, _COUNT.size)
    (count,) = struct.unpack_from(f"{order}4xI", payload)
    end = _COUNT.size + (_FIRST.size + (count - 1) * _NEXT.size if count else 0)
    _order(payload, end)
    # The bytes of an id may also occur by chance, across two elements: a hit counts only where an
    # element begins. A status is one byte, so the byte order does not matter here.
    found = []
    for uuid in wanted:
        start = payload.find(uuid, _COUNT.size, end)
        while start >= 0:
            after_first = start - _COUNT.size - _FIRST.size
            if after_first + _FIRST.size == 0:
                found.append((uuid, payload[start + _FIRST.size - 1]))
                break
            if after_first >= 0 and after_first % _NEXT.size == 0:
                found.append((uuid, payload[start + _NEXT.size - 1]))
                break
            start = payload.find(uuid, start + 1, end)
    return found


def _order(payload: bytes, size: int) -> str:
    """Return a payload's byte order as a `struct` character; raise if it is shorter than `size`."""
    order = _ORDERS.get(bytes(payload[:2]))
    if order is None or len(payload) < size:
        raise ValueError(
            f"payload: got {len(payload)} bytes that begin with {payload[:4].hex(' ')!r}; "
            f"expected CDR 1 of {size} bytes or more."
        )
    return order


def _checked(uuid: bytes) -> bytes:
    if len(uuid) != UUID_BYTES:
        raise ValueError(f"goal id: got {len(uuid)} bytes; expected {UUID_BYTES}.")
    return uuid


def _time(stamp_ns: int) -> tuple[int, int]:
    """Return seconds and nanoseconds, limited to what the message's fields can hold."""
    seconds, nanoseconds = divmod(stamp_ns, _NS)
    if seconds > _LATEST_S:
        return _LATEST_S, _NS - 1
    return (seconds, nanoseconds) if seconds >= 0 else (0, 0)
