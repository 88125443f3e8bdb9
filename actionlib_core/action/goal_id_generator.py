"""ROS 1's module name for `GoalIDGenerator`."""

from actionlib_core.action.client import GoalIDGenerator

__all__ = ["GoalIDGenerator"]
