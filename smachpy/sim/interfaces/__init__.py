"""The action `charge` of the simulated robot, from the definition file beside this module.

Your own definitions work in the same way: a folder in ROS layout and `add_path`.
"""

from __future__ import annotations

from pathlib import Path

from actionlib_core.interfaces import add_path

add_path(Path(__file__).parent)

# Below `add_path`: the module `mission_msgs` exists only after that call.
from actionlib_core.interfaces.mission_msgs.msg import (  # noqa: E402
    ChargeAction,
    ChargeFeedback,
    ChargeGoal,
    ChargeResult,
)

__all__ = ["ChargeAction", "ChargeFeedback", "ChargeGoal", "ChargeResult"]
