"""`GoalKeeper`: the goals of one action server, between the network and the server's code.

Three objects belong to a goal at its server. `ServerGoal` is its record, about which `ServerGoals`
decides (`actionlib_core.goal.server`), `ServerGoalHandle` is the program's view of it, and
`GoalKeeper`, one per server, connects the decisions with the network and the clock, under one lock.

The lock is held neither while user code runs nor while messages are sent: both may block, or lead
back into the server.
"""

from __future__ import annotations

import contextlib
import logging
import math
import threading
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

from actionlib_core.action.goal_id_generator import GoalIDGenerator
from actionlib_core.action.server_goal_handle import ServerGoalHandle
from actionlib_core.action.status_publisher import StatusPublisher
from actionlib_core.clock import wall_time
from actionlib_core.exceptions import (
    ActionException,
    IllegalTransitionError,
    ServerConflictError,
    TransportError,
)
from actionlib_core.goal.bounded import Recent
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.server import Arrival, ServerGoal, ServerGoals
from actionlib_core.goal.states import TERMINAL, Status

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from actionlib_core.action._durable import GoalFile
    from actionlib_core.clock import Event, Timer
    from actionlib_core.goal.ports import ServerPort
    from actionlib_core.node import Node
    from actionlib_core.wire.action_types import ActionTypes

log = logging.getLogger(__name__)

DRAIN_S = 0.7  # longest wait of `stop` for acknowledgements; less when a whole node closes
FAREWELL_S = 0.1  # interval of its farewells meanwhile, as each of them may get lost
AHEAD_NS = 1_000_000_000  # a stamp later than this is reported: it comes from another clock
CLIENTS_S = 10.0  # after a restart all living clients are found by then: peers search every 8 s
REMEMBERED = 1024  # senders that were reported

TEXT_STOPPED = "The action server was stopped"
TEXT_CLIENT_LOST = "The client that sent this goal is gone"
TEXT_RESTARTED = "The action server was restarted while it ran this goal"

OnClientLost = Literal["continue", "cancel"]


def _past_entry(goal_id: str, status: Status) -> StatusEntry:
    """Return the status entry of a goal that is no longer tracked; LOST: it is unknown."""
    text = (
        "The action server does not know this goal"
        if status is Status.LOST
        else f"The goal ended {status.name}; its result is no longer kept"
    )
    return StatusEntry(goal_id, 0, status, text)


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
        self._wall_time = wall_time(node.clock)
        self._cancels_lost = on_client_lost == "cancel"
        self._deliver_goal = deliver_goal
        self._deliver_cancel = deliver_cancel
        self._on_stopped = on_stopped
        self._drained: Event | None = None  # set when all clients have answered; made by `stop`
        self._durable = durable
        self._file: GoalFile | None = None
        self._waiting: list[ServerGoalHandle] = []  # goals to resume when their clients are found
        self._looking: Timer | None = None  # it looks for the clients of restored goals
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
                # Older than all goals that come before `settle` delivers it, see `is_older_than`.
                kept.record.age, kept.record.made_at = math.inf, -math.inf
                self.goals.restore(kept.record, now)
                if kept.record.status not in TERMINAL:
                    handles.append(handle)
        return handles

    def settle(self, handles: list[ServerGoalHandle]) -> None:
        """Run or end the goals that an earlier server did not end.

        A goal that was never accepted is treated as new. One that was asked to stop is not run
        again. Clients that have died meanwhile are noticed `CLIENTS_S` later; a goal that ends with
        its client waits until that is found.
        """
        others: list[ServerGoalHandle] = []
        with self.lock:
            for handle in handles:
                waits = (
                    (self._cancels_lost or handle.record.cancel_if_lost)
                    and handle.record.client  # else nobody knows who has sent it
                    and not self._ends(handle)
                )
                (self._waiting if waits else others).append(handle)
        for handle in others:
            self._settle(handle)
        self._settle_waiting()
        if handles:
            self.status.on_change()
            clients = {handle.record.client for handle in handles}
            with self.lock:
                if not self.stopped:
                    look = partial(self._look_for_clients, clients)
                    self._looking = self._clock.call_later(CLIENTS_S, look)
        elif self._file is not None:
            self.status.expire_later()  # results that were kept once more

    def _ends(self, handle: ServerGoalHandle) -> bool:
        """Return whether a goal of an earlier server is not run again."""
        record = handle.record
        asked = record.status in {Status.PREEMPTING, Status.RECALLING} or record.superseded
        return asked or (handle.resumed and not self._resumes)

    def _settle(self, handle: ServerGoalHandle) -> None:
        record = handle.record
        with self.lock:
            status, ends = record.status, self._ends(handle)
            if not ends:
                record.status = Status.PENDING  # so that the server's code can accept it again
        if status is Status.RECALLING:
            self.step(handle, "cancel", "the restart of its server", None, TEXT_RESTARTED)
        elif ends:
            self.give_up(handle, TEXT_RESTARTED)
        else:
            self._deliver_goal(handle)

    def _settle_waiting(self) -> None:
        """Go on with those goals that wait for their clients and need not wait any more."""
        if not self._waiting:
            return
        with self.lock:
            there, waiting, self._waiting = self.port.clients(), self._waiting, []
            ready: list[ServerGoalHandle] = []
            for handle in waiting:
                goes_on = handle.record.client in there or self._ends(handle)
                (ready if goes_on else self._waiting).append(handle)
            if self.goals.closed:  # `stop` ends them
                return
        for handle in ready:
            self._settle(handle)

    def _look_for_clients(self, clients: set[str]) -> None:
        """Treat clients of restored goals that are not there as dead."""
        for client in clients - self.port.clients() - {""}:
            self.on_client_lost(client)

    def close_file(self) -> None:
        """Close the file, if there is one."""
        self._tidy_file()
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def _tidy_file_soon(self) -> None:
        """Remove from the file, in another thread, what the goals have forgotten."""
        if self.goals.forgotten:
            with contextlib.suppress(RuntimeError):  # no thread is left: the next call does it
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

    def note_superseded(self, record: ServerGoal) -> None:
        """Note that a running goal is asked to stop without a change of its status."""
        record.superseded = True
        self._keep(record)

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
        if not self.port.clients():
            return True
        with self.lock:
            return self.port.is_farewell_heard() and not self.goals.has_unacknowledged()

    def leave(self) -> None:
        """Withdraw from the network at once."""
        self.used()
        with self.lock:
            self.stopped = True
            self.status.close()
            looking = self._looking
        if looking is not None:
            looking.cancel()
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
        self._wall_time.check()
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

    def on_client(self) -> None:
        """Handle the appearance of a client."""
        self._settle_waiting()

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
        self._settle_waiting()
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
