"""A client of ROS 2 actions that only knows the wire: what tests of our servers ask them with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.interfaces import ros2_action
from actionlib_core.wire.ros2.action_messages import (
    CancelRequest,
    CancelResponse,
    GoalState,
    pack_cancel,
    pack_id,
    pack_with_id,
    unpack_accepted,
    unpack_cancel_response,
    unpack_statuses,
    unpack_with_id,
)
from actionlib_core.wire.ros2.attachment import unpack_attachment
from actionlib_core.wire.ros2.graph import ActionServers, RosEnd, RosNode, RosType
from actionlib_core.wire.ros2.names import LATCHED, Kind, action_names

if TYPE_CHECKING:
    from actionlib_core.clock import Clock, Event
    from actionlib_core.transport import Reply, Sample, Transport
    from actionlib_core.wire.ros2.names import Token

LONG_S = 600.0


class Answer(NamedTuple):
    """How a query ended: its reply, or None without one; `error` is the text of an error."""

    payload: bytes | None
    error: str = ""


class Pending:
    """A request on its way."""

    def __init__(self, clock: Clock) -> None:
        self.replies: list[Reply] = []
        self.done: Event = clock.event()

    def answer(self, timeout: float = 60.0) -> Answer:
        assert self.done.wait(timeout), "the query has not ended"
        if not self.replies:
            return Answer(None)
        (reply,) = self.replies
        return Answer(None, reply.payload.decode()) if reply.error else Answer(reply.payload)


class Ros2Client:
    """Asks as rclpy does, and checks every attachment that comes back."""

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        name: str,
        action: Any,
        *,
        domain: int = 0,
        node: str = "asker",
    ) -> None:
        self.transport, self.clock = transport, clock
        self.parts = ros2_action(action)
        self.node = RosNode(transport, clock, domain=domain, full_name=node)
        self.names = action_names(name)
        services = (self.parts.send_goal, self.parts.cancel_goal, self.parts.get_result)
        topics = (self.parts.feedback, self.parts.status)
        types = [RosType(part.type, part.hash) for part in (*services, *topics)]
        kinds = (Kind.CLIENT,) * 3 + (Kind.SUBSCRIPTION,) * 2
        self.ends: dict[str, RosEnd] = {
            full: self.node.end(kind, full, ros_type)
            for full, kind, ros_type in zip(self.names, kinds, types, strict=True)
        }
        self.servers = ActionServers(name, types)
        self.ready: Event = clock.event()  # a server has appeared
        self.gone: Event = clock.event()  # a server has vanished
        self.feedback: list[tuple[bytes, Any]] = []
        self.statuses: list[list[GoalState]] = []
        self.problems: list[str] = []
        self.pending: list[Any] = []
        keys = {full: end.key for full, end in self.ends.items()}
        self.declared = [
            transport.subscribe(keys[self.names.feedback], self._on_feedback, history=False),
            transport.subscribe(keys[self.names.status], self._on_status, cached=LATCHED.depth),
            self.node.watch_action(name, self._on_token),
        ]
        for end in self.ends.values():
            end.show()

    def close(self) -> None:
        for declared in (*self.declared, *self.pending, *self.ends.values()):
            declared.close()

    def _on_token(self, token: Token, key: str, alive: bool) -> None:
        change = self.servers.on_token(token, alive=alive)
        if change is not None:
            (self.ready if change.alive else self.gone).set()

    def _on_feedback(self, sample: Sample) -> None:
        unpack_attachment(sample.attachment)
        uuid, body = unpack_with_id(sample.payload)
        self.feedback.append((uuid, self.parts.action.Feedback.from_cdr(body)))

    def _on_status(self, sample: Sample) -> None:
        unpack_attachment(sample.attachment)
        self.statuses.append(unpack_statuses(sample.payload))

    def ask(self, part: str, payload: bytes, attachment: bytes | None = b"ours") -> Pending:
        """Send a request; `attachment` stands for the right one unless it is given."""
        end, pending = self.ends[part], Pending(self.clock)
        sent = end.attachment() if attachment == b"ours" else attachment

        def on_reply(reply: Reply) -> None:
            if not reply.error and sent is not None:
                asked, back = unpack_attachment(sent), unpack_attachment(reply.attachment)
                if (asked.sequence, asked.gid) != (back.sequence, back.gid):
                    self.problems.append(f"{part}: asked {asked}, got {back}")
            pending.replies.append(reply)

        self.pending.append(
            self.transport.query(
                end.key,
                payload,
                attachment=sent,
                best=True,
                timeout=LONG_S,
                on_reply=on_reply,
                on_done=pending.done.set,
            )
        )
        return pending

    def send(self, uuid: bytes, goal: Any) -> Pending:
        return self.ask(self.names.send_goal, pack_with_id(uuid, goal.to_cdr()))

    def accepted(self, uuid: bytes, goal: Any) -> int | None:
        """Send a goal; return the stamp of its acceptance [ns], None when it is refused."""
        payload = self.send(uuid, goal).answer().payload
        assert payload is not None
        return unpack_accepted(payload)

    def result(self, uuid: bytes) -> Pending:
        return self.ask(self.names.get_result, pack_id(uuid))

    def cancel(self, uuid: bytes, stamp_ns: int = 0) -> CancelResponse:
        payload = (
            self.ask(self.names.cancel_goal, pack_cancel(CancelRequest(uuid, stamp_ns)))
            .answer()
            .payload
        )
        assert payload is not None
        return unpack_cancel_response(payload)

    def end_of(self, pending: Pending) -> tuple[int, Any]:
        """Return status and result of an answer to `result`."""
        payload = pending.answer().payload
        assert payload is not None
        response = self.parts.get_result.response.from_cdr(payload)
        return response.status, response.result
