"""rospy's module with `Rate`, `Timer` and `sleep`."""

from smachpy.ros1.names.rospy.rostime import Rate, Timer, TimerEvent, sleep

__all__ = ["Rate", "Timer", "TimerEvent", "sleep"]
