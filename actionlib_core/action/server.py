"""`ActionServer`: any number of goals at once, each accepted, refused and ended by your code.

Three objects belong to a goal at its server. `ServerGoal` is its record, about which `ServerGoals`
decides (`actionlib_core.goal.server`), `ServerGoalHandle` is the program's view of it, and
`GoalKeeper`, one per server, connects the decisions with the network and the clock, under one lock.

The lock is held neither while user code runs nor while messages are sent: both may block, or lead
back into the server.
"""

from __future__ import annotations

import contextlib
import logging
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from actionlib_core.action._callbacks import CallbackQueue
from actionlib_core.action.goal_id_generator import GoalIDGenerator
from actionlib_core.clock import wall_time
from actionlib_core.exceptions import (
    ActionException,
    IllegalTransitionError,
    ServerConflictError,
    TransportError,
    text_of,
)
from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.server import (
    RESULT_TIMEOUT_S,
    Arrival,
    ServerGoal,
    ServerGoals,
)
from actionlib_core.goal.states import TERMINAL, Status
from actionlib_core.inputs.arguments import check_delay, check_function, check_seconds
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus
from actionlib_core.node import get_node
from actionlib_core.time import Time
from actionlib_core.wire.action_types import ActionTypes
from actionlib_core.wire.ports import make_server_port

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from actionlib_core.action._durable import GoalFile
    from actionlib_core.clock import Clock, Event, Timer
    from actionlib_core.goal.ports import ServerPort
    from actionlib_core.node import Node
    from actionlib_core.time import Duration

log = logging.getLogger(__name__)

DRAIN_S = 0.7  # longest wait of `stop` for acknowledgements; less when a whole node closes
FAREWELL_S = 0.1  # interval of its farewells meanwhile, as each of them may get lost

PERIOD_S = 1.0  # interval of the status lists while goals are listed
GAP_S = 0.02  # shortest interval of lists: changes within it share one
SHORT = 8  # goals; `hurry` sends only lists up to this length
AHEAD_NS = 1_000_000_000  # a stamp later than this is reported: it comes from another clock
REMEMBERED = 1024  # senders that were reported
GAP_PER_GOAL_S = 100e-6  # added to `GAP_S` per tracked goal: long lists are sent less often

TEXT_STOPPED = "The action server was stopped"
TEXT_CLIENT_LOST = "The client that sent this goal is gone"

TEXT_RESTARTED = "The action server was restarted while it ran this goal"

OnClientLost = Literal["continue", "cancel"]
OnRestart = Literal["abort", "resume"]


@dataclass(slots=True, weakref_slot=True, eq=False, repr=False)
class ServerGoalHandle:
    """One goal of an `ActionServer`. Two handles are equal when they belong to the same goal.

    ROS's attribute `status_tracker` is the handle itself, with a tracker's `goal`, `goal_id` and
    `status`.

    Attributes:
        keeper: The server's goals.
        record: The goal's status and result.
        content: The goal message (XGoal).
        begun: The goal callback has been called with it.
        cancel_waits: A cancel came before that.
        resumed: An earlier server, which was killed, had already accepted it.

    Threads: every method may be called from any thread and any callback.
    """

    keeper: GoalKeeper
    record: ServerGoal
    content: Any
    begun: bool = False
    cancel_waits: bool = False
    resumed: bool = False

    @property
    def goal(self) -> Any:
        """The XActionGoal message that brought the goal."""
        return self.keeper.types.action_goal(goal_id=self.goal_id, goal=self.content)

    @property
    def goal_id(self) -> GoalID:
        """Id and stamp, as a new message."""
        return GoalID(stamp=Time(0, self.record.stamp_ns), id=self.record.id)

    @property
    def status(self) -> GoalStatus:
        """The present status, as a new message."""
        record = self.record
        return GoalStatus(goal_id=self.goal_id, status=int(record.status), text=record.text)

    @property
    def status_tracker(self) -> ServerGoalHandle:
        """The handle itself."""
        return self

    def get_default_result(self) -> Any:
        """Return a new result message with default values."""
        return self.keeper.types.result()

    def set_accepted(self, text: str = "") -> None:
        """Accept the goal: PENDING becomes ACTIVE, RECALLING becomes PREEMPTING.

        Raises:
            IllegalTransitionError: the goal is in another state.
            ActionException: `text` is not a string.
        """
        self.keeper.step(self, "accept", "set_accepted()", text=text)

    def set_canceled(self, result: Any = None, text: str = "") -> None:
        """End a cancelled goal: RECALLED if it was never accepted, else PREEMPTED.

        Args:
            result: The result message; None sends one with default values.
            text: The reason, for people.

        Raises:
            IllegalTransitionError: the goal has ended.
            ActionException: `result` is not of the action's type, or `text` is not a string. The
                goal's status does not change.
        """
        self.keeper.step(self, "cancel", "set_canceled()", result, text)

    def set_rejected(self, result: Any = None, text: str = "") -> None:
        """Refuse a goal that is not accepted yet; arguments and errors as `set_canceled`."""
        self.keeper.step(self, "reject", "set_rejected()", result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the goal in failure; arguments and errors as `set_canceled`."""
        self.keeper.step(self, "abort", "set_aborted()", result, text)

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the goal in success; arguments and errors as `set_canceled`."""
        self.keeper.step(self, "succeed", "set_succeeded()", result, text)

    def set_cancel_requested(self) -> bool:
        """Mark the goal as asked to stop; False when it has ended or was asked before."""
        return self.keeper.request_cancel(self)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the goal's client.

        Raises:
            FieldError: `feedback` does not fit the action.
            TransportError: the server is stopped, or the session is closed.
        """
        self.keeper.send_feedback(self.record.entry(), feedback)

    def get_goal(self) -> Any:
        """Return the goal message (XGoal)."""
        return self.content

    def get_goal_id(self) -> GoalID:
        """Return the goal's id and stamp."""
        return self.goal_id

    def get_goal_status(self) -> GoalStatus:
        """Return a copy of the goal's status."""
        return self.status

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ServerGoalHandle):
            return NotImplemented
        return self.record.id == other.record.id

    def __hash__(self) -> int:
        return hash(self.record.id)

    def __repr__(self) -> str:
        return f"<ServerGoalHandle {self.record.id} {self.record.status.name}>"


def nop_cb(goal_handle: ServerGoalHandle) -> None:
    """Do nothing; the default callback."""


def _past_entry(goal_id: str, status: Status) -> StatusEntry:
    """Return the status entry of a goal that is no longer tracked; LOST: it is unknown."""
    text = (
        "The action server does not know this goal"
        if status is Status.LOST
        else f"The goal ended {status.name}; its result is no longer kept"
    )
    return StatusEntry(goal_id, 0, status, text)


class StatusPublisher:
    """Sends the status list and lets goals expire, with one timer that exists only while needed.

    The first change after a pause is sent at once; changes that follow within `GAP_S` share a list.

    Args:
        clock: The server's clock.
        lock: The server's lock, which guards `goals`.
        goals: The server's goals.
        port: The server's connection to the network; used without the lock.
        on_expired: Called without the lock after goals may have expired; returns at once.

    Threads: any; the timer's calls come on the clock's thread.
    """

    def __init__(
        self,
        clock: Clock,
        lock: threading.RLock,
        goals: ServerGoals,
        port: ServerPort,
        on_expired: Callable[[], object] = bool,
    ) -> None:
        self._clock = clock
        self._on_expired = on_expired
        self._lock = lock
        self._goals = goals
        self._port = port
        self._published = clock.now() - PERIOD_S  # when the last list was sent [s, clock]
        self._timer: Timer | None = None
        self._due = 0.0  # when the timer runs [s, clock]
        self._change_waits = False  # the timer is to send a list with a change
        self._closed = False

    def close(self) -> None:
        """Send nothing more."""
        with self._lock:
            self._closed = True
            if self._timer is not None:
                self._timer.cancel()

    def publish(self) -> None:
        """Send the list now."""
        with self._lock:
            if not self.claim(self._clock.now(), at_once=True):
                return
            listed = self._goals.list_statuses()
        self._send(listed)

    def on_change(self) -> None:
        """Send the list, now or soon, as a goal has changed."""
        # No lock is needed: a list that waits to be sent is made after this is reset, so it has the
        # change.
        if self._change_waits:
            return
        with self._lock:
            if not self.claim(self._clock.now()):
                return
            listed = self._goals.list_statuses()
        self._send(listed)

    def on_arrival(self) -> None:
        """Send the list within `GAP_S`, as a goal has come.

        Usually its code accepts it before that, which sends the list at once.
        """
        if self._change_waits:
            return
        with self._lock:
            if self._closed or self._change_waits:
                return
            self._change_waits = True
            due = self._clock.now() + GAP_S
            if self._timer is None or due < self._due:
                self._arm(due)

    def claim(self, now: float, *, at_once: bool = False) -> bool:
        """Prepare for a goal's change. The caller holds the lock until it has made the list.

        Returns:
            Whether the caller is to send the list: `at_once`, or because the last one is old
            enough. Otherwise the timer will send it, or nothing does as the server has stopped.
        """
        if self._closed:
            return False
        due = self._published + GAP_S + GAP_PER_GOAL_S * len(self._goals.tracked)
        if at_once or due <= now:
            self._change_waits = False
            self._published = now
            if self._timer is None or now + PERIOD_S < self._due:
                self._arm(now + PERIOD_S)
            return True
        if not self._change_waits:
            self._change_waits = True
            if self._timer is None or due < self._due:
                self._arm(due)
        return False

    def expire_later(self) -> None:
        """Let goals expire when it is time, without sending a list."""
        with self._lock:
            soonest = self._goals.expire(self._clock.now())
            if self._timer is None and soonest is not None:
                self._arm(soonest)

    def _send(self, listed: list[StatusEntry]) -> None:
        try:
            self._port.send_status(listed)
        except TransportError:
            if not self._goals.closed:  # else the server was stopped in the meantime
                raise

    def hurry(self) -> None:
        """Send a waiting change now, unless the list is long."""
        if self._change_waits and len(self._goals.tracked) <= SHORT:
            self.publish()

    def _arm(self, due: float) -> None:
        """Let the timer run at `due`. Needs the lock."""
        if self._timer is not None:
            self._timer.cancel()
        self._due = due
        self._timer = self._clock.call_later(due - self._clock.now(), self._on_timer)

    def _on_timer(self) -> None:
        with self._lock:
            self._timer = None
            if self._closed:
                return
            now = self._clock.now()
            soonest = self._goals.expire(now)
            due = self._change_waits
            if not due:
                repeated = self._published + PERIOD_S
                if now < repeated:  # a list was sent after the timer was set
                    self._arm(repeated)
                elif self._goals.listed():
                    due = True
                elif soonest is not None:  # an empty list is not repeated
                    self._arm(soonest)
        self._on_expired()
        if not due:
            return
        try:
            self.publish()
        except TransportError as error:  # the program has closed the session, not the server
            self.close()
            log.warning("%s Its status is no longer sent.", error)


class GoalKeeper:
    """The goals of one action server: it connects their rules, the network and the server's code.

    Args:
        node: The server's node, whose clock counts.
        name: The action's full name.
        types: Its message classes.
        port: The server's connection to the network.
        on_client_lost: See `ActionServer`, also for `result_timeout` [s].
        deliver_goal: Called with the handle of each new goal, on the network's thread.
        deliver_cancel: Called with the handle of each goal that is asked to stop, likewise.
        on_stopped: Called when the server has stopped by itself.
        durable: The file in which the goals are kept; None: only in memory.
        resumes: Goals that an earlier server had accepted are run again; else they are ABORTED.

    Attributes:
        lock: Guards the goals.
        error: Why the server has stopped by itself; None: it has not.
        stopped: The server has withdrawn from the network.
        left: Set after that.
        used: Notes that the program does not end before anybody has used the server.

    Threads: every method may be called from any thread.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        types: ActionTypes,
        port: ServerPort,
        *,
        on_client_lost: OnClientLost,
        result_timeout: float,
        deliver_goal: Callable[[ServerGoalHandle], object],
        deliver_cancel: Callable[[ServerGoalHandle], object],
        on_stopped: Callable[[], object],
        durable: str | Path | None = None,
        resumes: bool = False,
    ) -> None:
        self.node = node
        self.name = name
        self.types = types
        self.port = port
        self.lock = threading.RLock()
        self.error: ServerConflictError | None = None
        self.stopped = False
        self.used: Callable[[], object] = bool
        self.left: Event = node.clock.event(f"the end of action server {name}")
        self.goals = ServerGoals(name, result_timeout=result_timeout)
        self.status = StatusPublisher(node.clock, self.lock, self.goals, port, self._tidy_file_soon)
        self._clock = node.clock
        self._cancels_lost = on_client_lost == "cancel"
        self._deliver_goal = deliver_goal
        self._deliver_cancel = deliver_cancel
        self._on_stopped = on_stopped
        self._drained: Event | None = None  # set when all clients have answered; made by `stop`
        self._durable = durable
        self._file: GoalFile | None = None
        self._tidying = threading.Lock()  # held while a thread tidies the file
        self._resumes = resumes
        self._ahead = Recent(REMEMBERED)  # senders whose stamps are in the future

    # -- goals of an earlier server ------------------------------------------------------------

    def restore(self) -> list[ServerGoalHandle]:
        """Read the goals from the file; return those without an end, for `settle`.

        Raises:
            DurableGoalsError: it cannot be opened or read.
        """
        if self._durable is None:
            return []
        from actionlib_core.action._durable import GoalFile  # here: most servers need no SQLite

        self._file = GoalFile(self._durable, self.name, self.types)
        self.goals.forgotten = []
        goals, past = self._file.load()
        now = self._clock.now()
        handles = []
        with self.lock:
            for goal_id, status in past.items():
                self.goals.restore_past(goal_id, status, now)
            for kept in goals:
                handle = ServerGoalHandle(self, kept.record, kept.content)
                handle.resumed = kept.begun
                kept.record.tag = handle
                self.goals.restore(kept.record, now)
                if kept.record.status not in TERMINAL:
                    handles.append(handle)
        return handles

    def settle(self, handles: list[ServerGoalHandle]) -> None:
        """Run or end the goals that an earlier server did not end.

        A goal that was never accepted is treated as new. One that was asked to stop is not run
        again.
        """
        for handle in handles:
            record = handle.record
            if record.status is Status.RECALLING:
                self.step(handle, "cancel", "the restart of its server", None, TEXT_RESTARTED)
            elif record.status is Status.PREEMPTING or (handle.resumed and not self._resumes):
                self.give_up(handle, TEXT_RESTARTED)
            else:
                with self.lock:
                    record.status = Status.PENDING  # so that the server's code can accept it again
                self._deliver_goal(handle)
        if handles:
            self.status.on_change()
        elif self._file is not None:
            self.status.expire_later()  # results that were kept once more

    def close_file(self) -> None:
        """Close the file, if there is one."""
        self._tidy_file()
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def _tidy_file_soon(self) -> None:
        """Remove from the file, in another thread, what the goals have forgotten."""
        if self.goals.forgotten:
            self._clock.spawn(self._tidy_file, name=f"{self.name} file")

    def _tidy_file(self) -> None:
        with self._tidying:  # in the order in which it was forgotten
            with self.lock:
                forgotten = self.goals.forgotten
                if self._file is None or not forgotten:
                    return
                self.goals.forgotten = []
            self._file.forget(forgotten, self._clock.time_ns() / 1e9)

    def _keep(self, record: ServerGoal) -> None:
        """Write a goal's status to the file, which comes before any message about it."""
        file = self._file
        if file is not None:
            file.update(record, self._clock.time_ns() / 1e9)

    # -- calls of the server's code ------------------------------------------------------------

    def request_cancel(self, handle: ServerGoalHandle) -> bool:
        """Mark a goal as asked to stop; see `ServerGoalHandle.set_cancel_requested`."""
        with self.lock:
            changed = self.goals.request_cancel(handle.record)
        if changed:
            self._keep(handle.record)
            self.status.on_change()
        return changed

    def step(
        self,
        handle: ServerGoalHandle,
        event: str,
        call: str,
        result: Any = None,
        text: str = "",
        *,
        wait: bool = True,
    ) -> None:
        """Accept a goal or end it, and notify its client.

        Args:
            handle: The goal.
            event: "accept", or an event that ends it: see `server_life_cycle`.
            call: What the user called, for the error.
            result: The result of a goal that ends; None: one with default values.
            text: The reason, for people.
            wait: Whether to wait while a link is full; False on the network's thread.

        Raises:
            IllegalTransitionError: the goal's status does not allow it.
            ActionException: `result` is not of the action's type, or `text` is not a string.
            FieldError: a field of `result` has a wrong type.
        """
        # First everything that can fail: a goal that has ended must have a result.
        if not (isinstance(text, str) and text.isascii()):
            text = self._as_text(text, call)
        body = None
        if event != "accept":
            kind = self.types.result
            body = self.port.pack_result(
                kind() if result is None else self._checked(result, kind, call)
            )
        record = handle.record
        with self.lock:
            now = self._clock.now()
            listed_now = self.status.claim(now)
            try:
                entry = self.goals.step(record, event, call, now, text)
            except IllegalTransitionError:
                # `claim` may have taken over another change's list, which must still be sent.
                self.status.on_change()
                raise
            if body is not None:
                record.result = body
            listed = self.goals.list_statuses() if listed_now else None
            stopped = self.stopped
        if self._file is not None:
            self._keep(record)
        if stopped:
            return
        # The result is sent before the list: a client that reads of an end without having its
        # result queries the server for it.
        with self._unless_stopped():
            if body is not None:
                self.port.send_result(entry, body, wait=wait)
            elif self.port.send_accepted is not None:
                self.port.send_accepted(entry)
            if listed is not None:
                self.port.send_status(listed)

    @contextlib.contextmanager
    def _unless_stopped(self) -> Iterator[None]:
        """Send in the block; what cannot be sent because the server is being stopped is dropped.

        Its clients learn from `stop` how their goals have ended.

        Raises:
            TransportError: the session is closed, but not the server.
        """
        try:
            yield
        except TransportError:
            if not self.goals.closed:
                raise

    def give_up(self, handle: ServerGoalHandle, text: str) -> None:
        """Abort or reject a goal, if its code has not ended it."""
        status = handle.record.status
        if status not in TERMINAL:
            event = "abort" if status in {Status.ACTIVE, Status.PREEMPTING} else "reject"
            # Another thread may have ended it in the meantime.
            with contextlib.suppress(IllegalTransitionError):
                self.step(handle, event, "the end of its callback", None, text)

    def release(self, record: ServerGoal) -> None:
        """Abandon a goal that no code will end; its client learns that it is LOST."""
        with self.lock:
            self.goals.release(record, self._clock.now())
        self.status.on_change()

    def send_result(self, entry: StatusEntry, result: Any) -> None:
        """Send a result under any status; errors as `step`."""
        message = self._checked(result, self.types.result, "publish_result()")
        self.port.send_result(entry, self.port.pack_result(message))

    def send_feedback(self, entry: StatusEntry, feedback: Any) -> None:
        """Send feedback for a goal; errors as `step`."""
        message = self._checked(feedback, self.types.feedback, "publish_feedback()")
        self.port.send_feedback(entry, self.port.pack_feedback(message))

    def _checked(self, message: Any, expected: Any, call: str) -> Any:
        """Return `message` if it has the expected type; for None, one with default values."""
        if message is None:
            return expected()
        if not isinstance(message, expected):
            raise ActionException(
                f"action '{self.name}': {call}: got {message!r}; expected a message of type "
                f"{expected._type}."
            )
        return message

    def _as_text(self, text: Any, call: str) -> str:
        """Return a text that can be sent: characters that UTF-8 cannot encode are escaped."""
        if not isinstance(text, str):
            raise ActionException(
                f"action '{self.name}': {call}: text: got {text!r}; expected a string. "
                "Try str(...)."
            )
        return text if text.isascii() else text.encode("utf-8", "backslashreplace").decode()

    # -- the end -------------------------------------------------------------------------------

    def close_to_goals(self) -> None:
        """Take no more goals: those that come from now on are left to the next server."""
        with self.lock:
            self.goals.close()

    def stop(self) -> None:
        """End all goals, notify the clients, and withdraw; see `ActionServer.stop`.

        Blocks: until the clients have acknowledged that, `DRAIN_S` at most.
        """
        with self.lock:
            self.goals.close()
            running = [goal for goal in self.goals.listed() if goal.status not in TERMINAL]
        try:  # without the lock: sending a result blocks while a link is full
            for goal in running:
                if isinstance(goal.tag, ServerGoalHandle):
                    self.give_up(goal.tag, TEXT_STOPPED)
            self._say_farewell()
        finally:
            self.leave()

    def _say_farewell(self) -> None:
        """Send the list of all goals ever taken: clients send any other goal to the next server.

        Waits for the clients' acknowledgements, since the end of the server's token could overtake
        this list and the results.
        """
        with self.lock:
            drained = self._drained = self._clock.event("clients that take their results")
            taken = [
                _past_entry(goal_id, status) if goal is None else goal.entry()
                for goal_id, status, goal in self.goals.taken()
            ]
        until = self._clock.now() + self.node.time_to_leave(DRAIN_S)
        with contextlib.suppress(TransportError):  # the session is closed: nothing can be sent
            listened = self.port.begin_farewell()
            while listened:
                self.port.send_farewell(taken)
                left = until - self._clock.now()
                if self._is_drained() or left <= 0 or drained.wait(min(left, FAREWELL_S)):
                    return

    def _is_drained(self) -> bool:
        if not self.port.has_clients():
            return True
        with self.lock:
            return self.port.is_farewell_heard() and not self.goals.has_unacknowledged()

    def leave(self) -> None:
        """Withdraw from the network at once."""
        self.used()
        with self.lock:
            self.stopped = True
            self.status.close()
        try:
            self.port.close()
        finally:
            self.close_file()
            self.left.set()  # last: then the program may start the next server on the same file

    # -- messages (on the network's thread) ----------------------------------------------------

    def on_goal(
        self,
        goal_id: str,
        stamp_ns: int,
        content: Any,
        client: str,
        age: float = 0.0,
        *,
        cancel_if_lost: bool = False,
    ) -> bool:
        """Handle a goal: deliver a new one, answer a repetition with its status or result.

        Nothing here waits while a link is full: a client that misses the answer asks again.
        """
        if not goal_id:  # as in ROS: a goal of a program that only publishes messages
            ids = GoalIDGenerator(f"/{self.node.full_name}", clock=self._clock)
            goal_id, stamp_ns = ids.generate()
        self._check_clock(f"goal {goal_id}", stamp_ns, client)
        now = self._clock.now()
        record = ServerGoal(
            goal_id,
            stamp_ns or self._clock.time_ns(),
            client=client,
            made_at=now - age,
            age=age,
            cancel_if_lost=cancel_if_lost,
        )
        with self.lock:
            if self.stopped:
                return False
            arrival, known = self.goals.on_goal(record, now)
            if arrival is Arrival.LATE:
                return False
            self.used()
            # Under the lock, so that a cancel that follows at once finds the handle.
            handle = record.tag = ServerGoalHandle(self, record, content)
            if arrival is Arrival.RECALLED:
                record.result = self.port.pack_result(self.types.result())
            past = None if known is not None else self.goals.past_status(goal_id)
        unkept = None
        file = self._file
        # Before the goal is delivered: a goal that has started must not be lost by a restart.
        if file is not None and arrival in {Arrival.NEW, Arrival.RECALLED}:
            unkept = file.add(record, content)
        if arrival is Arrival.NEW:
            if unkept is not None:  # after a restart it could run twice: rather reject it
                log.error("goal %s on '%s' cannot be written: %s", goal_id, self.name, unkept)
                self.step(handle, "reject", "its file", None, unkept, wait=False)
                return True
            self._deliver_goal(handle)
            return True
        # A repetition, or a goal that was recalled: send what its client has missed.
        with self._unless_stopped():
            if known is None:
                self.port.send_status([_past_entry(goal_id, past or Status.LOST)])
            elif isinstance(known.result, bytes):
                self.port.send_result(known.entry(), known.result, wait=False)
        self.status.on_change()
        return False

    def on_cancel(self, goal_id: str, stamp_ns: int) -> list[StatusEntry]:
        """Handle a cancel; return the goals that it asks to stop."""
        self._check_clock("a cancel", stamp_ns, "a cancel")
        with self.lock:
            asked = self.goals.on_cancel(goal_id, stamp_ns, self._clock.now())
            entries = [goal.entry() for goal in asked]
        self._cancel(asked)
        return entries

    def _check_clock(self, what: str, stamp_ns: int, sender: str) -> None:
        """Warn, once for each sender, of a stamp in the future; see `AHEAD_NS`."""
        wall_time(self._clock).check()
        ahead_ns = stamp_ns - self._clock.time_ns()
        if ahead_ns <= AHEAD_NS or sender in self._ahead:
            return
        self._ahead.add(sender)
        log.warning(
            "action '%s': %s has a stamp %.1f s in the future: a clock was set, or the clocks of "
            "two computers differ. Which goal runs does not depend on that, but which goals "
            "cancel_goals_at_and_before_time() stops. Try setting all clocks by NTP.",
            self.name,
            what,
            ahead_ns / 1e9,
        )

    def on_client_lost(self, client: str) -> None:
        """Handle the death of a client."""
        with self.lock:
            asked = self.goals.on_client_lost(client, every=self._cancels_lost)
            for goal in asked:
                goal.text = TEXT_CLIENT_LOST
        if asked:
            self._cancel(asked)

    def _cancel(self, asked: list[ServerGoal]) -> None:
        for goal in asked:
            self._keep(goal)
            if isinstance(goal.tag, ServerGoalHandle):
                self._deliver_cancel(goal.tag)
        self.status.on_change()

    def on_acknowledged(self, goal_ids: list[str]) -> None:
        """Handle acknowledgements."""
        with self.lock:
            self.goals.on_acknowledged(goal_ids, self._clock.now())
            if self._drained is not None and self._is_drained():
                self._drained.set()
        self._tidy_file_soon()

    def on_conflict(self, error: ServerConflictError) -> None:
        """Stop, because an older server has the name."""
        with self.lock:
            if self.error is not None or self.stopped:  # several tokens may report the conflict
                return
            self.error = error
            self.goals.close()
        log.error("%s", error)
        self.leave()
        self._on_stopped()

    def list_goals(self) -> list[StatusEntry]:
        """Return the status list."""
        with self.lock:
            return self.goals.list_statuses()

    def find_end(self, goal_id: str) -> tuple[StatusEntry, bytes | None]:
        """Return the status of a goal, and its result if it has one."""
        with self.lock:
            goal = self.goals.find(goal_id)
            if goal is None:
                return _past_entry(goal_id, self.goals.past_status(goal_id) or Status.LOST), None
            return goal.entry(), goal.result if isinstance(goal.result, bytes) else None

    def find_goal(self, goal_id: str) -> tuple[int, Any] | None:
        """Return stamp [ns] and message of a goal; None when it is no longer tracked."""
        with self.lock:
            goal = self.goals.find(goal_id)
        if goal is None or not isinstance(goal.tag, ServerGoalHandle):
            return None
        return goal.stamp_ns, goal.tag.get_goal()


class ActionServer:
    """Offers an action; every goal is a `ServerGoalHandle` that your callbacks accept and end.

    For goals that run at the same time, or are accepted late; others: docs/howto/which_way.md.

    Args:
        ns: The action's name.
        ActionSpec: The action class (XAction).
        goal_cb: Called with the handle of each new goal, which it or later code accepts or rejects.
        cancel_cb: Called with the handle of each goal that is asked to stop.
        auto_start: Start at once. With False, call `start` when everything is ready.
        node: The server's node; None: the current node.
        on_client_lost: What happens to the goals of a client that died: "continue" as in ROS, or
            "cancel", as if the client had cancelled them.
        result_timeout: How long a result waits for a client that lost its link [s]; 0 or more.
        direct: The callbacks return at once and may be called on the network's thread.
        on_stopped: Called when the server has stopped by itself; must return at once too.
        durable: A file in which goals and results survive the end of the process; servers may share
            one. None: they are in memory only.
        on_restart: With `durable`, what happens to a goal that was accepted when the process was
            killed: "abort" ends it ABORTED, with the reason; "resume" calls `goal_cb` again, with a
            handle that is `resumed`. A goal that was not yet accepted is always treated as new.

    Attributes:
        lock: Guards the server's data. While it is held, no goal changes; do not block with it.
        keeper: The server's goals.

    Raises:
        ActionException: `ActionSpec` is not an action class.
        ActionlibError: a callback is not a function, or `result_timeout` is not a duration.
        InvalidNameError: the name breaks the ROS rules.
        DurableGoalsError: the file cannot be used (from `start`).
        ServerConflictError: the name has a server already (from `start`).
        TransportError: the network session is closed.

    Threads: callbacks run one at a time, in order, on a thread of their own, without any lock. A
        cancel callback waits 20 ms at most for other callbacks to return, then it runs beside them,
        in another thread; it never starts before the goal callback of its goal.
    """

    def __init__(
        self,
        ns: str,
        ActionSpec: Any,  # noqa: N803  actionlib's name
        goal_cb: Callable[[ServerGoalHandle], object] = nop_cb,
        cancel_cb: Callable[[ServerGoalHandle], object] = nop_cb,
        auto_start: bool = True,
        *,
        node: Node | None = None,
        on_client_lost: OnClientLost = "continue",
        result_timeout: float | Duration = RESULT_TIMEOUT_S,
        direct: bool = False,
        on_stopped: Callable[[], object] | None = None,
        durable: str | Path | None = None,
        on_restart: OnRestart = "abort",
    ) -> None:
        if on_restart not in {"abort", "resume"}:
            raise ActionException(
                f"action {ns!r}: on_restart: got {on_restart!r}; expected 'abort' or 'resume'."
            )
        if on_client_lost not in {"continue", "cancel"}:
            raise ActionException(
                f"action {ns!r}: on_client_lost: got {on_client_lost!r}; "
                "expected 'continue' or 'cancel'."
            )
        check_function(f"action {ns!r}", "goal_cb", goal_cb)
        check_function(f"action {ns!r}", "cancel_cb", cancel_cb)
        keep = check_seconds(f"action {ns!r}", "result_timeout", result_timeout)
        self.node = node if node is not None else get_node()
        self.types = ActionTypes.of(ActionSpec)
        self.ns = self.node.resolve(ns, "action name")
        self.goal_callback = goal_cb
        self.cancel_callback = cancel_cb
        self.callback_queue = CallbackQueue(self.node, f"{self.ns} callbacks")
        self.keeper = GoalKeeper(
            self.node,
            self.ns,
            self.types,
            make_server_port(self.node, self.ns, self.types),
            on_client_lost=on_client_lost,
            result_timeout=keep,
            deliver_goal=goal_cb if direct else self._deliver_goal,
            deliver_cancel=cancel_cb if direct else self._deliver_cancel,
            on_stopped=self._note_stopped,
            durable=durable,
            resumes=on_restart == "resume",
        )
        self._on_stopped = on_stopped
        self.lock = self.keeper.lock
        self._forget: Callable[[], None] | None = None
        self._started = False
        if auto_start:
            self.start()

    def start(self) -> None:
        """Offer the action; a second call does nothing.

        Raises:
            ServerConflictError: the name has a server already.
            TransportError: the network session is closed.
            ActionException: the server was stopped.

        Blocks: until the network has listed the servers of the name, 1 s at most.
        """
        with self.lock:
            if self.keeper.stopped:
                raise ActionException(
                    f"action '{self.ns}': start(): the server was stopped; expected one that was "
                    "not. Try making a new one."
                )
            if self._started:
                return
            self._started = True
        # Without the lock, as opening waits for the network.
        self._forget = self.node.on_close(self.stop)  # raises when the node is closed
        self.keeper.used = self.node.offer(f"action server '/{self.ns}'")
        try:
            self.initialize()
        except BaseException:
            self._forget()
            self._started = False
            raise

    def initialize(self) -> None:
        """Declare the action's keys; `start` does it."""
        try:
            kept = self.keeper.restore()
            self.keeper.port.open(self.keeper)
        except BaseException:
            self.keeper.close_file()
            raise
        self.keeper.settle(kept)  # after `open`, without which clients would not get its messages

    def stop(self) -> None:
        """End all goals (ABORTED, or REJECTED when not yet accepted) and withdraw.

        Clients receive the result of each goal, then the server's absence; goals that came too late
        are sent to the next server. A second call does nothing, nor does one before `start`. A
        stopped server cannot be started again.

        Blocks: until the clients have acknowledged that, 0.7 s at most.
        """
        with self.lock:
            if self.keeper.stopped or not self._started:
                return
        try:
            self.keeper.stop()
        finally:
            if self._forget is not None:
                self._forget()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the server has stopped; for programs that do nothing else.

        Returns:
            Whether it has stopped.

        Raises:
            ServerConflictError: it stopped because an older server has the name.

        Blocks: until then, `timeout` [s] at most; None: no limit.
        """
        self.keeper.used()
        left = self.keeper.left.wait(check_delay(f"action '{self.ns}'", "timeout", timeout))
        if self.error is not None:
            raise self.error
        return left

    @property
    def error(self) -> ServerConflictError | None:
        """Why the server has stopped by itself; None: it has not."""
        return self.keeper.error

    @property
    def stopped(self) -> bool:
        """Whether the server has withdrawn from the network."""
        return self.keeper.stopped

    @property
    def ActionSpec(self) -> Any:  # noqa: N802  actionlib's names
        """The action class."""
        return self.types.action

    @property
    def ActionGoal(self) -> Any:  # noqa: N802
        """The class XActionGoal."""
        return self.types.action_goal

    @property
    def ActionResult(self) -> Any:  # noqa: N802
        """The class XActionResult."""
        return self.types.action_result

    @property
    def ActionResultType(self) -> Any:  # noqa: N802
        """The class XResult."""
        return self.types.result

    @property
    def ActionFeedback(self) -> Any:  # noqa: N802
        """The class XActionFeedback."""
        return self.types.action_feedback

    @property
    def status_list(self) -> list[ServerGoalHandle]:
        """The goals in the present status list."""
        with self.lock:
            tags = [goal.tag for goal in self.keeper.goals.listed()]
        return [tag for tag in tags if isinstance(tag, ServerGoalHandle)]

    def register_goal_callback(self, cb: Callable[[ServerGoalHandle], object] | None) -> None:
        """Replace the goal callback; None removes it."""
        check_function(f"action '{self.ns}'", "cb", cb)
        self.goal_callback = cb if cb is not None else nop_cb

    def register_cancel_callback(
        self, cancel_cb: Callable[[ServerGoalHandle], object] | None
    ) -> None:
        """Replace the cancel callback; None removes it."""
        check_function(f"action '{self.ns}'", "cancel_cb", cancel_cb)
        self.cancel_callback = cancel_cb if cancel_cb is not None else nop_cb

    def publish_result(self, status: GoalStatus, result: Any) -> None:
        """Send a result under any status. Usually a handle does this.

        Raises:
            FieldError: `result` does not fit the action.
        """
        self.keeper.send_result(_entry_of(status), result)

    def publish_feedback(self, status: GoalStatus, feedback: Any) -> None:
        """Send feedback for the goal in `status`.

        Raises:
            FieldError: `feedback` does not fit the action.
        """
        self.keeper.send_feedback(_entry_of(status), feedback)

    def publish_status(self) -> None:
        """Send the list of all goals now."""
        self.keeper.status.publish()

    def publish_status_async(self, event: object = None) -> None:  # noqa: ARG002  actionlib's
        """Send the list of all goals; the form that ROS timers call."""
        self.publish_status()

    # -- callbacks -----------------------------------------------------------------------------

    def _note_stopped(self) -> None:
        """Unregister from the node and notify the owner: the server has stopped by itself."""
        if self._forget is not None:
            self._forget()
        if self._on_stopped is not None:
            self._on_stopped()

    def _deliver_goal(self, handle: ServerGoalHandle) -> None:
        self.callback_queue.call(self._run_goal_callback, handle)
        self.keeper.status.on_arrival()

    def _run_goal_callback(self, handle: ServerGoalHandle) -> None:
        """Call the goal callback; if it raises, end the goal, which would otherwise stay."""
        # Under the lock: a cancel came before this and waits, or will be delivered on its own.
        with self.lock:
            handle.begun = True
            cancelled = handle.cancel_waits
        if cancelled:
            self.callback_queue.call_urgently(self._run_cancel_callback, handle)
        try:
            self.goal_callback(handle)
        except BaseException as error:  # also `sys.exit`, which ends this thread
            text = text_of(error, str if isinstance(error, Exception) else repr)
            self.keeper.give_up(handle, f"Exception in goal callback: {text}")
            raise

    def _deliver_cancel(self, handle: ServerGoalHandle) -> None:
        """Queue the cancel callback, at once or when the goal callback starts."""
        with self.lock:
            if not handle.begun:
                handle.cancel_waits = True
                return
        self.callback_queue.call_urgently(self._run_cancel_callback, handle)

    def _run_cancel_callback(self, handle: ServerGoalHandle) -> None:
        """Call the cancel callback, unless the goal has ended in the meantime."""
        if handle.record.status not in TERMINAL:
            self.cancel_callback(handle)


def _entry_of(status: GoalStatus) -> StatusEntry:
    """Return a status message as an entry of the status list."""
    goal_id = status.goal_id
    return StatusEntry(goal_id.id, goal_id.stamp.to_nsec(), status.status, status.text)
