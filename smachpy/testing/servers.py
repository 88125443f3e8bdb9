"""Scripted servers and topics: what a test says they do, faults included."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias

from actionlib_core.action.server import ActionServer
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import Node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.transport.faulty import DELIVERED, DROPPED, FaultyTransport
from smachpy.machines.names import name_of

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable
    from typing import Self

    from actionlib_core.action.server import ServerGoalHandle
    from actionlib_core.clock import VirtualClock
    from actionlib_core.transport.memory import MemoryNetwork

Status: TypeAlias = Literal["succeeded", "aborted", "preempted", "rejected"]
STATUSES = ("succeeded", "aborted", "preempted", "rejected")
TWICE = (0.0, 0.0)  # the delays of each copy of a message [s]
MOST_ERRORS = 5  # of one server that a failure shows
_UNASKED = (GoalStatus.PENDING, GoalStatus.ACTIVE)
_WAITING = (GoalStatus.PENDING, GoalStatus.RECALLING)
_UNENDED = (*_WAITING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING)


@dataclass(slots=True)
class Reply:
    """What is done with one goal or request.

    Attributes:
        result: The result or response message.
        status: How the goal ends; None: never.
        duration: From acceptance to the end [s].
        feedback: Sent evenly over the duration, the last one at its end.
        accept_after: From the goal's arrival to its acceptance [s]; None: never accepted.
        ignore_cancel: Continue when asked to stop.
        die_after: The server dies so long [s] after acceptance.
        back_after: And comes back so long [s] after that.
        lose_result: The result message is lost on the way.
        twice: Feedback and result arrive twice.
        text: The goal's status text.
        error: The service's handler raises with this text.
        silent: No response ever comes.
        function: Does it all: called with the goal handle, or with the request.
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
    error: str | None = None
    silent: bool = False
    function: Callable[[Any], Any] | None = None


class Test(Protocol):
    """What a scripted end needs of the test that it belongs to (`smachpy.testing.kit`)."""

    @property
    def clock(self) -> VirtualClock:
        """Its clock."""
        ...

    @property
    def network(self) -> MemoryNetwork:
        """Its network."""
        ...

    def add_end(self, end: ScriptedEnd) -> None:
        """Close `end` with the test, and report its errors."""


class ScriptedEnd:
    """One scripted server or topic: a process of its own, as far as the mission can see.

    A server takes the next of its replies, else the default, which is success at once until there
    is a script. With replies and no default, one goal or request too many fails the run.

    Args:
        kit: The test.
        name: Its name on the network.
        type_class: Class of the action, service or message.

    Attributes:
        name: See above.
        replies: What it does with the next goals or requests.
        default: What it does when there are none of them.
        errors: What went otherwise than the script says; the run fails with it.
        causes: What the test's own functions raised.
    """

    def __init__(self, kit: Test, name: str, type_class: Any) -> None:
        self.name = name
        self.errors: list[str] = []
        self.causes: list[BaseException] = []
        self._kit = kit
        self._clock = kit.clock
        self._type_class = type_class
        self.replies: deque[Reply] = deque()
        self.default: Reply | None = Reply()
        self._default_is_given = False
        self._faults: dict[str, deque[tuple[float, ...]]] = {}
        self._join()
        kit.add_end(self)

    def _join(self) -> None:
        """Join the network as a new process."""
        self._session = self._kit.network.session()
        self._link = FaultyTransport(self._session, self._fault, clock=self._clock)
        word = self.name.strip("/").replace("/", "_")
        self.node = Node(f"{word}_double", transport=self._link, clock=self._clock)
        self._start()

    def _start(self) -> None:
        """Make the server or the subscriber on the new node."""
        raise NotImplementedError

    def _fault(self, key: str, _number: int) -> tuple[float, ...]:
        faults = self._faults.get(key.rpartition("/")[2])
        return faults.popleft() if faults else DELIVERED

    def _disturb(self, word: str, fault: tuple[float, ...], count: int = 1) -> None:
        """Do this to the next messages on keys that end with `word`."""
        self._faults.setdefault(word, deque()).extend([fault] * count)

    def cut(self, seconds: float | None = None) -> None:
        """Cut its link to the network, for `seconds` or until `restore`."""
        self._link.cut(seconds)

    def restore(self) -> None:
        """Mend the link."""
        self._link.restore()

    def kill(self) -> None:
        """Die as a process does that gets SIGKILL."""
        self._session.kill()

    def come_back(self) -> None:
        """Start again after death, as a new process that knows nothing of what was before."""
        self._join()

    def close(self) -> None:
        """Leave the network."""
        if not self._session.killed:
            self.node.close()

    # -- the script ----------------------------------------------------------------------------

    def copy_to(self, kit: Test) -> Self:
        """Make the same end with the same script in another test."""
        made = type(self)(kit, self.name, self._type_class)
        made.replies, made.default = deque(self.replies), self.default
        return made

    def situation(self) -> Hashable:
        """Return what it still has to do, equal when all that can follow is equal."""
        return len(self.replies)

    @property
    def left(self) -> tuple[str, ...]:
        """Ids of the goals that it works on and nobody has asked to stop."""
        return ()

    def _queue(self, reply: Reply) -> Reply:
        if not self._default_is_given:
            self.default = None
        self.replies.append(reply)
        return reply

    def _set_default(self, reply: Reply) -> Reply:
        self.default, self._default_is_given = reply, True
        return reply

    def _next_reply(self, what: str, count: int, calls: str) -> Reply | None:
        """Return what is done with the `count`-th `what`; None, and an error, if nothing is."""
        reply = self.replies.popleft() if self.replies else self.default
        if reply is None:
            self.errors.append(
                f"{self.name}: {what} number {count} came; expected {count - 1}, as there are no "
                f"more replies. Try {calls}."
            )
        return reply

    # -- what went wrong -----------------------------------------------------------------------

    def note_raised(self, function: object, error: BaseException) -> str:
        """Note what a function of the test raised, and return it as a text."""
        name = name_of(function)
        text = f"{self.name}: {name} of the test raised {type(error).__name__}: {error}"
        self.errors.append(text)
        self.causes.append(error)
        return text

    def take_errors(self) -> tuple[list[str], list[BaseException]]:
        """Return what went otherwise than the script says, and what raised; forget both."""
        errors, self.errors = self.errors, []
        causes, self.causes = self.causes, []
        more = len(errors) - MOST_ERRORS
        last = [f"{self.name}: and {more} more"] if more > 0 else []
        return [*errors[:MOST_ERRORS], *last], causes

    def verify(self) -> None:
        """Fail if something went otherwise than the script says."""
        __tracebackhide__ = True
        raise_errors(*self.take_errors())


def raise_errors(errors: list[str], causes: list[BaseException]) -> None:
    """Fail with what went otherwise than the test says, if anything did.

    Raises:
        AssertionError: from the first of `causes`.
    """
    __tracebackhide__ = True
    if errors:
        raise AssertionError("\n".join(errors)) from (causes[0] if causes else None)


def as_message(kind: Any, value: Any, what: str) -> Any:
    """Return a message of class `kind` from one, from a dict of its fields, or from None.

    Raises:
        TypeError: it is something else.
    """
    if value is None:
        return kind()
    if isinstance(value, kind):
        return value
    if isinstance(value, dict):
        return kind(**value)
    raise TypeError(f"{what}: got {value!r}; expected {kind._type}, a dict of its fields, or None.")


class ScriptedActionServer(ScriptedEnd):
    """An action server that does what the test says; made by the `action_server` fixture.

    Each goal takes the first `reply_conditionally` whose predicate holds, else the next of the
    replies in order, else the default. Without any script every goal succeeds at once; with
    replies and no default, a goal more than there are replies is aborted and fails the run.

    Args:
        kit: The test.
        name: The action's name.
        type_class: Its class (XAction).

    Attributes:
        goals: The goals (XGoal) that arrived, in order.
        cancelled: The goals that were asked to stop, in order.
        conditional: Predicates of goals, and what is done with those for which they hold.
    """

    def __init__(self, kit: Test, name: str, type_class: Any) -> None:
        self.goals: list[Any] = []
        self.cancelled: list[Any] = []
        self._awaited = 0
        self.conditional: list[tuple[Callable[[Any], bool], Reply]] = []
        self._chooser: Callable[[], Reply] | None = None
        self._arrived = kit.clock.event(f"a goal for {name}")
        self._cancels: dict[str, Any] = {}
        self._handles: dict[str, ServerGoalHandle] = {}
        self._arrivals: dict[str, float] = {}  # goal id -> when it came [s]
        super().__init__(kit, name, type_class)

    def _start(self) -> None:
        self._server = ActionServer(
            self.name, self._type_class, self._on_goal, self._on_cancel, node=self.node
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
        self.conditional.append((predicate, reply))
        return reply

    def custom_reply(self, function: Callable[[ServerGoalHandle], object]) -> None:
        """Give the next goal to `function(goal_handle)`, which accepts and ends it; it may wait.

        What it raises fails the run, and the goal is aborted.
        """
        self._queue(Reply(function=function))

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
        return self._set_default(self._make(result, status, duration, feedback, text))

    def choose_by(self, choose: Callable[[], Reply]) -> None:
        """Ask `choose` for the reply to every goal."""
        self._chooser = choose

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

    def copy_to(self, kit: Test) -> Self:
        """Make the same server with the same script in another test."""
        made = super().copy_to(kit)
        made.conditional = list(self.conditional)
        return made

    def _make(
        self, result: Any, status: Status, duration: float, feedback: Iterable[Any], text: str
    ) -> Reply:
        if status not in STATUSES:
            raise ValueError(f"{self.name}: status: got {status!r}; expected one of {STATUSES}.")
        types = self._server.types
        message = as_message(types.result, result, f"{self.name}: result")
        parts = [as_message(types.feedback, one, f"{self.name}: feedback") for one in feedback]
        return Reply(message, status, duration, parts, text=text)

    # -- the test's side -----------------------------------------------------------------------

    def situation(self) -> Hashable:
        """Return how many replies it has left, and how far it is with its goals."""
        now = self._clock.now()
        goals = [
            (round(now - self._arrivals[goal_id], 6), status)
            for goal_id, handle in self._handles.items()
            if (status := handle.get_goal_status().status) in _UNENDED
        ]
        return len(self.replies), tuple(sorted(goals))

    @property
    def left(self) -> tuple[str, ...]:
        """Ids of the goals that it works on and nobody has asked to stop."""
        return tuple(
            goal_id
            for goal_id, handle in self._handles.items()
            if handle.get_goal_status().status in _UNASKED
        )

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

    def _on_goal(self, handle: ServerGoalHandle) -> None:
        goal = handle.get_goal()
        goal_id = handle.get_goal_id().id
        self.goals.append(goal)
        self._arrived.set()
        self._handles[goal_id] = handle
        self._arrivals[goal_id] = self._clock.now()
        self._cancels[goal_id] = self._clock.event(f"a cancel of {goal_id}")
        reply = self._choose(goal)
        self._clock.spawn(lambda: self._play(handle, reply), name=f"{self.name} server")

    def _choose(self, goal: Any) -> Reply:
        if self._chooser is not None:
            return self._chooser()
        for predicate, reply in self.conditional:
            try:
                holds = predicate(goal)
            except Exception as error:  # noqa: BLE001  a border: the run fails with it
                return self._failure(self.note_raised(predicate, error))
            if holds:
                return reply
        found = self._next_reply("goal", len(self.goals), "reply(...) or default_result(...)")
        return found or self._failure("the test has no reply for this goal")

    def _failure(self, text: str) -> Reply:
        return Reply(function=lambda handle: self._give_up(handle, text))

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
        """Do with a goal what the reply says."""
        if reply.function is not None:
            try:
                reply.function(handle)
            except Exception as error:  # noqa: BLE001  a border: the run fails with it
                self._give_up(handle, self.note_raised(reply.function, error))
            return
        cancel = self._cancels[handle.get_goal_id().id]
        if reply.accept_after is None:
            return
        if reply.accept_after and cancel.wait(reply.accept_after) and not reply.ignore_cancel:
            handle.set_canceled(text="cancelled before it was accepted")
        elif handle.get_goal_status().status not in _WAITING:
            return  # the test has ended, and the server with it
        elif reply.status == "rejected":
            handle.set_rejected(reply.result, reply.text)
        else:
            handle.set_accepted()
            self._work(handle, reply, cancel)

    def _work(self, handle: ServerGoalHandle, reply: Reply, cancel: Any) -> None:
        """Let the time of an accepted goal pass, and end it."""
        if reply.die_after is not None:
            self._clock.sleep(reply.die_after)
            self.kill()
            if reply.back_after is not None:
                self._clock.sleep(reply.back_after)
                self.come_back()
        elif self._is_cancelled(handle, reply, cancel):
            handle.set_canceled(reply.result, reply.text or "cancelled")
        elif reply.status is not None:
            if reply.lose_result:
                self._disturb("result", DROPPED)
            if reply.twice:
                self._disturb("result", TWICE)
            if reply.status == "preempted":
                handle.set_cancel_requested()  # the server stops it of its own accord
            ends = {"succeeded": handle.set_succeeded, "aborted": handle.set_aborted}
            ends.get(reply.status, handle.set_canceled)(reply.result, reply.text)

    def _is_cancelled(self, handle: ServerGoalHandle, reply: Reply, cancel: Any) -> bool:
        """Send the feedback over the duration; return whether a cancel ended that."""
        if reply.status is None:
            return not reply.ignore_cancel and bool(cancel.wait())
        steps = max(1, len(reply.feedback))
        for number in range(steps):
            if reply.ignore_cancel:
                self._clock.sleep(reply.duration / steps)
            elif cancel.wait(reply.duration / steps):
                return True
            if number < len(reply.feedback):
                if reply.twice:
                    self._disturb("feedback", TWICE)
                handle.publish_feedback(reply.feedback[number])
        return False

    def kill(self) -> None:
        """Die as a process does that gets SIGKILL, and its goals with it."""
        self._handles.clear()
        super().kill()


class ScriptedService(ScriptedEnd):
    """A service that answers what the test says; made by the `service_server` fixture.

    Each request takes the next reply, else the default; without any script that is an empty
    response at once. With replies and no default, a request more fails the run.

    Args:
        kit: The test.
        name: The service's name.
        type_class: Its class.

    Attributes:
        requests: The requests that arrived, in order.
    """

    def __init__(self, kit: Test, name: str, type_class: Any) -> None:
        self.requests: list[Any] = []
        super().__init__(kit, name, type_class)

    def _start(self) -> None:
        self._service = Service(self.name, self._type_class, self._handle, node=self.node)

    def reply(self, response: Any = None, duration: float = 0.0) -> Reply:
        """Answer the next request.

        Args:
            response: The response, or a dict of its fields.
            duration: How long it takes [s].
        """
        return self._queue(Reply(self._message(response), duration=duration))

    def custom_reply(self, function: Callable[[Any], Any]) -> Reply:
        """Answer the next request with what `function(request)` returns; it may wait or raise.

        An AssertionError of it fails the run, too.
        """
        return self._queue(Reply(function=function))

    def default_response(self, response: Any = None, duration: float = 0.0) -> Reply:
        """Answer all requests for which there is no other reply."""
        return self._set_default(Reply(self._message(response), duration=duration))

    def fail(self, text: str = "failed by the test", duration: float = 0.0) -> Reply:
        """Let the handler of the next request raise."""
        return self._queue(Reply(error=text, duration=duration))

    def never_answer(self) -> Reply:
        """Take the next request and say nothing."""
        return self._queue(Reply(silent=True))

    def die(self, after: float = 0.0) -> Reply:
        """Die with the next request unanswered, `after` so long [s]."""
        return self._queue(Reply(silent=True, die_after=after))

    def _message(self, response: Any) -> Any:
        return as_message(self._service.response_class, response, f"{self.name}: response")

    def _handle(self, request: Any) -> Any:
        self.requests.append(request)
        calls = "reply(...) or default_response(...)"
        reply = self._next_reply("request", len(self.requests), calls)
        if reply is None:
            raise RuntimeError(f"{self.name}: the test has no reply for this request")
        self._clock.sleep(reply.duration)
        if reply.die_after is not None:
            self._clock.sleep(reply.die_after)
            self.kill()
        if reply.silent:
            self._clock.event(f"the end of the test of {self.name}").wait()
        if reply.error is not None:
            raise RuntimeError(reply.error)
        if reply.function is None:
            return self._service.response_class() if reply.result is None else reply.result
        try:
            return reply.function(request)
        except AssertionError as error:  # whatever else it raises is what the service does
            self.note_raised(reply.function, error)
            raise


class ScriptedTopic(ScriptedEnd):
    """Writes to a topic and keeps what is written there; made by the `topic` fixture.

    Args:
        kit: The test.
        name: The topic's name.
        type_class: Class of its messages.

    Attributes:
        received: All messages on the topic, its own too, in order.
    """

    def __init__(self, kit: Test, name: str, type_class: Any) -> None:
        self.received: list[Any] = []
        self._calls: list[Callable[[ScriptedTopic], object]] = []  # all that it was told to do
        self._due: list[float] = []  # when it will write [s]
        super().__init__(kit, name, type_class)

    def _start(self) -> None:
        self._subscriber = Subscriber(
            self.name, self._type_class, self.received.append, node=self.node
        )
        self._publishers: dict[bool, Publisher] = {}  # latched or not

    def publish(self, message: Any = None, *, latch: bool = False, **fields: Any) -> None:
        """Write now.

        Args:
            message: A message or a dict of its fields; or give the fields themselves.
            latch: Those who come later get it too.
            **fields: The fields of the message, in place of `message`.
        """
        made = self._message(message if message is not None else fields)
        self._calls.append(lambda topic: topic.publish(made, latch=latch))
        self._publisher(latch=latch).publish(made)

    def publish_at(self, at: float, message: Any = None, **fields: Any) -> None:
        """Write `at` so long [s] from now."""
        made = self._message(message if message is not None else fields)
        self._calls.append(lambda topic: topic.publish_at(at, made))
        self._due.append(self._clock.now() + at)
        publisher = self._publisher(latch=False)
        self._clock.call_later(at, lambda: publisher.publish(made))

    def publish_every(self, period: float, messages: Iterable[Any], *, start: float = 0.0) -> None:
        """Write one message after the other, `period` [s] apart, the first `start` [s] from now."""
        for number, message in enumerate(messages):
            self.publish_at(start + number * period, message)

    def lose(self, count: int = 1) -> None:
        """Lose the next messages that this end writes."""
        self.disturb(DROPPED, count)

    def deliver_twice(self, count: int = 1) -> None:
        """Deliver the next messages twice."""
        self.disturb(TWICE, count)

    def delay(self, seconds: float, count: int = 1) -> None:
        """Deliver the next messages late by `seconds`: those after them may overtake."""
        self.disturb((seconds,), count)

    def copy_to(self, kit: Test) -> Self:
        """Make the same topic in another test, where everything is asked of it once more."""
        made = super().copy_to(kit)
        for call in self._calls:
            call(made)
        return made

    def situation(self) -> Hashable:
        """Return how long it is to the messages that it will write [s]."""
        now = self._clock.now()
        return tuple(round(at - now, 6) for at in self._due if at > now)

    def disturb(self, fault: tuple[float, ...], count: int) -> None:
        """Deliver the next messages with these delays [s], one for each copy."""
        self._calls.append(lambda topic: topic.disturb(fault, count))
        self._disturb(self.name.rpartition("/")[2], fault, count)

    def _publisher(self, *, latch: bool) -> Publisher:
        if latch not in self._publishers:
            self._publishers[latch] = Publisher(
                self.name, self._type_class, latch=latch, node=self.node
            )
        return self._publishers[latch]

    def _message(self, value: Any) -> Any:
        return as_message(self._type_class, value, f"{self.name}: message")
