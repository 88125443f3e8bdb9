"""ROS 1's name for where goal ids are made."""

from actionlib_core.action.client import GoalIDGenerator

__all__ = ["GoalIDGenerator"]
