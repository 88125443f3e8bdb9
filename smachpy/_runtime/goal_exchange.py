"""One goal of an action state: sent, watched, cancelled, and never left behind by accident."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from actionlib_core._core.states import CommState
from smachpy._core.goal_run import GoalRun, Step
from smachpy.events import GoalDone, GoalFeedback, GoalSent

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action_client import ActionClient
    from actionlib_core.comm_state_machine import CommStateMachine
    from smachpy._runtime.frame import Scope
    from smachpy._runtime.wakeup import Wakeup

_OVER = frozenset({CommState.DONE, CommState.LOST})
_RUNNING = frozenset({CommState.ACTIVE, CommState.PREEMPTING})


class GoalExchange:
    """Carries out what `GoalRun` decides about one goal.

    Args:
        client: Sends the goal.
        wake: What the state's thread waits on.
        scope: Where the events go; None outside any machine.
        run: The decisions.
        wants_feedback: Somebody besides the listeners wants the feedback: without either, feedback
            does not wake the state's thread.

    Attributes:
        run: See above.
        accepted: The server has begun with the goal.
        result: The result message once it is there, else None.
        unanswered: No server has said a word about the goal.

    Threads: everything belongs to the state's thread, apart from what the client tells: that is
        only noted, under the client's lock.
    """

    def __init__(
        self,
        client: ActionClient[Any],
        wake: Wakeup,
        scope: Scope | None,
        run: GoalRun,
        *,
        wants_feedback: bool = True,
    ) -> None:
        self.run = run
        self.accepted = False
        self.goal_id = ""
        self._client = client
        self._wake = wake
        self._scope = scope
        self._over = False
        self._wants_feedback = wants_feedback
        self._feedback: deque[Any] = deque()
        self._machine: CommStateMachine | None = None

    @property
    def result(self) -> Any:
        """See the class."""
        machine = self._machine
        return None if machine is None or self.run.abandoned else machine.goal.result

    @property
    def unanswered(self) -> bool:
        """See the class."""
        return self._machine is not None and not self._machine.goal.acknowledged

    def send(self, goal: Any, *, ack_timeout: float | None) -> None:
        """Send `goal`; when no server takes it within `ack_timeout` [s] it is LOST.

        Raises:
            ActionException, FieldError: the goal is not of the action's type.
            TypeMismatchError: the server is of another type.
            TransportError: the node is closed.
        """
        machine = self._client.manager.send(
            *self._client.pack(goal),
            on_transition=self._note_transition,
            on_feedback=self._note_feedback,
            ack_timeout=ack_timeout,
            created=self._note_created,
        )
        self.goal_id = machine.goal.id
        self._emit(GoalSent, self.goal_id, goal)

    def follow(
        self, preempt_requested: Callable[[], bool], on_feedback: Callable[[Any], object]
    ) -> None:
        """Wait until the goal has ended or is abandoned.

        Args:
            preempt_requested: Whether the state is to stop.
            on_feedback: Called with each feedback message, in this thread. When it raises, the goal
                is cancelled, its end awaited, and the exception goes on.

        Blocks: until then; a preempt or `exec_timeout` bounds it by `preempt_timeout`.
        """
        failure: Exception | None = None
        while True:
            self._wake.clear()
            over = self._over  # before the feedback: what was sent before the end is seen
            try:
                self._deliver_feedback(None if failure else on_feedback)
            except Exception as error:  # noqa: BLE001  raised again when the goal has ended
                failure = error
                self.run.on_failure()
            if preempt_requested():
                self.run.on_preempt()
            if over:
                self._note_end()
            if self._act():
                break
            self._wake.wait_until(self.run.deadline)
        self._emit(GoalDone, self.goal_id, self.run.status, self.run.text, self.result)
        if failure is not None:
            raise failure

    def cancel(self) -> None:
        """Ask the server to end the goal, if it was sent and has not ended."""
        machine = self._machine
        if machine is not None and not machine.goal.over:
            machine.manager.cancel(machine)

    def _act(self) -> bool:
        """Do what is due; whether it is over."""
        machine = self._machine
        assert machine is not None
        if machine.goal.acknowledged:
            self.run.on_taken(self._wake.clock.now())
        while True:
            step = self.run.step(self._wake.clock.now())
            if step is Step.CANCEL:
                machine.manager.cancel(machine)
                continue
            if step is Step.ABANDON:
                machine.manager.forget(machine)
            return step is not Step.WAIT

    def _note_created(self, machine: CommStateMachine) -> None:
        self._machine = machine

    def _note_transition(self, _machine: CommStateMachine, state: CommState) -> None:
        if state in _RUNNING:
            self.accepted = True
        if state in _OVER:
            self._over = True
        self._wake.set()

    def _note_feedback(self, _machine: CommStateMachine, feedback: Any) -> None:
        scope = self._scope
        watched = scope is not None and scope._frame.run.watched  # noqa: SLF001  one machinery
        if self._wants_feedback or watched:
            self._feedback.append(feedback)
            self._wake.set()

    def _deliver_feedback(self, on_feedback: Callable[[Any], object] | None) -> None:
        while self._feedback:
            feedback = self._feedback.popleft()
            self._emit(GoalFeedback, self.goal_id, feedback)
            if on_feedback is not None:
                on_feedback(feedback)

    def _note_end(self) -> None:
        machine = self._machine
        assert machine is not None
        self.run.on_end(machine.goal.status.name, machine.goal.text)

    def _emit(self, kind: Any, *fields: Any) -> None:
        if self._scope is not None:
            self._scope.emit(kind, self._client.ns, *fields)
