"""Interrupt a thread whose state ignores its preempt: the last resort of preemption.

Python offers two ways, and each works where the other does not:

- a signal to the main thread also ends blocking calls (`Lock.acquire`, `socket.recv`,
  `time.sleep`): the handler runs, and the exception that it raises goes through the state;
- an exception set for any other thread is raised there at the next bytecode, so it ends loops but
  not a call that blocks in C. Such a thread can only be left behind.

A virtual clock interrupts its own waits, so that tests stay deterministic.

Source: CPython's `PyThreadState_SetAsyncExc` and the `signal` module's documentation, "Execution
of Python signal handlers".
"""

from __future__ import annotations

import signal
import sys
import threading
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

    from actionlib_core.clock import Clock

T = TypeVar("T")

SIGNAL = signal.SIGURG  # its default action is to ignore it, so a late one does no harm


class Interruption(BaseException):
    """Raised inside a state that ignored its preempt; never leaves its container.

    Not an `Exception`, so that `except Exception` in the state does not swallow it.
    """


def uninterrupted(frame: Any, function: Callable[[], T]) -> T:
    """Return `function()`, which is called again if an interruption that was pending ends it.

    It ends the visit of what `frame` runs: once it is through, no interruption is pending any more.

    Raises:
        Interruption: the thread was left behind.
    """
    while True:
        try:
            return function()
        except Interruption:
            if frame.dead:
                raise


class ProgramEnds(Exception):  # noqa: N818  not an error
    """Raised by a wait inside a state at shutdown, in programs for ROS 1.

    A state that does not catch it ends as a preempted one.
    """


class _SignalHandler:
    """The handler of `SIGNAL`: interrupts the main thread if that is still due when it runs."""

    def __init__(self) -> None:
        self.is_wanted: Callable[[], bool] | None = None
        self.installed = False

    def __call__(self, _number: int, _stack: FrameType | None) -> None:
        is_wanted, self.is_wanted = self.is_wanted, None
        if is_wanted is not None and is_wanted():
            raise Interruption


_handler: Any = _SignalHandler()


def interrupt(clock: Clock, ident: int, is_wanted: Callable[[], bool]) -> bool:
    """Raise `Interruption` in the child that runs in the thread `ident`; with the run's lock held.

    Args:
        clock: The clock of the run.
        ident: The thread; 0 if it has not started yet.
        is_wanted: Called in that thread just before the exception is raised, if a signal is used.

    Returns:
        Whether an exception is now pending, which `take_back` must remove if the child ends first.
    """
    if not ident:
        return False
    end_wait = getattr(clock, "interrupt", None)  # a virtual clock ends the waits on it itself
    if end_wait is not None and end_wait(ident, Interruption()):
        return False
    handler: Any = signal.getsignal(SIGNAL)
    if ident == threading.main_thread().ident and handler is _handler:
        _handler.is_wanted = is_wanted
        signal.pthread_kill(ident, SIGNAL)
        return False  # nothing to take back: a late handler asks `is_wanted`
    _set_exception(ident, Interruption)
    return True


def take_back(ident: int) -> None:
    """Remove an interruption that has not been raised yet; with the run's lock held."""
    _set_exception(ident, None)


class _Dummy(BaseException):
    """Raised and caught in `_set_exception` only."""


def _set_exception(ident: int, kind: type[BaseException] | None) -> None:
    """Set the exception that the thread `ident` raises next, or remove it with None.

    Before Python 3.13 a pending exception is announced to all threads by one flag, which is checked
    at every step of the interpreter and cleared only when some thread raises its exception. If ours
    is removed, or its thread stays in C, the flag would stay set: that costs time, and in 3.11 a
    function that is traced meanwhile (by a debugger or coverage) never begins. So this thread
    raises a dummy exception itself, which clears the flag. A thread that returns from C checks
    again on its own. No function is called between the two calls, because it could be a traced one.
    """
    import ctypes

    set_exception = ctypes.pythonapi.PyThreadState_SetAsyncExc
    pointer = None if kind is None else ctypes.py_object(kind)
    target, me = ctypes.c_ulong(ident), ctypes.c_ulong(threading.get_ident())
    dummy = ctypes.py_object(_Dummy)
    if sys.version_info >= (3, 13) or (kind is not None and target.value == me.value):
        set_exception(target, pointer)
        return
    try:
        set_exception(target, pointer)
        set_exception(me, dummy)
        while True:  # it is raised at the jump back
            pass
    except _Dummy:
        return
    except BaseException:  # a signal handler has raised first; the dummy is still to come
        try:
            while True:
                pass
        except _Dummy:
            pass
        raise


def use_signals() -> None:
    """Install the signal handler that interrupts states in the main thread; call it there.

    The handler stays, because it does nothing unless a state is overdue. A program that handles the
    signal itself keeps its own handler.
    """
    if not _handler.installed and signal.getsignal(SIGNAL) is signal.SIG_DFL:
        signal.signal(SIGNAL, _handler)
    _handler.installed = True
