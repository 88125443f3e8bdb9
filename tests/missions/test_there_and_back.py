from __future__ import annotations

import math

import pytest

from smachpy import events as ev
from smachpy.exceptions import InvalidStateError
from smachpy_missions.lesson_06_drive import there_and_back


def test_it_stops_after_three_seconds_and_drives_home(clock, simulation):
    home = simulation.robot.body.pose
    machine = there_and_back()
    events, turned_back = [], []

    def listen(event):
        events.append(event)
        if isinstance(event, ev.Left) and event.path.endswith("/GO"):
            turned_back.append((simulation.robot.body.pose, simulation.robot.body.standing))

    machine.subscribe(listen)
    assert machine.execute() == "succeeded"
    left = [(e.path.rpartition("/")[2], e.outcome) for e in events if isinstance(e, ev.Left)]
    assert left == [("REMEMBER", "valid"), ("GO", "stopped"), ("COME_BACK", "succeeded")]
    ((pose, standing),) = turned_back
    assert standing
    assert 1.0 < pose.distance(home) < 5.0
    assert simulation.robot.body.pose.distance(home) < 0.05
    done = [(e.status, e.t) for e in events if isinstance(e, ev.GoalDone)]
    assert [status for status, _ in done] == ["PREEMPTED", "SUCCEEDED"]
    sent = next(e.t for e in events if isinstance(e, ev.GoalSent))
    assert done[0][1] - sent == pytest.approx(3.0 + 0.7, abs=0.4)


def test_a_near_goal_is_reached_before_the_time_is_up(simulation):
    x, y, _ = simulation.robot.body.pose
    assert there_and_back(x=x, y=y + 0.6, yaw=1.57, seconds=10).execute() == "succeeded"


def test_a_goal_in_a_wall_ends_it(simulation):
    assert there_and_back(x=0.5, y=5.0).execute() == "aborted"


@pytest.mark.parametrize("seconds", [-1.0, math.nan])
def test_a_time_that_is_none_is_refused(seconds):
    with pytest.raises(InvalidStateError, match=f"timeout: got {seconds}"):
        there_and_back(seconds=seconds)
