"""Transforms: against numbers written down from tf, against each other, and over the network."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.clock import use_clock
from actionlib_core.node import get_node
from smachpy import ros1
from smachpy.ros1 import session
from smachpy.ros1.session import Session
from smachpy.states.frames import (
    FrameError,
    Frames,
    OutOfTimeError,
    Transform,
    UnconnectedFramesError,
    UnknownFrameError,
)
from smachpy.testing import MissionKit
from tests.wall_clock import Computer

ANGLES = st.floats(-3.1, 3.1)


@pytest.fixture
def names(tmp_path):
    with ros1.installed(tmp_path / "script.py"):
        yield


def turn(yaw):
    return (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))


def test_known_numbers(names):
    from tf.transformations import (
        euler_from_quaternion,
        quaternion_about_axis,
        quaternion_from_euler,
        quaternion_multiply,
    )

    # From the docstrings of the original, whose quaternions are (x, y, z, w).
    assert quaternion_from_euler(1, 2, 3, "ryxz") == pytest.approx(
        [0.310622, -0.718287, 0.444435, 0.435953], abs=1e-6
    )
    assert euler_from_quaternion([0.06146124, 0, 0, 0.99810947]) == pytest.approx([0.123, 0, 0])
    assert quaternion_about_axis(0.123, (1, 0, 0)) == pytest.approx([0.06146124, 0, 0, 0.99810947])
    assert quaternion_multiply([1, -2, 3, 4], [-5, 6, 7, 8]) == pytest.approx([-44, -14, 48, 28])


def test_scales_along_a_direction_of_any_length(names):
    from tf.transformations import scale_matrix

    along_z = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0.5, 0.5], [0, 0, 0, 1]]
    assert np.allclose(scale_matrix(0.5, [0, 0, 1], [0, 0, 2]), along_z)


@given(ANGLES, st.floats(-1.5, 1.5), ANGLES)
def test_there_and_back(roll, pitch, yaw):
    from smachpy.ros1.names import PyKDL
    from smachpy.ros1.names.tf import transformations as t

    q = t.quaternion_from_euler(roll, pitch, yaw)
    assert t.euler_from_quaternion(q) == pytest.approx((roll, pitch, yaw), abs=1e-6)
    assert np.allclose(t.quaternion_matrix(q), t.euler_matrix(roll, pitch, yaw))
    rotation = PyKDL.Rotation.RPY(roll, pitch, yaw)
    assert rotation.GetRPY() == pytest.approx((roll, pitch, yaw), abs=1e-6)
    assert abs(np.dot(rotation.GetQuaternion(), q)) == pytest.approx(1, abs=1e-6)
    frame = PyKDL.Frame(rotation, PyKDL.Vector(1, 2, 3))
    assert PyKDL.Equal(frame * frame.Inverse(), PyKDL.Frame(), 1e-6)
    one = Transform(1, 2, 3, *q)
    assert one.then(one.inverse()) == pytest.approx(Transform(), abs=1e-9)


def test_half_turns_of_pykdl(names):
    import PyKDL

    for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 1, 1), (-1, 2, 0)):
        rotation = PyKDL.Rotation.Rot(PyKDL.Vector(*axis), math.pi)
        again = PyKDL.Rotation.Quaternion(*rotation.GetQuaternion())
        assert PyKDL.Equal(rotation, again, 1e-6), axis


def test_the_tree():
    frames = Frames()
    frames.add("map", "odom", 0, Transform(10, 0, 0), static=True)
    frames.add("odom", "base", 1_000, Transform(1, 0, 0, *turn(0)))
    frames.add("odom", "base", 3_000, Transform(3, 0, 0, *turn(math.pi / 2)))
    frames.add("/base", "laser", 0, Transform(0.5, 0, 0), static=True)
    found, stamp = frames.look_up("map", "laser")
    assert stamp == 3_000
    assert found[:3] == pytest.approx((13, 0.5, 0))
    found, _ = frames.look_up("map", "base", 2_000)
    assert found[:3] == pytest.approx((12, 0, 0))
    assert found[3:] == pytest.approx(turn(math.pi / 4))
    back, _ = frames.look_up("laser", "map", 3_000)
    assert back.apply(13, 0.5, 0) == pytest.approx((0, 0, 0))
    assert frames.look_up("base", "base")[0] == Transform()


@pytest.mark.parametrize(
    ("target", "source", "stamp", "error"),
    [
        ("map", "nobody", 0, UnknownFrameError),
        ("map", "island", 0, UnconnectedFramesError),
        ("map", "base", 500, OutOfTimeError),
        ("map", "base", 9_000, OutOfTimeError),
    ],
)
def test_what_is_not_known(target, source, stamp, error):
    frames = Frames()
    frames.add("map", "base", 1_000, Transform())
    frames.add("map", "base", 2_000, Transform())
    frames.add("sea", "island", 1_000, Transform())
    with pytest.raises(error):
        frames.look_up(target, source, stamp)


@pytest.mark.parametrize(
    ("parent", "child", "transform"),
    [
        ("a", "a", Transform()),
        ("a", "", Transform()),
        ("a", "b", Transform(math.nan)),
        ("a", "b", Transform(qw=0.0)),
    ],
)
def test_bad_transforms_are_refused(parent, child, transform):
    with pytest.raises(FrameError):
        Frames().add(parent, child, 0, transform)


def test_history_is_bounded_and_loops_do_not_hang():
    frames = Frames(cache_s=1.0)
    for stamp in range(0, 5_000_000_000, 100_000_000):
        frames.add("a", "b", stamp, Transform(stamp / 1e9))
    with pytest.raises(OutOfTimeError):
        frames.look_up("a", "b", 1_000_000_000)
    frames.add("b", "a", 5_000_000_000, Transform())
    with pytest.raises(FrameError):
        frames.look_up("a", "c")


def test_the_newest_transform_of_one_time_counts_and_takes_no_more_room():
    """A sender that never fills in its stamps filled the memory, and its first pose stayed."""
    frames = Frames()
    for x in range(100):
        frames.add("map", "base", 0, Transform(x))
    assert frames.look_up("map", "base")[0].x == 99
    assert len(frames._edges["base"].times) == 1


@pytest.fixture
def world(names):
    with MissionKit() as mission:
        made = Session(["script.py"], make_node=lambda _name: get_node())
        session.begin(made)
        yield mission
        session.end(made)


def stamped(child, x=0.0):
    import rospy
    from geometry_msgs.msg import TransformStamped

    made = TransformStamped()
    made.header.stamp, made.header.frame_id, made.child_frame_id = rospy.Time.now(), "map", child
    made.transform.translation.x, made.transform.rotation.w = x, 1.0
    return made


def test_a_buffer_goes_on_when_the_clock_is_set_back(world):
    """It took all that came for too old, and the robot stood where it had been for ever."""
    import rospy
    import tf2_ros

    rospy.init_node("script")
    computer = Computer(world.clock)
    with use_clock(computer):
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        moving, static = tf2_ros.TransformBroadcaster(), tf2_ros.StaticTransformBroadcaster()
        static.sendTransform(stamped("dock", 7.0))
        for x, step in ((1.0, 0.0), (2.0, -3600.0), (3.0, -3600.0)):
            computer.ahead = step
            moving.sendTransform(stamped("base", x))
            world.clock.sleep(0.1)
        for frame, x in (("base", 3.0), ("dock", 7.0)):
            found = buffer.lookup_transform("map", frame, rospy.Time(0))
            assert found.transform.translation.x == x


def test_static_transforms_of_several_broadcasters_and_of_one_message_are_all_there(world):
    """Only those of the last broadcaster were, and of a message only its last frame."""
    import rospy
    import tf2_ros

    rospy.init_node("script")
    first, second = tf2_ros.StaticTransformBroadcaster(), tf2_ros.StaticTransformBroadcaster()
    first.sendTransform(stamped("one"))
    message = stamped("two")
    second.sendTransform(message)
    message.child_frame_id = "three"
    second.sendTransform(message)
    buffer = tf2_ros.Buffer()
    tf2_ros.TransformListener(buffer)
    world.clock.sleep(1.0)
    assert buffer.get_frame_strings() == ["map", "one", "three", "two"]


def test_over_the_network(names):
    with MissionKit() as mission, mission.clock.patched():
        import rospy
        import tf
        import tf2_ros
        from geometry_msgs.msg import PoseStamped

        rospy.init_node("x")
        listener = tf.TransformListener()
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        with pytest.raises(tf.LookupException):
            listener.lookupTransform("map", "base", rospy.Time(0))
        with pytest.raises(tf.Exception):
            listener.waitForTransform("map", "base", rospy.Time(0), rospy.Duration(1))

        def send():
            rospy.sleep(2)
            tf.TransformBroadcaster().sendTransform(
                (1, 2, 0), turn(1), rospy.Time.now(), "base", "map"
            )

        mission.clock.spawn(send, name="send")
        listener.waitForTransform("map", "base", rospy.Time(0), rospy.Duration(5))
        place, rotation = listener.lookupTransform("/map", "base", rospy.Time(0))
        assert place == [1, 2, 0]
        assert rotation == pytest.approx(list(turn(1)))
        assert (
            buffer.lookup_transform("map", "base", rospy.Time(0), 1.0).transform.translation.y == 2
        )
        pose = PoseStamped()
        pose.header.frame_id = "base"
        pose.pose.position.x, pose.pose.orientation.w = 1, 1
        moved = buffer.transform(pose, "map")
        assert moved.pose.position.x == pytest.approx(1 + math.cos(1))
        static = tf2_ros.TransformStamped()
        static.header.frame_id, static.child_frame_id = "base", "laser"
        static.transform.rotation.w = 1
        tf2_ros.StaticTransformBroadcaster().sendTransform(static)
        late = tf2_ros.Buffer()
        assert late.can_transform("base", "laser", rospy.Time(0), rospy.Duration(1))
