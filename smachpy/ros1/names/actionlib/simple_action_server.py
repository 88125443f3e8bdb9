"""actionlib's server with one goal at a time."""

from __future__ import annotations

from actionlib_core.action.simple_server import SimpleActionServer as SimpleActionServer
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus as GoalStatus
