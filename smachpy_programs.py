"""The programs `smachpy` and `actionlib`, which Ctrl-C ends without a traceback from the start on.

A top-level module of its own: `import smachpy` takes 55 ms, much longer on a busy robot, and any
module inside the package is imported only after that. What is to hold meanwhile has to lie outside.

Ctrl-C while Python itself starts (some 20 ms, longer with an editable install) is a traceback of
Python's all the same: none of our code runs before that.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]  # `signal` without its enums, which take 3 ms more
import os

_INTERRUPTED = 128 + _signal.SIGINT


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
    if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
        _signal.signal(_signal.SIGINT, lambda _number, _frame: os._exit(_INTERRUPTED))


def _raise_again() -> None:
    """Raise KeyboardInterrupt on Ctrl-C, unless the process was told to ignore it."""
    if callable(_signal.getsignal(_signal.SIGINT)):
        _signal.signal(_signal.SIGINT, _signal.default_int_handler)
