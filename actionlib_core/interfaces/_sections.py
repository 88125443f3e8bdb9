"""The parts of `.srv` and `.action` text between `---` lines, and the messages made of them."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass

from actionlib_core.exceptions import InterfaceError, InterfaceWarning
from actionlib_core.interfaces._definition import Position

_SEPARATOR = "---"
# Printed course notes turn three hyphens into an en or em dash.
_LOOKS_LIKE_SEPARATOR = re.compile(r"\s*(-{2,}|[\u2012-\u2015]+|-[\u2012-\u2015]+)\s*(#.*)?\Z")

SERVICE_PARTS = ("request", "response")
ACTION_PARTS = ("goal", "result", "feedback")
_warned: dict[str | tuple[str, type[Warning], int], int] = {}  # so that each is shown once


@dataclass(frozen=True, slots=True)
class Section:
    """One part of a definition and the line it starts at."""

    text: str
    first_line: int


def split(text: str, parts: tuple[str, ...], source: str) -> tuple[Section, ...]:
    """Split a definition at its separators.

    Args:
        text: The whole `.srv` or `.action` text.
        parts: Names of the parts expected, for the error message.
        source: File name for messages.

    Raises:
        InterfaceError: More or fewer separators than the parts need.

    Warns:
        InterfaceWarning: A separator that is not exactly three hyphens.
    """
    lines = text.splitlines()
    sections: list[list[str]] = [[]]
    starts = [1]
    wanted = len(parts) - 1
    expected = f"expected {wanted} `---` between {', '.join(parts)}"
    for number, line in enumerate(lines, 1):
        match = _LOOKS_LIKE_SEPARATOR.match(line)
        if match is None:
            sections[-1].append(line)
            continue
        at = Position(source, number, line.index(match[1]), line)
        if len(starts) > wanted:
            raise InterfaceError(at.problem(f"one separator too many; {expected}"))
        if match[1] != _SEPARATOR:
            what = f"separator {match[1]!r} taken for '---'. Try writing '---'"
            warnings.warn_explicit(what, InterfaceWarning, source, number, registry=_warned)
        sections.append([])
        starts.append(number + 1)
    if len(starts) <= wanted:
        at = Position(source, len(lines) or 1, 0, lines[-1] if lines else "")
        raise InterfaceError(at.problem(f"got {len(starts) - 1} separators; {expected}"))
    return tuple(
        Section("\n".join(part) + "\n" if part else "", start)
        for part, start in zip(sections, starts, strict=True)
    )


def action_messages(name: str) -> dict[str, str]:
    """Return the text of the four messages around an action's goal, result and feedback.

    Source: actionlib's genaction.

    Args:
        name: The action's short name, "MoveBase".
    """
    return {
        f"{name}Action": f"{name}ActionGoal action_goal\n"
        f"{name}ActionResult action_result\n"
        f"{name}ActionFeedback action_feedback\n",
        f"{name}ActionGoal": f"Header header\nactionlib_msgs/GoalID goal_id\n{name}Goal goal\n",
        f"{name}ActionResult": "Header header\nactionlib_msgs/GoalStatus status\n"
        f"{name}Result result\n",
        f"{name}ActionFeedback": "Header header\nactionlib_msgs/GoalStatus status\n"
        f"{name}Feedback feedback\n",
    }
