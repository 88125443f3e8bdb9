"""The seven message classes of an action, read from its action class."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from actionlib_core.exceptions import ActionException


@dataclass(frozen=True, slots=True)
class ActionTypes:
    """The message classes of an action.

    Attributes:
        action: XAction, as the user passed it.
        action_goal: XActionGoal, with header and goal id around the goal. Actions of ROS 2 have it
            and the next two for this library only; they are never sent.
        action_result: XActionResult, with header and status around the result.
        action_feedback: XActionFeedback, with header and status around the feedback.
        goal: XGoal.
        result: XResult.
        feedback: XFeedback.
    """

    action: Any
    action_goal: Any
    action_result: Any
    action_feedback: Any
    goal: Any
    result: Any
    feedback: Any

    @classmethod
    def of(cls, spec: Any) -> ActionTypes:
        """Find the classes through an object of the action class, as ROS 1's actionlib does.

        Raises:
            ActionException: `spec` is not the class of an action.
        """
        try:
            example = spec()
            parts = example.action_goal, example.action_result, example.action_feedback
            inner = parts[0].goal, parts[1].result, parts[2].feedback
        except (AttributeError, TypeError) as error:
            if getattr(spec, "_wire", "") == "ros2":
                known = "nav2_msgs.action.NavigateToPose"
                way_out = "Try a class of the package's module 'action', without '_Goal' behind it."
            else:
                known = "move_base_msgs.msg.MoveBaseAction"
                way_out = "Try the name that ends with 'Action'."
            raise ActionException(
                f"ActionSpec: got {spec!r}; expected an action class such as "
                f"actionlib_core.interfaces.{known}. {way_out}"
            ) from error
        return cls(spec, *(type(part) for part in parts), *(type(part) for part in inner))
