"""Slips that SMACH accepted and this package refuses; programs for ROS 1 may go on with them.

`accepts` is asked where such a slip is found. It says no by itself; while `smachpy.ros1` is
installed it says yes, and warns once of each slip, with the line of the program.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import FrameType

__all__ = ["SlipWarning", "accepting", "accepts", "set_accepting"]

_OURS = tuple(
    str(Path(__file__).resolve().parent.parent / name)
    for name in ("smachpy", "actionlib_core", "viz")
)


class SlipWarning(UserWarning):
    """A program does what SMACH accepted and this package refuses elsewhere."""


ACCEPTING = [False]
"""Whether slips are accepted now; see `accepting`."""
_told: set[tuple[str, int, str]] = set()


def accepting() -> bool:
    """Tell whether slips are accepted now."""
    return ACCEPTING[0]


def set_accepting(on: bool) -> None:
    """Accept slips from now on, or refuse them; which ones were told is forgotten."""
    ACCEPTING[0] = on
    _told.clear()


def accepts(problem: str) -> bool:
    """Tell whether the program may go on with a slip; warns of it then.

    Args:
        problem: What is wrong, as an error would say it.

    Warns:
        SlipWarning: it may; once for each line of the program and problem.
    """
    if not ACCEPTING[0]:
        return False
    frame = _program_frame(sys._getframe(1))  # as `warnings` looks for its caller
    file, line = (frame.f_code.co_filename, frame.f_lineno) if frame else ("smachpy", 0)
    if (file, line, problem) not in _told:
        _told.add((file, line, problem))
        text = f"{problem} SMACH went on with it, and so does this run."
        warnings.warn_explicit(text, SlipWarning, file, line)
    return True


def _program_frame(frame: FrameType | None) -> FrameType | None:
    """Return the innermost frame of the program's own code."""
    while frame is not None:
        file = frame.f_code.co_filename
        if not file.startswith((*_OURS, "<")) and "importlib" not in file:
            return frame
        frame = frame.f_back
    return None
