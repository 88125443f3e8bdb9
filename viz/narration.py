"""One line of text for each event worth telling."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.text import Text

from smachpy import events as ev
from viz.feedback import progress_of
from viz.history import RAISED
from viz.model import OutcomeClass, outcome_class
from viz.words import shorten

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.introspection import StateRecord
    from viz.history import History

STYLES: dict[OutcomeClass, str] = {
    "success": "green",
    "failure": "red",
    "preempted": "yellow",
    "other": "cyan",
}
FEEDBACK_PERIOD = 5.0
"""Time between two lines about one goal's feedback [s]."""
ERROR_LENGTH = 200


def outcome_text(outcome: str) -> Text:
    """Return an outcome in its colour."""
    return Text(shorten(outcome), STYLES[outcome_class(outcome)])


class Narrator:
    """Turns events into lines.

    Args:
        record: The machine, for the targets of transitions.
        history: What happened before; an event is told before it is folded in.
        feedback: Whether goals' feedback is worth a line now and then.
    """

    def __init__(self, record: StateRecord, history: History, *, feedback: bool) -> None:
        self._root = record.path
        self._history = history
        self._feedback = feedback
        self._told: dict[str, float] = {}
        self._targets = {
            (f"{state.path}/{edge.source}", edge.outcome): edge
            for state in record.walk()
            for edge in state.transitions
        }
        self._tells: dict[type, Callable[[Any], Text | None]] = {
            ev.Started: lambda event: self._line(event, Text("started")),
            ev.Left: self._left,
            ev.Failed: self._failed,
            ev.Finished: self._finished,
            ev.PreemptRequested: lambda e: self._line(
                e, Text(f"asked to stop by {shorten(e.asker, 60)}", "yellow")
            ),
            ev.CallbackFailed: lambda e: self._line(
                e, Text(f"callback {shorten(e.callback)}: {_error(e.error)}", "red")
            ),
            ev.TimedOut: lambda e: self._line(e, Text(f"timeout of {e.timeout:g} s", "yellow")),
            ev.Retried: lambda e: self._line(
                e, Text(f"again, attempt {e.attempt} ended with {_error(e.reason)}", "yellow")
            ),
            ev.Abandoned: lambda e: self._line(
                e, Text(f"left behind: it ignored its preempt for {e.grace:g} s", "red")
            ),
            ev.Paused: lambda e: self._line(e, Text(f"paused ({shorten(e.reason)})", "yellow")),
            ev.Resumed: lambda e: self._line(e, Text("resumed")),
            ev.GoalFeedback: self._goal_feedback,
            ev.GoalDone: self._goal_done,
        }

    def tell(self, event: ev.Event) -> Text | None:
        """Return the line about `event`, None when it is not worth one."""
        tell = self._tells.get(type(event))
        return None if tell is None else tell(event)

    def name(self, path: str) -> str:
        """Return `path` without the root's name."""
        return shorten(path.removeprefix(self._root).lstrip("/") or path.lstrip("/"), 70)

    def _left(self, event: ev.Left) -> Text:
        words = outcome_text(event.outcome)
        edge = self._targets.get((event.path, event.outcome))
        if edge is not None and not edge.target_is_outcome:
            words = Text.assemble(words, f" \u2192 {shorten(edge.target)}")
        return self._line(event, Text.assemble(words, self._duration(event)))

    def _failed(self, event: ev.Failed) -> Text:
        return self._line(
            event, Text.assemble((_error(event.error), "bold red"), self._duration(event))
        )

    def _finished(self, event: ev.Finished) -> Text:
        words = Text.assemble("ended: ", outcome_text(event.outcome or RAISED))
        return self._line(event, Text.assemble(words, self._duration(event)))

    def _goal_feedback(self, event: ev.GoalFeedback) -> Text | None:
        if not self._feedback or event.t - self._told.get(event.goal_id, -1e9) < FEEDBACK_PERIOD:
            return None
        goal = self._history.goal(event.goal_id)
        if goal is None:
            return None
        self._told[event.goal_id] = event.t
        goal.feedback = event.feedback
        progress = progress_of(goal)
        words = [shorten(event.action)]
        if progress.distance is not None:
            words.append(f"{progress.distance:.2f} m left")
        if progress.fraction is not None:
            words.append(f"{progress.fraction:.0%}")
        if progress.text:
            words.append(progress.text)
        return self._line(event, Text("  ".join(words), "dim"))

    def _goal_done(self, event: ev.GoalDone) -> Text | None:
        self._told.pop(event.goal_id, None)
        if event.status == "SUCCEEDED" or not event.text:
            return None
        words = f"{shorten(event.action)} {shorten(event.status)}: {_error(event.text)}"
        return self._line(event, Text(words, "yellow"))

    def _duration(self, event: ev.Event) -> Text:
        since = self._history.since(event.path)
        return Text("" if since is None else f"  {event.t - since:.1f} s", "dim")

    def _line(self, event: ev.Event, words: Text) -> Text:
        started = self._history.started
        elapsed = 0.0 if started is None else event.t - started
        return Text.assemble(
            (f"{elapsed:8.2f}  ", "dim"), (self.name(event.path), "bold"), "  ", words
        )


def _error(text: str) -> str:
    return shorten(text, ERROR_LENGTH)
