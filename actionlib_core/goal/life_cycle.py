"""The two life cycles of a goal as tables: the server's and the client's.

Each table is written once, as rows. `transitions` builds a machine from the rows, which checks the
names of states and rejects what could not be reached; the machine is drawn in the documentation and
compiled to a dict, which is what runs.

Source:
    The state diagrams of http://wiki.ros.org/actionlib/DetailedDescription; where a status arrives
    that skips states, the states it passes on the way are those of the ROS 1 client.
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
        event: What happens.
        sources: In which states it may happen.
        path: The states that follow; the last one stays. Empty: the event changes nothing.
    """

    event: str
    sources: tuple[S, ...]
    path: tuple[S, ...]


@dataclass(frozen=True)
class LifeCycle(Generic[S]):
    """A table, compiled.

    Attributes:
        name: "server" or "client".
        initial: Where a goal begins.
        rows: The table as it was written.
        steps: (state, event) -> the states that follow.
    """

    name: str
    initial: S
    rows: tuple[Row[S], ...]
    steps: Mapping[tuple[S, str], tuple[S, ...]]

    def allowed_from(self, event: str) -> list[S]:
        """Return the states in which `event` may happen."""
        return [state for state, name in self.steps if name == event]

    def step(self, state: S, event: str, *, goal: str, call: str) -> tuple[S, ...]:
        """Return the states that follow `state` on `event`; () when it changes nothing.

        Args:
            state: The present state.
            event: What happens.
            goal: Names the goal in the error, for example "goal 7f3a on 'arm/move'".
            call: Names what the user did, for example "set_succeeded()".

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
    """Let `transitions` check the rows, and turn its machine into a dict."""
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
            if len(choices) != 1:
                raise ValueError(
                    f"{name}: {source} on {event.name}: got {len(choices)} rows; expected 1"
                )
            steps[kind[source], event.name] = paths[source, event.name]
    _check_reachable(name, initial, steps)
    return LifeCycle(name, initial, rows, steps)


def _check_reachable(name: str, initial: S, steps: Mapping[tuple[S, str], tuple[S, ...]]) -> None:
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
    """What statuses do to a goal the server has not begun."""
    c = CommState
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
    """What statuses do to a goal that runs, or whose result is awaited."""
    c = CommState
    yield Row("ACTIVE", (c.ACTIVE, c.PREEMPTING, c.WAITING_FOR_RESULT, c.DONE), ())
    yield Row("PREEMPTING", (c.ACTIVE,), (c.PREEMPTING,))
    yield Row("PREEMPTING", (c.PREEMPTING,), ())
    yield Row("PREEMPTED", (c.ACTIVE,), (c.PREEMPTING, c.WAITING_FOR_RESULT))
    yield Row("PREEMPTED", (c.PREEMPTING,), (c.WAITING_FOR_RESULT,))
    for event in ("SUCCEEDED", "ABORTED"):
        yield Row(event, (c.ACTIVE, c.PREEMPTING), (c.WAITING_FOR_RESULT,))
    for event in ("REJECTED", "RECALLED", "PREEMPTED", "SUCCEEDED", "ABORTED"):
        yield Row(event, (c.WAITING_FOR_RESULT, c.DONE), ())


def _cancelling_rows() -> Iterator[Row[CommState]]:
    """What statuses do to a goal that was cancelled before it began."""
    c = CommState
    asked, recalling, result = c.WAITING_FOR_CANCEL_ACK, c.RECALLING, c.WAITING_FOR_RESULT
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
    yield Row(
        "cancel", (c.WAITING_FOR_CANCEL_ACK, c.RECALLING, c.PREEMPTING, c.WAITING_FOR_RESULT), ()
    )
    yield Row("cancel", (c.DONE, c.LOST), ())
    yield Row("result", (c.WAITING_FOR_RESULT,), (c.DONE,))
    yield Row("lose", live, (c.LOST,))


@cache
def server_life_cycle() -> LifeCycle[Status]:
    """Return the server's table: what may be done to a goal in which status.

    Events: accept, request_cancel, cancel, reject, abort, succeed.
    """
    return _compile("server", Status.PENDING, _server_rows())


@cache
def client_life_cycle() -> LifeCycle[CommState]:
    """Return the client's table: what a status, a result or a cancel does to a goal.

    Events: the names of `Status` (one arrived from the server), cancel, result, lose. A status that
    is missing in a row cannot follow that state: when one arrives, it was overtaken on the way.
    """
    return _compile("client", CommState.WAITING_FOR_GOAL_ACK, _client_rows())
