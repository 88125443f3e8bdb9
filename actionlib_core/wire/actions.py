"""An action on our own wire: its keys, the bytes of its messages, and the ports of both sides.

It uses the five topics of ROS 1 actionlib under the action's name, each with its ROS message, and
two additions: clients acknowledge results on `ack`, and query `result` for what they have missed.
`docs/wire_protocol.md` describes them for authors of other clients.
"""

from __future__ import annotations

import logging
import struct
import threading
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.exceptions import ActionlibError, ServerConflictError, TransportError
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.interfaces._message import codecs_of
from actionlib_core.interfaces._values import TEXT_CODEC
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.transport import Quality, Sample
from actionlib_core.transport.tokens import Kind, parse_token, token_key, token_pattern
from actionlib_core.wire import in_process
from actionlib_core.wire.absence import explain_absence
from actionlib_core.wire.arrivals import Bursts, Readable
from actionlib_core.wire.encoding import encoding_of
from actionlib_core.wire.presence import (
    find_mismatch,
    in_conflict,
    is_younger,
    list_endpoints,
    with_age,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.goal.ports import ClientListener, ServerListener
    from actionlib_core.node import Node
    from actionlib_core.transport import (
        Closable,
        Presence,
        PublisherPort,
        Query,
        Reply,
        Transport,
    )
    from actionlib_core.transport.tokens import Endpoint
    from actionlib_core.wire.action_types import ActionTypes

log = logging.getLogger(__name__)

ASK_TIMEOUT_S = 2.0  # longest wait for the reply to a query about a goal
FAREWELL_LIST_S = 0.2  # longest wait for the list of clients before a farewell

# `express` messages are sent at once, the others may be put into one packet with later ones.
# `block` waits while a link is full; without it, the message is then dropped.
GOAL = Quality(express=True, block=True)
AGAIN = Quality(express=True, block=False)  # a repetition, which will be repeated again
ACK = Quality(express=False, block=False)  # a lost one leads to a repetition of the result
RESULT = Quality(express=True, block=True)
RESULT_OR_NOT = Quality(express=True, block=False)  # a client that misses it queries for it
FEEDBACK = Quality(express=False, block=True)
STATUS = Quality(express=False, block=False)  # repeated every second

_U32 = struct.Struct("<I")
_HEADER = struct.Struct("<IIII")  # seq, stamp, length of the frame_id
_SEQ_CANCEL_IF_LOST = _U32.pack(1)
_ID = struct.Struct("<III")  # stamp, length of the id
_FRONT = struct.Struct("<IIIIIII")  # a header with an empty frame_id and an `_ID` as one
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


_CUT_SHORT = (struct.error, IndexError)


def _too_short(what: str, payload: bytes) -> ValueError:
    return ValueError(f"{what}: got {len(payload)} bytes that end too early")


# ROS 1 serialises a message as its fields one after another, without gaps. So an XActionGoal is a
# header and a goal id, followed by the bytes of the XGoal, and the front can be written and read
# without message objects. Every goal and status passes through these functions. For speed, they
# repeat a line rather than call each other.


def pack_goal(
    sent_ns: int,
    goal_id: str,
    goal_stamp_ns: int,
    goal: bytes,
    server: str = "",
    *,
    cancel_if_lost: bool = False,
) -> bytes:
    """Write an XActionGoal: header, goal id, goal.

    Args:
        sent_ns: When it is sent [ns since the epoch].
        goal_id: Its id.
        goal_stamp_ns: Its stamp [ns since the epoch].
        goal: The bytes of the XGoal.
        server: The receiver's token.
        cancel_if_lost: The server is to cancel it when its client dies.
    """
    frame, raw = server.encode(*TEXT_CODEC), goal_id.encode(*TEXT_CODEC)
    header = _HEADER.pack(int(cancel_if_lost), sent_ns // _NS, sent_ns % _NS, len(frame))
    front = _ID.pack(goal_stamp_ns // _NS, goal_stamp_ns % _NS, len(raw))
    return b"".join((header, frame, front, raw, goal))


def unpack_goal(payload: bytes) -> tuple[str, int, bytes]:
    """Read an XActionGoal: its goal id, its stamp [ns], the bytes of the XGoal.

    Raises:
        ValueError: the bytes end too early.
    """
    try:
        at = 16 + int(_U32.unpack_from(payload, 12)[0])  # behind the header and its frame_id
        secs, nsecs, length = _ID.unpack_from(payload, at)
    except _CUT_SHORT as error:
        raise _too_short("XActionGoal", payload) from error
    at, end = at + 12, at + 12 + length
    if end > len(payload):
        raise _too_short("XActionGoal", payload)
    return payload[at:end].decode(*TEXT_CODEC), secs * _NS + nsecs, payload[end:]


def unpack_age(payload: bytes, stamp_ns: int) -> float:
    """Return how long after its stamp this copy of an XActionGoal was sent [s].

    0 without a stamp in the goal id or in the header, and if the header's is the earlier one.
    """
    sent_ns = int.from_bytes(payload[4:8], "little") * _NS + int.from_bytes(payload[8:12], "little")
    return max(0.0, (sent_ns - stamp_ns) / _NS) if stamp_ns else 0.0


def unpack_cancel_if_lost(payload: bytes, own_key: str) -> bool:
    """Read from an XActionGoal whether the server is to cancel it when its client dies.

    Only with the server's own token, `own_key`, as `frame_id`: programs for ROS 1 count their
    messages in `seq`, and some fill in a frame such as "map".

    Raises:
        ValueError: the bytes end too early.
    """
    return payload[:4] == _SEQ_CANCEL_IF_LOST and unpack_frame(payload) == own_key


def pack_goal_id(goal_id: str, stamp_ns: int) -> bytes:
    """Write an actionlib_msgs/GoalID."""
    raw = goal_id.encode(*TEXT_CODEC)
    return _ID.pack(stamp_ns // _NS, stamp_ns % _NS, len(raw)) + raw


def unpack_goal_id(payload: bytes) -> tuple[str, int]:
    """Read an actionlib_msgs/GoalID: the id, its stamp [ns].

    Raises:
        ValueError: the bytes end too early.
    """
    try:
        secs, nsecs, length = _ID.unpack_from(payload, 0)
    except _CUT_SHORT as error:
        raise _too_short("GoalID", payload) from error
    if len(payload) < 12 + length:
        raise _too_short("GoalID", payload)
    return payload[12 : 12 + length].decode(*TEXT_CODEC), secs * _NS + nsecs


def pack_status(entry: StatusEntry) -> bytes:
    """Write an actionlib_msgs/GoalStatus."""
    goal_id, stamp_ns, status, text = entry
    raw_id, raw = goal_id.encode(*TEXT_CODEC), text.encode(*TEXT_CODEC)
    front = _ID.pack(stamp_ns // _NS, stamp_ns % _NS, len(raw_id))
    return b"".join((front, raw_id, _TAIL.pack(status, len(raw)), raw))


def unpack_status(payload: bytes) -> StatusEntry:
    """Read an actionlib_msgs/GoalStatus.

    Raises:
        ValueError: the bytes end too early.
    """
    try:
        return _read_status(payload, 0)[0]
    except _CUT_SHORT as error:
        raise _too_short("GoalStatus", payload) from error


def pack_report(sent_ns: int, entry: StatusEntry, body: bytes) -> bytes:
    """Write an XActionResult or XActionFeedback: header, status, result or feedback."""
    goal_id, stamp_ns, status, text = entry
    raw_id, raw = goal_id.encode(*TEXT_CODEC), text.encode(*TEXT_CODEC)
    sent, stamp = divmod(sent_ns, _NS), divmod(stamp_ns, _NS)
    front = _FRONT.pack(0, *sent, 0, *stamp, len(raw_id))
    return b"".join((front, raw_id, _TAIL.pack(status, len(raw)), raw, body))


def unpack_report(payload: bytes) -> tuple[StatusEntry, int]:
    """Read the front of an XActionResult or XActionFeedback: status, position of the rest.

    Raises:
        ValueError: the bytes end too early.
    """
    try:
        return _read_status(payload, 16 + int(_U32.unpack_from(payload, 12)[0]))
    except _CUT_SHORT as error:
        raise _too_short("XActionResult or XActionFeedback", payload) from error


def pack_statuses(sent_ns: int, entries: Iterable[StatusEntry], frame: str = "") -> bytes:
    """Write an actionlib_msgs/GoalStatusArray; `frame`: the token in a farewell or its answer."""
    raw, parts = frame.encode(*TEXT_CODEC), list(map(pack_status, entries))
    header = _HEADER.pack(0, sent_ns // _NS, sent_ns % _NS, len(raw))
    return b"".join((header, raw, _U32.pack(len(parts)), *parts))


def unpack_statuses(payload: bytes) -> list[StatusEntry]:
    """Read an actionlib_msgs/GoalStatusArray.

    Raises:
        ValueError: the bytes end too early.
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
    """Read the frame_id of the header at the beginning of a message.

    Raises:
        ValueError: the bytes end too early.
    """
    length = int.from_bytes(payload[12:16], "little")
    if len(payload) < 16 + length:
        raise _too_short("Header", payload)
    return payload[16 : 16 + length].decode(*TEXT_CODEC)


def _read_status(payload: bytes, at: int) -> tuple[StatusEntry, int]:
    """Read a GoalStatus that begins at `at`; return it and the position of the rest."""
    secs, nsecs, length = _ID.unpack_from(payload, at)
    at, end = at + 12, at + 12 + length
    status, length = _TAIL.unpack_from(payload, end)  # fails if the bytes end within the id
    goal_id = payload[at:end].decode(*TEXT_CODEC)
    at, end = end + 5, end + 5 + length
    if end > len(payload):
        raise IndexError(end)
    text = payload[at:end].decode(*TEXT_CODEC)
    return StatusEntry(goal_id, secs * _NS + nsecs, status, text), end


# -- the two ends ------------------------------------------------------------------------------


class _Publishers(dict[tuple[str, Any, Quality], "PublisherPort"]):
    """The publishers of one port by key, message class and quality, made on first use.

    Args:
        transport: The network session.
        stopped: Text of the error once they are closed.
    """

    def __init__(self, transport: Transport, stopped: str) -> None:
        super().__init__()
        self._transport = transport
        self._stopped = stopped
        # Reentrant: a signal handler that sends may interrupt this thread while it holds the lock.
        self._lock = threading.RLock()
        self._closed = False

    def __missing__(self, which: tuple[str, Any, Quality]) -> PublisherPort:
        key, message_class, quality = which
        with self._lock:
            if self._closed:
                raise TransportError(self._stopped)
            publisher = self.get(which)  # another thread may have made it in the meantime
            if publisher is None:
                encoding = encoding_of(message_class)
                publisher = self[which] = self._transport.publisher(key, encoding, quality)
        return publisher

    def take_all(self) -> list[PublisherPort]:
        """Remove and return all publishers, to be closed; no new ones can be made."""
        with self._lock:
            self._closed = True
            publishers = list(self.values())
            self.clear()
        return publishers


class ActionClientPort:
    """A client's port on our own wire; see `ports.make_client_port`."""

    def __init__(
        self,
        node: Node,
        name: str,
        types: ActionTypes,
        spawn: Callable[[Callable[[], object], str], object],
    ) -> None:
        self._node = node
        self._transport = node.transport
        self._clock = node.clock
        self._name = name
        self._types = types
        self._keys = action_keys(name)
        self._declared: list[Closable] = []
        self._readable = Readable(log)
        action = types.action
        self.endpoint = node.endpoint(Kind.ACTION_CLIENT, name, action._type, action._md5sum)
        self._encodings = encoding_of(GoalStatusArray), encoding_of(types.action_result)
        self._goal_encoding = encoding_of(types.action_goal)
        stopped = f"action '{name}': the client is stopped."
        self._publishers = _Publishers(node.transport, stopped)
        self._goals = self._publishers[self._keys.goal, types.action_goal, GOAL]
        self.is_heard = self._goals.matching
        self.pack_goal = codecs_of(types.goal)[0]
        self.read_feedback = codecs_of(types.feedback)[1]
        self.read_result = codecs_of(types.result)[1]
        self._feedback: Bursts[Sample] = Bursts(node.clock, spawn, self._on_feedback)
        self.take_feedback = self._feedback.take
        self._session = node.transport.session_id
        self._in_process: dict[str, in_process.ServerInProcess] = {}  # by token
        self._direct: frozenset[str] = frozenset()  # their sessions
        self._closed = False

    def open(self, listener: ClientListener) -> None:
        self._listener = listener
        transport, keys = self._transport, self._keys
        # Token after subscriptions: a server that sees it may send at once. Servers are watched
        # last, since goals are sent to those that are found.
        self._declared = [
            transport.subscribe(keys.status, self._on_status, history=False),
            transport.subscribe(keys.feedback, self._on_feedback_sample, history=False),
            transport.subscribe(keys.result, self.take_result, history=False),
            transport.declare_alive(token_key(self.endpoint)),
            transport.watch_alive(token_pattern(Kind.ACTION_SERVER, self._name), self._on_presence),
        ]

    def close(self) -> None:
        declared = [*self._publishers.take_all(), *self._declared]
        self._declared = []
        for entry in reversed(declared):
            entry.close()
        self._closed = True
        for server in list(self._in_process.values()):
            server.leave(self)

    @property
    def lost_link(self) -> str:
        return self._transport.lost_link

    @property
    def link_delay(self) -> float:
        return self._transport.link_delay

    def explain_absence(self) -> str:
        return explain_absence(self._node, self._name, Kind.ACTION_SERVER)

    def send_goal(
        self,
        goal_id: str,
        stamp_ns: int,
        body: bytes,
        server: Endpoint | None,
        *,
        age: float = 0.0,
        wait: bool = True,
        cancel_if_lost: bool = False,
    ) -> None:
        """Send an XActionGoal with the receiver's token as its frame_id."""
        token = token_key(server) if server is not None else ""
        goals = (
            self._goals
            if wait
            else self._publishers[self._keys.goal, self._types.action_goal, AGAIN]
        )
        sent_ns = stamp_ns + int(age * _NS)
        message = pack_goal(sent_ns, goal_id, stamp_ns, body, token, cancel_if_lost=cancel_if_lost)
        goals.put(message)  # first, as it fails when the session is closed: nobody would follow it
        if wait and token in self._in_process and (near := in_process.servers.get(token)):
            near.take_goal(Sample(self._keys.goal, message, self._goal_encoding, self._session))

    def send_cancel(self, goal_id: str, stamp_ns: int, *, wait: bool = True) -> None:
        cancels = self._publishers[self._keys.cancel, GoalID, GOAL if wait else AGAIN]
        cancels.put(pack_goal_id(goal_id, stamp_ns))

    def acknowledge(self, goal_ids: list[str], *, farewell: bool = False) -> None:
        """Acknowledge results and, with our token as frame_id, a farewell.

        Never blocks: a lost acknowledgement is repeated with the result or farewell.
        """
        entries = [StatusEntry(goal_id, 0, 0, "") for goal_id in goal_ids]
        frame = token_key(self.endpoint) if farewell else ""
        acks = self._publishers[self._keys.ack, GoalStatusArray, ACK]
        acks.put(pack_statuses(self._clock.time_ns(), entries, frame))

    def ask(self, goal_id: str, on_done: Callable[[], None]) -> None:
        self._transport.query(
            self._keys.result,
            pack_goal_id(goal_id, 0),
            encoding=encoding_of(GoalID),
            timeout=ASK_TIMEOUT_S,
            on_reply=self._on_reply,
            on_done=on_done,
        )

    # -- messages ------------------------------------------------------------------------------

    def _on_feedback_sample(self, sample: Sample) -> None:
        if sample.source not in self._direct:
            self._feedback.take(sample)

    # Feedback may wait in `_feedback` for the rest of a burst. To keep the order of messages, it is
    # handed on before any status, result or end of a server.

    def _on_status(self, sample: Sample) -> None:
        if self._feedback.waiting or self._feedback.lock.locked():
            self._feedback.flush()
        # Comparing the strings here spares a call of `check` for nearly every status.
        if sample.encoding != self._encodings[0] and not self._readable.check(
            sample, GoalStatusArray
        ):
            return
        try:
            entries, frame = unpack_statuses(sample.payload), unpack_frame(sample.payload)
        except ValueError as error:
            self._report("a status", error)
            return
        # A token as frame_id makes the list a farewell; only that server itself may send it.
        server = parse_token(frame) if frame else None
        if server is None:
            self._listener.on_statuses(entries, sample.source)
        elif server.session == sample.source:
            self._listener.on_farewell(entries, server)
        else:
            self._listener.on_stranger(sample.source)

    def _on_feedback(self, sample: Sample) -> None:
        if self._readable.check(sample, self._types.action_feedback):
            try:
                entry, start = unpack_report(sample.payload)
            except ValueError as error:
                self._report("feedback", error)
            else:
                self._listener.on_feedback(entry, sample.payload[start:], sample.source)

    def take_result(self, sample: Sample, *, direct: bool = False) -> None:
        if not direct and sample.source in self._direct:
            return  # the copy of a message that came directly
        if self._feedback.waiting or self._feedback.lock.locked():
            self._feedback.flush()
        if sample.encoding != self._encodings[1] and not self._readable.check(
            sample, self._types.action_result
        ):
            return
        try:
            entry, start = unpack_report(sample.payload)
        except ValueError as error:
            self._report("a result", error)
        else:
            self._listener.on_result(entry, sample.payload[start:], sample.source)

    def _on_reply(self, reply: Reply) -> None:
        self._feedback.flush()
        payload, listener = reply.payload, self._listener
        try:
            if reply.error:
                self._report("an answer", payload.decode(errors="replace"))
            elif reply.encoding == encoding_of(GoalStatus):
                listener.on_answer(unpack_status(payload))
            elif reply.encoding == self._encodings[1]:
                entry, start = unpack_report(payload)
                listener.on_result(entry, payload[start:], "", answered=True)
            else:
                self._report("an answer", f"unknown encoding {reply.encoding!r}")
        except ValueError as error:
            self._report("an answer", error)

    def _report(self, what: str, error: object) -> None:
        """Report a dropped message, once per kind, as a server may keep sending them."""
        text = f"action '{self._name}': {what} cannot be read: {error}"
        self._readable.report(what, ActionlibError(text))

    def _on_presence(self, presence: Presence) -> None:
        server = parse_token(presence.key)
        if server is None:
            return
        if not presence.alive:
            self._note_in_process(presence.key, None)
            self._feedback.flush()
            self._listener.on_server_gone(server)
            return
        error = find_mismatch([server], self.endpoint)
        if error is not None:
            self._readable.report(f"{server.session} {server.type} {server.md5}", error)
        else:
            self._note_in_process(presence.key, in_process.servers.get(presence.key))
        self._listener.on_server(server, error)

    def _note_in_process(self, token: str, server: in_process.ServerInProcess | None) -> None:
        """Speak with the server of a token directly from now on; None: not any more."""
        if server is not None:
            self._in_process[token] = server
        elif self._in_process.pop(token, None) is None:
            return
        self._direct = frozenset(each.session for each in self._in_process.values())
        if server is not None:
            server.join(self)
            if self._closed:  # meanwhile
                server.leave(self)


class ActionServerPort:
    """A server's port on our own wire; see `ports.make_server_port`.

    Args:
        node: The server's node.
        name: The action's full name.
        types: Its message classes.

    Threads: any. The listener is called on the network's threads.
    """

    send_accepted = None

    def __init__(self, node: Node, name: str, types: ActionTypes) -> None:
        self._node = node
        self._clock = node.clock
        self._types = types
        self._name = name
        self._keys = action_keys(name)
        self._lock = threading.Lock()  # two threads may call `close` at once
        self._declared: list[Closable] = []
        stopped = f"action {name!r}: the server is stopped. Try ending goals before."
        self._publishers = _Publishers(node.transport, stopped)
        self._token: Closable | None = None
        self._clients: dict[str, Endpoint] = {}  # by token
        self._unaware: set[str] = set()  # tokens of clients that have not answered the farewell
        self._readable = Readable(log)
        self._goal_encoding = encoding_of(types.action_goal)
        self._read_goal = codecs_of(types.goal)[1]
        self.pack_result = codecs_of(types.result)[0]
        self.pack_feedback = codecs_of(types.feedback)[0]
        action = types.action
        endpoint = node.endpoint(Kind.ACTION_SERVER, name, action._type, action._md5sum)
        self.endpoint = with_age(endpoint, node)
        self._own_key = token_key(self.endpoint)

    def open(self, listener: ServerListener) -> None:
        self._listener = listener
        transport, keys = self._node.transport, self._keys
        # The usual conflict is found here, before this server has sent or taken anything.
        there = list_endpoints(transport, kind=Kind.ACTION_SERVER, name=self._name)
        if there:
            raise self._conflict(there[0])
        try:
            # Token after subscriptions: a client that sees it sends its goals at once.
            self._declared = [
                transport.subscribe(keys.goal, self._on_goal, history=False),
                transport.subscribe(keys.cancel, self._on_cancel, history=False),
                transport.subscribe(keys.ack, self._on_ack, history=False),
                transport.queryable(keys.result, self._on_query),
                transport.queryable(keys.goal, self._on_goal_query),
            ]
            self._token = transport.declare_alive(self._own_key)
            # The watch last: it reports a server that has started at the same time as this one, and
            # then the younger one of the two stops.
            self._declared += [
                self._token,
                transport.watch_alive(token_pattern(None, self._name), self._on_presence),
            ]
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        with self._lock:
            declared, self._declared = self._declared, []
            declared.extend(self._publishers.take_all())
            token, self._token = self._token, None
        # The token last: as long as it is there, clients check for a subscription before they send.
        declared.sort(key=lambda entry: entry is token)
        for entry in declared:
            entry.close()

    def clients(self) -> set[str]:
        # Copies, as other threads change them.
        return {client.session for client in list(self._clients.values())}

    def begin_farewell(self) -> bool:
        if not self._publishers[self._keys.status, GoalStatusArray, RESULT].matching():
            return False
        unaware = set(self._clients)
        if not unaware:  # a server that has just started may not have found them yet
            pattern = token_pattern(Kind.ACTION_CLIENT, self._name)
            unaware = set(self._node.transport.list_alive(pattern, FAREWELL_LIST_S))
        self._unaware = unaware
        return True

    def is_farewell_heard(self) -> bool:
        return not self._unaware

    def send_farewell(self, taken: Iterable[StatusEntry]) -> None:
        """Send a GoalStatusArray with our token as its frame_id."""
        payload = pack_statuses(self._clock.time_ns(), taken, self._own_key)
        self._publishers[self._keys.status, GoalStatusArray, RESULT].put(payload)

    def send_status(self, entries: Iterable[StatusEntry]) -> None:
        statuses = self._publishers[self._keys.status, GoalStatusArray, STATUS]
        statuses.put(pack_statuses(self._clock.time_ns(), entries))

    def send_result(self, entry: StatusEntry, body: bytes, *, wait: bool = True) -> None:
        quality = RESULT if wait else RESULT_OR_NOT
        results = self._publishers[self._keys.result, self._types.action_result, quality]
        results.put(pack_report(self._clock.time_ns(), entry, body))

    def send_feedback(self, entry: StatusEntry, body: bytes) -> None:
        feedback = self._publishers[self._keys.feedback, self._types.action_feedback, FEEDBACK]
        feedback.put(pack_report(self._clock.time_ns(), entry, body))

    # -- messages ------------------------------------------------------------------------------

    def _on_goal(self, sample: Sample) -> None:
        if sample.encoding != self._goal_encoding and not self._readable.check(
            sample, self._types.action_goal
        ):
            return
        try:
            receiver = unpack_frame(sample.payload)
            goal_id, stamp_ns, body = unpack_goal(sample.payload)
            if receiver not in {"", self._own_key} and self._is_of_another(receiver):
                return
            content = self._read_goal(body)
        except (ValueError, ActionlibError) as error:
            self._report_unreadable("a goal", sample, error)
            return
        age = unpack_age(sample.payload, stamp_ns)
        lost = unpack_cancel_if_lost(sample.payload, self._own_key)
        self._listener.on_goal(goal_id, stamp_ns, content, sample.source, age, cancel_if_lost=lost)

    def _is_of_another(self, frame: str) -> bool:
        """Return whether a goal was sent to another server of this action."""
        server = parse_token(frame)
        return (
            server is not None and server.kind is Kind.ACTION_SERVER and server.name == self._name
        )

    def _on_cancel(self, sample: Sample) -> None:
        if not self._readable.check(sample, GoalID):
            return
        try:
            goal_id, stamp_ns = unpack_goal_id(sample.payload)
        except ValueError as error:
            self._report_unreadable("a cancel", sample, error)
            return
        self._listener.on_cancel(goal_id, stamp_ns)

    def _on_ack(self, sample: Sample) -> None:
        try:
            entries = unpack_statuses(sample.payload)
            self._unaware.discard(unpack_frame(sample.payload))
        except ValueError as error:
            self._report_unreadable("an acknowledgement", sample, error)
            return
        self._listener.on_acknowledged([entry.id for entry in entries])

    def _on_query(self, query: Query) -> None:
        """Reply with a goal's result or status; without an id, with the status list."""
        goal_id = self._read_question(query)
        if goal_id:
            entry, body = self._listener.find_end(goal_id)
            if body is None:
                query.reply(pack_status(entry), encoding_of(GoalStatus))
            else:
                report = pack_report(self._clock.time_ns(), entry, body)
                query.reply(report, encoding_of(self._types.action_result))
        elif goal_id is not None:
            statuses = pack_statuses(self._clock.time_ns(), self._listener.list_goals())
            query.reply(statuses, encoding_of(GoalStatusArray))
        query.finish()

    def _on_goal_query(self, query: Query) -> None:
        """Reply with the goal message of a goal id."""
        goal_id = self._read_question(query)
        if goal_id is not None:
            found = self._listener.find_goal(goal_id)
            if found is None:
                query.reply_error(
                    f"action '{self._name}': goal {goal_id!r} is unknown or was forgotten"
                )
            else:
                stamp_ns, content = found
                goal = pack_goal(self._clock.time_ns(), goal_id, stamp_ns, content.to_bytes())
                query.reply(goal, encoding_of(self._types.action_goal))
        query.finish()

    def _read_question(self, query: Query) -> str | None:
        """Return the goal id that a query is about; None when it was refused."""
        try:
            return unpack_goal_id(query.payload)[0]
        except ValueError as error:
            query.reply_error(f"action '{self._name}': {error}; expected an actionlib_msgs/GoalID")
            return None

    def _report_unreadable(self, what: str, sample: Sample, error: Exception) -> None:
        """Report a dropped message, once per sender and kind."""
        text = f"action '{self._name}': {what} of session {sample.source} cannot be read: {error}"
        self._readable.report(f"{sample.source} {what}", ActionlibError(text))

    # -- other clients and servers -------------------------------------------------------------

    def _on_presence(self, presence: Presence) -> None:
        other = parse_token(presence.key)
        if other is None or other == self.endpoint:
            return
        if other.kind is Kind.ACTION_SERVER and presence.alive:
            self._meet_server(other)
        elif other.kind is Kind.ACTION_CLIENT:
            self._meet_client(presence, other)

    def _meet_server(self, other: Endpoint) -> None:
        if is_younger(self.endpoint, other):
            self._listener.on_conflict(self._conflict(other))
        else:
            log.error("%s", self._conflict(other, stays=True))

    def _conflict(self, other: Endpoint, *, stays: bool = False) -> ServerConflictError:
        return ServerConflictError(self._name, *in_conflict(self.endpoint, other, stays=stays))

    def _meet_client(self, presence: Presence, client: Endpoint) -> None:
        if presence.alive:
            self._clients[presence.key] = client
            error = find_mismatch([client], self.endpoint)
            if error is not None:
                self._readable.report(f"{client.session} {client.type} {client.md5}", error)
            self._listener.on_client()
        elif self._clients.pop(presence.key, None) is not None:
            if presence.key in self._unaware:  # it is gone and will not answer the farewell
                self._unaware.discard(presence.key)
                self._listener.on_acknowledged([])
            # A goal knows its client's session only, which may have several clients of the action.
            clients = list(self._clients.values())  # a copy, as other threads change it
            if not any(end.session == client.session for end in clients):
                self._listener.on_client_lost(client.session)
