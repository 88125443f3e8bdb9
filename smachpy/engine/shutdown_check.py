"""The function that says whether the program is shutting down; a program may set its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.base.problems import Problems

if TYPE_CHECKING:
    from collections.abc import Callable


def _program_ends() -> bool:
    from actionlib_core import shutdown

    return shutdown.requested()


class _ShutdownCheck:
    """The function that returns whether the program is shutting down.

    Attributes:
        is_own: `set_shutdown_check` was called.
    """

    function: Callable[[], bool] = staticmethod(_program_ends)
    is_own = False


SHUTDOWN_CHECK = _ShutdownCheck()


def is_shutdown() -> bool:
    """Return whether the program is shutting down.

    The answer comes from the check of `set_shutdown_check`, else from `actionlib_core.shutdown`.
    """
    return SHUTDOWN_CHECK.function()


def set_shutdown_check(cb: Callable[[], bool]) -> None:
    """Set the function that returns whether the program is shutting down.

    Machines end 'preempted' when it returns a true value. It is called before each state of a
    state machine, so it does not interrupt one: `request_preempt` does.

    Raises:
        InvalidStateError: `cb` cannot be called.

    Threads: it is called in the threads of the running machines.
    """
    problems = Problems("set_shutdown_check")
    problems.function("cb", cb, "cb()", 0, optional=False)
    problems.raise_all()
    SHUTDOWN_CHECK.function, SHUTDOWN_CHECK.is_own = cb, True


def reset_shutdown_check() -> None:
    """Undo `set_shutdown_check`."""
    SHUTDOWN_CHECK.function, SHUTDOWN_CHECK.is_own = _program_ends, False
