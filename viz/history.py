"""What a run did, folded from its events: for pictures, the terminal and tables.

The fold keeps counts and the newest facts, never the events, so a mission that runs for a month
needs no more memory than one that runs for a minute.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from smachpy import events as ev
from viz.model import Marks

if TYPE_CHECKING:
    from collections.abc import Callable

RAISED = "exception"
"""Stands for the outcome of a state that raised."""


@dataclass(slots=True)
class Goal:
    """A goal that is running.

    Attributes:
        since: When it was sent, on the machine's clock [s].
        feedback: The newest one, as the server sent it.
        first_feedback: The first one, from which progress is measured.
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
    """Everything about the visits of one state.

    Attributes:
        count: Times entered.
        since: When it was entered, None while it is not active [s].
        seconds: Time spent inside in finished visits [s].
        outcome: How the last finished visit ended; None before.
        outcomes: Times each outcome ended it.
    """

    count: int = 0
    since: float | None = None
    seconds: float = 0.0
    outcome: str | None = None
    outcomes: dict[str, int] = field(default_factory=dict)


class History:
    """A listener that remembers what a picture or a table of the run needs.

    Give `on_event` to `machine.subscribe`.

    Threads: `on_event` may be called from any thread; it takes microseconds and never waits for
    anything but another such call.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._states: dict[str, Visits] = {}
        self._goals: dict[str, Goal] = {}
        self._started: float | None = None
        self._seconds: float | None = None
        self._fold: dict[type, Callable[[Any], None]] = {
            ev.Started: self._on_started,
            ev.Finished: self._on_finished,
            ev.Entered: self._on_entered,
            ev.Left: self._on_left,
            ev.Failed: self._on_failed,
            ev.GoalSent: self._on_goal_sent,
            ev.GoalFeedback: self._on_feedback,
            ev.GoalDone: self._on_goal_done,
        }

    def on_event(self, event: ev.Event) -> None:
        """Take one event in."""
        fold = self._fold.get(type(event))
        if fold is not None:
            with self._lock:
                fold(event)

    def marks(self) -> Marks:
        """Return what a picture marks."""
        with self._lock:
            return Marks(
                active=frozenset(p for p, v in self._states.items() if v.since is not None),
                visits={path: visits.count for path, visits in self._states.items()},
                last={p: v.outcome for p, v in self._states.items() if v.outcome is not None},
                taken={
                    (path, outcome): count
                    for path, visits in self._states.items()
                    for outcome, count in visits.outcomes.items()
                },
            )

    def visits(self) -> dict[str, Visits]:
        """Return a copy of all visits by path, in the order of the first visit."""
        with self._lock:
            return {
                path: Visits(v.count, v.since, v.seconds, v.outcome, dict(v.outcomes))
                for path, v in self._states.items()
            }

    def goals(self) -> list[Goal]:
        """Return a copy of the running goals, oldest first."""
        with self._lock:
            return [
                Goal(g.path, g.action, g.goal_id, g.since, g.goal, g.feedback, g.first_feedback)
                for g in self._goals.values()
            ]

    def goal(self, goal_id: str) -> Goal | None:
        """Return a copy of one running goal, None when it does not run."""
        return next((goal for goal in self.goals() if goal.goal_id == goal_id), None)

    def active(self) -> dict[str, float]:
        """Return when each running state was entered [s], by path."""
        with self._lock:
            return {p: v.since for p, v in self._states.items() if v.since is not None}

    def since(self, path: str) -> float | None:
        """Return when the state was entered, None while it does not run [s]."""
        with self._lock:
            visits = self._states.get(path)
            return None if visits is None else visits.since

    @property
    def started(self) -> float | None:
        """When the newest run began [s on the machine's clock]."""
        return self._started

    @property
    def seconds(self) -> float | None:
        """How long the newest finished run took [s]."""
        return self._seconds

    def _on_started(self, event: ev.Started) -> None:
        self._started = event.t
        self._enter(event.path, event.t)

    def _on_finished(self, event: ev.Finished) -> None:
        if self._started is not None:
            self._seconds = event.t - self._started
        self._leave(event.path, event.t, event.outcome or RAISED)

    def _on_entered(self, event: ev.Entered) -> None:
        self._enter(event.path, event.t)

    def _on_left(self, event: ev.Left) -> None:
        self._leave(event.path, event.t, event.outcome)

    def _on_failed(self, event: ev.Failed) -> None:
        self._leave(event.path, event.t, RAISED)

    def _enter(self, path: str, t: float) -> None:
        visits = self._states.setdefault(path, Visits())
        visits.count += 1
        visits.since = t

    def _leave(self, path: str, t: float, outcome: str) -> None:
        visits = self._states.setdefault(path, Visits(count=1))
        if visits.since is not None:
            visits.seconds += t - visits.since
        visits.since = None
        visits.outcome = outcome
        visits.outcomes[outcome] = visits.outcomes.get(outcome, 0) + 1
        self._goals = {k: g for k, g in self._goals.items() if g.path != path}

    def _on_goal_sent(self, event: ev.GoalSent) -> None:
        self._goals[event.goal_id] = Goal(
            event.path, event.action, event.goal_id, event.t, event.goal
        )

    def _on_feedback(self, event: ev.GoalFeedback) -> None:
        goal = self._goals.get(event.goal_id)
        if goal is not None:
            goal.feedback = event.feedback
            if goal.first_feedback is None:
                goal.first_feedback = event.feedback

    def _on_goal_done(self, event: ev.GoalDone) -> None:
        self._goals.pop(event.goal_id, None)
