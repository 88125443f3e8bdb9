"""Lesson 8: a scripted battery, full or empty, while the robot drives."""

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from smachpy_missions.lesson_08_together import watched_drive


@pytest.mark.parametrize(("charge", "outcome"), [(0.9, "succeeded"), (0.1, "low")])
def test_a_low_battery_stops_the_drive(mission, charge, outcome):
    robot = mission.action_server("move_base", MoveBaseAction)
    robot.default_result(duration=10)
    mission.topic("battery", BatteryState).publish_at(4.0, {"percentage": charge})
    run = mission(watched_drive())
    run.assert_outcome(outcome)
    assert len(robot.cancelled) == (outcome == "low")
