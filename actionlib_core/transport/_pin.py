"""Let Python remember the network library's threads, which it otherwise forgets at each callback.

CPython makes a thread state for a foreign thread that calls back and destroys it as the callback
returns, with a mapping of memory each time: about 14 microseconds of a callback that otherwise
takes 2 (3.11, this kind of machine). A thread that has entered once more than it has left keeps
its state.

Source:
    https://docs.python.org/3/c-api/init.html#non-python-created-threads
"""

from __future__ import annotations

import ctypes
import sys

LONGEST = 64  # threads; a library that starts more of them than this has no pool worth keeping

_enter = ctypes.pythonapi.PyGILState_Ensure if sys.implementation.name == "cpython" else None

pinned: set[int] = set()
"""The threads that are kept, by their idents."""


def pin(me: int) -> None:
    """Keep the state of the calling thread, whose ident is `me`, until the interpreter ends.

    An ident that comes again for a new thread stays in `pinned`: that thread is not kept, which
    costs it time and nothing else.
    """
    if _enter is not None and len(pinned) < LONGEST:
        _enter()
    pinned.add(me)
