"""Every row written by ROS 1 itself: md5, slots, bytes of defaults and samples, both directions."""

from __future__ import annotations

import io
import json
from typing import Any

import pytest

from actionlib_core import interfaces
from actionlib_core.time import Duration, Time
from tests.places import DATA

GOLDEN = json.loads((DATA / "ros1_messages.json").read_text())
MESSAGES = GOLDEN["messages"] + [
    s[part] for s in GOLDEN["services"] for part in ("request", "response")
]


def build(cls: Any, fields: dict[str, Any]) -> Any:
    """Make a message with its constructor, from the plain values of the data file."""
    values = {}
    for name, slot_type in zip(cls.__slots__, cls._slot_types, strict=True):
        values[name] = build_one(cls, slot_type, fields[name])
    return cls(**values)


def build_one(cls: Any, slot_type: str, value: Any) -> Any:
    base, _, array = slot_type.partition("[")
    if array and isinstance(value, list):
        return [build_one(cls, base, v) for v in value]
    if isinstance(value, dict) and set(value) == {"bytes"}:
        return bytes.fromhex(value["bytes"])
    if base in {"time", "duration"}:
        return (Time if base == "time" else Duration)(**value)
    if isinstance(value, dict):
        return build(interfaces.get_message(base), value)
    return value


@pytest.mark.parametrize("row", MESSAGES, ids=lambda row: row["type"])
def test_message_is_that_of_ros1(row: dict[str, Any]) -> None:
    cls: Any = interfaces.get_message(row["type"])
    assert cls._type == row["type"]
    assert cls._md5sum == row["md5"]
    assert cls.__slots__ == row["slots"]
    assert cls._slot_types == row["slot_types"]
    assert row["samples"]
    for sample in row["samples"]:
        data = bytes.fromhex(sample["hex"])
        message = build(cls, sample["fields"])
        if sample["default"]:
            assert cls() == message
            assert cls().to_bytes() == data
        assert message.to_bytes() == data
        buffer = io.BytesIO()
        message.serialize(buffer)
        assert buffer.getvalue() == data
        assert cls.from_bytes(data) == message
        assert cls.from_bytes(memoryview(data)) == message
        assert cls().deserialize(data) == message
        assert cls.from_bytes(data).to_bytes() == data
        assert cls.from_dict(message.to_dict()) == message
        assert cls.from_yaml(message.to_yaml()) == message


@pytest.mark.parametrize("row", GOLDEN["services"], ids=lambda row: row["type"])
def test_service_is_that_of_ros1(row: dict[str, Any]) -> None:
    service = interfaces.get_service(row["type"])
    assert service._type == row["type"]
    assert service._md5sum == row["md5"]
    assert service._request_class is interfaces.get_message(row["request"]["type"])
    assert service._response_class is interfaces.get_message(row["response"]["type"])


# Checksums that ROS 1 prints for types which the data file does not hold.
KNOWN = {
    "visualization_msgs/Marker": "4048c9de2a16f4ae8e0538085ebf1b97",
    "visualization_msgs/MarkerArray": "d155b9ce5188fbaf89745847fd5882d7",
    "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec",
    "smach_msgs/SmachContainerStatus": "5ba2bb79ac19e3842d562a191f2a675b",
    "smach_msgs/SmachContainerStructure": "3d3d1e0d0f99779ee9e58101a5dcf7ea",
    "smach_msgs/SmachContainerInitialStatusCmd": "45f8cf31fc29b829db77f23001f788d6",
    "trajectory_msgs/JointTrajectory": "65b4f94a94d1ed67169da35a02f33d3f",
    "sensor_msgs/PointCloud2": "1158d486dd51d683ce2f1be655c3c181",
    "sensor_msgs/CameraInfo": "c9a58c1b0b154e0e6da7578cb991d214",
    "sensor_msgs/Imu": "6a62c6daae103f4ff57a132d6f95cec2",
    "diagnostic_msgs/DiagnosticArray": "60810da900de1dd6ddd437c3503511da",
    "rosgraph_msgs/Log": "acffd30cd6b6de30f120938c17c593fb",
    "nav_msgs/GetMapAction": "e611ad23fbf237c031b7536416dc7cd7",
    "control_msgs/FollowJointTrajectoryGoal": "69636787b6ecbde4d61d711979bc7ecb",
}


@pytest.mark.parametrize("name", KNOWN)
def test_checksums_of_other_types(name: str) -> None:
    assert interfaces.get_message(name)._md5sum == KNOWN[name]
