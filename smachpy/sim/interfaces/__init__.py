"""The action `charge` of the simulated robot, from the file in ROS layout beside this module.

Own definitions are added in the same way: a folder in ROS layout and `add_path`.
"""

from __future__ import annotations

from pathlib import Path

from actionlib_core.interfaces import add_path

add_path(Path(__file__).parent)

from actionlib_core.interfaces.mission_msgs.msg import (  # noqa: E402  found since the line above
    ChargeAction,
    ChargeFeedback,
    ChargeGoal,
    ChargeResult,
)

__all__ = ["ChargeAction", "ChargeFeedback", "ChargeGoal", "ChargeResult"]
