"""Actions on the wire: which keys, which messages, and the bytes that are read without a class.

The five topics of ROS 1 actionlib under the action's name, each with its ROS message, and two
additions of ours: clients acknowledge results on `ack`, and a query on `result` asks for what was
missed. `docs/wire_protocol.md` describes them for writers of other clients.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.exceptions import ActionException
from actionlib_core.goal.ports import StatusEntry

if TYPE_CHECKING:
    from collections.abc import Iterable

_U32 = struct.Struct("<I")
_HEADER = struct.Struct("<IIII")  # seq, stamp, length of the frame_id
_ID = struct.Struct("<III")  # stamp, length of the id
_FRONT = struct.Struct("<IIIIIII")  # a header with an empty frame_id, then stamp, length of the id
_TAIL = struct.Struct("<BI")  # status, length of its text
_NS = 1_000_000_000


class ActionKeys(NamedTuple):
    """The keys of one action."""

    goal: str
    cancel: str
    status: str
    feedback: str
    result: str
    ack: str


def action_keys(name: str) -> ActionKeys:
    """Return the keys of the action `name` (resolved, no slash in front)."""
    return ActionKeys(*(f"{name}/{word}" for word in ActionKeys._fields))


@dataclass(frozen=True, slots=True)
class ActionTypes:
    """The message classes of an action.

    Attributes:
        action: XAction, as the user gave it.
        action_goal: XActionGoal, with header and goal id around the goal; that of a ROS 2 action
            never travels, nor do the next two.
        action_result: XActionResult, with header and status around the result.
        action_feedback: XActionFeedback, with header and status around the feedback.
        goal: XGoal.
        result: XResult.
        feedback: XFeedback.
    """

    action: Any
    action_goal: Any
    action_result: Any
    action_feedback: Any
    goal: Any
    result: Any
    feedback: Any

    @classmethod
    def of(cls, spec: Any) -> ActionTypes:
        """Read the classes off an action class, as ROS 1 code does.

        Raises:
            ActionException: `spec` is not the class of an action.
        """
        try:
            example = spec()
            parts = example.action_goal, example.action_result, example.action_feedback
            inner = parts[0].goal, parts[1].result, parts[2].feedback
        except (AttributeError, TypeError) as error:
            raise ActionException(
                f"ActionSpec: got {spec!r}; expected an action class such as "
                "actionlib_core.interfaces.move_base_msgs.msg.MoveBaseAction. Try the name that "
                "ends with 'Action'."
            ) from error
        return cls(spec, *(type(part) for part in parts), *(type(part) for part in inner))


_CUT_SHORT = (struct.error, IndexError)


def _too_short(what: str, payload: bytes) -> ValueError:
    return ValueError(f"{what}: got {len(payload)} bytes that end too early")


# ROS 1 writes a message as its fields one after another, without gaps. So an XActionGoal is a
# header and a goal id in front of the bytes of the XGoal, and the front can be written and read
# without making objects of it.


def pack_goal(
    sent_ns: int, goal_id: str, goal_stamp_ns: int, goal: bytes, server: str = ""
) -> bytes:
    """Write an XActionGoal: header, goal id, goal; `server` is the token of the one it is for."""
    return b"".join((_pack_header(sent_ns, server), pack_goal_id(goal_id, goal_stamp_ns), goal))


def unpack_goal(payload: bytes) -> tuple[str, int, bytes]:
    """Read an XActionGoal: its goal id, its stamp [ns], the bytes of the XGoal.

    Raises:
        ValueError: the bytes are cut short or are not text where text belongs.
    """
    try:
        goal_id, stamp_ns, at = _read_id(payload, 16 + int(_U32.unpack_from(payload, 12)[0]))
    except _CUT_SHORT as error:
        raise _too_short("XActionGoal", payload) from error
    return goal_id, stamp_ns, payload[at:]


def pack_goal_id(goal_id: str, stamp_ns: int) -> bytes:
    """Write an actionlib_msgs/GoalID."""
    raw = goal_id.encode()
    return _ID.pack(stamp_ns // _NS, stamp_ns % _NS, len(raw)) + raw


def unpack_goal_id(payload: bytes) -> tuple[str, int]:
    """Read an actionlib_msgs/GoalID: the id, its stamp [ns].

    Raises:
        ValueError: the bytes are cut short or are not text where text belongs.
    """
    try:
        goal_id, stamp_ns, _ = _read_id(payload, 0)
    except _CUT_SHORT as error:
        raise _too_short("GoalID", payload) from error
    return goal_id, stamp_ns


def pack_status(entry: StatusEntry) -> bytes:
    """Write an actionlib_msgs/GoalStatus."""
    text = entry.text.encode()
    front = pack_goal_id(entry.id, entry.stamp_ns)
    return front + _TAIL.pack(entry.status, len(text)) + text


def unpack_status(payload: bytes) -> StatusEntry:
    """Read an actionlib_msgs/GoalStatus.

    Raises:
        ValueError: the bytes are cut short or are not text where text belongs.
    """
    try:
        return _read_status(payload, 0)[0]
    except _CUT_SHORT as error:
        raise _too_short("GoalStatus", payload) from error


def pack_report(sent_ns: int, entry: StatusEntry, body: bytes) -> bytes:
    """Write an XActionResult or XActionFeedback: header, status, result or feedback."""
    goal_id, stamp_ns, status, text = entry
    raw_id, raw = goal_id.encode(), text.encode()
    sent, stamp = divmod(sent_ns, _NS), divmod(stamp_ns, _NS)
    front = _FRONT.pack(0, *sent, 0, *stamp, len(raw_id))
    return b"".join((front, raw_id, _TAIL.pack(status, len(raw)), raw, body))


def unpack_report(payload: bytes) -> tuple[StatusEntry, int]:
    """Read the front of an XActionResult or XActionFeedback: status, where the rest begins.

    Raises:
        ValueError: the bytes are cut short or are not text where text belongs.
    """
    try:
        return _read_status(payload, 16 + int(_U32.unpack_from(payload, 12)[0]))
    except _CUT_SHORT as error:
        raise _too_short("XActionResult or XActionFeedback", payload) from error


def pack_statuses(sent_ns: int, entries: Iterable[StatusEntry], frame: str = "") -> bytes:
    """Write an actionlib_msgs/GoalStatusArray; a `frame` makes it a farewell or its answer."""
    parts = [pack_status(entry) for entry in entries]
    return b"".join((_pack_header(sent_ns, frame), _U32.pack(len(parts)), *parts))


def unpack_statuses(payload: bytes) -> list[StatusEntry]:
    """Read an actionlib_msgs/GoalStatusArray.

    Raises:
        ValueError: the bytes are cut short or are not text where text belongs.
    """
    entries = []
    try:
        at = 16 + int(_U32.unpack_from(payload, 12)[0])
        (count,) = _U32.unpack_from(payload, at)
        at += 4
        for _ in range(count):
            entry, at = _read_status(payload, at)
            entries.append(entry)
    except _CUT_SHORT as error:
        raise _too_short("GoalStatusArray", payload) from error
    return entries


def unpack_frame(payload: bytes) -> str:
    """Read the frame id of the header that a message begins with.

    Raises:
        ValueError: the bytes are cut short or are not text where text belongs.
    """
    try:
        return _read_text(payload, 16, int(_U32.unpack_from(payload, 12)[0]))
    except _CUT_SHORT as error:
        raise _too_short("Header", payload) from error


def _pack_header(sent_ns: int, frame: str = "") -> bytes:
    raw = frame.encode()
    return _HEADER.pack(0, sent_ns // _NS, sent_ns % _NS, len(raw)) + raw


def _read_id(payload: bytes, at: int) -> tuple[str, int, int]:
    """Read a GoalID: the id, its stamp [ns], where the rest begins."""
    secs, nsecs, length = _ID.unpack_from(payload, at)
    at += 12
    return _read_text(payload, at, length), secs * _NS + nsecs, at + length


def _read_status(payload: bytes, at: int) -> tuple[StatusEntry, int]:
    goal_id, stamp_ns, at = _read_id(payload, at)
    status, length = _TAIL.unpack_from(payload, at)
    at += 5
    text = _read_text(payload, at, length) if length else ""
    return StatusEntry(goal_id, stamp_ns, status, text), at + length


def _read_text(payload: bytes, at: int, length: int) -> str:
    raw = payload[at : at + length]
    if len(raw) < length:
        raise IndexError(at)
    return raw.decode()
