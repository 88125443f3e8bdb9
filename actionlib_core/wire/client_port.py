"""An action client's end of the wire: keys and ROS 1's messages."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError, TransportError
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.transport import Quality
from actionlib_core.wire.action_messages import (
    action_keys,
    pack_goal,
    pack_goal_id,
    pack_statuses,
    unpack_frame,
    unpack_report,
    unpack_status,
    unpack_statuses,
)
from actionlib_core.wire.arrivals import Bursts, Readable
from actionlib_core.wire.encoding import encoding_of
from actionlib_core.wire.presence import Kind, find_mismatch, parse_token, token_key, token_pattern

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.goal.ports import ClientListener
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence, PublisherPort, Reply, Sample
    from actionlib_core.wire.action_messages import ActionTypes
    from actionlib_core.wire.presence import Endpoint

log = logging.getLogger(__name__)

ASK_TIMEOUT_S = 2.0
GOAL = Quality(express=True, block=True)
AGAIN = Quality(express=True, block=False)  # what is repeated anyway need not wait for a full link
ACK = Quality(express=False, block=False)


class ActionClientPort:
    """Declares the keys of an action client and speaks on them.

    Args:
        node: On whose network.
        name: The action's full name.
        types: Its message classes.
        spawn: Starts a named thread for a burst of feedback.

    Threads: any. The listener is called on the network's threads; feedback that comes in a burst is
        handed on in a thread of its own.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        types: ActionTypes,
        spawn: Callable[[Callable[[], object], str], object],
    ) -> None:
        self._transport = node.transport
        self._clock = node.clock
        self._name = name
        self._types = types
        self._keys = action_keys(name)
        self._lock = threading.Lock()
        self._closed = False
        self._declared: list[Closable] = []
        self._readable = Readable(log)
        action = types.action
        self.endpoint = node.endpoint(Kind.ACTION_CLIENT, name, action._type, action._md5sum)
        self._publishers: dict[tuple[str, Quality], PublisherPort] = {}
        self._goals = self._publisher(self._keys.goal, types.action_goal, GOAL)
        self._feedback: Bursts[Sample] = Bursts(node.clock, spawn, self._on_feedback)

    def open(self, listener: ClientListener) -> None:
        self._listener = listener
        transport, keys = self._transport, self._keys
        self._declared = [
            transport.subscribe(keys.status, self._on_status, history=False),
            transport.subscribe(keys.feedback, self._feedback.take, history=False),
            transport.subscribe(keys.result, self._on_result, history=False),
            transport.declare_alive(token_key(self.endpoint)),
            transport.watch_alive(token_pattern(Kind.ACTION_SERVER, self._name), self._on_presence),
        ]

    def close(self) -> None:
        with self._lock:
            declared = [*self._publishers.values(), *self._declared]
            self._publishers, self._declared = {}, []
            self._closed = True
        for entry in reversed(declared):
            entry.close()

    def _publisher(self, key: str, message_class: Any, quality: Quality) -> PublisherPort:
        publisher = self._publishers.get((key, quality))
        if publisher is None:
            with self._lock:
                if self._closed:
                    raise TransportError(f"action '{self._name}': the client is stopped.")
                publisher = self._publishers.get((key, quality))
                if publisher is None:
                    encoding = encoding_of(message_class)
                    publisher = self._transport.publisher(key, encoding, quality)
                    self._publishers[key, quality] = publisher
        return publisher

    def is_heard(self) -> bool:
        return self._goals.matching()

    def explain_absence(self) -> str:
        return ""

    def pack_goal(self, goal: Any) -> bytes:
        body: bytes = goal.to_bytes()
        return body

    def read_feedback(self, body: bytes) -> Any:
        return self._types.feedback.from_bytes(body)

    def read_result(self, body: bytes) -> Any:
        return self._types.result.from_bytes(body)

    def send_goal(
        self,
        goal_id: str,
        stamp_ns: int,
        body: bytes,
        server: Endpoint | None,
        *,
        wait: bool = True,
    ) -> None:
        """Send an XActionGoal; its frame id is the token of the server that it is for."""
        token = token_key(server) if server is not None else ""
        goals = (
            self._goals
            if wait
            else self._publisher(self._keys.goal, self._types.action_goal, AGAIN)
        )
        goals.put(pack_goal(stamp_ns, goal_id, stamp_ns, body, token))

    def send_cancel(self, goal_id: str, stamp_ns: int, *, wait: bool = True) -> None:
        cancels = self._publisher(self._keys.cancel, GoalID, GOAL if wait else AGAIN)
        cancels.put(pack_goal_id(goal_id, stamp_ns))

    def acknowledge(self, goal_ids: list[str], *, farewell: bool = False) -> None:
        """Acknowledge results, and maybe a farewell: the frame id is our token then.

        Never waits: what is lost is sent again when the result, or the farewell, is repeated.
        """
        entries = [StatusEntry(goal_id, 0, 0, "") for goal_id in goal_ids]
        frame = token_key(self.endpoint) if farewell else ""
        acks = self._publisher(self._keys.ack, GoalStatusArray, ACK)
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

    # -- what arrives --------------------------------------------------------------------------

    def _on_status(self, sample: Sample) -> None:
        self._feedback.flush()
        if not self._readable.check(sample, GoalStatusArray):
            return
        try:
            entries, frame = unpack_statuses(sample.payload), unpack_frame(sample.payload)
        except ValueError as error:
            self._report("a status", error)
            return
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

    def _on_result(self, sample: Sample) -> None:
        self._feedback.flush()
        if self._readable.check(sample, self._types.action_result):
            self._read_result(sample.payload, sample.source)

    def _read_result(self, payload: bytes, session: str, *, answered: bool = False) -> None:
        try:
            entry, start = unpack_report(payload)
        except ValueError as error:
            self._report("a result", error)
        else:
            self._listener.on_result(entry, payload[start:], session, answered=answered)

    def _on_reply(self, reply: Reply) -> None:
        self._feedback.flush()
        if reply.error:
            self._report("an answer", reply.payload.decode(errors="replace"))
        elif reply.encoding == encoding_of(GoalStatus):
            try:
                self._listener.on_answer(unpack_status(reply.payload))
            except ValueError as error:
                self._report("an answer", error)
        elif reply.encoding == encoding_of(self._types.action_result):
            self._read_result(reply.payload, "", answered=True)
        else:
            self._report("an answer", f"unknown encoding {reply.encoding!r}")

    def _report(self, what: str, error: object) -> None:
        """Report a message that is dropped; once of a kind, a server may go on like this."""
        text = f"action '{self._name}': {what} cannot be read: {error}"
        self._readable.report(what, ActionlibError(text))

    def _on_presence(self, presence: Presence) -> None:
        server = parse_token(presence.key)
        if server is None:
            return
        if not presence.alive:
            self._feedback.flush()
            self._listener.on_server_gone(server)
            return
        error = find_mismatch([server], self.endpoint)
        if error is not None:
            self._readable.report(f"{server.session} {server.type} {server.md5}", error)
        self._listener.on_server(server, error)
