"""The children of a concurrence while they run, each in a task of its own."""

from __future__ import annotations

import threading
from collections import deque
from contextvars import copy_context
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import RealClock
from smachpy._runtime.failures import ChildErrors, unknown_outcome
from smachpy._runtime.frame import FRAME, Frame
from smachpy._runtime.interrupt import Interruption
from smachpy._runtime.step import run_watched
from smachpy._runtime.watch import disarm, has_answered
from smachpy.events import OutcomeForced
from smachpy.exceptions import InvalidUserCodeError

if TYPE_CHECKING:
    from actionlib_core.clock import Event as ClockEvent
    from smachpy._runtime.frame import Override
    from smachpy._runtime.step import Step
    from smachpy.container import Container


class Branch(Frame):
    """One child of a concurrence, in its task.

    Attributes:
        outcome: What it ended with; None while it runs, or when it raised.
        error: What it raised.
        ended: It has ended, or was abandoned.
    """

    path = ""

    def __init__(self, group: Group, step: Step) -> None:
        frame = group.frame
        self.container = frame.container
        self.parent = frame.parent
        self.run = frame.run
        self.step = step
        self.boundary = self
        self.thread = 0  # until it runs there is nothing to interrupt
        self.path = frame.path
        self.group = group
        self.outcome: str | None = None
        self.error: BaseException | None = None
        self.ended = False

    def run_child(self) -> None:
        """Run the child; the task's whole work."""
        FRAME.set(self)
        self.thread = threading.get_ident()
        outcome, failure = None, None
        try:
            outcome = self._execute()
        except Interruption:
            outcome = "preempted"
        except BaseException as error:  # noqa: BLE001  handed to the container's thread
            failure = error
        while True:
            try:
                self.group.end(self, outcome, failure)
            except Interruption:  # on its way when the child ended; `end` has done nothing yet
                continue
            return

    def outcome_left(self) -> str:
        """Return the child's outcome if it is left behind now."""
        return self.step.state.timeout_outcome if self.timed_out else "preempted"

    def abandon(self) -> None:
        """Go on without the child; its thread is left behind."""
        self.dead = True
        self.group.end(self, self.outcome_left(), None)

    def _execute(self) -> str:
        """Run the child, again when an operator wants it so, and check its outcome."""
        again = True
        outcome: Any = None
        while again:
            outcome = self._attempt()
            override = self._take_override()
            again = override is not None and override.label is not None
            if override is not None and override.outcome is not None:
                outcome = override.outcome
                self.emit(OutcomeForced, outcome)
        step = self.step
        if outcome in step.next or (outcome == "preempted" and self._is_told()):
            return str(outcome)
        raise unknown_outcome(self.here(), step.state.get_registered_outcomes(), outcome)

    def _attempt(self) -> Any:
        """Run the child once, unless it was asked to stop before it began."""
        step = self.step
        if self.run.control is not None and not self._is_told():
            self.run.control.pass_gate(self, step)
        if self._is_told():
            return "preempted"
        if self.run.watched:
            return run_watched(self, step)
        return step.execute(step.userdata)

    def _take_override(self) -> Override | None:
        container = self.container
        with container._lock:  # noqa: SLF001  one machinery
            override, self.override = self.override, None
            if override is None or container.preempt_requested():
                return None
            if override.label is not None:
                disarm(self)
                self.step.state.recall_preempt()
            return override

    def _is_told(self) -> bool:
        return self.told is not None


class _Crew:
    """Starts branches in as many threads as they need: one each when they all block.

    Whoever takes a branch calls another thread first if more branches wait, so none ever waits
    for another one's end. A thread whose child has ended meanwhile takes the next branch itself:
    children that do little cost no thread each, of which waking up is by far the greatest part.

    Threads: `call` by the container's; `_work` by those that it brings.
    """

    def __init__(self, clock: RealClock, branches: list[Branch]) -> None:
        self._clock = clock
        self._waiting = deque((branch, copy_context()) for branch in branches)
        self._lock = threading.Lock()
        self._coming = False

    def call(self) -> None:
        """Let a thread come for the branches that wait, unless one is on its way."""
        with self._lock:
            if self._coming or not self._waiting:
                return
            self._coming = True
            name = self._waiting[0][0].here()
        self._clock.spawn(self._work, name=name)

    def _work(self) -> None:
        thread = threading.current_thread()
        with self._lock:
            self._coming = False
        while True:
            with self._lock:
                if not self._waiting:
                    return
                branch, context = self._waiting.popleft()
            try:
                self.call()
            except RuntimeError as error:  # the system gives no more threads
                self._fail(error)
            thread.name = branch.here()
            context.run(branch.run_child)

    def _fail(self, error: RuntimeError) -> None:
        """End the branches that no thread can come for."""
        with self._lock:
            branches = [branch for branch, _ in self._waiting]
            self._waiting.clear()
        for branch in branches:
            branch.group.end(branch, None, error)


class Group:
    """All branches of one run, and the queue on which they report to the container's thread.

    Attributes:
        reports: Ended branches that the container has not looked at yet.
        each: The container wants to be woken for every end, not only for the last.
        failed: A branch or a callback has raised; the container will raise too.
    """

    __slots__ = ("_left", "_wake", "branches", "container", "each", "failed", "frame", "reports")

    def __init__(
        self, container: Container, frame: Frame, steps: list[Step], *, each: bool
    ) -> None:
        self.container = container
        self.frame = frame
        self.each = each
        self.failed = False
        self.reports: deque[Branch] = deque()
        self._wake: ClockEvent = frame.run.clock.event()
        self.branches = [Branch(self, step) for step in steps]
        self._left = len(steps)

    def start(self) -> None:
        """Start every branch, in a thread named after its path."""
        clock = self.frame.run.clock
        if isinstance(clock, RealClock):
            _Crew(clock, self.branches).call()
            return
        for branch in self.branches:
            clock.spawn(branch.run_child, name=branch.here())

    def tell(self, branches: list[Branch]) -> None:
        """Ask the children of `branches` to stop; with the container's lock held."""
        for branch in branches:
            if not branch.ended:
                self.container._tell(branch, branch.step)  # noqa: SLF001

    def end(self, branch: Branch, outcome: str | None, error: BaseException | None) -> None:
        """Note how a branch ended; the first report of a branch counts."""
        with self.container._lock:  # noqa: SLF001  whoever passes a preempt on is done after this
            if branch.ended:
                return
            answered = has_answered(branch, outcome)
            disarm(branch)  # from here on no interruption arrives
            branch.ended = True
            branch.outcome, branch.error = outcome, error
            branch.answered = answered
            if not branch.dead:
                branch.step.state.recall_preempt()
            if error is not None:
                self.failed = True
            self.reports.append(branch)  # before it is counted: who sees the last sees them all
            self._left -= 1
            last = self._left == 0
        if last or self.each or error is not None:
            self._wake.set()

    def wait(self) -> bool:
        """Wait for reports.

        Returns:
            Whether branches are still running.

        Blocks: until a branch has something to report; an ignored preempt ends in a report too.
        """
        if not self.reports or not (self.each or self._left == 0):
            self._wake.wait()
        self._wake.clear()
        return self._left > 0

    def running(self) -> list[Branch]:
        """Return the branches that have not ended."""
        return [branch for branch in self.branches if not branch.ended]

    def outcomes(self) -> dict[str, str | None]:
        """Return label -> outcome, None for those that run."""
        return {branch.step.label: branch.outcome for branch in self.branches}

    def raise_errors(self, failure: InvalidUserCodeError | None) -> None:
        """Raise what the branches raised, all of it, and `failure`, what a callback raised.

        Raises:
            InvalidUserCodeError: `failure` when no branch raised, else from an `ExceptionGroup` of
                the branches' exceptions and `failure`.
        """
        failed = [branch for branch in self.branches if branch.error is not None]
        if not failed:
            if failure is not None:
                raise failure
            return
        errors: list[Exception] = []
        for branch in failed:
            if not isinstance(branch.error, Exception):  # SystemExit and its like go through
                assert branch.error is not None
                raise branch.error
            errors.append(branch.error)
        first = failed[0]
        raised = ", ".join(
            f"{branch.here()}: {type(branch.error).__name__}: {branch.error}" for branch in failed
        )
        if failure is not None:
            errors.append(failure)
            raised += f"; {failure}"
        raise InvalidUserCodeError(
            f"{self.frame.path}: {len(failed)} of {len(self.branches)} children raised: {raised}",
            path=getattr(first.error, "path", "") or first.here(),
        ) from ChildErrors(f"children of {self.frame.path}", errors)
