"""A client's end of the wire: bytes and keys on one side, goals and news on the other."""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Protocol

from actionlib_core._action_wire import (
    ActionKeys,
    StatusEntry,
    action_keys,
    pack_goal_id,
    pack_statuses,
    unpack_frame,
    unpack_report,
    unpack_status,
    unpack_statuses,
)
from actionlib_core._bursts import Bursts
from actionlib_core._readable import Readable
from actionlib_core.exceptions import ActionlibError, TypeMismatchError
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from actionlib_core.presence import Kind, find_mismatch, parse_token, token_key, token_pattern
from actionlib_core.transport import Quality
from actionlib_core.wire import encoding_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core._action_wire import ActionTypes
    from actionlib_core.node import Node
    from actionlib_core.presence import Endpoint
    from actionlib_core.transport import Closable, Presence, PublisherPort, Reply, Sample

log = logging.getLogger(__name__)

ASK_TIMEOUT_S = 2.0
GOAL = Quality(express=True, block=True)
ACK = Quality(express=False, block=True)


class ClientListener(Protocol):
    """Who decides about what arrives. Called on the network's thread."""

    def on_statuses(self, entries: list[StatusEntry], server: str) -> None:
        """Take a list of all goals."""

    def on_farewell(self, entries: list[StatusEntry], server: Endpoint) -> None:
        """Take the last list of a server that leaves: the goals it ever took; answer it."""

    def on_feedback(self, entry: StatusEntry, payload: bytes, start: int, server: str) -> None:
        """Take feedback; its bytes begin at `start`."""

    def on_result(self, entry: StatusEntry, body: bytes, server: str) -> None:
        """Take a result."""

    def on_answer(self, entry: StatusEntry) -> None:
        """Take the answer to `ask` when there is no result to send."""

    def on_server(self, server: Endpoint, error: TypeMismatchError | None) -> None:
        """Take the appearance of a server; `error` when it has another type."""

    def on_server_gone(self, server: Endpoint) -> None:
        """Take the disappearance of a server."""


class ClientPort:
    """Declares the keys of an action client and speaks on them.

    Args:
        node: On whose network.
        name: The action's full name.
        types: Its message classes.
        listener: Decides.
        spawn: Starts a named thread for a burst of feedback.

    Threads: the `send_` methods may be called from any thread; what arrives is handed to `listener`
        on the network's thread, feedback that comes in a burst on one started for it.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        types: ActionTypes,
        listener: ClientListener,
        spawn: Callable[[Callable[[], object], str], object],
    ) -> None:
        self._transport = node.transport
        self._types = types
        self._listener = listener
        self.name = name
        self.keys: ActionKeys = action_keys(name)
        self._lock = threading.Lock()
        self._declared: list[Closable] = []
        self._readable = Readable(log)
        self.endpoint = node.endpoint(
            Kind.ACTION_CLIENT,
            name,
            types.action._type,
            types.action._md5sum,
        )
        self._goals: PublisherPort = self._transport.publisher(
            self.keys.goal, encoding_of(types.action_goal), GOAL
        )
        self._cancels: PublisherPort = self._transport.publisher(
            self.keys.cancel, encoding_of(GoalID), GOAL
        )
        self._acks: PublisherPort | None = None
        self._feedback: Bursts[Sample] = Bursts(node.clock, spawn, self._read_feedback)

    def open(self) -> None:
        """Declare everything; listening comes before the token.

        Raises:
            TransportError: the session is closed.
        """
        transport = self._transport
        self._declared = [
            self._goals,
            self._cancels,
            transport.subscribe(self.keys.status, self._on_status, history=False),
            transport.subscribe(self.keys.feedback, self._feedback.take, history=False),
            transport.subscribe(self.keys.result, self._on_result, history=False),
            transport.declare_alive(token_key(self.endpoint)),
            transport.watch_alive(token_pattern(Kind.ACTION_SERVER, self.name), self._on_presence),
        ]

    def close(self) -> None:
        """Undeclare everything; a second call does nothing."""
        with self._lock:
            declared, self._declared = self._declared, []
            if self._acks is not None:
                declared.append(self._acks)
        for entry in reversed(declared):
            entry.close()

    def send_goal(self, payload: bytes) -> None:
        """Send an XActionGoal."""
        self._goals.put(payload)

    def is_heard(self) -> bool:
        """Tell whether anybody listens for goals."""
        return self._goals.matching()

    def send_cancel(self, goal_id: str, stamp_ns: int) -> None:
        """Send a GoalID as a cancel."""
        self._cancels.put(pack_goal_id(goal_id, stamp_ns))

    def send_acks(self, goal_ids: list[str], now_ns: int, *, farewell: bool = False) -> None:
        """Say that the results of these goals have arrived, and maybe a server's farewell."""
        with self._lock:
            if self._acks is None:
                self._acks = self._transport.publisher(
                    self.keys.ack, encoding_of(GoalStatusArray), ACK
                )
        entries = [StatusEntry(goal_id, 0, 0, "") for goal_id in goal_ids]
        frame = token_key(self.endpoint) if farewell else ""
        self._acks.put(pack_statuses(now_ns, entries, frame))

    def ask(self, goal_id: str, on_done: Callable[[], None]) -> None:
        """Ask the server what became of a goal; the answer goes to the listener."""
        self._transport.query(
            self.keys.result,
            pack_goal_id(goal_id, 0),
            encoding=encoding_of(GoalID),
            timeout=ASK_TIMEOUT_S,
            on_reply=self._on_reply,
            on_done=on_done,
        )

    # -- what arrives --------------------------------------------------------------------------

    def _on_status(self, sample: Sample) -> None:
        self._feedback.flush()
        if self._readable.check(sample, GoalStatusArray):
            try:
                entries = unpack_statuses(sample.payload)
                frame = unpack_frame(sample.payload)
            except ValueError as error:
                self._report("a status", error)
                return
            server = parse_token(frame) if frame else None
            if server is not None:
                self._listener.on_farewell(entries, server)
            else:
                self._listener.on_statuses(entries, sample.source)

    def _read_feedback(self, sample: Sample) -> None:
        if not self._readable.check(sample, self._types.action_feedback):
            return
        try:
            entry, start = unpack_report(sample.payload)
        except ValueError as error:
            self._report("feedback", error)
            return
        self._listener.on_feedback(entry, sample.payload, start, sample.source)

    def _on_result(self, sample: Sample) -> None:
        self._feedback.flush()
        if self._readable.check(sample, self._types.action_result):
            self._read_result(sample.payload, sample.source)

    def _read_result(self, payload: bytes, source: str) -> None:
        try:
            entry, start = unpack_report(payload)
        except ValueError as error:
            self._report("a result", error)
            return
        self._listener.on_result(entry, payload[start:], source)

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
            self._read_result(reply.payload, "")
        else:
            self._report("an answer", f"unknown encoding {reply.encoding!r}")

    def _report(self, what: str, error: object) -> None:
        """Report a message that is dropped; once of a kind, a server may go on like this."""
        text = f"action '{self.name}': {what} cannot be read: {error}"
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
