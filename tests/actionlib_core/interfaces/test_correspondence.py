"""Messages of ROS 1 as those of ROS 2 and back, field by field."""

from __future__ import annotations

import pytest

from actionlib_core import interfaces
from actionlib_core.exceptions import CorrespondenceError, FieldError
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces._correspondence import converter
from actionlib_core.interfaces._registry import Registry
from actionlib_core.interfaces._sources import BUNDLED, Sources
from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseFeedback, MoveBaseGoal
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.time import Time

ONLY_ROS1 = {"std_msgs/Duration", "std_msgs/Time"}
SHARED = ("geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "tf2_msgs", "trajectory_msgs")


def test_a_goal_of_move_base_is_one_of_navigate_to_pose() -> None:
    goal = MoveBaseGoal(
        target_pose=PoseStamped(header=Header(seq=4, stamp=Time(3, 4), frame_id="map"))
    )
    goal.target_pose.pose.position.x = 1.5
    made = converter(MoveBaseGoal, NavigateToPose.Goal)(goal)
    assert isinstance(made, NavigateToPose.Goal)
    assert (made.pose.header.stamp.sec, made.pose.header.stamp.nanosec) == (3, 4)
    assert (made.pose.header.frame_id, made.pose.pose.position.x) == ("map", 1.5)
    assert made.behavior_tree == ""
    back = converter(NavigateToPose.Goal, MoveBaseGoal, whole="target")(made)
    assert back.target_pose.header.seq == 0
    back.target_pose.header.seq = 4
    assert back == goal


def test_feedback_is_paired_by_its_only_pose() -> None:
    feedback = NavigateToPose.Feedback(distance_remaining=3.0)
    feedback.current_pose.pose.position.y = 2.0
    made = converter(NavigateToPose.Feedback, MoveBaseFeedback, whole="target")(feedback)
    assert made.base_position.pose.position.y == 2.0


@pytest.mark.parametrize("package", SHARED)
def test_messages_that_both_worlds_have_correspond(package: str) -> None:
    ours = Registry(Sources(folders=[BUNDLED]))
    for name in ours.sources.names("msg", package):
        if f"{package}/{name}" in ONLY_ROS1:
            continue
        one = interfaces.get_message(f"{package}/{name}")
        other = ros2.get_message(f"{package}/msg/{name}")
        made = converter(one, other)(one())
        assert converter(other, one, whole="target")(made) == one()
        made.to_cdr()


def test_distributions_correspond_where_they_can() -> None:
    kilted, humble = (ros2.get_action("nav2_msgs/Spin", d) for d in ("kilted", "humble"))
    made = converter(humble.Goal, kilted.Goal)(humble.Goal(target_yaw=1.0))
    assert type(made) is kilted.Goal
    assert made.target_yaw == 1.0
    with pytest.raises(CorrespondenceError, match="error_code"):
        converter(humble.Result, kilted.Result, whole="target")


def test_what_has_no_counterpart_is_named_all_at_once() -> None:
    odometry = interfaces.get_message("nav_msgs/Odometry")
    with pytest.raises(CorrespondenceError) as caught:
        converter(odometry, NavigateToPose.Goal)
    fields = [problem.split(": ")[1] for problem in caught.value.problems]
    assert fields == ["header", "twist", "pose.covariance"]


def test_fields_are_paired_as_told() -> None:
    one = interfaces.define_message(
        "correspondence_pkg/One", "float32 near\nfloat32 far\nint8 mode\n"
    )
    other = ros2.get_message("geometry_msgs/msg/Point32")
    told = {"near": "x", "far": "y", "mode": ""}
    made = converter(one, other, told)(one(near=1.0, far=2.0, mode=3))
    assert (made.x, made.y) == (1.0, 2.0)
    assert converter(other, one, told, whole="target")(made) == one(near=1.0, far=2.0)
    with pytest.raises(CorrespondenceError) as caught:
        converter(one, other, {"nere": "x", "far": "yy", "mode": ""})
    assert len(caught.value.problems) == 3


def test_types_that_differ_are_named() -> None:
    one = interfaces.define_message("correspondence_pkg/Two", "string x\nfloat64[] y\nfloat64 z\n")
    with pytest.raises(CorrespondenceError) as caught:
        converter(one, ros2.get_message("geometry_msgs/msg/Point"))
    assert [problem.split(": ")[1] for problem in caught.value.problems] == ["x", "y"]


def test_arrays_and_bytes_are_taken_over() -> None:
    image, image2 = (
        interfaces.get_message("sensor_msgs/Image"),
        ros2.get_message("sensor_msgs/Image"),
    )
    assert converter(image, image2)(image(data=b"\1\2")).data == b"\1\2"
    path, path2 = interfaces.get_message("nav_msgs/Path"), ros2.get_message("nav_msgs/Path")
    made = converter(path, path2)(path(poses=[PoseStamped(), PoseStamped(header=Header(stamp=2))]))
    assert [pose.header.stamp.sec for pose in made.poses] == [0, 2]


@pytest.mark.parametrize("stamp", [12.5, 12, Time(12)])
def test_a_stamp_in_seconds_is_converted_as_in_the_bytes_of_ros_1(stamp) -> None:
    goal = MoveBaseGoal()
    goal.target_pose.header.stamp = stamp
    made = converter(MoveBaseGoal, NavigateToPose.Goal)(goal)
    assert made.pose.header.stamp.sec == 12
    assert goal.target_pose.header.stamp == stamp


@pytest.mark.parametrize(("field", "value"), [
    ("poses", None), ("poses", 5), ("poses", "ab"), ("poses", [None]), ("header", {"seq": 1}),
    ("header", Header(frame_id="map", stamp=Time(1)).stamp),
])  # fmt: skip
def test_values_of_a_wrong_type_are_the_same_error_as_on_our_own_wire(field, value) -> None:
    path = interfaces.get_message("nav_msgs/Path")
    message = path()
    setattr(message, field, value)
    with pytest.raises(FieldError) as own:
        message.to_bytes()
    with pytest.raises(FieldError) as caught:
        converter(path, ros2.get_message("nav_msgs/Path"))(message)
    assert str(caught.value) == str(own.value)


@pytest.mark.parametrize("value", [5, "ab", {"a": 1}])
def test_what_is_no_array_does_not_become_one(value) -> None:
    image, state = (interfaces.get_message(f"sensor_msgs/{n}") for n in ("Image", "JointState"))
    for cls, field in ((image, "data"), (state, "name")):
        message = cls()
        setattr(message, field, value)
        with pytest.raises(FieldError, match=f"[$].{field}: expected"):
            converter(cls, ros2.get_message(cls._type))(message)


def test_a_time_that_ros_1_cannot_hold_is_named() -> None:
    odometry = ros2.get_message("nav_msgs/Odometry")
    message = odometry()
    message.header.stamp.sec = -5
    back = converter(odometry, interfaces.get_message("nav_msgs/Odometry"), whole="target")
    with pytest.raises(FieldError, match=r"nav_msgs/msg/Odometry -> nav_msgs/Odometry: .*got -5 s"):
        back(message)
