"""The messages around the goals, results and feedback of ROS 2's actions, as bytes.

Their fronts are packed and read here without making objects: a goal id is 16 bytes, which leaves
what follows it as aligned as it was alone, so that a request is `front + goal`. Only a result
stands behind a single byte, and is written with its status by its own class. Padding is written as
zeros; real nodes leave anything there.

Source:
    `action_msgs`, `unique_identifier_msgs`, and rosidl_generator's action templates; OMG CDR 1.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

FRONT = b"\x00\x01\x00\x00"  # CDR version 1, little-endian
UUID_BYTES = 16
_ORDERS = {b"\x00\x01": "<", b"\x00\x00": ">"}
_NS = 1_000_000_000
_LATEST_S = 2**31 - 1

_ACCEPTED = struct.Struct("<4s?3xiI")
_INFO = struct.Struct("<16siI")
_COUNT = struct.Struct("<4sI")
_CANCELED = struct.Struct("<4sb3xI")
_FIRST = struct.Struct("<16siIb")
SOUGHT = 16  # goals at most that are looked for one by one
_NEXT = struct.Struct("<16s3xiIb")  # an element begins where the status before it has ended


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


class Asked(NamedTuple):
    """A request to cancel (action_msgs/srv/CancelGoal); zeros stand for "any".

    Attributes:
        uuid: Of the goal, 16 bytes.
        stamp_ns: Goals accepted at or before it [ns since 1970].
    """

    uuid: bytes
    stamp_ns: int


class Canceling(NamedTuple):
    """An answer to a cancel.

    Attributes:
        code: See `CancelCode`.
        goals: Id and stamp [ns since 1970] of the goals that are canceling now.
    """

    code: int
    goals: tuple[tuple[bytes, int], ...]


def pack_with_id(uuid: bytes, body: bytes) -> bytes:
    """Write X_SendGoal_Request or X_FeedbackMessage around the bytes of a goal or feedback.

    Raises:
        ValueError: the id is not 16 bytes, or `body` is no little-endian CDR.
    """
    if body[:4] != FRONT:
        raise ValueError(f"body: got bytes that begin with {body[:4].hex(' ')}; expected CDR 1.")
    return b"".join((FRONT, _checked(uuid), body[4:]))


def unpack_with_id(payload: bytes) -> tuple[bytes, bytes]:
    """Read what `pack_with_id` writes: the id, and the bytes of what it stands before.

    Raises:
        ValueError: the bytes are cut short, or no CDR of version 1.
    """
    _order(payload, 4 + UUID_BYTES)
    return payload[4:20], payload[:4] + payload[20:]


def pack_id(uuid: bytes) -> bytes:
    """Write X_GetResult_Request; errors as `pack_with_id`."""
    return FRONT + _checked(uuid)


def unpack_id(payload: bytes) -> bytes:
    """Read X_GetResult_Request; errors as `unpack_with_id`."""
    return unpack_with_id(payload)[0]


def pack_accepted(stamp_ns: int | None) -> bytes:
    """Write X_SendGoal_Response: accepted at a time, or refused with None."""
    return _ACCEPTED.pack(FRONT, stamp_ns is not None, *_time(stamp_ns or 0))


def unpack_accepted(payload: bytes) -> int | None:
    """Read X_SendGoal_Response: the stamp [ns since 1970], None when the goal is refused.

    Raises:
        ValueError: see `unpack_with_id`.
    """
    order = _order(payload, _ACCEPTED.size)
    accepted, seconds, nanoseconds = struct.unpack_from(f"{order}4x?3xiI", payload)
    return seconds * _NS + nanoseconds if accepted else None


def with_status(response: bytes, code: int) -> bytes:
    """Return the bytes of an X_GetResult_Response with another status in them."""
    return b"".join((response[:4], bytes((code,)), response[5:]))


def status_in(response: bytes) -> int:
    """Return the status in an X_GetResult_Response; errors as `unpack_with_id`."""
    _order(response, 5)
    return int.from_bytes(response[4:5], signed=True)


def pack_cancel(asked: Asked) -> bytes:
    """Write CancelGoal_Request; errors as `pack_with_id`."""
    return FRONT + _INFO.pack(_checked(asked.uuid), *_time(asked.stamp_ns))


def unpack_cancel(payload: bytes) -> Asked:
    """Read CancelGoal_Request; errors as `unpack_with_id`."""
    order = _order(payload, 4 + _INFO.size)
    uuid, seconds, nanoseconds = struct.unpack_from(f"{order}4x16siI", payload)
    return Asked(uuid, seconds * _NS + nanoseconds)


def pack_canceling(answer: Canceling) -> bytes:
    """Write CancelGoal_Response; errors as `pack_with_id`."""
    parts = [_CANCELED.pack(FRONT, answer.code, len(answer.goals))]
    parts += [_INFO.pack(_checked(uuid), *_time(stamp_ns)) for uuid, stamp_ns in answer.goals]
    return b"".join(parts)


def unpack_canceling(payload: bytes) -> Canceling:
    """Read CancelGoal_Response; errors as `unpack_with_id`."""
    order = _order(payload, _CANCELED.size)
    code, count = struct.unpack_from(f"{order}4xb3xI", payload)
    info = struct.Struct(f"{order}16siI")
    _order(payload, _CANCELED.size + count * info.size)
    end = _CANCELED.size + count * info.size
    found = info.iter_unpack(payload[_CANCELED.size : end])
    return Canceling(code, tuple((uuid, sec * _NS + nsec) for uuid, sec, nsec in found))


def pack_state(goal: GoalState) -> bytes:
    """Write an element of GoalStatusArray, one that is not the first; errors as `pack_with_id`."""
    return _NEXT.pack(_checked(goal.uuid), *_time(goal.stamp_ns), goal.code)


def pack_statuses(goals: Iterable[GoalState]) -> bytes:
    """Write GoalStatusArray; errors as `pack_with_id`."""
    return join_statuses([pack_state(goal) for goal in goals])


def join_statuses(packed: Collection[bytes]) -> bytes:
    """Write GoalStatusArray of what `pack_state` has written."""
    body = b"".join(packed)
    # Only the first element has its stamp where it needs no padding.
    return b"".join((_COUNT.pack(FRONT, len(packed)), body[:16], body[19:]))


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
    """Return id and status of the goals of GoalStatusArray that are wanted; errors as above.

    A list names every goal of the last seconds, and a client knows few of them: looking for those
    is quicker than reading all.
    """
    if len(wanted) > SOUGHT:
        return [(uuid, code) for uuid, _, code in unpack_statuses(payload) if uuid in wanted]
    order = _order(payload, _COUNT.size)
    (count,) = struct.unpack_from(f"{order}4xI", payload)
    end = _COUNT.size + (_FIRST.size + (count - 1) * _NEXT.size if count else 0)
    _order(payload, end)
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
            start = payload.find(uuid, start + 1, end)  # by chance, across two goals
    return found


def _order(payload: bytes, size: int) -> str:
    """Return the byte order of a payload of `size` bytes at least, in `struct`'s letters."""
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
    """Return seconds and nanoseconds; what the wire cannot say becomes the nearest that it can."""
    seconds, nanoseconds = divmod(stamp_ns, _NS)
    if seconds > _LATEST_S:
        return _LATEST_S, _NS - 1
    return (seconds, nanoseconds) if seconds >= 0 else (0, 0)
