"""Break into a thread that does not listen: the last resort of the preemption contract.

Python offers two ways, and each reaches what the other does not:

- a signal to the main thread wakes blocking calls too (`Lock.acquire`, `socket.recv`,
  `time.sleep`): they return, the handler runs, and what it raises goes through the state;
- an exception set for another thread is raised there at the next bytecode, so it ends loops but
  no call that blocks in C. Such a thread can only be left behind.

A virtual clock interrupts what waits on it by itself, so that tests stay deterministic.

Source: CPython's `PyThreadState_SetAsyncExc` and the `signal` module's documentation, "Execution
of Python signal handlers".
"""

from __future__ import annotations

import signal
import sys
import threading
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from actionlib_core.clock import Clock

SIGNAL = signal.SIGURG  # ignored by default, so a late one does no harm


class Interruption(BaseException):
    """Raised inside a state that ignored its preempt; never seen outside its container."""


class ProgramEnds(Exception):  # noqa: N818  a fact, no fault
    """Raised by a wait inside a state as the program is to end, in programs for ROS 1.

    A state that lets it through ends as one that was preempted.
    """


@runtime_checkable
class InterruptingClock(Protocol):
    """A clock that can end a wait with an exception."""

    def interrupt(self, ident: int, error: BaseException) -> bool:
        """Raise `error` in the thread `ident` if it waits on this clock; tell whether it did."""
        ...


class _Breaker:
    """What the signal handler shall break into, if it is still wanted then."""

    def __init__(self) -> None:
        self.is_wanted: Callable[[], bool] | None = None
        self.installed = False

    def __call__(self, _number: int, _stack: FrameType | None) -> None:
        is_wanted, self.is_wanted = self.is_wanted, None
        if is_wanted is not None and is_wanted():
            raise Interruption


_target: Any = _Breaker()


def interrupt(clock: Clock, ident: int, is_wanted: Callable[[], bool]) -> bool:
    """Raise `Interruption` in the child that runs in the thread `ident`; with the run's lock held.

    Args:
        clock: The clock of the run.
        ident: The thread; 0: none yet.
        is_wanted: Asked in that thread just before, if it comes by a signal.

    Returns:
        Whether it is on its way and has to be taken back (`take_back`) when the child ends first.
    """
    if not ident:
        return False
    if isinstance(clock, InterruptingClock) and clock.interrupt(ident, Interruption()):
        return False
    handler: Any = signal.getsignal(SIGNAL)
    if ident == threading.main_thread().ident and handler is _target:
        _target.is_wanted = is_wanted
        signal.pthread_kill(ident, SIGNAL)
        return False
    _set_exception(ident, Interruption)
    return True


def take_back(ident: int) -> None:
    """Take back an interruption that has not arrived; with the run's lock held."""
    _set_exception(ident, None)


class _Attention(BaseException):
    """Raised and caught in `_set_exception`, to be seen by nobody."""


def _set_exception(ident: int, kind: type[BaseException] | None) -> None:
    """Set the exception that the thread `ident` raises next, or take it back with None.

    Before 3.13 the interpreter then looks for it at every step of every thread until a thread has
    raised one. It would look for ever when the exception is taken back or its thread stays in C,
    which costs time, and in 3.11 a function that is traced then (by a debugger, by coverage) never
    begins. So this thread raises one itself; a thread that returns from C looks on its own. No
    function is called between the two, as it could be a traced one.
    """
    import ctypes

    set_exception = ctypes.pythonapi.PyThreadState_SetAsyncExc
    pointer = None if kind is None else ctypes.py_object(kind)
    target, me = ctypes.c_ulong(ident), ctypes.c_ulong(threading.get_ident())
    attention = ctypes.py_object(_Attention)
    if sys.version_info >= (3, 13) or (kind is not None and target.value == me.value):
        set_exception(target, pointer)
        return
    try:
        set_exception(target, pointer)
        set_exception(me, attention)
        while True:  # it comes as this turns
            pass
    except _Attention:
        return
    except BaseException:  # a signal's handler has raised first
        try:
            while True:
                pass
        except _Attention:
            pass
        raise


def use_signals() -> None:
    """Let a signal break into states in the main thread; call it there.

    The handler stays, as it does nothing unless a state is overdue. A program that handles the
    signal itself keeps its handler.
    """
    if not _target.installed and signal.getsignal(SIGNAL) is signal.SIG_DFL:
        signal.signal(SIGNAL, _target)
    _target.installed = True
