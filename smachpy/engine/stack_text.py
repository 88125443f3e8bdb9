"""Where a thread is, or where an error came from, as text without the lines of this library."""

from __future__ import annotations

import os
import sys
from typing import Final

import actionlib_core

TRACE_LINES: Final = 6
_OURS: Final = tuple(
    os.path.dirname(os.path.abspath(path)) + os.sep  # noqa: PTH100, PTH120  texts
    for path in (actionlib_core.__file__ or "", os.path.dirname(__file__))  # noqa: PTH120
)
"""Folders of our packages; a package's is that of its `__init__.py`."""
_STANDARD: Final = os.path.dirname(os.__file__) + os.sep  # noqa: PTH120
_IMPORTS: Final = f"{_STANDARD}importlib{os.sep}"

Line = tuple[str, int, str]
"""One line of a stack: file, line, function."""


def trace_of(error: BaseException) -> str:
    """Return the innermost lines of user code in a traceback, one per line."""
    import traceback  # here, as a machine that works does not need it

    frames = [
        one
        for one in traceback.extract_tb(error.__traceback__)
        if not one.filename.startswith((*_OURS, _IMPORTS, "<"))
    ]
    lines = (f"{one.filename}:{one.lineno} in {one.name}: {one.line}" for one in frames)
    return "\n".join(list(lines)[-TRACE_LINES:])


def stack_of(ident: int) -> list[Line]:
    """Return the stack of the thread `ident`, innermost last."""
    top = sys._current_frames().get(ident)
    lines = []
    while top is not None:
        lines.append((top.f_code.co_filename, top.f_lineno or 0, top.f_code.co_name))
        top = top.f_back
    return lines[::-1]


def stack_text(stack: list[Line]) -> str:
    """Return a stack as in a traceback, beginning with the user's code that the machine called."""
    import traceback

    called = 0
    while called < len(stack) and not stack[called][0].startswith(_OURS):
        called += 1  # the program, up to its call of `execute`
    while called < len(stack) and not _is_users(stack[called][0]):
        called += 1
    lines = stack[called:] or stack  # none: a state of this library waits
    return "".join(traceback.format_list([traceback.FrameSummary(*line) for line in lines]))


def _is_users(file: str) -> bool:
    return not file.startswith((*_OURS, "<")) and (
        not file.startswith(_STANDARD) or "site-packages" in file
    )
