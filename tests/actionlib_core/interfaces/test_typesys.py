"""ROS 2's hashes and bytes."""

from __future__ import annotations

from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

from actionlib_core import interfaces
from actionlib_core.exceptions import DeserializationError, InterfaceError
from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
from actionlib_core.interfaces.std_msgs.msg import Header, String


def test_hashes_are_those_of_ros2() -> None:
    known = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
    assert interfaces.rihs01(String) == interfaces.rihs01("std_msgs/String") == known
    cls = interfaces.define_message("test_typesys_pkg/Goal", "geometry_msgs/PoseStamped pose\n")
    assert interfaces.rihs01(cls).startswith("RIHS01_")
    assert len(interfaces.rihs01(cls)) == 71


def test_cdr_there_and_back() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    message = PoseStamped(Header(7, 1.5, "map"))
    message.pose.orientation.w = 1.0
    data = interfaces.to_cdr(message)
    theirs: Any = store.deserialize_cdr(data, "geometry_msgs/msg/PoseStamped")
    assert theirs.header.frame_id == "map"
    assert theirs.pose.orientation.w == 1.0
    back = interfaces.from_cdr(PoseStamped, data)
    message.header.seq = 0
    assert back == message


def test_cdr_of_own_types() -> None:
    cls: Any = interfaces.define_message(
        "test_typesys_pkg/Many",
        "std_msgs/Header[] h\nbyte[] b\nchar c\nint8[3] i\nstring[] s\ntime t\nduration[2] d\n",
    )
    message = cls(h=[Header(frame_id="a")], b=[-1], c=3, i=[1, -2, 3], s=["x"], t=1.5)
    assert interfaces.from_cdr(cls, interfaces.to_cdr(message)) == message


def test_types_that_ros2_defines_otherwise_are_refused() -> None:
    cls = interfaces.get_message("visualization_msgs/Marker")
    with pytest.raises(InterfaceError, match="ROS 2 defines it otherwise"):
        interfaces.to_cdr(cls())


def test_wrong_cdr() -> None:
    for data in (b"", b"\0\1\0\0", b"\0\0\0\0\1", interfaces.to_cdr(PoseStamped())[:30]):
        with pytest.raises(DeserializationError):
            interfaces.from_cdr(PoseStamped, data)
