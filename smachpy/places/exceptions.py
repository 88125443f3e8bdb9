"""The exceptions of places that a robot cannot reach, and of the readers of files.

smachpy.exceptions.MissionError
├── InputFileError        a YAML file, map or waypoint list is wrong: all problems at once
└── NavigationError       the robot cannot do what a goal asks
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actionlib_core.inputs.checked_file import Problem


class InputFileError(MissionError):
    """A user's file has problems.

    Try: correct each line that is listed.

    Attributes:
        problems: Every problem found, in the order of the file.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))


class NavigationError(MissionError):
    """The robot cannot do what a goal asks; the text is the abort text of the goal.

    Try: send a goal that lies on free floor, within the map.
    """
