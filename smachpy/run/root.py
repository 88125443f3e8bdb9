"""One execution of a root container, from outside to the first frame."""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]  # `signal` without its enums, 20 us a run
import signal
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core import shutdown
from actionlib_core.clock import RealClock, current_clock
from smachpy.context import THREAD
from smachpy.events import Finished, Started
from smachpy.run.branches import Branch
from smachpy.run.frame import Run
from smachpy.run.grace import ask, forget_visit, request_soon
from smachpy.run.interrupt import Interruption, use_signals
from smachpy.run.origin import REQUESTING, asking, current_origin, shutdown_asking
from smachpy.run.runner import runner_of
from smachpy.run.step import Step

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from actionlib_core.clock import Event
    from smachpy.run.child import Parent
    from smachpy.run.options import Options

# What a program that does not handle them itself does with the signals that ask it to end.
_DEFAULTS = (
    (int(signal.SIGINT), signal.default_int_handler),
    (int(signal.SIGTERM), _signal.SIG_DFL),
)


OBSERVERS: list[Callable[[Any], Callable[[str | None], object] | None]] = []
"""Called with each root before it runs; what one returns is called with the outcome, None if the
root raised. For programs whose roots are not known before: `smachpy.ros1`."""


def execute_root(
    root: Parent, execute: Callable[[Any], Any], options: Options, parent_ud: Any
) -> str:
    """Run `root` as the top of a machine, and tell the observers; see `_execute_root`."""
    if not OBSERVERS:
        return _execute_root(root, execute, options, parent_ud)
    ends = [observe(root) for observe in OBSERVERS]
    outcome: str | None = None
    try:
        outcome = _execute_root(root, execute, options, parent_ud)
        return outcome
    finally:
        for end in ends:
            if end is not None:
                end(outcome)


def _execute_root(
    root: Parent, execute: Callable[[Any], Any], options: Options, parent_ud: Any
) -> str:
    """Run `root`, by `execute`, as the top of a machine.

    In the main thread it runs right there; a state that ignores its preempt is interrupted by a
    signal. In another thread it runs in a thread of its own, because a state that blocks in C could
    not be interrupted there: that thread can be left behind.

    Blocks: until it has ended.
    """
    ending = shutdown.current_shutdown()
    stop = _Stop(root, ending)
    forget = ending.on_shutdown(stop)
    signals: _Signals | None = None
    try:
        if ending.requested():
            stop()
        top = Root(root, execute, options, parent_ud)
        if threading.current_thread() is threading.main_thread():
            use_signals()
            signals = _Signals.install(stop)
        elif options.preempt_timeout is not None:
            return top.run_in_thread()
        return top.run_here()
    finally:
        if signals is not None:
            signals.remove()
        stop.end()
        forget()
        _forget_late_request(root)


def _forget_late_request(root: Parent) -> None:
    """Forget a request that came during the last steps: it was for this run."""
    if root._smachpy.frame is None:
        root._preempt_requested = False


class Root(Branch):
    """The invisible top of a machine: what the root's visit happens in."""

    def __init__(
        self, root: Parent, execute: Callable[[Any], Any], options: Options, parent_ud: Any
    ) -> None:
        self.container = root
        self.parent = None
        self.run = Run(current_clock())
        self.step = Step(root.name or "SM_ROOT", root, parent_ud, runner_of(root, options, execute))
        self._done: Event | None = None

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

    def run_here(self) -> str:
        """Run the root in this thread."""
        self.can_be_left = False
        self.begin_thread()
        token = THREAD.set(self)
        try:
            return self.run_child()
        finally:
            THREAD.reset(token)
            self.ended = True
            self.end_thread()

    def run_child(self) -> str:
        """Run the root and publish its start and end."""
        run, step, root = self.run, self.step, self.container
        data = root._smachpy
        self._attach()
        if run.watched:
            self.emit(Started, tuple(root.get_initial_states()))
        data.root = self  # from here on a request is one of this run
        if root._preempt_requested:
            token = REQUESTING.set(root)  # its own `request_preempt`, if any, was called then
            with asking(*(data.origin or current_origin())), run.lock:
                ask(self)
            REQUESTING.reset(token)
            run.flush()
        data.origin = None
        outcome: str | None = None
        try:
            try:
                outcome = self._execute(step)
            except Interruption:  # one of its own hooks did not listen
                if self.dead:
                    raise
                outcome = "preempted"
            visit = self.visit
            if visit is not None and visit.has_answered(outcome):
                visit.service()
            return outcome
        finally:
            if self.visit is not None:
                forget_visit(self)
            if data.root is self:
                data.root = None
            self.emit(Finished, outcome)

    def _attach(self) -> None:
        """Let a journal, an operator and those who watch have their part in the run."""
        run, data = self.run, self.container._smachpy
        if data.journal is not None:
            data.journal.attach(self)
        if data.control is not None:
            data.control.attach(run)
        if data.listeners or data.buffers:
            run.watched = True

    def _execute(self, step: Step) -> str:
        journal = self.run.journal
        if journal is None:
            outcome: str = step.execute(step.userdata)
            return outcome
        outcome = journal.execute(self, step, step.userdata)
        journal.finish(outcome)
        return outcome

    def end(self, outcome: str | None, error: BaseException | None) -> None:
        """Let the caller of `execute` go on."""
        with self.run.lock:
            if self.ended:
                return
            self.ended = True
            data = self.container._smachpy
            if data.root is self:
                data.root = None
        self.outcome, self.error = outcome, error
        if self._done is not None:
            self._done.set()


class _Stop:
    """Preempts one run of a root; without effect on later ones.

    The lock is for this alone: the run's end waits for a request that is under way.
    """

    def __init__(self, root: Parent, ending: shutdown.Shutdown) -> None:
        self._root = root
        self._shutdown = ending
        self._over = False
        self._calling = threading.RLock()

    def __call__(self) -> None:
        with self._calling:
            if not self._over:
                self._over = True
                with shutdown_asking(self._shutdown):
                    request_soon(self._root)

    def end(self) -> None:
        with self._calling:
            self._over = True


class _Signals:
    """Ctrl-C and SIGTERM while a root runs: the first of them requests the program's shutdown.

    The second Ctrl-C raises KeyboardInterrupt, the second SIGTERM ends the process at once.
    """

    def __init__(self, stop: _Stop) -> None:
        self._stop = stop
        self._seen = False
        self._replaced: list[tuple[int, object]] = []

    @classmethod
    def install(cls, stop: _Stop) -> _Signals | None:
        """Handle those that the program does not handle itself; in the main thread."""
        made = cls(stop)
        for number, default in _DEFAULTS:
            if _signal.getsignal(number) is default:
                _signal.signal(number, made)
                made._replaced.append((number, default))
        return made if made._replaced else None

    def remove(self) -> None:
        """Give the signals back, except those that somebody else has taken meanwhile."""
        for number, default in self._replaced:
            if _signal.getsignal(number) is self:
                _signal.signal(number, default)

    def __call__(self, number: int, _stack: FrameType | None) -> None:
        if self._seen:
            if number == signal.SIGINT:
                raise KeyboardInterrupt
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        self._seen = True
        current = shutdown.current_shutdown()
        name = signal.Signals(number).name
        current.note(name)
        # Delivering takes locks, which the interrupted code may hold: another thread does it, of
        # a clock of its own, whose locks nobody holds.
        RealClock().spawn(lambda: self._deliver(current, name), name="shutdown")

    def _deliver(self, current: shutdown.Shutdown, name: str) -> None:
        try:
            self._stop()
        finally:
            current.request(name)
