"""Ready-made states for robot missions, and their parts.

Each is a state for `sm.add(...)`, or a function that makes one: `drive_to`, `turn`, `locate`,
`nav2_active`, `AskOperator`, `AwaitMessage`, `Barrier`, `Wait`, `Serve`. The lessons in `missions`
use them. The modules of this package are imported when they are used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from smachpy.exceptions import MissionError as MissionError
    from smachpy.places.exceptions import InputFileError as InputFileError
    from smachpy.places.exceptions import NavigationError as NavigationError
    from smachpy.places.pose import Pose2D as Pose2D
    from smachpy.states.ask_operator import AskOperator as AskOperator
    from smachpy.states.bags import RecordBag as RecordBag
    from smachpy.states.barrier import Barrier as Barrier
    from smachpy.states.confirming import confirm as confirm
    from smachpy.states.confirming import set_autonomy as set_autonomy
    from smachpy.states.driving import DRIVE_TIMEOUT as DRIVE_TIMEOUT
    from smachpy.states.driving import SIGNAL_TIMEOUT as SIGNAL_TIMEOUT
    from smachpy.states.driving import TURN_TIMEOUT as TURN_TIMEOUT
    from smachpy.states.driving import drive_back as drive_back
    from smachpy.states.driving import drive_to as drive_to
    from smachpy.states.driving import goal_at as goal_at
    from smachpy.states.driving import locate as locate
    from smachpy.states.driving import turn as turn
    from smachpy.states.localising import pose_of as pose_of
    from smachpy.states.nav2 import clear_costmaps as clear_costmaps
    from smachpy.states.nav2 import dock as dock
    from smachpy.states.nav2 import follow_waypoints as follow_waypoints
    from smachpy.states.nav2 import nav2_active as nav2_active
    from smachpy.states.nav2 import undock as undock
    from smachpy.states.progress import Progress as Progress
    from smachpy.states.questions import AnswerRefusedError as AnswerRefusedError
    from smachpy.states.questions import Question as Question
    from smachpy.states.questions import find_questions as find_questions
    from smachpy.states.questions import give_answer as give_answer
    from smachpy.states.ros2_nodes import RestoreParameters as RestoreParameters
    from smachpy.states.ros2_nodes import SetLifecycle as SetLifecycle
    from smachpy.states.ros2_nodes import SetParameters as SetParameters
    from smachpy.states.serving import Serve as Serve
    from smachpy.states.serving import serve_during as serve_during
    from smachpy.states.serving import serving_machine as serving_machine
    from smachpy.states.topics import LookUpTransform as LookUpTransform
    from smachpy.states.topics import Publish as Publish
    from smachpy.states.waiting import AwaitMessage as AwaitMessage
    from smachpy.states.waiting import Wait as Wait
    from smachpy.states.waypoints import PlaceFile as PlaceFile
    from smachpy.states.waypoints import Route as Route
    from smachpy.states.waypoints import Waypoint as Waypoint
    from smachpy.states.waypoints import load_route as load_route

__all__ = [
    "DRIVE_TIMEOUT",
    "SIGNAL_TIMEOUT",
    "TURN_TIMEOUT",
    "AnswerRefusedError",
    "AskOperator",
    "AwaitMessage",
    "Barrier",
    "InputFileError",
    "LookUpTransform",
    "MissionError",
    "NavigationError",
    "PlaceFile",
    "Pose2D",
    "Progress",
    "Publish",
    "Question",
    "RecordBag",
    "RestoreParameters",
    "Route",
    "Serve",
    "SetLifecycle",
    "SetParameters",
    "Wait",
    "Waypoint",
    "clear_costmaps",
    "confirm",
    "dock",
    "drive_back",
    "drive_to",
    "find_questions",
    "follow_waypoints",
    "give_answer",
    "goal_at",
    "load_route",
    "locate",
    "nav2_active",
    "pose_of",
    "serve_during",
    "serving_machine",
    "set_autonomy",
    "turn",
    "undock",
]

_HOMES = {
    "AnswerRefusedError": "smachpy.states.questions",
    "AskOperator": "smachpy.states.ask_operator",
    "AwaitMessage": "smachpy.states.waiting",
    "Barrier": "smachpy.states.barrier",
    "DRIVE_TIMEOUT": "smachpy.states.driving",
    "InputFileError": "smachpy.places.exceptions",
    "LookUpTransform": "smachpy.states.topics",
    "MissionError": "smachpy.exceptions",
    "NavigationError": "smachpy.places.exceptions",
    "PlaceFile": "smachpy.states.waypoints",
    "Pose2D": "smachpy.places.pose",
    "Progress": "smachpy.states.progress",
    "Publish": "smachpy.states.topics",
    "Question": "smachpy.states.questions",
    "RecordBag": "smachpy.states.bags",
    "RestoreParameters": "smachpy.states.ros2_nodes",
    "Route": "smachpy.states.waypoints",
    "SIGNAL_TIMEOUT": "smachpy.states.driving",
    "Serve": "smachpy.states.serving",
    "SetLifecycle": "smachpy.states.ros2_nodes",
    "SetParameters": "smachpy.states.ros2_nodes",
    "TURN_TIMEOUT": "smachpy.states.driving",
    "confirm": "smachpy.states.confirming",
    "set_autonomy": "smachpy.states.confirming",
    "Wait": "smachpy.states.waiting",
    "Waypoint": "smachpy.states.waypoints",
    "clear_costmaps": "smachpy.states.nav2",
    "dock": "smachpy.states.nav2",
    "drive_back": "smachpy.states.driving",
    "drive_to": "smachpy.states.driving",
    "find_questions": "smachpy.states.questions",
    "follow_waypoints": "smachpy.states.nav2",
    "give_answer": "smachpy.states.questions",
    "goal_at": "smachpy.states.driving",
    "load_route": "smachpy.states.waypoints",
    "locate": "smachpy.states.driving",
    "nav2_active": "smachpy.states.nav2",
    "pose_of": "smachpy.states.localising",
    "serve_during": "smachpy.states.serving",
    "serving_machine": "smachpy.states.serving",
    "turn": "smachpy.states.driving",
    "undock": "smachpy.states.nav2",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'smachpy.states' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
