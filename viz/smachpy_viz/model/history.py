"""The history of a run, for pictures, the terminal and tables: a view of a `RunState`.

It keeps counts and the newest values, never the events, so its size depends on the machine and not
on the length of the run.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from smachpy.events import EVENT_KINDS, EVENT_TYPES, Event
from smachpy.events.run_state import RunState
from smachpy_viz.model.machine import Marks

if TYPE_CHECKING:
    from collections.abc import Iterator

_EVENT_TYPES = frozenset(EVENT_TYPES)


@dataclass(slots=True)
class RunningGoal:
    """A goal that is running.

    Attributes:
        since: When it was sent, on the machine's clock [s].
        feedback: The newest feedback, as the server sent it.
        first_feedback: The first feedback; progress is measured from it.
    """

    path: str
    action: str
    goal_id: str
    since: float
    goal: Any
    feedback: Any = None
    first_feedback: Any = None


@dataclass(slots=True)
class Visits:
    """The visits of one state.

    Attributes:
        count: Number of visits.
        since: When it was entered; None while it is not active [s].
        seconds: Total duration of the finished visits [s].
        outcome: Outcome of the last finished visit; None before.
        outcomes: How often each outcome ended a visit.
    """

    count: int = 0
    since: float | None = None
    seconds: float = 0.0
    outcome: str | None = None
    outcomes: dict[str, int] = field(default_factory=dict)


class History:
    """A listener that keeps what a picture or a table of the run needs.

    Pass `on_event` to `machine.subscribe`.

    Threads: `on_event` may be called from any thread; it takes microseconds and waits only for
    another call of it.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._state = RunState()
        self._seconds: float | None = None

    def on_event(self, event: Event) -> None:
        """Process one event."""
        if type(event) in _EVENT_TYPES:
            fields = dict(zip(event._fields, event, strict=True))
            self.on_record({**fields, "kind": type(event).__name__})

    def on_record(self, record: dict[str, Any]) -> None:
        """Process one record of a recording; kinds of a newer version are ignored."""
        if record["kind"] not in EVENT_KINDS:
            return
        # The machine's clock instead of the event's date: a computer whose date is set changes no
        # duration. After a recovery, what the earlier process did is not on this clock: a Recovered
        # event counts as a start.
        kind = "Started" if record["kind"] == "Recovered" else record["kind"]
        record = {**record, "kind": kind, "stamp_ns": round(record["t"] * 1e9)}
        with self._lock:
            self._state.fold(record)
            if kind == "Finished" and self._state.data["started"] is not None:
                self._seconds = (record["stamp_ns"] - self._state.data["started"]) / 1e9

    def marks(self) -> Marks:
        """Return the marks for a picture."""
        visits = self.visits()
        return Marks(
            active=frozenset(p for p, v in visits.items() if v.since is not None),
            visits={path: v.count for path, v in visits.items()},
            last={p: v.outcome for p, v in visits.items() if v.outcome is not None},
            taken={(path, o): n for path, v in visits.items() for o, n in v.outcomes.items()},
        )

    def visits(self) -> dict[str, Visits]:
        """Return a copy of all visits by path, in the order of the first visit."""
        with self._lock:
            return {
                path: Visits(
                    max(state["visits"], 1),  # at least one, even if only its end was received
                    _seconds(state["since"]),
                    state["seconds"],
                    state["outcome"],
                    dict(state["outcomes"]),
                )
                for path, state in self._state.data["states"].items()
                if state["visits"] or state["outcomes"]
            }

    def goals(self) -> list[RunningGoal]:
        """Return a copy of the running goals, oldest first."""
        with self._lock:
            return list(self._running_goals())

    def goal(self, goal_id: str) -> RunningGoal | None:
        """Return a copy of a running goal; None if it is not running."""
        return next((goal for goal in self.goals() if goal.goal_id == goal_id), None)

    def written(self, most: int) -> list[tuple[str, Any]]:
        """Return the most recently written userdata keys and values, newest first."""
        with self._lock:
            entries = list(self._state.data["userdata"].values())
        newest: dict[str, Any] = {}
        for entry in reversed(entries):
            newest.setdefault(entry["key"], entry["value"])
        return list(newest.items())[:most]

    def active(self) -> dict[str, float]:
        """Return when each running state was entered [s], by path."""
        return {p: v.since for p, v in self.visits().items() if v.since is not None}

    def since(self, path: str) -> float | None:
        """Return when the state was entered [s]; None while it is not active."""
        with self._lock:
            state = self._state.data["states"].get(path)
            return None if state is None else _seconds(state["since"])

    @property
    def started(self) -> float | None:
        """When the newest run began, on the machine's clock [s]."""
        return _seconds(self._state.data["started"])

    @property
    def seconds(self) -> float | None:
        """How long the newest finished run took [s]."""
        return self._seconds

    def _running_goals(self) -> Iterator[RunningGoal]:
        """Yield the goals without an end whose state is still in the same visit.

        A goal whose state has ended, or was entered again since, is over even if its own end was
        not reported.
        """
        states = self._state.data["states"]
        for goal_id, goal in self._state.data["goals"].items():
            state = states[goal["path"]]
            visited, since = state["visits"] or state["outcomes"], state["since"]
            outlived = visited if since is None else goal["since"] < since
            if goal["ended"] is None and not outlived:
                yield RunningGoal(
                    goal["path"],
                    goal["action"],
                    goal_id,
                    goal["since"] / 1e9,
                    goal["goal"],
                    goal["feedback"],
                    goal["first_feedback"],
                )


def _seconds(stamp_ns: int | None) -> float | None:
    return None if stamp_ns is None else stamp_ns / 1e9
