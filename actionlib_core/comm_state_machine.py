"""One goal of a client: its life cycle, its bytes, and who wants to hear of it."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core._core.client_goal import ClientGoal
    from actionlib_core._core.states import CommState
    from actionlib_core.clock import Event
    from actionlib_core.goal_manager import GoalManager


class CommStateMachine:
    """One goal of a client.

    Args:
        goal: Its life cycle.
        manager: The client's goals.
        body: The bytes of the XGoal.
        on_transition: Called under the manager's lock for each state passed; must only note it.
        on_feedback: The same, with each XFeedback message; None when nobody wants them.

    Attributes:
        ended: Set when the goal is over; made when somebody waits for that.
        settled: Set when the goal is over and its last callback has returned, or nobody follows it.
    """

    __slots__ = (
        "_shown",
        "_shown_to",
        "asking",
        "body",
        "ended",
        "goal",
        "manager",
        "on_feedback",
        "on_transition",
        "settled",
    )

    def __init__(
        self,
        goal: ClientGoal,
        manager: GoalManager,
        body: bytes,
        on_transition: Callable[[CommStateMachine, CommState], None] | None,
        on_feedback: Callable[[CommStateMachine, Any], None] | None,
    ) -> None:
        self.goal = goal
        self.manager = manager
        self.body = body
        self.on_transition = on_transition
        self.on_feedback = on_feedback
        self.asking = False
        self.ended: Event | None = None
        self.settled: Event = manager.node.clock.event()
        self._shown: CommState | None = None
        self._shown_to = 0

    @property
    def forgotten(self) -> bool:
        """Whether it runs on and nobody follows it."""
        return self.settled.is_set() and not self.goal.over

    def on_answered(self) -> None:
        """Note that a question about the goal was answered, or that its time is over."""
        self.asking = False

    @property
    def state(self) -> CommState:
        """Where the goal stands; inside a transition callback, the state that callback is for."""
        if self._shown is not None and self._shown_to == threading.get_ident():
            return self._shown
        return self.goal.comm

    def show(self, state: CommState, function: Callable[..., object], *args: object) -> None:
        """Call `function`, to which the goal stands in `state`."""
        self._shown_to, self._shown = threading.get_ident(), state
        try:
            function(*args)
        finally:
            self._shown = None
