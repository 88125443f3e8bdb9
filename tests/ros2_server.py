"""A server of a ROS 2 action that does what a test says: what tests of our clients are told by.

It dies, that is it notes a problem, of every request that a real node dies of.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces import ros2_action
from actionlib_core.transport import Quality
from actionlib_core.wire.ros2.action_messages import (
    CancelResponse,
    GoalState,
    pack_accepted,
    pack_cancel_response,
    pack_statuses,
    pack_with_id,
    unpack_cancel,
    unpack_id,
)
from actionlib_core.wire.ros2.attachment import answer_to, unpack_attachment
from actionlib_core.wire.ros2.graph import RosEnd, RosNode, RosType
from actionlib_core.wire.ros2.names import LATCHED, Kind, action_names

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock
    from actionlib_core.transport import Query, Transport


class Ros2Server:
    """Five ends of an action; `on_goal`, `on_result` and `on_cancel` answer, or keep the query.

    Attributes:
        goals: Goal id -> the goal, of every goal that was sent.
        sent: How often each was sent.
        asked: Goal id -> the open questions for its result.
        states: Goal id -> state; `publish_states` shows them.
        problems: What a real node would have died of.
    """

    def __init__(
        self,
        transport: Transport,
        clock: Clock,
        name: str,
        action: Any,
        *,
        domain: int = 0,
        node: str = "robot",
        distro: str = "jazzy",
        show: bool = True,
    ) -> None:
        self.transport, self.clock = transport, clock
        self.parts = ros2_action(action, distro)
        self.node = RosNode(transport, clock, domain=domain, full_name=node)
        names = action_names(name)
        services = (self.parts.send_goal, self.parts.cancel_goal, self.parts.get_result)
        topics = (self.parts.feedback, self.parts.status)
        types = [RosType(part.type, part.hash) for part in (*services, *topics)]
        kinds = (Kind.SERVICE,) * 3 + (Kind.PUBLISHER,) * 2
        self.ends: list[RosEnd] = [
            self.node.end(kind, full, ros_type)
            for full, kind, ros_type in zip(names, kinds, types, strict=True)
        ]
        self.goals: dict[bytes, Any] = {}
        self.sent: list[bytes] = []
        self.asked: dict[bytes, list[Query]] = {}
        self.cancels: list[tuple[bytes, int]] = []
        self.states: dict[bytes, int] = {}
        self.problems: list[str] = []
        self.news = clock.event()
        self.on_goal: Callable[[Query, bytes], object] = self.accept
        self.on_result: Callable[[Query, bytes], object] = self.park
        self.on_cancel: Callable[[Query, bytes], object] = self.let_cancel
        self._seen: set[tuple[str, bytes, int]] = set()
        keys = [end.key for end in self.ends]
        handlers = (self._take_goal, self._take_cancel, self._take_result)
        self.declared = [
            transport.queryable(key, handler, complete=True)
            for key, handler in zip(keys[:3], handlers, strict=True)
        ]
        self.feedback = transport.publisher(keys[3])
        self.status = transport.publisher(keys[4], "", Quality(cache=LATCHED.depth))
        if show:
            self.show()

    def show(self) -> None:
        for end in self.ends:
            end.show()

    def close(self) -> None:
        for end in (*self.ends, *self.declared, self.feedback, self.status):
            end.close()

    def wait(self, condition: Callable[[], object], timeout: float = 60.0) -> None:
        deadline = self.clock.now() + timeout
        while not condition():
            self.news.clear()
            left = deadline - self.clock.now()
            assert left > 0, "it did not come"
            self.news.wait(left)

    def _check(self, what: str, query: Query) -> None:
        attachment = unpack_attachment(query.attachment)
        key = (what, attachment.gid, attachment.sequence)
        if key in self._seen:
            self.problems.append(f"{what}: a repetition of {attachment}")
        self._seen.add(key)
        self.news.set()

    def reply(self, query: Query, payload: bytes) -> None:
        asked = unpack_attachment(query.attachment)
        query.reply(payload, attachment=answer_to(asked, self.clock.time_ns()))
        query.finish()

    # -- goals ---------------------------------------------------------------------------------

    def _take_goal(self, query: Query) -> None:
        request = self.parts.send_goal.request.from_cdr(query.payload)
        uuid = bytes(request.goal_id.uuid)
        self.goals[uuid] = request.goal
        self.sent.append(uuid)
        self._check("goal", query)
        self.on_goal(query, uuid)

    def accept(self, query: Query, uuid: bytes) -> None:
        """Answer as a server that takes a new goal and refuses one that it knows."""
        known = uuid in self.states
        self.reply(query, pack_accepted(None if known else self.clock.time_ns()))
        if not known:
            self.set_state(uuid, 1)

    def refuse(self, query: Query, uuid: bytes) -> None:
        self.reply(query, pack_accepted(None))

    def set_state(self, uuid: bytes, code: int) -> None:
        self.states[uuid] = code
        self.publish_states()

    def publish_states(self) -> None:
        states = [GoalState(uuid, 1_000_000_000, code) for uuid, code in self.states.items()]
        self.status.put(pack_statuses(states), self.ends[4].attachment())

    def publish_feedback(self, uuid: bytes, feedback: Any) -> None:
        self.feedback.put(pack_with_id(uuid, feedback.to_cdr()), self.ends[3].attachment())

    # -- results -------------------------------------------------------------------------------

    def _take_result(self, query: Query) -> None:
        uuid = unpack_id(query.payload)
        self._check("result", query)
        self.on_result(query, uuid)

    def park(self, query: Query, uuid: bytes) -> None:
        """Keep the question of a goal that is known; say of another that it is not."""
        if uuid in self.states:
            self.asked.setdefault(uuid, []).append(query)
        else:
            self.answer_result(query, 0)

    def answer_result(self, query: Query, code: int, result: Any = None) -> None:
        response = self.parts.get_result.response
        made = response(status=code) if result is None else response(status=code, result=result)
        self.reply(query, made.to_cdr())

    def end(self, uuid: bytes, code: int, result: Any = None) -> None:
        """End a goal: its state, and the result for those who have asked."""
        self.set_state(uuid, code)
        for query in self.asked.pop(uuid, []):
            self.answer_result(query, code, result)

    # -- cancels -------------------------------------------------------------------------------

    def _take_cancel(self, query: Query) -> None:
        asked = unpack_cancel(query.payload)
        self.cancels.append((asked.uuid, asked.stamp_ns))
        self._check("cancel", query)
        self.on_cancel(query, asked.uuid)

    def let_cancel(self, query: Query, uuid: bytes) -> None:
        goals = [uuid] if uuid in self.states else [u for u in self.states if not any(uuid)]
        code = 0 if goals else 2
        for goal in goals:
            self.set_state(goal, 3)
        self.reply(query, pack_cancel_response(CancelResponse(code, tuple((u, 0) for u in goals))))

    def refuse_cancel(self, query: Query, uuid: bytes) -> None:
        """Answer as rclpy does when its callback refuses: code 0 and an empty list."""
        self.reply(query, pack_cancel_response(CancelResponse(0, ())))
