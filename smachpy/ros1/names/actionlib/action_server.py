"""actionlib's server whose program decides about each goal."""

from __future__ import annotations

from actionlib_core.action.server import ActionServer as ActionServer
from actionlib_core.action.server import ServerGoalHandle as ServerGoalHandle
from actionlib_core.action.server import nop_cb as nop_cb
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus as GoalStatus
