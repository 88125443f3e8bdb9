"""The threads of a machine: one for the root, and one for each child of a concurrence."""

from __future__ import annotations

import os
import threading
from collections import deque
from contextvars import copy_context
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core import shutdown
from actionlib_core.clock import RealClock
from actionlib_core.clock.forks import end_copy
from smachpy.base import log
from smachpy.base.context import THREAD
from smachpy.base.slips import accepts
from smachpy.engine.child import run_child
from smachpy.engine.container import run_container
from smachpy.engine.errors import already_runs
from smachpy.engine.frame import Frame, Run
from smachpy.engine.interrupt import Interruption, take_back, uninterrupted, use_signals
from smachpy.engine.preempt import (
    FLAGS,
    REQUESTING,
    Visit,
    ask,
    asking,
    current_origin,
    forget_visit,
    leave_inner,
    outcome_left,
    request_soon,
    shutdown_asking,
)
from smachpy.engine.step import Step, get_options, runner_of
from smachpy.engine.visit import ChildErrors, Phase, Why
from smachpy.events import Finished, Recovered, Started
from smachpy.exceptions import InvalidStateError, InvalidUserCodeError, error_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.clock import Event as ClockEvent
    from smachpy.engine.described import Parent


class Branch(Frame):
    """A thread in which one child runs: a child of a concurrence, or a root.

    Attributes:
        outcome: Its outcome; None while it runs, or if it raised.
        error: The exception it raised.
    """

    path = ""
    can_be_left = True
    outcome: str | None = None
    error: BaseException | None = None

    def work(self) -> None:
        """Run the child and report how it ended; the body of the thread."""
        self.begin_thread()
        THREAD.set(self)
        outcome, failure = None, None
        try:
            outcome = self.execute_child()
        except Interruption:
            outcome = "preempted"
        except BaseException as error:  # noqa: BLE001  handed to the container's thread
            failure = error
        # An interruption that was injected just before the child ended is raised at any later
        # bytecode of this thread, so maybe here. Then start again: nothing was reported yet, and
        # once `end` has marked the visit as ended no other one can arrive.
        while True:
            try:
                if self.visit is not None and self.visit.override_call is not None:
                    self.visit.settle()
                waiting = self.end(outcome, failure)
                if self.dead:  # nothing of it is left for what this thread runs next
                    take_back(self.thread)
            except Interruption:
                continue
            # Before the container goes on, so that this thread holds nothing of a run that ends.
            self.end_thread()
            if waiting is not None:
                waiting.set()
            return

    def execute_child(self) -> str:
        """Run the child and return its outcome."""
        raise NotImplementedError

    def end(self, outcome: str | None, error: BaseException | None) -> ClockEvent | None:
        """Record how the child ended; only the first call counts.

        Returns:
            An event for the caller to set, which wakes the waiting thread; None if nobody waits.
        """
        raise NotImplementedError

    def abandon(self) -> None:
        """Report the child as ended although its thread, which is left behind, still runs."""
        waiting = self.end(outcome_left(self), None)
        if waiting is not None:
            waiting.set()


class ChildBranch(Branch):
    """A child of a concurrence, in a thread of its own.

    Attributes:
        was_asked: Its container has asked it to stop.
        siblings: All branches that run with it, itself included.
    """

    was_asked = False
    siblings: Group

    is_branch = True

    def __init__(self, group: Group, step: Step) -> None:
        frame = group.frame
        super().__init__(frame.container, frame.parent, frame.run)
        self.path = frame.path
        self.step = step
        self.visit = Visit(self, step)
        self.siblings = group

    def execute_child(self) -> str:
        """Run the child, and again if an operator jumps to it; return its outcome."""
        while True:
            decision = run_child(self, self.step)
            if decision.why is not Why.JUMPED:
                outcome: str = decision.outcome
                return outcome
            with self.run.lock:
                self.was_asked = False

    def end(self, outcome: str | None, error: BaseException | None) -> ClockEvent | None:
        """Report how the child ended; the event returned wakes the container."""
        group = self.siblings
        with self.run.lock:  # after this no request is being passed on to the branch
            if self.ended:  # its thread was left behind, and has ended now
                return None
            visit = self.visit
            if visit is not None:
                self.answered = self.answered or visit.has_answered(outcome)
                visit.end()  # from here on no interruption arrives
            if not self.dead:  # else `Visit._cut_off` has cleared the flag
                self.step.state._preempt_requested = False
            self.ended = True
            self.outcome, self.error = outcome, error
            if error is not None:
                group.failed = True
            group.reports.append(self)
            group.left -= 1
            if group.meetings is not None:
                group.meetings.branch_ended()
            last = group.left == 0
            when_ended = group.when_ended if last else None
        if when_ended is not None:  # it takes the lock again and may end the container
            when_ended()
        return group.wake if last or group.each or error is not None else None

    def end_thread(self) -> None:
        """Break the reference cycles through this frame: its run is freed without the collector."""
        super().end_thread()
        self.release()

    def release(self) -> None:
        """Drop the references to objects that refer back to this frame."""
        del self.siblings
        self.visit = None
        self.step.watched_window = None


class _Threads:
    """Runs branches in threads: one each if they block, fewer if they end at once.

    A thread that takes a branch first starts another thread if more branches wait, so no branch
    waits for the end of another. If its own child ends before that thread has woken up, it takes
    the next branch itself. Waking a thread is by far the greatest cost of a branch that does
    little.

    Threads: the container's calls `start`; the started ones run `_work`.
    """

    def __init__(self, clock: RealClock, branches: list[ChildBranch]) -> None:
        self._clock = clock
        # A context may be entered once at a time, so each branch gets its own copy.
        self._waiting = deque((branch, copy_context()) for branch in branches)
        self._lock = threading.Lock()
        self._is_starting = False

    def start(self) -> None:
        """Start a thread if branches wait, unless one is already starting."""
        with self._lock:
            if self._is_starting or not self._waiting:
                return
            self._is_starting = True
            name = self._waiting[0][0].here()
        self._clock.spawn(self._work, name=name)

    def _work(self) -> None:
        thread = threading.current_thread()
        with self._lock:
            self._is_starting = False
        while True:
            with self._lock:
                if not self._waiting:
                    return
                branch, context = self._waiting.popleft()
            try:
                self.start()
            except RuntimeError as error:  # "can't start new thread": the system's limit
                self._fail(error)
            thread.name = branch.here()
            context.run(branch.work)

    def _fail(self, error: RuntimeError) -> None:
        """End the branches for which no thread can be started."""
        with self._lock:
            branches = [branch for branch, _ in self._waiting]
            self._waiting.clear()
        for branch in branches:
            waiting = branch.end(None, error)
            if waiting is not None:
                waiting.set()


class Group:
    """The branches of one run, and the queue on which they report to the container's thread.

    Attributes:
        reports: Ended branches that the container has not handled yet.
        each: Every end wakes the container, not only the last one.
        failed: A branch or a callback has raised; the container will raise too.
        started: The branches have threads, or will have them in a moment.
        interruption: What interrupted a callback that outlasted its grace; the container will end
            'preempted'.
        left: Number of branches that have not ended.
        wake: Set to wake the container.
        when_ended: Called once after the last branch has ended; None for nothing.
        meetings: Where branches wait for each other; None until one does.
    """

    __slots__ = (
        "branches",
        "each",
        "failed",
        "frame",
        "interruption",
        "left",
        "meetings",
        "reports",
        "started",
        "wake",
        "when_ended",
    )

    def __init__(self, frame: Frame, steps: list[Step], *, each: bool) -> None:
        self.frame = frame
        self.each = each
        self.failed = False
        self.started = False
        self.interruption: Interruption | None = None
        self.when_ended: Callable[[], object] | None = None
        self.meetings: Any = None  # of smachpy.states.barrier, which imports this module
        self.reports: deque[ChildBranch] = deque()
        self.branches = [ChildBranch(self, step) for step in steps]
        self.left = len(steps)
        self.wake: ClockEvent = frame.run.clock.event()

    def start(self) -> None:
        """Start every branch, in a thread named after its path."""
        self.started = True
        clock = self.frame.run.clock
        if isinstance(clock, RealClock):
            _Threads(clock, self.branches).start()
            return
        # One thread each, so that the seed of a virtual clock decides about the order of all.
        for branch in self.branches:
            clock.spawn(branch.work, name=branch.here())

    def ask(self, branches: Iterable[ChildBranch]) -> None:
        """Ask the children of `branches` to stop; those that have ended are skipped.

        Each is asked once, as its end asks for no more: a machine that tidies up after the first
        request would be stopped in that by the end of the next sibling.
        """
        with self.frame.run.lock:
            for branch in branches:
                if not (branch.ended or branch.was_asked):
                    branch.was_asked = True
                    ask(branch)
        self.frame.run.flush()

    def wait(self) -> bool:
        """Wait for reports.

        Returns:
            Whether branches are still running.

        Blocks: until a branch has ended; one that ignores its preempt is reported too, once its
            thread is left behind.
        """
        lock = self.frame.run.lock
        with lock:
            is_ready = bool(self.reports) and (self.each or self.left == 0)
        if not is_ready:
            self.wake.wait()
        self.wake.clear()
        with lock:
            return self.left > 0

    def running(self) -> list[ChildBranch]:
        """Return the branches that have not ended."""
        return [branch for branch in self.branches if not branch.ended]

    def release(self) -> None:
        """Release branches that were not started; a started one does it as its thread ends."""
        for branch in self.branches:
            branch.release()

    def raise_errors(self, failure: InvalidUserCodeError | None) -> None:
        """Raise all exceptions of the branches, and `failure`, the exception of a callback.

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
            f"{branch.here()}: {error_text(error)}"
            for branch, error in zip(failed, errors, strict=True)
        )
        if failure is not None:
            errors.append(failure)
            raised += f"; {failure}"
        raise InvalidUserCodeError(
            f"{self.frame.path}: {len(failed)} of {len(self.branches)} children raised: {raised}",
            path=getattr(first.error, "path", "") or first.here(),
        ) from ChildErrors(f"children of {self.frame.path}", errors)


# -- the root ------------------------------------------------------------------------------------

OBSERVERS: list[Callable[[Any], Callable[[str | None], object] | None]] = []
"""Each is called with every root before it runs, and returns a function to call with its outcome
(None if it raised), or None. For programs whose roots are not known in advance: `smachpy.ros1`."""


def execute_root(root: Parent, parent_ud: Any) -> str:
    """Run `root` as the top of a machine.

    The main thread runs it itself, because there a signal can interrupt a state that ignores its
    preempt. Any other thread starts one more thread for it: a state that blocks in C cannot be
    interrupted there, so its thread must be one that can be left behind.

    Blocks: until it has ended.
    """
    top = Root(root, parent_ud)
    ends: list[Callable[[str | None], object] | None] = []
    outcome: str | None = None
    # Refused here, before this call touches the signal handlers and the shutdown of the other run.
    top.come()
    try:
        ends += [observe(root) for observe in OBSERVERS]
        for other in [run for run in top.ending.enlist(top) if isinstance(run, Root)]:
            _share_no_state(top, other)
        if top.ending.requested():
            top.refuse()
        if threading.current_thread() is threading.main_thread():
            outcome = top.run_with_signals()
        elif top.waits_for_ever:
            outcome = top.run_here()
        else:
            outcome = top.run_in_thread()
        return outcome
    finally:
        if top.run.pending:  # of what was left behind: nothing is published after the end
            top.run.flush()
        top.ending.forget(top)
        try:
            for end in ends:
                if end is not None:
                    end(outcome)
        finally:
            _forget_late_request(top)
            if top.live.control is not None:
                top.live.control.detach(top.run)


def _leave_in_copy() -> None:
    """In a forked process, treat this thread as left behind: its run goes on in the parent."""
    first = THREAD.get()
    frame = None if first is None else first.innermost
    if frame is None:
        return
    run = frame.run
    run.lock, run.pending = threading.RLock(), deque()  # another thread may have held the lock
    while frame is not None:
        frame.dead, frame.subscribers = True, None
        frame = frame.parent


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_in_copy)


def _share_no_state(top: Root, other: Root) -> None:
    """See to it that a preempt of one of two machines reaches none of the other's states.

    A state that is only a function runs as a copy in each.

    Raises:
        InvalidStateError: they share a state with attributes.
    """
    path = top.here()
    if path == other.here() and top.container is other.container:
        return  # a second run of one machine, refused where it begins
    mine = {id(state): (where, state) for where, state in _leaves(top.container, path)}
    for where, state in _leaves(other.container, other.here()):
        own = mine.get(id(state))
        data = state._smachpy
        if own is None or data.is_shared:
            continue
        if data.is_function:
            data.is_shared = True
            data.changed()
            continue
        problem = (
            f"{own[0]}: state: got the {type(state).__name__} that the running machine "
            f"{other.here()!r} has at {where!r}; expected an instance of its own, or a request to "
            "stop would reach both."
        )
        if not accepts(problem):
            raise InvalidStateError(problem)


def _leaves(container: Parent, path: str) -> Iterator[tuple[str, Any]]:
    """Yield (path, state) of all states below a container that are no containers."""
    for label, child in container.get_children().items():
        if child._smachpy_is_container:
            yield from _leaves(child, f"{path}/{label}")
        else:
            yield f"{path}/{label}", child


def _forget_late_request(top: Root) -> None:
    """Clear the flag of a request that arrived while the run was ending: it was for that run."""
    root, live = top.container, top.live
    with FLAGS:
        if live.coming is top:  # it has not begun
            live.coming = None
        if live.frame is None and live.root is None and live.coming is None:
            root._preempt_requested = False  # else it may be for the next run, which has begun
            live.ended += 1


class Root(Branch):
    """The invisible top of a machine, whose only child is the root.

    Attributes:
        waits_for_ever: The root's `preempt_timeout` is None: it is never interrupted.
        ending: The program's shutdown, which preempts the run.
    """

    _is_stopped = False
    _is_shutting_down = False
    _done: ClockEvent | None = None

    def __init__(self, root: Parent, parent_ud: Any) -> None:
        super().__init__(root, None, Run(root._smachpy.live.journal))
        options = get_options(root)
        execute = runner_of(root, options, partial(run_container, root))
        self.step = Step(root.name or "SM_ROOT", root, execute, parent_ud)
        self.waits_for_ever = options.preempt_timeout is None
        self.ending = shutdown.current_shutdown()

    @property
    def clock(self) -> Clock:
        """The clock of the run."""
        return self.run.clock

    def come(self) -> None:
        """Let no other run of the root begin.

        Raises:
            InvalidStateError: there is one.
        """
        with FLAGS:
            running = self.live.coming or self.live.root
            if running is not None and not running.ended:
                raise already_runs(self.here())
            self.live.coming = self

    def run_in_thread(self) -> str:
        """Run the root in a thread that can be left behind."""
        path = self.here()
        self._done = self.run.clock.event(f"the end of {path}")
        self.run.clock.spawn(self.work, name=path)
        self._done.wait()
        if self.error is not None:
            raise self.error
        assert self.outcome is not None
        return self.outcome

    def run_with_signals(self) -> str:
        """Run the root in the main thread; meanwhile signals that end a program preempt it.

        A handler that the program has set, before or during the run, is kept.
        """
        use_signals()
        with shutdown.SignalHandler(self.ending, interrupted=self._interrupt):
            return self.run_here()

    def run_here(self) -> str:
        """Run the root in this thread, which is the caller's and cannot be left behind."""
        self.can_be_left = False
        self.begin_thread()
        token = THREAD.set(self)
        try:
            return self.execute_child()
        except BaseException as error:
            if self.dead:  # this thread cannot be left behind, so it is that of a copy
                end_copy(None if isinstance(error, Interruption) else error)
            raise
        finally:
            THREAD.reset(token)
            self.ended = True
            self.end_thread()

    def execute_child(self) -> str:
        """Run the root and publish its start and end."""
        step, root, live, journal = self.step, self.container, self.live, self.run.journal
        self._begin()
        self.visit = Visit(self, step, Phase.RUNNING)
        with self.run.lock, FLAGS:  # from here on a request belongs to this run
            live.root, live.coming = self, None
            is_asked = self._is_stopped or root._preempt_requested
        if live.control is not None:  # maybe since the start was published
            live.control.attach(self.run)
        if is_asked:
            self._ask_at_start()
        live.origin = None
        outcome: str | None = None
        try:
            try:
                outcome = journal.execute(self, step, step.userdata)
                journal.finish(outcome)
            except Interruption:  # a hook of the root outlasted its grace
                if self.dead:
                    raise
                outcome = "preempted"
            finally:
                uninterrupted(self, partial(leave_inner, self))
            if self.visit is not None and self.visit.has_answered(outcome):
                self.visit.service()
            return outcome
        finally:
            if self.visit is not None:
                forget_visit(self)
            self._leave()
            if self.run.watched:
                self.emit(Finished, outcome)

    def _leave(self) -> None:
        with FLAGS:
            if self.live.root is self:
                self.live.root = None
                self.live.ended += 1

    def _begin(self) -> None:
        """Attach the journal, and publish the start."""
        run, live = self.run, self.live
        earlier = run.journal.attach(self)
        run.watched = run.watched or bool(live.listeners or live.buffers)
        if earlier is not None:
            self.emit(Recovered, *earlier)
        elif run.watched:
            self.emit(Started, tuple(self.container.get_initial_states()))

    def _ask_at_start(self) -> None:
        """Pass on a request made before the run, by the program's shutdown or by anyone else."""
        if self._is_stopped:
            self._ask_for_shutdown()
            return
        root = self.container
        # The root's own `request_preempt`, if it has one, was called with that request: not again.
        token = REQUESTING.set(root)
        with asking(*(self.live.origin or current_origin())), self.run.lock:
            ask(self)
        REQUESTING.reset(token)
        self.run.flush()

    def stop(self) -> None:
        """Preempt this run because the program shuts down; only the first call has an effect.

        Called before the run begins, it preempts it at its start; after the end it does nothing.

        Threads: any, but no signal handler.
        """
        with self.run.lock:
            self._is_stopped = True
            has_begun = self.live.root is self
        if has_begun:
            self._ask_for_shutdown()

    def _ask_for_shutdown(self) -> None:
        with shutdown_asking(self.ending), self.run.lock:
            if self._is_shutting_down:
                return
            self._is_shutting_down = True
            request_soon(self.container, self)

    def refuse(self) -> None:
        """Preempt this run at its start, and say why: a program that goes on may not know."""
        log.logwarn(f"{self.here()}: ends at once: the program is to end ({self.ending.reason}).")
        self.stop()

    def _interrupt(self) -> None:
        """Preempt this run, and no later one, because of Ctrl-C in an interactive session."""
        with asking("signal", "SIGINT"):
            self.stop()

    def end(self, outcome: str | None, error: BaseException | None) -> ClockEvent | None:
        """Record how the root ended; return the event for which the caller of `execute` waits."""
        with self.run.lock:
            if self.ended:
                return None
            self.ended = True
            self._leave()
        self.outcome, self.error = outcome, error
        return self._done
