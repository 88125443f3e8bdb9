"""One execution of a root container, from outside to the first frame."""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]  # `signal` without its enums, 20 us a run
import signal
import threading
from functools import partial
from typing import TYPE_CHECKING

from actionlib_core import shutdown
from actionlib_core.clock import RealClock, current_clock
from smachpy._runtime.asker import shutdown_asking
from smachpy._runtime.frame import RootFrame, Run
from smachpy._runtime.guarded import guarded
from smachpy._runtime.interrupt import Interruption, use_signals
from smachpy.events import Finished, PreemptRequested, PreemptServiced, Started

if TYPE_CHECKING:
    from types import FrameType

    from actionlib_core.clock import Event
    from smachpy.container import Container
    from smachpy.user_data import Remapper, UserData


def execute_root(root: Container, parent_ud: UserData | Remapper | None) -> str:
    """Run `root` as the top of a machine.

    In the main thread it runs right there; a state that ignores its preempt is interrupted by a
    signal. In another thread it runs in a task of its own, because a state that blocks in C could
    not be interrupted there: the task can be left behind.

    Blocks: until it has ended.
    """
    stop = _Stop(root, shutdown.current_shutdown())
    forget = shutdown.on_shutdown(stop)
    ctrl_c: _CtrlC | None = None
    try:
        if shutdown.requested():
            stop()
        if threading.current_thread() is threading.main_thread():
            use_signals()
            ctrl_c = _CtrlC.install(stop)
        elif root.preempt_timeout is not None:
            return _Boundary(root, parent_ud).run()
        return _run_root(root, parent_ud, None)
    finally:
        if ctrl_c is not None:
            ctrl_c.remove()
        stop.end()
        forget()
        root._forget_preempt()  # noqa: SLF001  one asked for during the last steps was for this run


def _run_root(
    root: Container, parent_ud: UserData | Remapper | None, boundary: _Boundary | None
) -> str:
    run = Run(current_clock())
    frame = RootFrame(root, run, boundary)
    if boundary is not None:
        boundary.begin(frame)
    control = root._control  # noqa: SLF001  one machinery
    if control is not None:
        control.attach(run)
    if root._listeners or root._tapes:  # noqa: SLF001  one machinery
        run.watched = True
    if run.watched:
        frame.emit_own(Started, tuple(root.get_initial_states()))
    asker, root._asker = root._asker, None  # noqa: SLF001  one machinery
    if root.preempt_requested():
        frame.asked = frame.called_off = True
    if not run.watched:
        return _run_in(root, frame, parent_ud)
    if asker is not None and frame.asked:
        frame.emit_own(PreemptRequested, *asker)
    outcome: str | None = None
    try:
        outcome = _run_in(root, frame, parent_ud)
        if frame.asked and frame.answered:
            frame.emit_own(PreemptServiced)
    finally:
        frame.emit_own(Finished, outcome)
    return outcome


def _run_in(root: Container, frame: RootFrame, parent_ud: UserData | Remapper | None) -> str:
    """Run `root` in `frame`, with its options around it if it has any."""
    run = partial(root._run, frame)  # noqa: SLF001  one machinery
    outcome: str = guarded(root, run, frame)(parent_ud)
    return outcome


class _Boundary:
    """A root that runs in a task of its own, so that it can be left behind."""

    def __init__(self, root: Container, parent_ud: UserData | Remapper | None) -> None:
        self._root = root
        self._userdata = parent_ud
        self._done: Event = current_clock().event(f"the end of /{root.name or 'SM_ROOT'}")
        self._lock = threading.Lock()
        self._frame: RootFrame | None = None
        self._ended = False
        self._outcome = "preempted"
        self._error: BaseException | None = None

    def run(self) -> str:
        """Run the root and return its outcome."""
        current_clock().spawn(self._work, name=f"/{self._root.name or 'SM_ROOT'}")
        self._done.wait()
        if self._error is not None:
            raise self._error
        return self._outcome

    def begin(self, frame: RootFrame) -> None:
        """The root runs in `frame`."""
        self._frame = frame

    def outcome_left(self) -> str:
        """Return the root's outcome if it is left behind now."""
        frame = self._frame
        late = frame is not None and frame.asked and not frame.called_off
        return self._root.timeout_outcome if late else "preempted"

    def abandon(self) -> None:
        """Go on without the root's thread."""
        self._end(self.outcome_left(), None)

    def _work(self) -> None:
        outcome, failure = "preempted", None
        try:
            outcome = _run_root(self._root, self._userdata, self)
        except Interruption:
            pass
        except BaseException as error:  # noqa: BLE001  raised in the caller's thread
            failure = error
        self._end(outcome, failure)

    def _end(self, outcome: str, error: BaseException | None) -> None:
        with self._lock:
            if self._ended:
                return
            self._ended = True
        self._outcome, self._error = outcome, error
        self._done.set()


class _Stop:
    """Preempts one run of a root; without effect on later ones.

    The lock is for this alone: the run's end waits for a request that is under way.
    """

    def __init__(self, root: Container, ending: shutdown.Shutdown) -> None:
        self._root = root
        self._shutdown = ending
        self._over = False
        self._calling = threading.RLock()

    def __call__(self) -> None:
        with self._calling:
            if not self._over:
                self._over = True
                with shutdown_asking(self._shutdown):
                    self._root.request_preempt()

    def end(self) -> None:
        with self._calling:
            self._over = True


class _CtrlC:
    """The first Ctrl-C requests the program's shutdown, the second raises KeyboardInterrupt."""

    def __init__(self, stop: _Stop) -> None:
        self._stop = stop
        self._seen = False

    @classmethod
    def install(cls, stop: _Stop) -> _CtrlC | None:
        """Handle Ctrl-C, unless the program does so itself; in the main thread."""
        if _signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
            return None
        made = cls(stop)
        _signal.signal(signal.SIGINT, made)
        return made

    def remove(self) -> None:
        """Give Ctrl-C back to Python, unless somebody else has taken it meanwhile."""
        if _signal.getsignal(signal.SIGINT) is self:
            _signal.signal(signal.SIGINT, signal.default_int_handler)

    def __call__(self, number: int, _stack: FrameType | None) -> None:
        if self._seen:
            raise KeyboardInterrupt
        self._seen = True
        current = shutdown.current_shutdown()
        name = signal.Signals(number).name
        current.note(name)
        # Delivering takes locks, which the interrupted code may hold: another thread does it, of
        # a clock of its own, whose locks nobody holds.
        RealClock().spawn(lambda: self._deliver(current, name), name="shutdown")

    def _deliver(self, current: shutdown.Shutdown, name: str) -> None:
        self._stop()
        current.request(name)
