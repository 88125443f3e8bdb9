"""Mistakes ("slips") that SMACH accepted and this package refuses, except in programs for ROS 1.

The code that finds such a slip calls `accepts`. It returns False, so that an error is raised. While
`smachpy.ros1` is installed it returns True, and warns once of each slip with the program's line.
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from typing import TYPE_CHECKING

from actionlib_core.names import set_name_replacement

if TYPE_CHECKING:
    from types import FrameType

__all__ = ["SlipWarning", "accepting", "accepts", "set_accepting"]

_ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))  # noqa: PTH120
_OURS = (os.path.join(_ROOT, "smachpy"), os.path.join(_ROOT, "actionlib_core"))  # noqa: PTH118
_APART = ("smachpy_viz", "importlib", "/bin/smachpy")
"""Parts of file names; pictures are a package of their own, and the command a file of its own."""


class SlipWarning(UserWarning):
    """A program for ROS 1 does something that SMACH accepted and this package normally refuses."""


ACCEPTING = [False]
"""Whether slips are accepted now; see `accepting`. A list, as `from ... import` copies a bool."""
_warned: set[tuple[str, int, str]] = set()


def accepting() -> bool:
    """Return whether slips are accepted now."""
    return ACCEPTING[0]


def set_accepting(on: bool) -> None:
    """Accept slips from now on, or refuse them, and warn of each one again."""
    ACCEPTING[0] = on
    set_name_replacement(_allowed_name if on else None)
    _warned.clear()


def _allowed_name(name: str, kind: str) -> str:
    """Return the name to use instead of one that rospy accepted and the network refuses."""
    single = re.sub("//+", "/", name)
    single = single.rstrip("/") or single
    made = re.sub(r"(?!^)~|[^\w/~]", "_", single, flags=re.ASCII)
    made = f"_{made}" if made[:1].isdigit() else made
    # Slashes are no slip: rospy itself removed them.
    problem = f"{kind}: got {name!r}; expected letters, digits, '_' or '/', as in {made!r}."
    return made if made == single or accepts(problem) else name


def accepts(problem: str) -> bool:
    """Return whether a slip is accepted, and warn of it in that case.

    Args:
        problem: The problem, as in the text of an error.

    Warns:
        SlipWarning: it is accepted; once for each line of the program and problem.
    """
    if not ACCEPTING[0]:
        return False
    frame = _program_frame(sys._getframe(1))
    file, line = (frame.f_code.co_filename, frame.f_lineno) if frame else ("smachpy", 0)
    if (file, line, problem) not in _warned:
        _warned.add((file, line, problem))
        text = f"{problem} SMACH went on with it, and so does this run."
        warnings.warn_explicit(text, SlipWarning, file, line)
    return True


def _program_frame(frame: FrameType | None) -> FrameType | None:
    """Return the innermost frame of the program's own code."""
    while frame is not None:
        file = frame.f_code.co_filename
        if not file.startswith((*_OURS, "<")) and not any(one in file for one in _APART):
            return frame
        frame = frame.f_back
    return None
