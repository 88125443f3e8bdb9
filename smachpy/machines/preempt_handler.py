"""`set_preempt_handler`: let a machine end before its program does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.base import log
from smachpy.base.problems import Problems
from smachpy.engine.preempt import shutdown_asking

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.machines.state import State


def set_preempt_handler(sc: State, *, timeout: float | None = 60.0) -> None:
    """Preempt `sc` at shutdown, and let it finish before the network is left.

    Ctrl-C and the program's shutdown preempt a running machine anyway. This function makes the
    program also wait for a machine that runs in another thread, so that its goals are cancelled and
    not left running. Called in the main thread it also makes SIGTERM, SIGHUP and SIGQUIT request
    the shutdown, as Ctrl-C does, unless the program handles or ignores them.

    Args:
        sc: A container, or a state.
        timeout: Longest wait for its end [s]; None waits for ever.

    Raises:
        InvalidStateError: `sc` is not a state, or `timeout` is not a duration.
    """
    from actionlib_core import shutdown

    problems = Problems("set_preempt_handler")
    timeout = problems.seconds("timeout", timeout)
    if not callable(getattr(sc, "request_preempt", None)):
        problems.add(f"sc: got {sc!r}; expected a container or state.")
    problems.raise_all()
    running: Callable[[], bool] = getattr(sc, "is_running", lambda: True)
    wait: Callable[[float | None], object] = getattr(sc, "wait_ended", lambda _timeout: True)

    def stop() -> None:
        if running():
            with shutdown_asking(current):
                sc.request_preempt()
            if not wait(timeout):
                log.logerr(f"{sc!r} still runs {timeout} s after its preempt; it is left behind.")

    current = shutdown.current_shutdown()
    restore = _handle_signals()
    if restore is not None:
        current.at_exit(restore)
    # Both: a program that just returns from `main` is never asked to shut down.
    current.on_shutdown(stop)
    current.at_exit(stop)


def _handle_signals() -> Callable[[], object] | None:
    """Make the signals that end a program by default request the shutdown; not Ctrl-C.

    Returns:
        A function that restores the handlers; None if nothing was changed.
    """
    import contextlib
    import signal
    import threading

    from actionlib_core.clock import RealClock, current_clock
    from actionlib_core.shutdown import default_signals, handle_signals

    real = isinstance(current_clock(), RealClock)
    main = threading.current_thread() is threading.main_thread()
    ours = [number for number in default_signals() if number != signal.SIGINT]
    if not (real and main and ours):
        return None
    handling = contextlib.ExitStack()
    handling.enter_context(handle_signals(ours))
    return handling.close
