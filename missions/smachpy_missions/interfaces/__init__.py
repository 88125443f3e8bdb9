"""The messages and actions of the course's missions and of the fleet.

They are made from the definition files beside this module. Your own definitions work in the same
way: a folder in ROS layout and `add_path`. The services are in `smachpy_missions.interfaces.srv`.
"""

from __future__ import annotations

from pathlib import Path

from actionlib_core.interfaces import add_path

add_path(Path(__file__).parent)

# Below `add_path`: the module `mission_msgs` exists only after that call.
from actionlib_core.interfaces.mission_msgs.msg import (  # noqa: E402
    CountdownAction,
    CountdownFeedback,
    CountdownGoal,
    CountdownResult,
    DeliverAction,
    DeliverFeedback,
    DeliverGoal,
    DeliverResult,
    Demo_actionAction,
    Demo_actionFeedback,
    Demo_actionGoal,
    Demo_actionResult,
    DemoMsg,
    RechargeAction,
    RechargeFeedback,
    RechargeGoal,
    RechargeResult,
    TurnAction,
    TurnFeedback,
    TurnGoal,
    TurnResult,
)

__all__ = [
    "CountdownAction",
    "CountdownFeedback",
    "CountdownGoal",
    "CountdownResult",
    "DeliverAction",
    "DeliverFeedback",
    "DeliverGoal",
    "DeliverResult",
    "DemoMsg",
    "Demo_actionAction",
    "Demo_actionFeedback",
    "Demo_actionGoal",
    "Demo_actionResult",
    "RechargeAction",
    "RechargeFeedback",
    "RechargeGoal",
    "RechargeResult",
    "TurnAction",
    "TurnFeedback",
    "TurnGoal",
    "TurnResult",
]
