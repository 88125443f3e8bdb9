"""What robots' topics tell, as records: poses in the map frame, scans, plans, maps, the battery."""

from __future__ import annotations

import base64
import json
import math
import threading
import zlib
from itertools import pairwise

import pytest

from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.interfaces.geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from actionlib_core.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry
from actionlib_core.interfaces.nav_msgs.msg import Path as PathMessage
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState, Image, JointState, LaserScan
from actionlib_core.interfaces.std_msgs.msg import Float64, Header, String
from actionlib_core.interfaces.tf2_msgs.msg import TFMessage
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.topic import Publisher
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import CBState, StateMachine
from smachpy.events.recording import Recorder, read_recording
from smachpy.network.observations import Observer, is_small, role_of
from smachpy.network.robot_topics import RobotTopics
from smachpy.places.pose import Pose2D
from smachpy.sim.simulation import simulation
from smachpy.states import goal_at
from tests.places import DATA
from tests.wall_clock import Computer

S = 1_000_000_000


def pose(x, y, yaw=0.0):
    return Pose(Point(x, y, 0.0), Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2)))


def odometry(x, y, yaw=0.0, speed=0.5, frame="odom"):
    return Odometry(
        header=Header(frame_id=frame),
        pose=PoseWithCovariance(pose=pose(x, y, yaw)),
        twist=TwistWithCovariance(twist=Twist(linear=Vector3(x=speed))),
    )


def transform(parent, child, x, y, yaw=0.0):
    turn = pose(x, y, yaw).orientation
    return TFMessage(
        [
            TransformStamped(
                header=Header(frame_id=parent),
                child_frame_id=child,
                transform=Transform(Vector3(x, y, 0.0), turn),
            )
        ]
    )


def grid(cells, width, height, resolution=0.5):
    info = MapMetaData(resolution=resolution, width=width, height=height, origin=pose(1.0, 2.0))
    return OccupancyGrid(info=info, data=cells)


def scan(*ranges):
    return LaserScan(
        header=Header(frame_id="base_link"),
        angle_min=-1.0,
        angle_increment=0.5,
        range_min=0.1,
        range_max=8.0,
        ranges=ranges,
    )


@pytest.mark.parametrize(
    ("type_name", "name", "role"),
    [
        ("nav_msgs/Odometry", "odom", ("odometry", "")),
        ("nav_msgs/msg/Odometry", "robot_0/odometry/filtered", ("odometry", "robot_0")),
        ("nav_msgs/Path", "a/b/move_base/NavfnROS/plan", ("plan", "a/b")),
        ("nav_msgs/OccupancyGrid", "move_base/global_costmap/costmap", None),
        ("nav_msgs/OccupancyGrid", "my_map", None),
        ("std_msgs/String", "odom", None),
        ("", "", None),
    ],
)
def test_a_topic_is_known_by_its_type_and_name(type_name, name, role):
    assert role_of(type_name, name) == role


def observed():
    """What the tests of the page's JavaScript read as well."""
    observer = Observer()
    told = []
    for role, message, seconds in [
        ("map", grid([0, 100, -1, 20, 50, 0], 3, 2), 0.0),
        ("odometry", odometry(1.0, 1.0, speed=0.0), 0.0),
        ("battery", BatteryState(percentage=0.75), 0.0),
        ("scan", scan(1.0, math.inf, 2.5, math.nan, 0.05), 0.5),
        ("plan", PathMessage(poses=[PoseStamped(pose=pose(1.0, 1.0)), PoseStamped(pose=pose(3, 1))]), 1.0),
        ("odometry", odometry(2.0, 1.0), 2.0),
        ("odometry", odometry(3.0, 1.0, math.pi / 2, speed=0.0), 3.0),
        ("plan", PathMessage(), 3.0),
    ]:  # fmt: skip
        told += observer.take(role, "", message, int(seconds * S))
    return [{**record, "n": n} for n, record in enumerate(told, 1)]


def test_the_records_are_those_that_the_page_reads():
    def unpacked(records):  # how well it is packed is up to the library
        return [
            {**one, "cells": list(zlib.decompress(base64.b64decode(one["cells"])))}
            if "cells" in one
            else one
            for one in records
        ]

    shared = json.loads((DATA / "observed.json").read_text(encoding="utf-8"))
    assert unpacked(observed()) == unpacked(shared)
    assert unpacked(shared)[0]["cells"] == [0, 1, 2, 0, 2, 0]
    (seen,) = [one for one in observed() if one["what"] == "scan"]
    assert seen["ranges"] == [100, -1, 250, -1, -1]


def test_poses_come_at_five_a_second_and_where_it_stops_at_once():
    observer, told = Observer(), []
    for step in range(100):  # 5 s at 20 Hz
        told += observer.take("odometry", "r", odometry(0.05 * step, 0.0), step * S // 20)
    assert 24 <= len(told) <= 27
    told = observer.take("odometry", "r", odometry(5.0, 0.0, speed=0.0), 100 * S // 20 + 1)
    assert [one["at"] for one in told] == [[5.0, 0.0, 0.0]]
    assert not observer.take("odometry", "r", odometry(5.0, 0.0, speed=0.0), 200 * S)


def test_a_map_that_changes_soon_is_told_later():
    """A map is published once; the second one was never shown."""
    observer = Observer()
    first, second, third = (grid([0, 100, cell, 20, 50, 0], 3, 2) for cell in (0, 50, 100))

    def maps(role, message, at):
        told = observer.take(role, "", message, round(at * 1e9))
        return [(one["robot"], one["stamp_ns"] / 1e9) for one in told if one["what"] == "map"]

    def pose(at):
        return maps("odometry", odometry(0.0, 0.0, 0.0), at)

    assert maps("map", first, 0.0) == [("", 0.0)]
    assert maps("map", second, 0.5) == maps("map", third, 1.0) == pose(1.5) == []
    assert pose(2.5) == [("", 2.5)]
    assert pose(9.0) == maps("map", third, 9.0) == []
    assert maps("map", first, 20.0) == [("", 20.0)]
    assert maps("map", second, 20.5) == maps("map", first, 21.0) == pose(30.0) == []  # as before


def test_frames_lead_to_the_map():
    observer = Observer()
    observer.take("tf", "", transform("map", "/odom", 10.0, 0.0, math.pi / 2), 0)
    (told,) = observer.take("odometry", "", odometry(1.0, 0.0, 0.5), 0)
    assert told["at"] == pytest.approx([10.0, 1.0, math.pi / 2 + 0.5], abs=1e-3)
    # A circle of frames leads nowhere, and ends.
    observer.take("tf", "x", transform("a", "b", 0.0, 0.0), 0)
    observer.take("tf", "x", transform("b", "a", 0.0, 0.0), 0)
    (told,) = observer.take("odometry", "x", odometry(1.0, 2.0, frame="a"), 0)
    assert told["at"] == [1.0, 2.0, 0.0]


def test_what_localizes_is_believed_rather_than_odometry_that_drifts():
    observer = Observer()
    localized = PoseWithCovarianceStamped(pose=PoseWithCovariance(pose=pose(4.0, 4.0)))
    assert observer.take("pose", "", localized, 0)
    assert not observer.take("odometry", "", odometry(9.0, 9.0), S)


@pytest.mark.parametrize(
    ("role", "message"),
    [
        ("odometry", odometry(math.nan, 0.0)),
        ("odometry", odometry(math.inf, 0.0)),
        ("tf", transform("map", "odom", math.nan, 0.0)),
        ("battery", BatteryState(percentage=math.nan)),
        ("map", grid([0, 0], 3, 2)),
        ("map", grid([], 0, 0)),
        ("map", grid([0] * 6, 3, 2, resolution=0.0)),
        ("map", grid([0] * 6, 3, 2, resolution=math.nan)),
        ("scan", scan(1.0)),  # of a robot that has told no pose
        ("plan", PathMessage(poses=[PoseStamped(pose=pose(math.nan, 0))])),
    ],
)
def test_what_makes_no_sense_is_left_out(role, message):
    assert Observer().take(role, "", message, 0) == []


@pytest.fixture
def office():
    """Two robots in virtual time, and a node of a mission's."""
    with VirtualClock() as clock, use_clock(clock):
        network = MemoryNetwork(clock)
        with (
            Node("sim", transport=network.session(), clock=clock) as sim,
            Node("mission", transport=network.session(), clock=clock) as node,
            use_node(node),
            simulation(robots=2, node=sim) as floor,
        ):
            yield clock, node, floor


def drive(node, robot="robot_0"):
    from actionlib_core.action.simple_client import SimpleActionClient
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction

    client = SimpleActionClient(f"{robot}/move_base", MoveBaseAction, node=node)
    client.wait_for_server(1.0)
    client.send_goal_and_wait(goal_at(Pose2D(8.5, 7.6, 0.0)))


def test_the_robots_of_a_floor_are_told_while_somebody_listens(office):
    clock, node, floor = office
    told = []
    with RobotTopics(node) as topics:
        cancel = topics.listen(told.append)
        clock.sleep(1.0)
        drive(node)
        assert {"pose", "scan", "plan", "map", "value", "values"} == {one["what"] for one in told}
        assert [one["n"] for one in told] == list(range(1, len(told) + 1))
        (floor_map,) = [one for one in told if one["what"] == "map"]
        assert (floor_map["width"], floor_map["height"]) == (540, 340)
        last = [one for one in told if one["what"] == "pose" and one["robot"] == "robot_0"][-1]
        body = floor.robots["robot_0"].body.pose
        assert last["at"] == pytest.approx([body.x, body.y, body.yaw], abs=0.02)
        plans = [one["points"] for one in told if one["what"] == "plan"]
        assert plans[0]
        assert plans[-1] == []
        assert topics.kept() == told
        cancel()
        count = len(told)
        drive(node, "robot_1")
        assert len(told) == count
        assert floor.servers["robot_0"]._scan.get_num_connections() == 0  # nothing is measured


def test_only_what_is_below_the_missions_name_space_is_told(office):
    clock, _, _ = office
    told = []
    network = office[1].transport
    with (
        Node("one", transport=network, clock=clock, namespace="robot_1") as node,
        RobotTopics(node) as topics,
    ):
        topics.listen(told.append)
        clock.sleep(2.0)
    poses = {one["robot"] for one in told if one["what"] == "pose"}
    assert poses == {"robot_1"}  # named as in the goals that are sent to it
    assert [one["robot"] for one in told if one["what"] == "map"] == [""]


@pytest.mark.parametrize(
    ("message", "small"),
    [
        (Float64(), True),
        (Twist(), True),
        (JointState(), True),
        (Odometry(), True),
        (String(), False),  # no number
        (Image(), False),
        (PathMessage(), False),
        (OccupancyGrid(), False),
    ],
    ids=lambda value: getattr(value, "_type", None),
)
def test_which_messages_are_small_and_have_numbers(message, small):
    assert is_small(message) == small


def test_numbers_of_a_message_by_path_twice_a_second():
    observer = Observer()
    state = JointState(name=["a"] * 9, position=[0.5, math.nan, 2] + [1.0] * 9)
    (record,) = observer.take("numbers", "arm/joints", state, S)
    assert record["topic"] == "arm/joints"
    assert record["robot"] == ""
    assert record["values"] == {
        "position.0": 0.5, "position.2": 2.0, **{f"position.{i}": 1.0 for i in range(3, 8)},
    }  # fmt: skip
    assert observer.take("numbers", "arm/joints", state, S + S // 4) == []
    assert observer.take("numbers", "other", Float64(data=math.inf), S) == []
    (record,) = observer.take("numbers", "arm/joints", Odometry(), S + S // 2)
    assert "twist.twist.linear.x" in record["values"]
    assert not any("covariance" in path for path in record["values"])


def test_any_topic_with_numbers_is_told_and_a_large_one_is_not_listened_to():
    told = []
    with (
        VirtualClock() as clock,
        use_clock(clock),
        Node("one", transport=MemoryNetwork(clock).session(), clock=clock) as node,
        RobotTopics(node) as topics,
    ):
        topics.listen(told.append)
        wheel = Publisher("arm/current", Float64, queue_size=1, node=node)
        image = Publisher("camera", Image, queue_size=1, node=node)
        clock.sleep(1.0)
        assert image.get_num_connections() == 0
        wheel.publish(Float64(data=1.5))
        wheel.publish(Float64(data=2.5))  # too soon after
        clock.sleep(1.0)
        wheel.publish(Float64(data=3.5))
        clock.sleep(1.0)
        wheel.unregister()
        image.unregister()
    assert [(one["topic"], one["values"]) for one in told] == [
        ("arm/current", {"data": 1.5}), ("arm/current", {"data": 3.5}),
    ]  # fmt: skip


def test_the_robot_is_told_at_the_same_rate_after_the_computers_clock_was_set():
    told = []
    with VirtualClock() as clock, use_clock(Computer(clock)) as computer:
        network = MemoryNetwork(computer)
        with (
            Node("one", transport=network.session(), clock=computer) as node,
            RobotTopics(node) as topics,
        ):
            topics.listen(told.append)
            wheel = Publisher("wheel", Float64, queue_size=1, node=node)
            for step in (0.0, -3600.0, 7200.0):
                computer.ahead += step
                for _ in range(4):
                    clock.sleep(0.25)
                    wheel.publish(Float64())
    stamps = [one["stamp_ns"] for one in told]
    assert len(told) in {6, 7}
    assert {later - former for former, later in pairwise(stamps)} == {S // 2}


def test_of_many_records_the_newest_are_kept_and_the_map(office, monkeypatch):
    monkeypatch.setattr("smachpy.network.robot_topics.MAX_KEPT_OBSERVATIONS", 5)
    clock, node, _ = office
    with RobotTopics(node) as topics:
        topics.listen(lambda _: None)
        clock.sleep(4.0)
        kept = topics.kept()
    assert len(kept) == 6
    assert kept[0]["what"] == "map"
    assert [one["n"] for one in kept] == sorted(one["n"] for one in kept)


def test_of_many_large_maps_the_newest_are_kept(office, monkeypatch):
    """A history of all of them was longer than viewers read: they did not show the machine."""
    monkeypatch.setattr("smachpy.network.robot_topics.MAX_KEPT_BYTES", 10_000)
    _, node, _ = office
    with RobotTopics(node) as topics:
        for number in [*range(100), 98]:
            topics._keep({"what": "map", "robot": f"r{number}", "cells": "x" * 3_000})
        kept = topics.kept()
    assert [one["robot"] for one in kept] == ["r97", "r98", "r99", "r98"]
    assert sum(len(json.dumps(one)) for one in kept) < 2 * 10_000


def test_robots_and_topics_without_end_are_bounded(monkeypatch):
    monkeypatch.setattr("smachpy.network.observations._MAX_SCOPES", 3)
    observer = Observer()
    for role, message in (("odometry", odometry(1.0, 2.0)), ("numbers", Float64(1.0))):
        told = [observer.take(role, f"r{number}", message, S) for number in range(5)]
        assert [len(one) for one in told] == [1, 1, 1, 0, 0]
        assert observer.take(role, "r0", message, 9 * S) == ([] if role == "odometry" else [{
            "kind": "Observed", "path": "", "stamp_ns": 9 * S, "what": "values", "robot": "",
            "topic": "r0", "values": {"data": 1.0},
        }])  # fmt: skip


def test_a_recording_holds_what_the_robot_told(office, tmp_path):
    _, node, _ = office
    sm = StateMachine(outcomes=["done"], name="JOB")
    with sm:
        StateMachine.add(
            "GO", CBState(lambda _: (drive(node), "done")[1], outcomes=["done"]), {"done": "done"}
        )
    with RobotTopics(node) as topics:
        recorder = Recorder(tmp_path / "run.jsonl", sm)
        topics.listen(recorder.observe)
        sm.execute()
        recorder.close()
        recorder.observe({"kind": "Observed"})  # too late: left out
    recording = read_recording(tmp_path / "run.jsonl")
    assert {one["kind"] for one in recording.events} >= {"Started", "Entered", "Finished"}
    assert all(one["kind"] != "Observed" for one in recording.events)
    assert [one["n"] for one in recording.observed] == list(range(1, len(recording.observed) + 1))
    assert {"pose", "map"} <= {one["what"] for one in recording.observed}


def test_who_has_left_is_not_being_called():
    """What the listener uses may be closed then: its publisher, its file."""
    called = threading.Event()
    waits, leavers = [], []

    def listener(_record):
        if not called.is_set():
            leaver = threading.Thread(target=leave)
            leaver.start()
            leaver.join(0.1)
            waits.append(leaver.is_alive())
            leavers.append(leaver)
            called.set()

    with (
        Node("n", transport=MemoryNetwork().session()) as node,
        RobotTopics(node) as topics,
        Publisher("odom", Odometry, latch=True, queue_size=1, node=node) as odom,
    ):
        leave = topics.listen(listener)
        odom.publish(odometry(1.0, 1.0))
        assert called.wait(60.0)
        leavers[0].join(60.0)
        assert not leavers[0].is_alive()
    assert waits == [True]
