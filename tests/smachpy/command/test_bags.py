"""Bags as input: MCAP, rosbag1 and rosbag2."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np
import pytest

from actionlib_core.interfaces import bags
from actionlib_core.interfaces.bags import BagError, read_bag
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from smachpy import MonitorState, StateMachine
from smachpy.command import main

TIMES = [(1.5, 0.8), (7.0, 0.25)]
SEVEN = b"\0\1\0\0\7\0\0\0"  # of an Int32, in CDR
BEGAN_NS = 1_700_000_000_000_000_000


@contextmanager
def written(path):
    """Write an MCAP file."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        yield writer
        writer.finish()


def mcap_of_ros1(folder):
    path = folder / "drive.mcap"
    with written(path) as writer:
        schema = writer.register_schema("sensor_msgs/BatteryState", "ros1msg", b"")
        channel = writer.register_channel("/akku", "ros1", schema)
        for at, percentage in [(0.0, 0.9), *TIMES]:
            stamp = BEGAN_NS + round(at * 1e9)
            data = BatteryState(percentage=percentage).to_bytes()
            writer.add_message(channel, stamp, data, stamp)
    return path


def rosbag2(folder):
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    battery, header, time = (
        store.types[f"{name}"]
        for name in (
            "sensor_msgs/msg/BatteryState",
            "std_msgs/msg/Header",
            "builtin_interfaces/msg/Time",
        )
    )
    path = folder / "drive"
    with Writer(path, version=9) as writer:
        connection = writer.add_connection("/akku", battery.__msgtype__, typestore=store)
        for at, percentage in [(0.0, 0.9), *TIMES]:
            message = battery(
                header=header(stamp=time(sec=5, nanosec=6), frame_id="base"),
                voltage=24.0,
                temperature=20.0,
                current=-1.0,
                charge=1.0,
                capacity=2.0,
                design_capacity=3.0,
                percentage=percentage,
                power_supply_status=2,
                power_supply_health=1,
                power_supply_technology=0,
                present=True,
                cell_voltage=np.array([12.0, 12.0], dtype=np.float32),
                cell_temperature=np.array([], dtype=np.float32),
                location="hull",
                serial_number="1",
            )
            stamp = BEGAN_NS + round(at * 1e9)
            writer.write(connection, stamp, store.serialize_cdr(message, battery.__msgtype__))
    return path


@pytest.mark.parametrize("make", [mcap_of_ros1, rosbag2])
def test_messages_come_with_their_times_and_our_types(make, tmp_path):
    found = list(read_bag(make(tmp_path)))
    assert [one.at for one in found] == pytest.approx([0.0, 1.5, 7.0])
    assert {(one.topic, one.type) for one in found} == {("akku", "sensor_msgs/BatteryState")}
    assert [one.message.percentage for one in found] == pytest.approx([0.9, 0.8, 0.25])
    assert isinstance(found[0].message, BatteryState)


def test_fields_of_ros2_are_those_of_ros1(tmp_path):
    message = next(read_bag(rosbag2(tmp_path))).message
    assert (message.header.stamp.secs, message.header.stamp.nsecs) == (5, 6)
    assert message.header.frame_id == "base"
    assert list(message.cell_voltage) == [12.0, 12.0]


@pytest.mark.parametrize("make", [mcap_of_ros1, rosbag2])
def test_a_mission_under_test_hears_a_bag(make, tmp_path, mission):
    sm = StateMachine(["valid", "invalid", "preempted"], name="WATCH")
    sm.add("WATCH", MonitorState("battery", BatteryState, lambda _, m: m.percentage > 0.3))
    mission.play(make(tmp_path), remap={"/akku": "battery"}, start=2.0)
    run = mission(sm)
    assert run.outcome == "invalid"
    assert run.duration == pytest.approx(9.0)


def test_only_the_topics_that_were_asked_for(tmp_path):
    assert list(read_bag(mcap_of_ros1(tmp_path), ["/scan"])) == []


def test_what_is_no_bag_is_refused_in_one_line(tmp_path):
    with pytest.raises(BagError, match="no such file"):
        list(read_bag(tmp_path / "none.mcap"))
    (tmp_path / "bad.mcap").write_bytes(b"x" * 100)
    (tmp_path / "bad.bag").write_bytes(b"x" * 100)
    for name, said in (("bad.mcap", "is cut off, or no MCAP"), ("bad.bag", "cannot be read")):
        with pytest.raises(BagError, match=said):
            list(read_bag(tmp_path / name))


def mixed_mcap(folder):
    """A bag whose other topic has a schema that nobody here reads."""
    path = folder / "mixed.mcap"
    with written(path) as writer:
        number = writer.register_schema("std_msgs/msg/Int32", "ros2msg", b"int32 data\n")
        other = writer.register_schema("mine/msg/Other", "ros2idl", b"module mine {};")
        channels = [
            writer.register_channel("/n", "cdr", number),
            writer.register_channel("/other", "cdr", other),
        ]
        for at in range(3):
            for channel in channels:
                writer.add_message(channel, BEGAN_NS + at * 10**9, SEVEN, 0)
    return path


def test_topics_that_cannot_be_read_do_not_hide_the_others(tmp_path, monkeypatch):
    stores, make = [], bags._store
    monkeypatch.setattr(bags, "_store", lambda *schema: stores.append(schema) or make(*schema))
    found = list(read_bag(mixed_mcap(tmp_path)))
    assert [(one.topic, one.message.data) for one in found] == [("n", 7)] * 3
    assert len(stores) == 1  # not one for each message


@pytest.mark.parametrize("size", [0, 7, 8, 40, -9, -1])
def test_a_file_that_is_cut_off_is_called_so(size, tmp_path):
    file = mcap_of_ros1(tmp_path)
    file.write_bytes(file.read_bytes()[:size])
    with pytest.raises(BagError, match=r"drive.mcap': is cut off.* Try: mcap recover"):
        next(read_bag(file))


def test_a_message_that_is_none_names_bag_and_topic(tmp_path):
    file = tmp_path / "drive.mcap"
    with written(file) as writer:
        schema = writer.register_schema("sensor_msgs/BatteryState", "ros1msg", b"")
        writer.add_message(writer.register_channel("/akku", "ros1", schema), BEGAN_NS, b"zz", 0)
    with pytest.raises(BagError, match=r"drive.mcap': topic 'akku': .*got 2 bytes"):
        next(read_bag(file))


MISSION = """
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from smachpy import MonitorState, StateMachine


def mission() -> StateMachine:
    sm = StateMachine(["valid", "invalid", "preempted"], name="WATCH")
    sm.add("WATCH", MonitorState("battery", BatteryState, lambda _, m: m.percentage > 0.3))
    return sm
"""


def test_a_run_plays_a_bag_on_its_clock_and_can_be_reproduced(tmp_path, capsys):
    file, recording = tmp_path / "watch.py", tmp_path / "run.jsonl"
    file.write_text(MISSION)
    arguments = ["--bag", str(mcap_of_ros1(tmp_path)), "--record", str(recording), "akku:=battery"]
    code = main(["run", str(file), "--time", "virtual", "--plain", *arguments])
    assert "WATCH: invalid after 7.00 s" in capsys.readouterr().out
    assert code == 1
    assert main(["runs", "reproduce", str(recording), "--allow", str(file)]) == 0


def test_a_run_refuses_what_is_no_bag(tmp_path, capsys):
    (tmp_path / "watch.py").write_text(MISSION)
    arguments = ["--time", "virtual", "--plain", "--bag", str(tmp_path / "none.bag")]
    assert main(["run", str(tmp_path / "watch.py"), *arguments]) == 2
    assert "no such file or folder" in capsys.readouterr().err
