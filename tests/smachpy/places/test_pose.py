from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from smachpy.places.pose import ORIGIN, Pose2D, quaternion_of, wrap_angle, yaw_of

angles = st.floats(-50.0, 50.0)
poses = st.builds(Pose2D, st.floats(-20, 20), st.floats(-20, 20), st.floats(-math.pi, math.pi))


def inverse(pose):
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return Pose2D(-c * pose.x - s * pose.y, s * pose.x - c * pose.y, -pose.yaw)


def same(a, b):
    assert (a.x, a.y) == pytest.approx((b.x, b.y), abs=1e-9)
    assert wrap_angle(a.yaw - b.yaw) == pytest.approx(0.0, abs=1e-9)


@given(angles)
def test_a_wrapped_angle_points_the_same_way(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@given(angles, st.floats(0.1, 10.0) | st.floats(1e-290, 1e-280) | st.floats(1e300, 1e308))
def test_a_heading_survives_a_quaternion_of_any_length(angle, length):
    yaw = yaw_of(*(length * value for value in quaternion_of(angle)))
    assert wrap_angle(yaw - angle) == pytest.approx(0.0, abs=1e-9)


@given(poses)
def test_a_step_back_returns_to_where_it_began(pose):
    same(pose.then(inverse(pose)), ORIGIN)
    same(inverse(pose).then(pose), ORIGIN)


@given(poses, poses, poses)
def test_steps_may_be_grouped_in_any_way(a, b, c):
    same(a.then(b).then(c), a.then(b.then(c)))


@given(poses, poses)
def test_a_step_is_as_long_in_every_frame(frame, step):
    assert frame.distance(frame.then(step)) == pytest.approx(math.hypot(step.x, step.y), abs=1e-9)
