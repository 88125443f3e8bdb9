"""The children of a concurrence while they run, each in a task of its own."""

from __future__ import annotations

import threading
from collections import deque
from contextvars import copy_context
from typing import TYPE_CHECKING, Any

from actionlib_core.clock import RealClock
from smachpy.context import THREAD
from smachpy.exceptions import InvalidUserCodeError
from smachpy.run.frame import Frame
from smachpy.run.grace import Visit, ask, end_visit, outcome_left
from smachpy.run.interrupt import Interruption
from smachpy.run.runner import ChildErrors, run_watched
from smachpy.run.visit import Event, Phase, Why

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.clock import Event as ClockEvent
    from smachpy.run.step import Step


class Branch(Frame):
    """A thread in which one child runs: a child of a concurrence, or a root.

    Attributes:
        outcome: What it ended with; None while it runs, or when it raised.
        error: What it raised.
    """

    path = ""
    can_be_left = True
    outcome: str | None = None
    error: BaseException | None = None

    def work(self) -> None:
        """Run the child; the thread's whole work."""
        self.begin_thread()
        THREAD.set(self)
        outcome, failure = None, None
        try:
            outcome = self.run_child()
        except Interruption:
            outcome = "preempted"
        except BaseException as error:  # noqa: BLE001  handed to the container's thread
            failure = error
        while True:
            try:
                if self.visit is not None and self.visit.override_call is not None:
                    self.visit.settle()
                self.end(outcome, failure)
            except Interruption:  # on its way when the child ended; `end` has done nothing yet
                continue
            self.end_thread()
            return

    def run_child(self) -> str:
        """Run the child and return its outcome."""
        raise NotImplementedError

    def end(self, outcome: str | None, error: BaseException | None) -> None:
        """Note how the child ended, and tell who waits for it; only the first call counts."""
        raise NotImplementedError

    def abandon(self) -> None:
        """Go on without the child; its thread is left behind."""
        self.end(outcome_left(self), None)


class ChildBranch(Branch):
    """A child of a concurrence, in a thread of its own."""

    def __init__(self, group: Group, step: Step) -> None:
        frame = group.frame
        self.container = frame.container
        self.parent = frame.parent
        self.run = frame.run
        self.path = frame.path
        self.step = step
        self.visit = Visit(self, step, Phase.CHOSEN)
        self._group = group

    def run_child(self) -> str:
        """Run the child, again when an operator wants it so, and return its outcome."""
        while True:
            decision = end_visit(self, self._once())
            if decision.why is not Why.JUMPED:
                outcome: str = decision.target.outcome
                return outcome
            with self.run.lock:
                self.visit = Visit(self, self.step, Phase.CHOSEN)

    def _once(self) -> Any:
        """Run the child once, unless it was asked to stop before it began."""
        step, visit, control = self.step, self.visit, self.run.control
        assert visit is not None
        if control is not None and not visit.is_asked():
            control.pass_gate(self, step)
        with self.run.lock:
            if visit.is_asked():
                return "preempted"
            visit.happen(Event.START)
        return run_watched(self, step) if self.run.watched else step.execute(step.userdata)

    def end(self, outcome: str | None, error: BaseException | None) -> None:
        """Report how the child ended."""
        self._group.end(self, outcome, error)

    def end_thread(self) -> None:
        """Refer to itself no more, so that no run waits for the garbage collector."""
        super().end_thread()
        self.let_go()

    def let_go(self) -> None:
        """Refer to nothing that refers to it."""
        del self._group
        self.visit = None
        self.step.forget_frame()


class _Threads:
    """Starts branches in as many threads as they need: one each when they all block.

    Whoever takes a branch calls another thread first if more branches wait, so none ever waits
    for another one's end. A thread whose child has ended meanwhile takes the next branch itself:
    children that do little cost no thread each, of which waking up is by far the greatest part.

    Threads: `call` by the container's; `_work` by those that it brings.
    """

    def __init__(self, clock: RealClock, branches: list[ChildBranch]) -> None:
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
            context.run(branch.work)

    def _fail(self, error: RuntimeError) -> None:
        """End the branches that no thread can come for."""
        with self._lock:
            branches = [branch for branch, _ in self._waiting]
            self._waiting.clear()
        for branch in branches:
            branch.end(None, error)


class Group:
    """All branches of one run, and the queue on which they report to the container's thread.

    Attributes:
        reports: Ended branches that the container has not looked at yet.
        each: The container wants to be woken for every end, not only for the last.
        failed: A branch or a callback has raised; the container will raise too.
        started: The branches have threads, or are about to.
        interruption: Ended a callback that did not listen; the container will be preempted.
        when_ended: Called once when the last branch has ended; None: nothing.
    """

    __slots__ = (
        "_left",
        "_wake",
        "branches",
        "each",
        "failed",
        "frame",
        "interruption",
        "reports",
        "started",
        "when_ended",
    )

    def __init__(self, frame: Frame, steps: list[Step], *, each: bool) -> None:
        self.frame = frame
        self.each = each
        self.failed = False
        self.started = False
        self.interruption: Interruption | None = None
        self.when_ended: Callable[[], object] | None = None
        self.reports: deque[ChildBranch] = deque()
        self._wake: ClockEvent = frame.run.clock.event()
        self.branches = [ChildBranch(self, step) for step in steps]
        self._left = len(steps)

    def start(self) -> None:
        """Start every branch, in a thread named after its path."""
        self.started = True
        clock = self.frame.run.clock
        if isinstance(clock, RealClock):
            _Threads(clock, self.branches).call()
            return
        for branch in self.branches:
            clock.spawn(branch.work, name=branch.here())

    def ask(self, branches: Iterable[Branch]) -> None:
        """Ask the children of `branches` to stop."""
        with self.frame.run.lock:
            for branch in branches:
                if not branch.ended:
                    ask(branch)
        self.frame.run.flush()

    def end(self, branch: ChildBranch, outcome: str | None, error: BaseException | None) -> None:
        """Note how a branch ended; the first report of a branch counts."""
        with self.frame.run.lock:  # whoever passes a request on is done after this
            if branch.ended:
                return
            visit = branch.visit
            if visit is not None:
                branch.answered = branch.answered or visit.has_answered(outcome)
                visit.happen(Event.END)  # from here on no interruption arrives
            if not branch.dead:
                branch.step.state._preempt_requested = False
            branch.ended = True
            branch.outcome, branch.error = outcome, error
            if error is not None:
                self.failed = True
            self.reports.append(branch)  # before it is counted: who sees the last sees them all
            self._left -= 1
            last = self._left == 0
            when_ended = self.when_ended if last else None
        if when_ended is not None:
            when_ended()
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

    def running(self) -> list[ChildBranch]:
        """Return the branches that have not ended."""
        return [branch for branch in self.branches if not branch.ended]

    def end_run(self) -> None:
        """Let go of the branches, when nobody waits for them any more."""
        if not self.started:
            for branch in self.branches:
                branch.let_go()

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
