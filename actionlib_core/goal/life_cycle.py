"""The two life cycles of a goal as tables: the server's and the client's.

Each table is written once, as rows. `transitions` builds a machine from the rows and checks the
names of the states; states that cannot be reached are an error. The rows are also drawn in the
documentation. At run time only a dict made from them is used, because a lookup costs far less than
an event of `transitions`.

Source:
    The state diagrams of http://wiki.ros.org/actionlib/DetailedDescription. When a status skips
    states, the states passed in between are those of the ROS 1 client.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Generic, TypeVar

from transitions import Machine

from actionlib_core.exceptions import IllegalTransitionError
from actionlib_core.goal.states import CommState, Status

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from enum import IntEnum

S = TypeVar("S", bound="IntEnum")


@dataclass(frozen=True)
class Row(Generic[S]):
    """One line of a table.

    Attributes:
        event: The event's name.
        sources: The states in which it may happen.
        path: The states that it passes through; the last one is the new state. Empty: the event
            is allowed and changes nothing.
    """

    event: str
    sources: tuple[S, ...]
    path: tuple[S, ...]


@dataclass(frozen=True)
class LifeCycle(Generic[S]):
    """A table, compiled.

    Attributes:
        name: "server" or "client".
        initial: The state of a new goal.
        rows: The table as written above.
        steps: (state, event) -> path, as in `Row`.
    """

    name: str
    initial: S
    rows: tuple[Row[S], ...]
    steps: Mapping[tuple[S, str], tuple[S, ...]]

    def allowed_from(self, event: str) -> list[S]:
        """Return the states in which `event` may happen."""
        return [state for state, name in self.steps if name == event]

    def step(self, state: S, event: str, *, goal: str, call: str) -> tuple[S, ...]:
        """Return the path from `state` on `event`; () when the event changes nothing.

        Args:
            state: The present state.
            event: The event's name.
            goal: The goal, for the error: "goal 7f3a on 'arm/move'".
            call: What the user called, for the error: "set_succeeded()".

        Raises:
            IllegalTransitionError: `event` may not happen in `state`.
        """
        path = self.steps.get((state, event))
        if path is None:
            raise IllegalTransitionError(
                goal,
                state.name,
                self._target(event),
                call,
                [s.name for s in self.allowed_from(event)],
            )
        return path

    def _target(self, event: str) -> str:
        targets = {row.path[-1].name for row in self.rows if row.event == event and row.path}
        return " or ".join(sorted(targets)) or event


def _compile(name: str, initial: S, rows: Iterable[Row[S]]) -> LifeCycle[S]:
    """Check the rows with `transitions`, and turn its machine into a dict."""
    rows = tuple(rows)
    machine = Machine(
        model=None,
        states=[state.name for state in type(initial)],
        initial=initial.name,
        auto_transitions=False,
        transitions=[
            [row.event, source.name, row.path[-1].name if row.path else None]
            for row in rows
            for source in row.sources
        ],
    )
    paths = {(source.name, row.event): row.path for row in rows for source in row.sources}
    kind = type(initial)
    steps: dict[tuple[S, str], tuple[S, ...]] = {}
    for event in machine.events.values():
        for source, choices in event.transitions.items():
            # `transitions` allows several rows for one event, tried in order (it has conditions).
            if len(choices) != 1:
                raise ValueError(
                    f"{name}: {source} on {event.name}: got {len(choices)} rows; expected 1"
                )
            steps[kind[source], event.name] = paths[source, event.name]
    _check_reachable(name, initial, steps)
    return LifeCycle(name, initial, rows, steps)


def _check_reachable(name: str, initial: S, steps: Mapping[tuple[S, str], tuple[S, ...]]) -> None:
    # A path's inner states count as reached too: clients show them, and events may follow them.
    reached, found = {initial}, True
    while found:
        found = False
        for (source, _), path in steps.items():
            if source in reached and not reached.issuperset(path):
                reached.update(path)
                found = True
    left = {source for source, _ in steps} - reached
    if left:
        raise ValueError(f"{name}: can never be reached: {sorted(s.name for s in left)}")


def _server_rows() -> Iterator[Row[Status]]:
    s = Status
    yield Row("accept", (s.PENDING,), (s.ACTIVE,))
    yield Row("accept", (s.RECALLING,), (s.PREEMPTING,))
    yield Row("request_cancel", (s.PENDING,), (s.RECALLING,))
    yield Row("request_cancel", (s.ACTIVE,), (s.PREEMPTING,))
    yield Row("cancel", (s.PENDING, s.RECALLING), (s.RECALLED,))
    yield Row("cancel", (s.ACTIVE, s.PREEMPTING), (s.PREEMPTED,))
    yield Row("reject", (s.PENDING, s.RECALLING), (s.REJECTED,))
    yield Row("abort", (s.ACTIVE, s.PREEMPTING), (s.ABORTED,))
    yield Row("succeed", (s.ACTIVE, s.PREEMPTING), (s.SUCCEEDED,))


def _waiting_rows() -> Iterator[Row[CommState]]:
    """Yield the effect of each status on a goal that, as far as known, has not started."""
    c = CommState
    # Status lists are sent once a second at least, and may be lost: a client often sees only some
    # of the statuses. A path fills in the missing ones, so that callbacks see each state in order.
    ack, pending, result = c.WAITING_FOR_GOAL_ACK, c.PENDING, c.WAITING_FOR_RESULT
    yield Row("PENDING", (ack,), (pending,))
    yield Row("PENDING", (pending,), ())
    yield Row("ACTIVE", (ack, pending), (c.ACTIVE,))
    yield Row("REJECTED", (ack,), (pending, result))
    yield Row("REJECTED", (pending,), (result,))
    yield Row("RECALLING", (ack,), (pending, c.RECALLING))
    yield Row("RECALLING", (pending,), (c.RECALLING,))
    yield Row("RECALLED", (ack,), (pending, result))
    yield Row("RECALLED", (pending,), (c.RECALLING, result))
    yield Row("PREEMPTED", (ack, pending), (c.ACTIVE, c.PREEMPTING, result))
    yield Row("SUCCEEDED", (ack, pending), (c.ACTIVE, result))
    yield Row("ABORTED", (ack, pending), (c.ACTIVE, result))
    yield Row("PREEMPTING", (ack, pending), (c.ACTIVE, c.PREEMPTING))


def _running_rows() -> Iterator[Row[CommState]]:
    """Yield the effect of each status on a goal that runs, or whose result is awaited."""
    c = CommState
    # An older ACTIVE may arrive after a newer status: servers send their lists without a lock.
    yield Row("ACTIVE", (c.ACTIVE, c.PREEMPTING, c.WAITING_FOR_RESULT, c.DONE), ())
    yield Row("PREEMPTING", (c.ACTIVE,), (c.PREEMPTING,))
    yield Row("PREEMPTING", (c.PREEMPTING,), ())
    yield Row("PREEMPTED", (c.ACTIVE,), (c.PREEMPTING, c.WAITING_FOR_RESULT))
    yield Row("PREEMPTED", (c.PREEMPTING,), (c.WAITING_FOR_RESULT,))
    for event in ("SUCCEEDED", "ABORTED"):
        yield Row(event, (c.ACTIVE, c.PREEMPTING), (c.WAITING_FOR_RESULT,))
    # The server lists a goal for some seconds after its end, so final statuses come repeatedly.
    for event in ("REJECTED", "RECALLED", "PREEMPTED", "SUCCEEDED", "ABORTED"):
        yield Row(event, (c.WAITING_FOR_RESULT, c.DONE), ())


def _cancelling_rows() -> Iterator[Row[CommState]]:
    """Yield the effect of each status on a goal whose cancel has been sent."""
    c = CommState
    asked, recalling, result = c.WAITING_FOR_CANCEL_ACK, c.RECALLING, c.WAITING_FOR_RESULT
    # PENDING and ACTIVE were sent before the server received the cancel: they change nothing.
    yield Row("PENDING", (asked, recalling), ())
    yield Row("ACTIVE", (asked, recalling), ())
    yield Row("REJECTED", (asked, recalling), (result,))
    yield Row("RECALLING", (asked,), (recalling,))
    yield Row("RECALLING", (recalling,), ())
    yield Row("RECALLED", (asked,), (recalling, result))
    yield Row("RECALLED", (recalling,), (result,))
    for event in ("PREEMPTED", "SUCCEEDED", "ABORTED"):
        yield Row(event, (asked, recalling), (c.PREEMPTING, result))
    yield Row("PREEMPTING", (asked, recalling), (c.PREEMPTING,))


def _client_rows() -> Iterator[Row[CommState]]:
    c = CommState
    yield from _waiting_rows()
    yield from _running_rows()
    yield from _cancelling_rows()
    live = tuple(state for state in c if state not in {c.DONE, c.LOST})
    yield Row("cancel", (c.WAITING_FOR_GOAL_ACK, c.PENDING, c.ACTIVE), (c.WAITING_FOR_CANCEL_ACK,))
    # No error in the other states: the goal may end while the program is calling `cancel`.
    yield Row(
        "cancel", (c.WAITING_FOR_CANCEL_ACK, c.RECALLING, c.PREEMPTING, c.WAITING_FOR_RESULT), ()
    )
    yield Row("cancel", (c.DONE, c.LOST), ())
    yield Row("result", (c.WAITING_FOR_RESULT,), (c.DONE,))
    yield Row("lose", live, (c.LOST,))


@cache
def server_life_cycle() -> LifeCycle[Status]:
    """Return the server's table: which events a goal's status allows.

    Events: accept, request_cancel, cancel, reject, abort, succeed.
    """
    return _compile("server", Status.PENDING, _server_rows())


@cache
def client_life_cycle() -> LifeCycle[CommState]:
    """Return the client's table: the effect of a status, a result and a cancel on a goal.

    Events: the names of `Status` (the server has sent that status), cancel, result, lose. A status
    without a row for the present state is out of date: newer messages have overtaken it.
    """
    return _compile("client", CommState.WAITING_FOR_GOAL_ACK, _client_rows())
