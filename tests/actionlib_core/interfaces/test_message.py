"""Message objects: construction, comparison, text forms, and values that do not fit."""

from __future__ import annotations

import array
import copy
import io
import math
import pickle
from typing import Any

import numpy as np
import pytest

from actionlib_core import interfaces
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.exceptions import DeserializationError, FieldError, InterfaceError
from actionlib_core.interfaces.geometry_msgs.msg import (
    Point,
    Polygon,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    Vector3,
)
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseActionGoal, MoveBaseGoal
from actionlib_core.interfaces.sensor_msgs.msg import Image, JointState, LaserScan
from actionlib_core.interfaces.std_msgs.msg import (
    Bool,
    ByteMultiArray,
    ColorRGBA,
    Empty,
    Header,
    Int8,
    String,
)
from actionlib_core.time import Duration, Time


def text_of(message: Any) -> str:
    with pytest.raises(FieldError) as caught:
        message.to_bytes()
    return str(caught.value)


def test_construction() -> None:
    assert Point(1, 2, 3) == Point(z=3, x=1, y=2) == Point(1, z=3, y=2)
    assert Point() == Point(None, None, None) == Point(0.0, 0.0, 0.0)
    assert PoseStamped().header is not PoseStamped().header
    assert PoseWithCovariance().covariance == [0.0] * 36
    assert Image().data == b""
    with pytest.raises(TypeError, match=r"^Point\.__init__\(\) takes"):
        Point(1, 2, 3, 4)  # type: ignore[call-arg]
    with pytest.raises(FieldError, match=r"unknown field 'psoe'.*Did you mean 'pose'"):
        PoseStamped(psoe=Pose())  # type: ignore[call-arg]
    with pytest.raises(AttributeError):
        Point().w = 1  # type: ignore[attr-defined]


def test_ros_class_attributes() -> None:
    assert PoseStamped._type == "geometry_msgs/PoseStamped"
    assert PoseStamped._md5sum == "d3812c3cbc69362b77dc0b19b345f8f5"
    assert PoseStamped.__slots__ == ["header", "pose"]
    assert PoseStamped._slot_types == ["std_msgs/Header", "geometry_msgs/Pose"]
    assert PoseStamped._has_header
    assert not Pose._has_header
    assert "position (geometry_msgs/Point): [m]" in str(Pose.__doc__)


def test_time_fields_take_seconds() -> None:
    assert Header(stamp=1.5).stamp == Time(1, 500_000_000)
    header = Header()
    header.stamp = 2.25  # type: ignore[assignment]
    assert Header.from_bytes(header.to_bytes()).stamp == Time(2.25)
    assert header.to_dict()["stamp"] == {"secs": 2, "nsecs": 250_000_000}
    with pytest.raises(TypeError, match="expected time"):
        Header(stamp=Duration(1))  # type: ignore[arg-type]


def test_equality() -> None:
    assert Point(1) != Point(2)
    assert Point() != Vector3()
    assert Point() != "x"
    assert JointState(position=(1.0, 2.0)) == JointState(position=[1.0, 2.0])
    assert JointState(position=np.array([1.0, 2.0])) == JointState(position=[1.0, 2.0])
    assert JointState(position=np.array([1.0])) != JointState(position=np.array([1.0, 2.0]))
    wrong = JointState()
    wrong.position = 5  # type: ignore[assignment]
    assert wrong != JointState()
    assert Image(data=[1, 2]) == Image(data=b"\1\2")
    with pytest.raises(TypeError):
        hash(Point())


def test_copies_and_pickles() -> None:
    goal = MoveBaseGoal(PoseStamped(Header(frame_id="map"), Pose(Point(1, 2, 3))))
    for other in (copy.deepcopy(goal), pickle.loads(pickle.dumps(goal)), copy.copy(goal)):
        assert other == goal
        assert type(other) is MoveBaseGoal
    assert copy.copy(goal).target_pose is goal.target_pose
    assert copy.deepcopy(goal).target_pose is not goal.target_pose
    assert pickle.loads(pickle.dumps(Empty())) == Empty()


def test_repr_is_short_and_reads_as_code() -> None:
    assert repr(Header(1, 2.5, "map")) == "Header(seq=1, stamp=Time(2, 500000000), frame_id='map')"
    names = {"Pose": Pose, "Point": Point, "Quaternion": Quaternion}
    pose = Pose(Point(1, 2, 3), Quaternion(w=1.0))
    assert eval(repr(pose), names) == pose
    scan = repr(LaserScan(ranges=[0.5] * 1000))
    assert "ranges=[0.5, 0.5, 0.5, ... 1000 elements]" in scan
    assert "data=<1000 bytes 00 00 00 00 00 00 00 00 ...>" in repr(Image(data=bytes(1000)))
    assert "data=b'ab'" in repr(Image(data=b"ab"))


def test_str_is_that_of_rostopic_echo() -> None:
    assert str(Header(1, Time(2, 5), 'a"b\n')) == (
        'seq: 1\nstamp:\n  secs: 2\n  nsecs:         5\nframe_id: "a\\"b\\n"'
    )
    assert str(Polygon([])) == "points: []"
    assert "points:\n  -\n    x: 0.0\n    y: 0.0" in str(
        Polygon([interfaces.get_message("geometry_msgs/Point32")()])
    )  # type: ignore[list-item]
    assert str(Empty()) == "{}"
    broken = Header()
    broken.stamp = None  # type: ignore[assignment]
    assert "stamp: None" in str(broken)


def test_wrong_values_are_named_with_their_path() -> None:
    goal = MoveBaseActionGoal()
    goal.goal.target_pose.pose.position.x = "1"  # type: ignore[assignment]
    goal.header.seq = -1
    goal.goal_id.stamp = "now"  # type: ignore[assignment]
    goal.goal_id.id = b"x"  # type: ignore[assignment]
    with pytest.raises(FieldError) as caught:
        goal.to_bytes()
    where = "move_base_msgs/MoveBaseActionGoal: $."
    assert caught.value.problems == (
        f"{where}header.seq: expected uint32 (0 to 4294967295), got -1",
        f"{where}goal_id.stamp: expected time (float seconds will do), got str",
        f"{where}goal_id.id: expected string, got bytes",
        f"{where}goal.target_pose.pose.position.x: expected float64, got str",
    )
    for write in (goal.to_dict, goal.to_yaml, lambda: goal.serialize(io.BytesIO())):
        with pytest.raises(FieldError):
            write()


def test_wrong_values_of_each_kind() -> None:
    assert "$.data: expected int8 (-128 to 127), got 128" in text_of(Int8(128))
    assert "$.data: expected int8, got float" in text_of(Int8(1.5))  # type: ignore[arg-type]
    assert "$.data: expected bool, got 'false'" in text_of(Bool("false"))  # type: ignore[arg-type]
    assert "$.data: expected string, got int" in text_of(String(5))  # type: ignore[arg-type]
    assert "$.data: expected text that UTF-8 can hold" in text_of(String("\ud800"))
    assert "$.r: expected float32 (up to 3.4e38), got 1e+39" in text_of(ColorRGBA(1e39))
    pose = PoseStamped(pose=Vector3())  # type: ignore[arg-type]
    assert "$.pose: expected geometry_msgs/Pose, got geometry_msgs/Vector3" in text_of(pose)
    lost = Point()
    del lost.x
    assert "$.x: expected float64, got nothing (deleted)" in text_of(lost)
    assert "expected time" in text_of(_with(Header(), "stamp", -1.0)) or "Time" in text_of(
        _with(Header(), "stamp", -1.0)
    )


def _with(message: Any, name: str, value: object) -> Any:
    setattr(message, name, value)
    return message


def test_wrong_arrays() -> None:
    cov = PoseWithCovariance(covariance=[0.0] * 35)
    assert "$.covariance: expected float64[36], got 35 elements" in text_of(cov)
    assert "$.name: expected string[], got str" in text_of(JointState(name="ab"))
    assert "$.name[1]: expected string, got int" in text_of(JointState(name=["a", 1]))  # type: ignore[list-item]
    assert "$.position[0]: expected float64, got str" in text_of(JointState(position=["a"]))  # type: ignore[list-item]
    assert "$.position: expected float64[], got int" in text_of(JointState(position=5))  # type: ignore[arg-type]
    assert "$.position: expected float64[], got 2 dimensions" in text_of(
        JointState(position=np.zeros((2, 2)))
    )
    assert "$.data[0]: expected uint8 (0 to 255), got 256" in text_of(Image(data=[256]))
    assert "$.data: expected uint8[], got int" in text_of(Image(data=5))  # type: ignore[arg-type]
    assert "$.poses[0]: expected geometry_msgs/Pose, got geometry_msgs/Point" in text_of(
        PoseArray(poses=[Point()])  # type: ignore[list-item]
    )
    assert "$.data[0]: expected byte" in text_of(ByteMultiArray(data=[128]))


@pytest.mark.parametrize(
    "values",
    [
        (1.0, 2.0),
        np.array([1.0, 2.0]),
        np.array([1, 2], dtype=np.int32),
        np.array([1.0, 2.0], dtype=">f8"),
        np.array([1.0, 9.0, 2.0, 9.0])[::2],
        array.array("d", [1.0, 2.0]),
        array.array("f", [1.0, 2.0]),
        [np.float32(1), np.int64(2)],
        [True, 2],
    ],
    ids=str,
)
def test_numeric_arrays_are_taken_in_any_form(values: Any) -> None:
    state = JointState(position=values)
    assert state.to_bytes() == JointState(position=[1.0, 2.0]).to_bytes()
    assert JointState.from_bytes(state.to_bytes()).position == [1.0, 2.0]
    assert JointState.from_yaml(state.to_yaml()).position == [1.0, 2.0]


@pytest.mark.parametrize(
    "values",
    [
        b"\1\2",
        bytearray(b"\1\2"),
        memoryview(b"\1\2"),
        [1, 2],
        (1, 2),
        np.array([1, 2], dtype=np.uint8),
        np.array([1, 2]),
    ],
    ids=lambda v: type(v).__name__,
)
def test_octets_are_taken_in_any_form(values: Any) -> None:
    data = Image(data=values).to_bytes()
    assert data == Image(data=b"\1\2").to_bytes()
    assert Image.from_bytes(data).data == b"\1\2"


def test_subclasses_and_foreign_times_are_taken() -> None:
    class MyPoint(Point):  # type: ignore[misc]
        """A user's own."""

    class ForeignTime:
        secs, nsecs = 3, 4

    pose = Pose(position=MyPoint(1, 2, 3))
    assert pose.to_bytes() == Pose(position=Point(1, 2, 3)).to_bytes()
    assert Header.from_bytes(Header(stamp=ForeignTime()).to_bytes()).stamp == Time(3, 4)  # type: ignore[arg-type]


def test_numpy_scalars_in_fields() -> None:
    assert Point(np.float32(1.5), np.int64(2)).to_bytes() == Point(1.5, 2).to_bytes()
    assert Bool(np.True_).to_bytes() == b"\1"  # type: ignore[arg-type]


def test_strings_of_any_bytes_pass_through() -> None:
    data = b"\3\0\0\0a\xffb"
    message = String.from_bytes(data)
    assert message.to_bytes() == data
    assert String.from_yaml(message.to_yaml()) == message
    assert String("Zürich ✓").to_bytes() == b"\x0b\0\0\0" + "Zürich ✓".encode()


@pytest.mark.parametrize("size", range(0, 60, 7))
def test_cut_or_long_payloads_are_refused(size: int) -> None:
    data = PoseStamped(Header(frame_id="map")).to_bytes()
    with pytest.raises(DeserializationError) as caught:
        PoseStamped.from_bytes(data[:size])
    assert caught.value.type_name == "geometry_msgs/PoseStamped"
    assert caught.value.size == size
    with pytest.raises(DeserializationError):
        PoseStamped().deserialize(data + b"\0")


def test_counts_that_lie_cost_nothing() -> None:
    for data in (b"\0" * 12 + b"\0\0\0\0" + b"\xff\xff\xff\xff", b"\0" * 12 + b"\xff\xff\xff\xff"):
        for cls in (PoseArray, JointState):
            with pytest.raises(DeserializationError):
                cls.from_bytes(data)
    many = interfaces.define_message("test_message_pkg/Many", "std_msgs/Empty[] nothing\n")
    with pytest.raises(DeserializationError, match="says it has 4294967295 elements"):
        many.from_bytes(b"\xff\xff\xff\xff")


def test_times_out_of_the_wire_are_normalised() -> None:
    header = Header.from_bytes(
        (1).to_bytes(4, "little") * 2 + (1_500_000_000).to_bytes(4, "little") + bytes(4)
    )
    assert header.stamp == Time(2, 500_000_000)
    with pytest.raises(DeserializationError):
        Header.from_bytes(bytes(4) + b"\xff" * 8 + bytes(4))


def test_dicts_and_yaml() -> None:
    goal = MoveBaseGoal.from_yaml(
        "{target_pose: {header: {frame_id: map}, pose: {position: {x: 1, y: 2e-1}}}}"
    )
    assert goal.target_pose.pose.position == Point(1, 0.2, 0)
    assert MoveBaseGoal.from_yaml("") == MoveBaseGoal.from_dict({}) == MoveBaseGoal()
    assert MoveBaseGoal.from_yaml(goal.to_yaml()) == goal
    assert Header.from_dict({"stamp": 1.5}).stamp == Time(1.5)
    assert Header.from_dict({"stamp": {"secs": 1, "nsecs": 2}}).stamp == Time(1, 2)
    assert Header.from_dict({"stamp": {"sec": 1, "nanosec": 2}}).stamp == Time(1, 2)
    clock = VirtualClock()
    with use_clock(clock):
        stamped = PoseStamped.from_dict({"header": "auto"})
        assert stamped.header.stamp.to_nsec() == clock.time_ns()
        assert Header.from_yaml("stamp: now").stamp.to_nsec() == clock.time_ns()
    message = LaserScan(
        ranges=[math.inf, -math.inf, 0.5], header=Header(frame_id='é\u2028\t\\"\x00\U00018cd6')
    )
    assert LaserScan.from_yaml(message.to_yaml()) == message
    assert "nan" in Point(math.nan).to_yaml()
    assert Image.from_yaml("data: [1, 2]").data == b"\1\2"
    assert interfaces.get_message("move_base_msgs/MoveBaseActionResult").from_yaml("result:")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{target_pos: {}}", "$.target_pos: no such field in move_base_msgs/MoveBaseGoal"),
        ("{target_pos: {}}", "Did you mean 'target_pose'?"),
        ("{target_pose: {pose: {position: {x: a}}}}", "$.target_pose.pose.position.x: expected"),
        ("{target_pose: {pose: {position: [1, 2]}}}", "expected geometry_msgs/Point, got list"),
        ("{target_pose: {header: {stamp: {secs: 1.5}}}}", "$.target_pose.header.stamp: "),
        ("{target_pose: {header: {stamp: {scs: 1}}}}", "Did you mean 'secs'"),
        ("{target_pose: ", "malformed YAML"),
        ("hello", "expected a YAML mapping"),
        ('{"\\UFFFFFFFF": 1}', "malformed YAML"),
        ("{1: 2}", "$.1: no such field"),
        ("!!python/object/apply:os.system [ls]", "malformed YAML"),
    ],
)
def test_wrong_yaml(text: str, said: str) -> None:
    with pytest.raises(FieldError) as caught:
        MoveBaseGoal.from_yaml(text)
    assert said in str(caught.value)
    assert str(caught.value).startswith("move_base_msgs/MoveBaseGoal: ")


def test_fields_named_as_methods() -> None:
    cls: Any = interfaces.define_message(
        "test_message_pkg/Odd", "int32 serialize\nint32 lambda\nint32 _x1\n".replace("_x1", "x_1")
    )
    message = cls(1, 2, 3)
    assert (message.serialize_, message.lambda_, message.x_1) == (1, 2, 3)
    assert cls.from_bytes(message.to_bytes()) == message
    assert message.to_dict() == {"serialize": 1, "lambda": 2, "x_1": 3}


def test_fields_named_as_what_the_generated_code_uses() -> None:
    text = (
        "time Time\nduration Duration\nint32 extra\nint32 to_time\nstd_msgs/Header d\nint32 self\n"
    )
    cls: Any = interfaces.define_message("test_message_pkg/Names", text)
    message = cls(Time=1.5, Duration=2, extra=3, to_time=4, self_=5)
    assert cls.from_bytes(message.to_bytes()) == message
    assert message.Duration == Duration(2)
    with pytest.raises(InterfaceError, match="used twice: \\['in_'\\]"):
        interfaces.define_message("test_message_pkg/In", "int32 in\nint32 in_\n")


def test_numbers_are_no_payload() -> None:
    with pytest.raises(TypeError):
        Empty.from_bytes(0)  # type: ignore[arg-type]


def test_a_field_and_a_constant_cannot_share_a_name() -> None:
    with pytest.raises(InterfaceError, match="duplicate"):
        interfaces.define_message("test_message_pkg/Twice", "int32 a=1\nint32 a\n")
