"""Writes a line of text for each event that is worth reading."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.text import Text

from smachpy import events as ev
from smachpy.events.outcome_classes import OutcomeClass, outcome_class
from smachpy.events.run_state import RAISED
from smachpy_viz.model.labels import cleanups, one_line, shorten
from smachpy_viz.model.progress import progress_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.events.introspection import StateRecord
    from smachpy_viz.model.history import History

STYLES: dict[OutcomeClass, str] = {
    "success": "#16906C",
    "failure": "#D65A32",
    "preempted": "#B07C00",
    "other": "#7B8794",
}
"""The page's hues (`smachpy_viz.pictures.theme`), as light as black and white allow."""
RUNNING = "#0082D4"
WAITING = "#B065A3"
NARROW = 72
"""Below this many columns names are shown without their containers, and bars are left out."""
FEEDBACK_PERIOD = 5.0
"""Time between two lines for one goal's feedback [s]."""
ERROR_LENGTH = 200


def outcome_text(outcome: str) -> Text:
    """Return an outcome in its colour."""
    return Text(shorten(outcome), STYLES[outcome_class(outcome)])


class EventLines:
    """Turns events into lines.

    Args:
        record: The machine, for the targets of transitions.
        history: The events so far; a line is made before its event is added to the history.
        panel: Whether there is a panel below, which shows feedback. Without one, feedback gets a
            line now and then, and no text is cut.
        narrow: Write short lines: names without their containers.
    """

    def __init__(
        self, record: StateRecord, history: History, *, panel: bool, narrow: bool = False
    ) -> None:
        self._root = record.path
        self._history = history
        self._panel = panel
        self._narrow = narrow
        self._feedback_lines: dict[str, float] = {}
        self._cleanups = cleanups(record)
        self._targets = {
            (f"{state.path}/{edge.source}", edge.outcome): edge
            for state in record.walk()
            for edge in state.transitions
        }
        self._by_type: dict[type, Callable[[Any], Text | None]] = {
            ev.Started: lambda event: self._line(event, Text("started")),
            ev.Recovered: lambda event: self._line(event, Text(ev.recovered_text(event.outages))),
            ev.Left: self._left,
            ev.Failed: self._failed,
            ev.Finished: self._finished,
            ev.PreemptRequested: lambda e: self._line(
                e, Text(f"asked to stop by {self._reason(e.asker)}", STYLES["preempted"])
            ),
            ev.CallbackFailed: lambda e: self._line(
                e,
                Text(f"callback {shorten(e.callback)}: {self._reason(e.error)}", STYLES["failure"]),
            ),
            ev.TimedOut: lambda e: self._line(
                e, Text(f"timeout of {e.timeout:g} s", STYLES["preempted"])
            ),
            ev.Retried: lambda e: self._line(
                e,
                Text(
                    f"again, attempt {e.attempt} ended with {self._reason(e.reason)}",
                    STYLES["preempted"],
                ),
            ),
            ev.ResourceUse: self._resource,
            ev.Noted: lambda e: self._line(e, Text(self._reason(e.text))),
            ev.Abandoned: lambda e: self._line(
                e, Text(f"left behind: it ignored its preempt for {e.grace:g} s", STYLES["failure"])
            ),
            ev.Paused: lambda e: self._line(
                e, Text(f"paused ({self._reason(e.reason)})", STYLES["preempted"])
            ),
            ev.Resumed: lambda e: self._line(e, Text("resumed")),
            ev.QuestionAsked: lambda e: self._line(
                e, Text(f"asks: {self._reason(e.text)}", RUNNING)
            ),
            ev.QuestionAnswered: lambda e: self._line(
                e, Text(self._reason(ev.answered_text(e.answer, e.by)), RUNNING)
            ),
            ev.GoalFeedback: self._goal_feedback,
            ev.GoalDone: self._goal_done,
        }

    def line(self, event: ev.Event) -> Text | None:
        """Return the line for `event`; None if it gets none."""
        make = self._by_type.get(type(event))
        return None if make is None else make(event)

    def name(self, path: str) -> str:
        """Return `path` without the root's name; in narrow lines only its last part."""
        if self._narrow:
            return shorten(path.rpartition("/")[2], 24)
        return shorten(path.removeprefix(self._root).lstrip("/") or path.lstrip("/"), 70)

    def _resource(self, event: ev.ResourceUse) -> Text | None:
        if event.status == "free":
            return None
        text = ev.resource_text(event.status, event.resource, event.holder)
        return self._line(event, Text(self._reason(text)))

    def _left(self, event: ev.Left) -> Text:
        words = outcome_text(event.outcome)
        edge = self._targets.get((event.path, event.outcome))
        if edge is not None and not edge.target_is_outcome:
            words = Text.assemble(words, f" \u2192 {shorten(edge.target)}")
        if event.path in self._cleanups:
            words = Text.assemble("tidied up: ", words)
        return self._line(event, Text.assemble(words, self._duration(event)))

    def _failed(self, event: ev.Failed) -> Text:
        return self._line(
            event,
            Text.assemble(
                (self._reason(event.error), f"bold {STYLES['failure']}"), self._duration(event)
            ),
        )

    def _finished(self, event: ev.Finished) -> Text:
        words = Text.assemble("ended: ", outcome_text(event.outcome or RAISED))
        return self._line(event, Text.assemble(words, self._duration(event)))

    def _goal_feedback(self, event: ev.GoalFeedback) -> Text | None:
        if self._panel or event.t - self._feedback_lines.get(event.goal_id, -1e9) < FEEDBACK_PERIOD:
            return None
        goal = self._history.goal(event.goal_id)
        if goal is None:
            return None
        self._feedback_lines[event.goal_id] = event.t
        first = event.feedback if goal.first_feedback is None else goal.first_feedback
        progress = progress_of(goal.goal, event.feedback, first)
        words = [shorten(event.action)]
        if progress.distance is not None:
            words.append(f"{progress.distance:.2f} m left")
        if progress.fraction is not None:
            words.append(f"{progress.fraction:.0%}")
        if progress.text:
            words.append(shorten(progress.text))
        return self._line(event, Text("  ".join(words), "dim"))

    def _goal_done(self, event: ev.GoalDone) -> Text | None:
        self._feedback_lines.pop(event.goal_id, None)
        if event.status == "SUCCEEDED" or not event.text:
            return None
        words = f"{shorten(event.action)} {shorten(event.status)}: {self._reason(event.text)}"
        return self._line(event, Text(words, STYLES["preempted"]))

    def _reason(self, text: str) -> str:
        return shorten(text, ERROR_LENGTH) if self._panel else one_line(text)

    def _duration(self, event: ev.Event) -> Text:
        since = self._history.since(event.path)
        return Text("" if since is None else f"  {max(0.0, event.t - since):.1f} s", "dim")

    def _line(self, event: ev.Event, words: Text) -> Text:
        started = self._history.started
        elapsed = 0.0 if started is None else event.t - started
        return Text.assemble(
            (f"{elapsed:6.1f} " if self._narrow else f"{elapsed:8.2f}  ", "dim"),
            (self.name(event.path), "bold"),
            " " if self._narrow else "  ",
            words,
        )
