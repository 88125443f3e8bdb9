"""A scripted action server: what a test says it does with each goal, faults included."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from actionlib_core.action_server import ActionServer
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from smachpy.testing.ends import TWICE, ScriptedEnd, as_message

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.server_goal_handle import ServerGoalHandle
    from smachpy.testing.kit import MissionKit

Status: TypeAlias = Literal["succeeded", "aborted", "preempted", "rejected"]
STATUSES = ("succeeded", "aborted", "preempted", "rejected")
_UNASKED = (GoalStatus.PENDING, GoalStatus.ACTIVE)
_WAITING = (GoalStatus.PENDING, GoalStatus.RECALLING)
_UNENDED = (*_WAITING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING)


@dataclass(slots=True)
class Reply:
    """What is done with one goal.

    Attributes:
        result: The result message.
        status: How the goal ends; None: never.
        duration: From acceptance to the end [s].
        feedback: Sent evenly over the duration, the last one at its end.
        accept_after: From the goal's arrival to its acceptance [s]; None: never accepted.
        ignore_cancel: Go on when asked to stop.
        die_after: The server dies so long [s] after acceptance.
        back_after: And comes back so long [s] after that.
        lose_result: The result message is lost on the way.
        twice: Feedback and result arrive twice.
    """

    result: Any = None
    status: Status | None = "succeeded"
    duration: float = 0.0
    feedback: list[Any] = field(default_factory=list)
    accept_after: float | None = 0.0
    ignore_cancel: bool = False
    die_after: float | None = None
    back_after: float | None = None
    lose_result: bool = False
    twice: bool = False
    text: str = ""


class ScriptedActionServer(ScriptedEnd):
    """An action server that does what the test says; made by the `action_server` fixture.

    Each goal takes the first `reply_conditionally` whose predicate holds, else the next of the
    replies in order, else the default. Without any script every goal succeeds at once; with
    replies and no default, a goal more than there are replies is aborted and fails the run.

    Args:
        kit: The test.
        name: The action's name.
        action_class: Its class (XAction).

    Attributes:
        goals: The goals (XGoal) that arrived, in order.
        cancelled: The goals that were asked to stop, in order.
    """

    def __init__(self, kit: MissionKit, name: str, action_class: Any) -> None:
        self._action_class = action_class
        self.goals: list[Any] = []
        self.cancelled: list[Any] = []
        self._awaited = 0
        self._replies: deque[Reply | Callable[[ServerGoalHandle], object]] = deque()
        self._conditional: list[tuple[Callable[[Any], bool], Reply]] = []
        self._default: Reply | None = Reply()
        self._arrived = kit.clock.event(f"a goal for {name}")
        self._cancels: dict[str, Any] = {}
        self._handles: dict[str, ServerGoalHandle] = {}
        super().__init__(kit, name)
        self._start()

    def _start(self) -> None:
        self._server = ActionServer(
            self.name, self._action_class, self._on_goal, self._on_cancel, node=self.node
        )

    # -- script --------------------------------------------------------------------------------

    def reply(
        self,
        result: Any = None,
        status: Status = "succeeded",
        duration: float = 0.0,
        feedback: Iterable[Any] = (),
        *,
        text: str = "",
    ) -> Reply:
        """Answer the next goal.

        Args:
            result: XResult, or a dict of its fields.
            status: "succeeded", "aborted", "preempted" or "rejected".
            duration: From acceptance to the end [s]; a cancel ends it early.
            feedback: XFeedback messages or dicts, sent evenly over the duration.
            text: The status text.

        Returns:
            The reply, whose attributes may be changed.

        Raises:
            ValueError: there is no such status.
            TypeError, FieldError: a message does not fit the action.
        """
        return self._queue(self._make(result, status, duration, feedback, text))

    def reply_conditionally(
        self,
        predicate: Callable[[Any], bool],
        result: Any = None,
        status: Status = "succeeded",
        duration: float = 0.0,
        feedback: Iterable[Any] = (),
        *,
        text: str = "",
    ) -> Reply:
        """Answer every goal for which `predicate(goal)` holds; else as `reply`.

        What the predicate raises fails the run, and the goal is aborted.
        """
        reply = self._make(result, status, duration, feedback, text)
        self._conditional.append((predicate, reply))
        return reply

    def custom_reply(self, function: Callable[[ServerGoalHandle], object]) -> None:
        """Give the next goal to `function(goal_handle)`, which accepts and ends it; it may wait.

        What it raises fails the run, and the goal is aborted.
        """
        self._forget_default()
        self._replies.append(function)

    def default_result(
        self,
        result: Any = None,
        status: Status = "succeeded",
        duration: float = 0.0,
        feedback: Iterable[Any] = (),
        *,
        text: str = "",
    ) -> Reply:
        """Answer all goals for which there is no other reply; else as `reply`."""
        self._default = self._make(result, status, duration, feedback, text)
        self._default_is_given = True
        return self._default

    def choose_by(self, choose: Callable[[], Reply]) -> None:
        """Ask `choose` for the reply to every goal."""
        self._chooser = choose

    # -- faults --------------------------------------------------------------------------------

    def never_answer(self) -> Reply:
        """Take the next goal and say nothing of it, not even that it is there."""
        return self._queue(Reply(status=None, accept_after=None))

    def never_finish(self, *, ignore_cancel: bool = False) -> Reply:
        """Accept the next goal and never end it, unless it is cancelled."""
        return self._queue(Reply(status=None, ignore_cancel=ignore_cancel))

    def accept_late(self, after: float, **reply: Any) -> Reply:
        """Accept the next goal only `after` so long [s], then as `reply`."""
        made = self.reply(**reply)
        made.accept_after = after
        return made

    def reject(self, text: str = "rejected by the test") -> Reply:
        """Refuse the next goal."""
        return self.reply(status="rejected", text=text)

    def die(self, after: float = 0.0, *, back_after: float | None = None) -> Reply:
        """Die `after` so long [s] with the next goal active, and maybe come back.

        Args:
            after: From acceptance to death [s].
            back_after: From death to a new server of the same name [s]; None: never.
        """
        return self._queue(Reply(status=None, die_after=after, back_after=back_after))

    def lose_result(self, **reply: Any) -> Reply:
        """Answer the next goal as `reply`, but the result message is lost."""
        made = self.reply(**reply)
        made.lose_result = True
        return made

    def deliver_twice(self, **reply: Any) -> Reply:
        """Answer the next goal as `reply`; feedback and result arrive twice."""
        made = self.reply(**reply)
        made.twice = True
        return made

    def ignore_cancel(self, duration: float, **reply: Any) -> Reply:
        """Answer the next goal as `reply`, and go on to the end when asked to stop."""
        made = self.reply(duration=duration, **reply)
        made.ignore_cancel = True
        return made

    @property
    def left(self) -> tuple[str, ...]:
        """Ids of the goals that it works on and nobody has asked to stop."""
        return tuple(
            goal_id
            for goal_id, handle in self._handles.items()
            if handle.get_goal_status().status in _UNASKED
        )

    # -- the test's side -----------------------------------------------------------------------

    def await_goal(self, timeout: float | None = None) -> Any:
        """Return the next goal, waiting for it; each goal is given once.

        Raises:
            AssertionError: none came in time; beside the mission it fails the run.

        Blocks: until then; for functions that run beside the mission (`clock.spawn`).
        """
        __tracebackhide__ = True
        deadline = None if timeout is None else self._clock.now() + timeout
        while len(self.goals) <= self._awaited:
            self._arrived.clear()
            left = None if deadline is None else deadline - self._clock.now()
            if not self._arrived.wait(left) and len(self.goals) <= self._awaited:
                raise AssertionError(f"{self.name}: no goal came within {timeout:g} s.")
        self._awaited += 1
        return self.goals[self._awaited - 1]

    # -- the server's side ---------------------------------------------------------------------

    _default_is_given = False
    _chooser: Callable[[], Reply] | None = None

    def _forget_default(self) -> None:
        if not self._default_is_given:
            self._default = None

    def _queue(self, reply: Reply) -> Reply:
        self._forget_default()
        self._replies.append(reply)
        return reply

    def _make(
        self, result: Any, status: Status, duration: float, feedback: Iterable[Any], text: str
    ) -> Reply:
        if status not in STATUSES:
            raise ValueError(f"{self.name}: status: got {status!r}; expected one of {STATUSES}.")
        types = self._server.types
        where = f"{self.name}: "
        return Reply(
            as_message(types.result, result, f"{where}result"),
            status,
            duration,
            [as_message(types.feedback, one, f"{where}feedback") for one in feedback],
            text=text,
        )

    def _on_goal(self, handle: ServerGoalHandle) -> None:
        goal = handle.get_goal()
        self.goals.append(goal)
        self._arrived.set()
        goal_id = handle.get_goal_id().id
        self._handles[goal_id] = handle
        self._cancels[goal_id] = self._clock.event(f"a cancel of {goal_id}")
        reply = self._choose(goal)
        if isinstance(reply, Reply):
            self._clock.spawn(lambda: self._play(handle, reply), name=f"{self.name} server")
        elif isinstance(reply, str):
            self._give_up(handle, reply)
        elif reply is not None:
            self._clock.spawn(lambda: self._hand_over(handle, reply), name=f"{self.name} server")
        else:
            count = len(self.goals)
            self.errors.append(
                f"{self.name}: goal number {count} came; expected {count - 1}, as there are no "
                "more replies. Try reply(...) or default_result(...)."
            )
            self._give_up(handle, "the test has no reply for this goal")

    def _choose(self, goal: Any) -> Reply | Callable[[ServerGoalHandle], object] | str | None:
        """Return what is to be done with a goal; a text when a predicate raised."""
        if self._chooser is not None:
            return self._chooser()
        for predicate, reply in self._conditional:
            try:
                holds = predicate(goal)
            except Exception as error:  # noqa: BLE001  a border: the run fails with it
                return self.note_raised(predicate, error)
            if holds:
                return reply
        return self._replies.popleft() if self._replies else self._default

    def _hand_over(
        self, handle: ServerGoalHandle, function: Callable[[ServerGoalHandle], object]
    ) -> None:
        try:
            function(handle)
        except Exception as error:  # noqa: BLE001  a border: the run fails with it
            self._give_up(handle, self.note_raised(function, error))

    def _give_up(self, handle: ServerGoalHandle, text: str) -> None:
        """Abort a goal that the test has no right answer to, unless it has ended."""
        status = handle.get_goal_status().status
        if status in _WAITING:
            handle.set_accepted()
        if status in _UNENDED:
            handle.set_aborted(text=text)

    def _on_cancel(self, handle: ServerGoalHandle) -> None:
        self.cancelled.append(handle.get_goal())
        event = self._cancels.get(handle.get_goal_id().id)
        if event is not None:
            event.set()

    def _play(self, handle: ServerGoalHandle, reply: Reply) -> None:
        cancel = self._cancels[handle.get_goal_id().id]
        if reply.accept_after is None:
            return
        if reply.accept_after and cancel.wait(reply.accept_after) and not reply.ignore_cancel:
            handle.set_canceled(text="cancelled before it was accepted")
            return
        if handle.get_goal_status().status not in _WAITING:
            return  # the test has ended, and the server with it
        if reply.status == "rejected":
            handle.set_rejected(reply.result, reply.text)
            return
        handle.set_accepted()
        if reply.die_after is not None:
            self._die(reply)
            return
        if self._work(handle, reply, cancel):
            handle.set_canceled(reply.result, reply.text or "cancelled")
        elif reply.status is not None:
            self._end(handle, reply)

    def _work(self, handle: ServerGoalHandle, reply: Reply, cancel: Any) -> bool:
        """Let the time of a goal pass; whether it ended early because of a cancel."""
        if reply.status is None:
            if reply.ignore_cancel:
                return False
            cancel.wait()
            return True
        steps = max(1, len(reply.feedback))
        for number in range(steps):
            if reply.ignore_cancel:
                self._clock.sleep(reply.duration / steps)
            elif cancel.wait(reply.duration / steps):
                return True
            if number < len(reply.feedback):
                if reply.twice:
                    self._doom("feedback", TWICE)
                handle.publish_feedback(reply.feedback[number])
        return False

    def _end(self, handle: ServerGoalHandle, reply: Reply) -> None:
        if reply.lose_result:
            self._doom("result")
        if reply.twice:
            self._doom("result", TWICE)
        ends = {
            "succeeded": handle.set_succeeded,
            "aborted": handle.set_aborted,
            "preempted": self._preempt(handle),
        }
        ends[str(reply.status)](reply.result, reply.text)

    @staticmethod
    def _preempt(handle: ServerGoalHandle) -> Callable[[Any, str], None]:
        def preempt(result: Any, text: str) -> None:
            handle.set_cancel_requested()  # the server stops it of its own accord
            handle.set_canceled(result, text)

        return preempt

    def _die(self, reply: Reply) -> None:
        assert reply.die_after is not None
        self._clock.sleep(reply.die_after)
        self.kill()
        if reply.back_after is not None:
            self._clock.sleep(reply.back_after)
            self.come_back()

    def kill(self) -> None:
        """Die as a process does that gets SIGKILL, and its goals with it."""
        self._handles.clear()
        super().kill()

    def come_back(self) -> None:
        """Start again after death, as a new process that knows nothing of the goals before."""
        self._join()
        self._start()
