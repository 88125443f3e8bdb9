"""Scripted servers and topics, including faults."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeAlias

from actionlib_core.action.server import ActionServer
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import Node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.topic import Publisher, WatchingSubscriber
from actionlib_core.transport.faulty import DELIVERED, DROPPED, FaultyTransport
from smachpy.base.functions import name_of
from smachpy.base.problems import Problems
from smachpy.exceptions import error_text

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterator
    from typing import Self

    from actionlib_core.action.server import ServerGoalHandle
    from actionlib_core.clock import Event, VirtualClock
    from actionlib_core.transport.memory import MemoryNetwork
    from smachpy.testing.process import MissionNode

Status: TypeAlias = Literal["succeeded", "aborted", "preempted", "rejected"]
STATUSES = ("succeeded", "aborted", "preempted", "rejected")
TWICE = (0.0, 0.0)  # delays of the copies of a message [s]: two copies, both at once
MAX_ERRORS = 5  # errors of one server that a failure shows
_UNASKED = (GoalStatus.PENDING, GoalStatus.ACTIVE)
_ASKED = (GoalStatus.RECALLING, GoalStatus.PREEMPTING)
_WAITING = (GoalStatus.PENDING, GoalStatus.RECALLING)
_UNENDED = (*_WAITING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING)


def _check_function(where: str, argument: str, given: object, call: str) -> None:
    problems = Problems(where)
    problems.function(argument, given, call, 1, optional=False)
    problems.raise_all()


@dataclass(slots=True)
class Reply:
    """The reply to one goal or request.

    Attributes:
        result: The result or response message.
        status: How the goal ends; None: never.
        duration: From acceptance to the end [s].
        feedback: Sent evenly over the duration, the last one at its end.
        accept_after: From the goal's arrival to its acceptance [s]; None: never accepted.
        ignore_cancel: Continue after a cancel.
        die_after: The server dies this long after acceptance [s].
        back_after: It comes back this long after that [s].
        lose_result: The result message is lost.
        twice: Feedback and result arrive twice.
        text: The goal's status text.
        error: The service's handler raises with this text.
        silent: No response ever comes.
        function: Does everything itself; called with the goal handle, or with the request.
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

    def __post_init__(self) -> None:
        problems = Problems("reply")
        for name in ("duration", "accept_after", "die_after", "back_after"):
            seconds = problems.seconds(name, getattr(self, name), optional=name != "duration")
            if seconds is not None:  # else None, which stays, or infinity
                setattr(self, name, seconds)
        problems.raise_all()


class Test(Protocol):
    """The part of the test (`smachpy.testing.kit`) that its scripted ends need."""

    @property
    def clock(self) -> VirtualClock:
        """Its clock."""
        ...

    @property
    def network(self) -> MemoryNetwork:
        """Its network."""
        ...

    @property
    def node(self) -> MissionNode:
        """The mission's node."""
        ...

    @property
    def ends(self) -> tuple[ScriptedEnd, ...]:
        """Its scripted servers and topics."""
        ...

    def add_end(self, end: ScriptedEnd) -> None:
        """Close `end` with the test, and report its errors."""


class ScriptedEnd:
    """One scripted server or topic; to the mission it looks like a separate process.

    A server takes the next of its replies, else the default, which is immediate success as long as
    there is no script. With replies and no default, a surplus goal or request fails the run.

    Args:
        kit: The test.
        name: Its name on the network.
        type_class: Class of the action, service or message.

    Attributes:
        name: See above.
        replies: The replies to the next goals or requests.
        default: The reply if there are no more.
        errors: Deviations from the script; they fail the run.
        causes: Exceptions of the test's own functions.
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
        self._chooser: Callable[[], Reply] | None = None
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
        """Apply a fault to the next messages on keys that end with `word`."""
        self._faults.setdefault(word, deque()).extend([fault] * count)

    def cut(self, seconds: float | None = None) -> None:
        """Cut its connection to the network, for `seconds` or until `restore`."""
        self._link.cut(seconds)

    def restore(self) -> None:
        """Restore the connection."""
        self._link.restore()

    def kill(self) -> None:
        """Die like a process that gets SIGKILL."""
        self._session.kill()

    def come_back(self) -> None:
        """Start again after death, as a new process without any memory."""
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
        """Return its remaining work; equal if everything that can follow is equal."""
        return len(self.replies)

    @property
    def left(self) -> tuple[str, ...]:
        """Ids of the goals that it works on without a cancel."""
        return ()

    @property
    def ignored(self) -> tuple[str, ...]:
        """Ids of the goals that it works on although somebody has cancelled them."""
        return ()

    def choose_by(self, choose: Callable[[], Reply]) -> None:
        """Call `choose` for the reply to every goal or request."""
        self._chooser = choose

    def _queue(self, reply: Reply) -> Reply:
        if not self._default_is_given:
            self.default = None
        self.replies.append(reply)
        return reply

    def _set_default(self, reply: Reply) -> Reply:
        self.default, self._default_is_given = reply, True
        return reply

    def _next_reply(self, what: str, count: int, calls: str) -> Reply | None:
        """Return the reply to goal or request `count`; None, and an error, if there is none."""
        if self._chooser is not None:
            return self._chooser()
        reply = self.replies.popleft() if self.replies else self.default
        if reply is None:
            self.errors.append(
                f"{self.name}: {what} number {count} came; expected {count - 1}, as there are no "
                f"more replies. Try {calls}."
            )
        return reply

    # -- what went wrong -----------------------------------------------------------------------

    def note_raised(self, function: object, error: BaseException) -> str:
        """Record an exception of a function of the test, and return it as text."""
        name = name_of(function)
        text = f"{self.name}: {name} of the test raised {error_text(error)}"
        self.errors.append(text)
        self.causes.append(error)
        return text

    def take_errors(self) -> tuple[list[str], list[BaseException]]:
        """Return and clear the deviations from the script and the exceptions."""
        errors, self.errors = self.errors, []
        causes, self.causes = self.causes, []
        more = len(errors) - MAX_ERRORS
        last = [f"{self.name}: and {more} more"] if more > 0 else []
        return [*errors[:MAX_ERRORS], *last], causes

    def verify(self) -> None:
        """Fail if anything deviated from the script."""
        __tracebackhide__ = True
        raise_errors(*self.take_errors())


def raise_errors(errors: list[str], causes: list[BaseException]) -> None:
    """Fail with these errors, if there are any.

    Raises:
        AssertionError: from the first of `causes`.
    """
    __tracebackhide__ = True
    if errors:
        raise AssertionError("\n".join(errors)) from (causes[0] if causes else None)


def _is_nested(value: dict[str, Any]) -> bool:
    """Return whether messages inside a message are dicts, too."""
    return any(
        isinstance(one, dict) or (isinstance(one, list) and any(isinstance(x, dict) for x in one))
        for one in value.values()
    )


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
        return kind.from_dict(value) if _is_nested(value) else kind(**value)
    raise TypeError(f"{what}: got {value!r}; expected {kind._type}, a dict of its fields, or None.")


class ScriptedActionServer(ScriptedEnd):
    """An action server with scripted replies; made by the `action_server` fixture.

    Each goal takes the first `reply_conditionally` whose predicate holds, else the next of the
    replies in order, else the default. Without a script every goal succeeds at once; with replies
    and no default, a surplus goal is aborted and fails the run.

    Args:
        kit: The test.
        name: The action's name.
        type_class: Its class (XAction).

    Attributes:
        goals: The goals (XGoal) that arrived, in order.
        cancelled: The goals that were cancelled, in order.
        conditional: Predicates of goals, with the reply if they hold.
    """

    def __init__(self, kit: Test, name: str, type_class: Any) -> None:
        self.goals: list[Any] = []
        self.cancelled: list[Any] = []
        self._awaited = 0
        self.conditional: list[tuple[Callable[[Any], bool], Reply]] = []
        self._arrived = kit.clock.event(f"a goal for {name}")
        self._cancels: dict[str, Event] = {}
        self._deaf: dict[str, None] = {}  # ids of the goals whose cancel it ignores
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
        """Answer every goal for which `predicate(goal)` holds; other arguments as for `reply`.

        An exception of the predicate fails the run, and the goal is aborted.
        """
        _check_function(self.name, "predicate", predicate, "predicate(goal)")
        reply = self._make(result, status, duration, feedback, text)
        self.conditional.append((predicate, reply))
        return reply

    def custom_reply(self, function: Callable[[ServerGoalHandle], object]) -> None:
        """Pass the next goal to `function(goal_handle)`, which accepts and ends it; it may wait.

        An exception of the function fails the run, and the goal is aborted.
        """
        _check_function(self.name, "custom_reply", function, "function(goal_handle)")
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
        """Answer all goals without another reply; arguments as for `reply`."""
        return self._set_default(self._make(result, status, duration, feedback, text))

    def cancel_of(self, goal_id: str) -> Event:
        """Return the event that is set when a goal that arrived is cancelled."""
        return self._cancels[goal_id]

    def never_answer(self) -> Reply:
        """Receive the next goal without any sign of it, not even that it has arrived."""
        return self._queue(Reply(status=None, accept_after=None))

    def never_finish(self, *, ignore_cancel: bool = False) -> Reply:
        """Accept the next goal and never end it, unless it is cancelled."""
        return self._queue(Reply(status=None, ignore_cancel=ignore_cancel))

    def accept_late(self, after: float, **reply: Any) -> Reply:
        """Accept the next goal `after` this long [s], then answer as `reply`."""
        checked = Reply(accept_after=after)
        made = self.reply(**reply)
        made.accept_after = checked.accept_after
        return made

    def reject(self, text: str = "rejected by the test") -> Reply:
        """Reject the next goal."""
        return self.reply(status="rejected", text=text)

    def die(self, after: float = 0.0, *, back_after: float | None = None) -> Reply:
        """Die while the next goal is active, and optionally come back.

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
        """Answer the next goal as `reply`, and ignore a cancel of it."""
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
        """Return the number of remaining replies, and the age and status of its goals."""
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

    @property
    def ignored(self) -> tuple[str, ...]:
        """Ids of the goals that it works on although somebody has cancelled them."""
        return tuple(
            goal_id
            for goal_id in self._deaf
            if self._handles[goal_id].get_goal_status().status in _ASKED
        )

    def await_goal(self, timeout: float | None = None) -> Any:
        """Wait for the next goal and return it; each goal is returned once.

        Raises:
            AssertionError: none came in time; in a thread of the test it fails the run.

        Blocks: until then; for functions that run next to the mission (`clock.spawn`).
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
        for predicate, reply in self.conditional:
            try:
                holds = predicate(goal)
            except Exception as error:  # noqa: BLE001  the test's own code: it fails the run
                return self._failure(self.note_raised(predicate, error))
            if holds:
                return reply
        found = self._next_reply("goal", len(self.goals), "reply(...) or default_result(...)")
        return found or self._failure("the test has no reply for this goal")

    def _failure(self, text: str) -> Reply:
        return Reply(function=lambda handle: self._give_up(handle, text))

    def _give_up(self, handle: ServerGoalHandle, text: str) -> None:
        """Abort a goal without a valid reply, unless it has ended."""
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
        """Carry out a reply to a goal."""
        if reply.function is not None:
            try:
                reply.function(handle)
            except Exception as error:  # noqa: BLE001  the test's own code: it fails the run
                self._give_up(handle, self.note_raised(reply.function, error))
            return
        cancel = self._cancels[handle.get_goal_id().id]
        if reply.ignore_cancel:
            self._deaf[handle.get_goal_id().id] = None
        if reply.accept_after is None:
            return
        if reply.accept_after and cancel.wait(reply.accept_after) and not reply.ignore_cancel:
            handle.set_canceled(text="cancelled before it was accepted")
        elif handle.get_goal_status().status not in _WAITING:
            return  # the test has ended meanwhile, and the server with it
        elif reply.status == "rejected":
            handle.set_rejected(reply.result, reply.text)
        else:
            handle.set_accepted()
            self._work(handle, reply, cancel)

    def _work(self, handle: ServerGoalHandle, reply: Reply, cancel: Any) -> None:
        """Wait for the duration of an accepted goal, and end it."""
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
                handle.set_cancel_requested()  # as if the server itself decided to stop
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
        """Die like a process that gets SIGKILL, together with its goals."""
        self._handles.clear()
        self._deaf.clear()
        super().kill()


class ScriptedService(ScriptedEnd):
    """A service with scripted replies; made by the `service_server` fixture.

    Each request takes the next reply, else the default; without a script that is an immediate
    empty response. With replies and no default, a surplus request fails the run.

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

        An AssertionError in it also fails the run.
        """
        _check_function(self.name, "custom_reply", function, "function(request)")
        return self._queue(Reply(function=function))

    def default_response(self, response: Any = None, duration: float = 0.0) -> Reply:
        """Answer all requests without another reply."""
        return self._set_default(Reply(self._message(response), duration=duration))

    def fail(self, text: str = "failed by the test", duration: float = 0.0) -> Reply:
        """Make the handler of the next request raise."""
        return self._queue(Reply(error=text, duration=duration))

    def never_answer(self) -> Reply:
        """Receive the next request and never respond."""
        return self._queue(Reply(silent=True))

    def die(self, after: float = 0.0) -> Reply:
        """Die `after` this long [s], without a response to the next request."""
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
        except AssertionError as error:  # any other exception is the service's own behaviour
            self.note_raised(reply.function, error)
            raise


class _Turns:
    """The messages that a topic publishes one after another; its copies take the same ones.

    Attributes:
        endless: It is one message, again and again.
        given: What the test gave.
    """

    def __init__(self, topic: ScriptedTopic, messages: Any) -> None:
        self.given = messages
        self._make = topic.make_message
        self._taken: list[Any] = []
        self._rest: Iterator[Any] = iter(())
        self.endless = not isinstance(messages, Iterable) or isinstance(messages, (dict, str))
        if self.endless:
            self._taken.append(self._make(messages))
        elif isinstance(messages, Collection):  # a list: a wrong message is reported at once
            self._taken = [self._make(message) for message in messages]
        else:
            self._rest = iter(messages)

    def take(self, number: int) -> Any:
        """Return the message with this number, counted from 0; None: there are no more."""
        if self.endless:
            return self._taken[0]
        while len(self._taken) <= number:
            try:
                self._taken.append(self._make(next(self._rest)))
            except StopIteration:
                return None
        return self._taken[number]


class ScriptedTopic(ScriptedEnd):
    """Publishes on a topic and records its messages; made by the `topic` fixture.

    Args:
        kit: The test.
        name: The topic's name.
        type_class: Class of its messages.

    Attributes:
        received: All messages on the topic, including its own, in order.
    """

    def __init__(self, kit: Test, name: str, type_class: Any) -> None:
        self.received: list[Any] = []
        self._calls: list[Callable[[ScriptedTopic], object]] = []  # its script so far, for copies
        self._due: list[tuple[float, int]] = []  # when it will publish [s], and a message's number
        super().__init__(kit, name, type_class)

    def _start(self) -> None:
        self._subscriber = WatchingSubscriber(
            self.name, self._type_class, self.received.append, node=self.node
        )
        self._publishers: dict[bool, Publisher] = {}  # latched or not

    def publish(self, message: Any = None, *, latch: bool = False, **fields: Any) -> None:
        """Publish now.

        Args:
            message: A message or a dict of its fields; or pass the fields themselves.
            latch: Whether later subscribers get it, too.
            **fields: The fields of the message, instead of `message`.
        """
        made = self.make_message(message if message is not None else fields)
        self._calls.append(lambda topic: topic.publish(made, latch=latch))
        self._publisher(latch=latch).publish(made)

    def publish_at(
        self, at: float, message: Any = None, *, latch: bool = False, **fields: Any
    ) -> None:
        """Publish `at` this long from now [s]; other arguments as for `publish`.

        Raises:
            InvalidStateError: `at` is no number of seconds.
        """
        at = self._seconds("publish_at", "at", at)
        made = self.make_message(message if message is not None else fields)
        self._calls.append(lambda topic: topic.publish_at(at, made, latch=latch))
        self._due.append((self._clock.now() + at, 0))
        publisher = self._publisher(latch=latch)
        self._clock.call_later(at, lambda: publisher.publish(made))

    def publish_every(self, period: float, messages: Any, *, start: float = 0.0) -> None:
        """Publish messages `period` [s] apart, the first one `start` [s] from now.

        Args:
            period: See above; more than 0.
            messages: One message, or a dict of its fields, which is published again and again; or
                an iterable of them, from which each is taken when its time has come, so that it
                may have no end. An exception that it raises then fails the run.
            start: See above.

        Raises:
            InvalidStateError: one of the times is no duration, or `period` is 0.
            TypeError: `messages`, or one of them, is something else.
        """
        problems = Problems(f"{self.name}: publish_every")
        seconds = problems.seconds("period", period, optional=False)
        if seconds == 0:
            problems.add(f"period: got {period!r}; expected more than 0 s.")
        first = problems.seconds("start", start, optional=False)
        problems.raise_all()
        assert seconds is not None  # for the type checker, as the other one
        assert first is not None
        self._publish_in_turn(seconds, _Turns(self, messages), first)

    def _publish_in_turn(self, period: float, turns: _Turns, start: float) -> None:
        self._calls.append(lambda topic: topic._publish_in_turn(period, turns, start))  # noqa: SLF001
        publisher, begun = self._publisher(latch=False), self._clock.now() + start

        def schedule(number: int) -> None:
            message = turns.take(number)
            if message is None:
                return
            at = begun + number * period
            self._due = [due for due in self._due if due[0] > self._clock.now()]
            self._due.append((at, 0 if turns.endless else number))
            self._clock.call_later(at - self._clock.now(), lambda: publish(number, message))

        def publish(number: int, message: Any) -> None:
            publisher.publish(message)
            try:
                schedule(number + 1)
            except Exception as error:  # noqa: BLE001  the test's own code: it fails the run
                self.note_raised(turns.given, error)

        schedule(0)

    def lose(self, count: int = 1) -> None:
        """Lose the next messages that this end publishes."""
        self.disturb(DROPPED, count)

    def deliver_twice(self, count: int = 1) -> None:
        """Deliver the next messages twice."""
        self.disturb(TWICE, count)

    def delay(self, seconds: float, count: int = 1) -> None:
        """Deliver the next messages late by `seconds`; later messages may overtake them.

        Raises:
            InvalidStateError: it is no number of seconds.
        """
        self.disturb((self._seconds("delay", "seconds", seconds),), count)

    def _seconds(self, call: str, argument: str, given: float) -> float:
        problems = Problems(f"{self.name}: {call}")
        seconds = problems.seconds(argument, given, optional=False)
        problems.raise_all()
        return seconds or 0.0

    def copy_to(self, kit: Test) -> Self:
        """Make the same topic in another test, and repeat its script there."""
        made = super().copy_to(kit)
        for call in self._calls:
            call(made)
        return made

    def situation(self) -> Hashable:
        """Return the times until its scheduled messages [s]."""
        now = self._clock.now()
        return tuple((round(at - now, 6), number) for at, number in self._due if at > now)

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

    def make_message(self, value: Any) -> Any:
        """Return a message of the topic from one, or from a dict of its fields."""
        return as_message(self._type_class, value, f"{self.name}: message")
