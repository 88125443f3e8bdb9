"""The threads in which machines run: that of a root, and one for each child of a concurrence."""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]  # `signal` without its enums, 20 us a run
import signal
import threading
from collections import deque
from contextvars import copy_context
from logging import INFO
from typing import TYPE_CHECKING, Any

from actionlib_core import shutdown
from actionlib_core.clock import RealClock, current_clock
from smachpy.context import THREAD
from smachpy.events import Finished, Recovered, Started
from smachpy.exceptions import InvalidStateError, InvalidUserCodeError
from smachpy.log import MESSAGES
from smachpy.run.frame import Frame, Run
from smachpy.run.grace import (
    REQUESTING,
    Visit,
    ask,
    asking,
    current_origin,
    end_visit,
    forget_visit,
    outcome_left,
    request_soon,
    shutdown_asking,
)
from smachpy.run.interrupt import Interruption, use_signals
from smachpy.run.step import ChildErrors, Step, get_options, run_watched, runner_of
from smachpy.run.visit import Event, Phase, Why
from smachpy.util import SHUTDOWN_CHECK

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from types import FrameType

    from actionlib_core.clock import Event as ClockEvent
    from smachpy.run.child import Parent


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
        self.first = self.innermost = self
        self.thread = threading.get_ident()
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
                waiting = self.end(outcome, failure)
            except Interruption:  # on its way when the child ended; `end` has done nothing yet
                continue
            self.end_thread()
            if waiting is not None:
                waiting.set()
            return

    def here(self) -> str:
        """Return the path of the child."""
        return f"{self.path}/{self.step.label}"

    def run_child(self) -> str:
        """Run the child and return its outcome."""
        raise NotImplementedError

    def end(self, outcome: str | None, error: BaseException | None) -> ClockEvent | None:
        """Note how the child ended; only the first call counts.

        Returns:
            To be set by the caller, for those who wait; None: nobody does.
        """
        raise NotImplementedError

    def abandon(self) -> None:
        """Go on without the child; its thread is left behind."""
        waiting = self.end(outcome_left(self), None)
        if waiting is not None:
            waiting.set()


class ChildBranch(Branch):
    """A child of a concurrence, in a thread of its own."""

    def __init__(self, group: Group, step: Step) -> None:
        frame = group.frame
        self.container = frame.container
        self.data = frame.data
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

    def end(self, outcome: str | None, error: BaseException | None) -> ClockEvent | None:
        """Report how the child ended."""
        return self._group.end(self, outcome, error)

    def end_thread(self) -> None:
        """Refer to itself no more, so that no run waits for the garbage collector."""
        self.innermost = None
        del self.first
        self.let_go()

    def let_go(self) -> None:
        """Refer to nothing that refers to it."""
        del self._group
        self.visit = None
        self.step.watched_window = None


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
            waiting = branch.end(None, error)
            if waiting is not None:
                waiting.set()


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
        self.branches = [ChildBranch(self, step) for step in steps]
        self._left = len(steps)
        self._wake: ClockEvent = frame.run.clock.event()

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

    def end(
        self, branch: ChildBranch, outcome: str | None, error: BaseException | None
    ) -> ClockEvent | None:
        """Note how a branch ended; the first report of a branch counts.

        Returns:
            To be set by the caller, as the container is to look; None: it is not.
        """
        with self.frame.run.lock:  # whoever passes a request on is done after this
            if branch.ended:
                return None
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
        return self._wake if last or self.each or error is not None else None

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

    def let_go(self) -> None:
        """Let go of branches that were not started."""
        for branch in self.branches:
            branch.let_go()

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


# -- the root ------------------------------------------------------------------------------------

# What a program that does not handle them itself does with the signals that ask it to end.
_DEFAULTS = (
    (int(signal.SIGINT), signal.default_int_handler),
    (int(signal.SIGTERM), _signal.SIG_DFL),
)


OBSERVERS: list[Callable[[Any], Callable[[str | None], object] | None]] = []
"""Called with each root before it runs; what one returns is called with the outcome, None if the
root raised. For programs whose roots are not known before: `smachpy.ros1`."""


def execute_root(root: Parent, execute: Callable[[Any], Any], parent_ud: Any) -> str:
    """Run `root`, by `execute`, as the top of a machine.

    In the main thread it runs right there; a state that ignores its preempt is interrupted by a
    signal. In another thread it runs in a thread of its own, because a state that blocks in C could
    not be interrupted there: that thread can be left behind.

    Blocks: until it has ended.
    """
    top = Root(root, execute, parent_ud)
    running = top.data.root
    if running is not None and not running.ended:  # before it is in the way of the run that is on
        raise already_runs(top.here())
    ends = [observe(root) for observe in OBSERVERS] if OBSERVERS else ()
    outcome: str | None = None
    runs = top.ending.runs
    try:
        runs.add(top)
        if top.ending.requested():
            top.stop()
        if threading.current_thread() is threading.main_thread():
            outcome = top.run_with_signals()
        elif top.waits_for_ever:
            outcome = top.run_here()
        else:
            outcome = top.run_in_thread()
        return outcome
    finally:
        runs.discard(top)
        try:
            for end in ends:
                if end is not None:
                    end(outcome)
        finally:
            _forget_late_request(root)


def _forget_late_request(root: Parent) -> None:
    """Forget a request that came during the last steps: it was for this run."""
    if root._smachpy.frame is None:
        root._preempt_requested = False


def already_runs(path: str) -> InvalidStateError:
    """Return the error for a second `execute` of the container at `path`."""
    return InvalidStateError(
        f"{path}: execute: got a second call while it runs; expected one run at a time."
    )


class _Itself:
    """Stands for the attribute `run` of a root that has ended: a reference to itself would last.

    A late timer and a scope that was kept still ask for it.
    """

    def __get__(self, root: Any, _owner: type) -> Any:
        return self if root is None else root


class Root(Branch, Run):
    """The invisible top of a machine: what the root's visit happens in, and its `Run`.

    Attributes:
        waits_for_ever: The root is given all the time it takes after a preempt.
        ending: The end of the program, which stops the run.
    """

    parent = None
    run: Any = _Itself()
    _is_told = False
    _has_signal = False
    _done: ClockEvent | None = None

    def __init__(self, root: Parent, execute: Callable[[Any], Any], parent_ud: Any) -> None:
        self.container = root
        data = self.data = root._smachpy
        if data.lock is None:
            data.lock = threading.RLock()
        self.run = self  # while it runs: see `_Itself`
        self.lock = data.lock
        self.visit = self.control = self.journal = None
        self._is_stopped = False
        self.clock = current_clock()
        self.logged = MESSAGES.are_own or MESSAGES.logger.isEnabledFor(INFO)
        self.has_shutdown_check = SHUTDOWN_CHECK.is_own
        self.watched = self.careful = self.logged or self.has_shutdown_check
        self.pending = deque()
        options = get_options(root)
        self.step = Step(root.name or "SM_ROOT", root, runner_of(root, options, execute))
        self.step.userdata = parent_ud
        self.waits_for_ever = options.preempt_timeout is None
        self.ending = shutdown.current_shutdown()

    def run_in_thread(self) -> str:
        """Run the root in a thread that can be left behind."""
        path = self.here()
        self._done = self.clock.event(f"the end of {path}")
        self.clock.spawn(self.work, name=path)
        self._done.wait()
        if self.error is not None:
            raise self.error
        assert self.outcome is not None
        return self.outcome

    def run_with_signals(self) -> str:
        """Run the root here, in the main thread, where Ctrl-C and SIGTERM preempt it meanwhile.

        Those that the program handles itself are left alone, also if it begins to meanwhile.
        """
        use_signals()
        handler, (interrupt, default), (terminate, ends) = self.on_signal, *_DEFAULTS
        is_ours = _signal.getsignal(interrupt) is default, _signal.getsignal(terminate) is ends
        try:
            if is_ours[0]:
                _signal.signal(interrupt, handler)
            if is_ours[1]:
                _signal.signal(terminate, handler)
            return self.run_here()
        finally:
            if is_ours[0] and _signal.getsignal(interrupt) is handler:
                _signal.signal(interrupt, default)
            if is_ours[1] and _signal.getsignal(terminate) is handler:
                _signal.signal(terminate, ends)

    def run_here(self) -> str:
        """Run the root in this thread."""
        self.can_be_left = False
        self.first = self.innermost = self
        self.thread = threading.get_ident()
        token = THREAD.set(self)
        try:
            return self.run_child()
        finally:
            THREAD.reset(token)
            self.ended = True
            self.end_thread()

    def run_child(self) -> str:
        """Run the root and publish its start and end."""
        step, root, data = self.step, self.container, self.data
        journal = data.journal
        if self.watched or journal or data.control or data.listeners or data.buffers:
            self._begin()
        data.root = self  # from here on a request is one of this run
        if self._is_stopped or root._preempt_requested:  # first the mark, then the look: see `stop`
            self._ask_at_start()
        data.origin = None
        outcome: str | None = None
        try:
            try:
                if journal is None:
                    execute = step.execute
                    outcome = execute(step.userdata)
                else:
                    outcome = journal.execute(self, step, step.userdata)
                    journal.finish(outcome)
            except Interruption:  # one of its own hooks did not listen
                if self.dead:
                    raise
                outcome = "preempted"
            if self.visit is not None and self.visit.has_answered(outcome):
                self.visit.service()
            return outcome
        finally:
            if self.visit is not None:
                forget_visit(self)
            if data.root is self:
                data.root = None
            if self.watched:
                self.emit(Finished, outcome)

    def _begin(self) -> None:
        """Let a journal, an operator and those who watch have their part in the run."""
        run, data = self.run, self.data
        if data.journal is not None:
            data.journal.attach(self)
        if data.control is not None:
            data.control.attach(run)
        run.watched = run.watched or bool(data.listeners or data.buffers)
        earlier = None if data.journal is None else data.journal.recovered()
        if earlier is not None:
            self.emit(Recovered, *earlier)
        elif run.watched:
            self.emit(Started, tuple(self.container.get_initial_states()))

    def _ask_at_start(self) -> None:
        """Pass on what was requested before the run, by the program's end or by others."""
        if self._is_stopped:
            self._ask_as_program_ends()
            return
        root = self.container
        token = REQUESTING.set(root)  # its own `request_preempt`, if any, was called then
        with asking(*(self.data.origin or current_origin())), self.lock:
            ask(self)
        REQUESTING.reset(token)
        self.flush()

    def stop(self) -> None:
        """Ask this run to end, as the program does; without effect before, after, or twice.

        Threads: any, but no signal handler.
        """
        self._is_stopped = True
        if self.data.root is self:
            self._ask_as_program_ends()

    def _ask_as_program_ends(self) -> None:
        with shutdown_asking(self.ending), self.lock:
            if self._is_told:
                return
            self._is_told = True
            request_soon(self.container, self)

    def on_signal(self, number: int, _stack: FrameType | None) -> None:
        """Request the program's shutdown for the first Ctrl-C or SIGTERM.

        The second Ctrl-C raises KeyboardInterrupt, the second SIGTERM ends the process at once.
        """
        if self._has_signal:
            if number == signal.SIGINT:
                raise KeyboardInterrupt
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        self._has_signal = True
        name = signal.Signals(number).name
        self.ending.note(name)

        def deliver() -> None:
            try:
                self.stop()
            finally:
                self.ending.request(name)

        # Delivering takes locks, which the interrupted code may hold: another thread does it, of
        # a clock of its own, whose locks nobody holds.
        RealClock().spawn(deliver, name="shutdown")

    def end_thread(self) -> None:
        """Refer to itself no more, so that no run waits for the garbage collector."""
        self.innermost = None
        del self.first, self.run

    def end(self, outcome: str | None, error: BaseException | None) -> ClockEvent | None:
        """Let the caller of `execute` go on."""
        with self.lock:
            if self.ended:
                return None
            self.ended = True
            data = self.data
            if data.root is self:
                data.root = None
        self.outcome, self.error = outcome, error
        return self._done
