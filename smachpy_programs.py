"""The programs `smachpy` and `actionlib`, which Ctrl-C ends without a traceback from the start on.

A top-level module of its own: `import smachpy` takes 80 ms, much longer on a busy robot, and any
module inside the package is imported only after that. What is to hold meanwhile has to lie outside.
"""

from __future__ import annotations

import os
import signal

_INTERRUPTED = 128 + signal.SIGINT


def smachpy() -> int:
    """Run the `smachpy` command; returns its exit code."""
    _leave_quietly()
    from smachpy.command import main

    return main(on_ready=_raise_again)


def actionlib() -> int:
    """Run the `actionlib` command; returns its exit code."""
    _leave_quietly()
    from actionlib_core.cli import main

    return main(on_ready=_raise_again)


def _leave_quietly() -> None:
    """End the process on Ctrl-C: an exception out of an import is often swallowed or renamed."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, lambda _number, _frame: os._exit(_INTERRUPTED))


def _raise_again() -> None:
    """Raise KeyboardInterrupt on Ctrl-C, unless the process was told to ignore it."""
    if callable(signal.getsignal(signal.SIGINT)):
        signal.signal(signal.SIGINT, signal.default_int_handler)
