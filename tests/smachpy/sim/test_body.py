from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy.places.pose import Pose2D, quaternion_of, wrap_angle, yaw_of
from smachpy.places.robot_file import RobotConfig
from smachpy.sim.body import Body

LIMITS = RobotConfig(
    max_speed=1.0,
    max_reverse_speed=0.5,
    max_turn_rate=1.0,
    acceleration=2.0,
    braking=4.0,
    turn_acceleration=3.0,
)


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), max_size=60))
def test_speed_and_acceleration_stay_within_their_limits(commands):
    body, dt = Body(LIMITS, Pose2D(0, 0, 0)), 0.05
    for speed, turn_rate in commands:
        before = body.speed, body.turn_rate
        body.steer(speed, turn_rate, dt)
        body.advance(dt)
        assert -0.5 <= body.speed <= 1.0
        assert abs(body.turn_rate) <= 1.0
        change = body.speed - before[0]
        assert abs(change) <= 4.0 * dt + 1e-12
        assert abs(body.turn_rate - before[1]) <= 3.0 * dt + 1e-12
        assert -math.pi <= body.yaw < math.pi


def test_speeding_up_is_slower_than_braking():
    body = Body(LIMITS, Pose2D(0, 0, 0))
    body.steer(1.0, 0, 0.1)
    assert body.speed == pytest.approx(0.2)
    body.speed = 1.0
    body.steer(0.0, 0, 0.1)
    assert body.speed == pytest.approx(0.6)


def test_an_arc_closes_to_a_circle():
    body = Body(LIMITS, Pose2D(0, 0, 0))
    body.speed, body.turn_rate = 1.0, 0.5
    steps = 40
    for _ in range(steps):
        body.advance(4 * math.pi / steps)
    assert body.pose == pytest.approx((0, 0, 0), abs=1e-9)


def test_it_rolls_the_braking_distance():
    body, dt = Body(LIMITS, Pose2D(0, 0, 0)), 0.001
    body.speed = 1.0
    expected = body.braking_distance()
    while not body.standing:
        body.steer(0, 0, dt)
        body.advance(dt)
    assert body.x == pytest.approx(expected, abs=2e-3)


@given(st.floats(-50, 50), st.floats(0.1, 3))
def test_headings_survive_quaternions_of_any_length(yaw, length):
    x, y, z, w = (length * part for part in quaternion_of(yaw))
    assert wrap_angle(yaw_of(x, y, z, w) - yaw) == pytest.approx(0, abs=1e-6)


def test_a_pose_in_the_robots_frame():
    here = Pose2D(2, 1, math.pi / 2)
    assert here.then(Pose2D(1, 0, 0)) == pytest.approx((2, 2, math.pi / 2))
    assert here.then(Pose2D(0, 1, math.pi)) == pytest.approx((1, 1, -math.pi / 2))
