"""Types of action classes: type checkers find an action's goal, result and feedback through them.

Action classes are generated and have no common base class, so these are protocols.
"""

from __future__ import annotations

from typing import Protocol, TypeVar

Goal = TypeVar("Goal")  # invariant: a result must not pass as a goal
Result_co = TypeVar("Result_co", covariant=True)
Feedback_co = TypeVar("Feedback_co", covariant=True)


class HasGoal(Protocol[Goal]):
    """An XActionGoal.

    Attributes:
        goal: The XGoal.
    """

    goal: Goal


class HasResult(Protocol[Result_co]):
    """An XActionResult."""

    @property
    def result(self) -> Result_co:
        """The XResult."""


class HasFeedback(Protocol[Feedback_co]):
    """An XActionFeedback."""

    @property
    def feedback(self) -> Feedback_co:
        """The XFeedback."""


class ActionSpec(Protocol[Goal, Result_co, Feedback_co]):
    """An XAction. `type[ActionSpec[G, R, F]]` accepts every action class and yields its types."""

    @property
    def action_goal(self) -> HasGoal[Goal]:
        """The XActionGoal."""

    @property
    def action_result(self) -> HasResult[Result_co]:
        """The XActionResult."""

    @property
    def action_feedback(self) -> HasFeedback[Feedback_co]:
        """The XActionFeedback."""
