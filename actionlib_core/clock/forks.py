"""Copies of this process, which `os.fork` and `multiprocessing` make.

A copy has the memory of this process, but none of its other threads, and files, sessions, databases
and child processes stay those of this one. So in a copy everything that waits for a thread returns
at once, everything that writes does nothing or refuses, and a copy that comes back from the user's
code ends.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import traceback
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from typing import NoReturn

END_S: Final = 2
"""Longest time for the end of a copy [s]."""


def is_copy(pid: int) -> bool:
    """Return whether this process is a copy of the process `pid`, in which something was made."""
    return os.getpid() != pid


def end_copy(error: BaseException | None) -> NoReturn:
    """End this process, a copy that comes back from the user's code with this exception or None.

    Its exit code is that of a program that ends so. Nothing is closed: it is all the parent's.
    """
    # A stream's lock may be held by a thread that exists only in the parent.
    with contextlib.suppress(ValueError):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGALRM})
    signal.alarm(END_S)
    code = 0
    if isinstance(error, SystemExit):
        code = error.code if isinstance(error.code, int) else int(error.code is not None)
        if code and not isinstance(error.code, int):
            _write(f"{error.code}\n")
    elif error is not None:
        code = 1
        _write("".join(traceback.format_exception(error)))
    flush_streams()
    os._exit(code)


def _write(text: str) -> None:
    with contextlib.suppress(Exception):
        sys.stderr.write(text)


def flush_streams() -> None:
    """Write what waits in standard output and error; what they raise is the program's to find."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(Exception):
            stream.flush()


if hasattr(os, "register_at_fork"):
    # Or a copy would write it again at its end.
    os.register_at_fork(before=flush_streams)
