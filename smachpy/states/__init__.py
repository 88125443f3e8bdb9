"""Ready-made states for robot missions, and their parts.

Each is a state for `sm.add(...)`, or a function that makes one: `drive_to`, `turn`, `locate`,
`nav2_active`, `AskOperator`, `AwaitMessage`, `Wait`, `Serve`. The lessons in `missions` use them.
"""

from __future__ import annotations

from smachpy.exceptions import MissionError
from smachpy.places.exceptions import InputFileError, NavigationError
from smachpy.places.pose import Pose2D
from smachpy.states.ask_operator import AskOperator
from smachpy.states.driving import (
    DRIVE_TIMEOUT,
    SIGNAL_TIMEOUT,
    TURN_TIMEOUT,
    drive_back,
    drive_to,
    goal_at,
    locate,
    turn,
)
from smachpy.states.localising import pose_of
from smachpy.states.nav2 import nav2_active
from smachpy.states.progress import Progress
from smachpy.states.questions import (
    AnswerRefusedError,
    Question,
    find_questions,
    give_answer,
)
from smachpy.states.ros2_nodes import RestoreParameters, SetLifecycle, SetParameters
from smachpy.states.serving import Serve, serve_during, serving_machine
from smachpy.states.waiting import AwaitMessage, Wait
from smachpy.states.waypoints import PlaceFile, Route, Waypoint, load_route

__all__ = [
    "DRIVE_TIMEOUT",
    "SIGNAL_TIMEOUT",
    "TURN_TIMEOUT",
    "AnswerRefusedError",
    "AskOperator",
    "AwaitMessage",
    "InputFileError",
    "MissionError",
    "NavigationError",
    "PlaceFile",
    "Pose2D",
    "Progress",
    "Question",
    "RestoreParameters",
    "Route",
    "Serve",
    "SetLifecycle",
    "SetParameters",
    "Wait",
    "Waypoint",
    "drive_back",
    "drive_to",
    "find_questions",
    "give_answer",
    "goal_at",
    "load_route",
    "locate",
    "nav2_active",
    "pose_of",
    "serve_during",
    "serving_machine",
    "turn",
]
