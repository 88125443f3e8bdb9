"""The simulated robot as a Nav2 robot, asked by a client that only knows the wire of ROS 2."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core import SimpleActionClient
from actionlib_core.clock import RealClock
from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import SimpleActionState, StateMachine
from smachpy.places.maps import OFFICE_DOORS
from smachpy.places.pose import Pose2D, quaternion_of, wrap_angle
from smachpy.sim.nav2 import Nav2Server
from smachpy.sim.simulation import Simulation
from smachpy.sim.world import Robot, World
from smachpy.sim.world_file import load_world
from smachpy.states import drive_back, drive_to, locate
from smachpy.states.nav2 import nav2_active
from tests.free_port import free_port
from tests.ros2_client import Ros2Client

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import VirtualClock

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
DOMAIN = 42


class Nav2:
    """A Nav2 robot on a network in memory, and clients of its actions."""

    def __init__(self, clock: VirtualClock, robot: Robot, distro: str) -> None:
        self.clock, self.robot, self.distro = clock, robot, distro
        self.network = MemoryNetwork(clock)
        config = Config(ros2=(Ros2(domain=DOMAIN, distro=distro),))
        self.node = Node("nav2", transport=self.network.session(), clock=clock, config=config)
        self.server = Nav2Server(robot, node=self.node)
        self.server.start()
        self.clients: list[Ros2Client] = []
        self.number = 0

    def client(self, name: str, action: str) -> Ros2Client:
        spec = ros2.get_action(f"nav2_msgs/{action}", self.distro)
        client = Ros2Client(self.network.session(), self.clock, name, spec, domain=DOMAIN)
        self.clients.append(client)
        assert client.ready.wait(5.0)
        return client

    def send(self, client: Ros2Client, goal: Any) -> bytes:
        self.number += 1
        uuid = self.number.to_bytes(16, "big")
        assert client.accepted(uuid, goal) is not None
        return uuid

    def run(self, client: Ros2Client, goal: Any) -> tuple[int, Any]:
        pending = client.result(self.send(client, goal))
        pending.answer(600.0)
        return client.end_of(pending)

    def close(self) -> None:
        self.server.close()
        for client in self.clients:
            client.close()
            client.transport.close()
        self.node.close()
        self.node.transport.close()


@pytest.fixture
def nav2(clock: VirtualClock, office: Any, office_robot: Any) -> Iterator[Callable[..., Nav2]]:
    made = []

    def make(distro: str = "kilted") -> Nav2:
        robot = Robot(World(office), office_robot, office_robot.start, clock.now())
        made.append(Nav2(clock, robot, distro))
        return made[-1]

    yield make
    for robot in made:
        robot.close()


def nav_goal(client: Ros2Client, pose: Pose2D, frame: str = "map") -> Any:
    goal = client.parts.action.Goal()
    goal.pose.header.frame_id = frame
    goal.pose.pose.position.x, goal.pose.pose.position.y = pose.x, pose.y
    turn = goal.pose.pose.orientation
    turn.x, turn.y, turn.z, turn.w = quaternion_of(pose.yaw)
    return goal


@pytest.mark.parametrize("distro", ["humble", "jazzy", "kilted", "rolling"])
def test_it_drives_to_a_pose_and_tells_how_far_it_is(nav2: Any, distro: str) -> None:
    world = nav2(distro)
    client = world.client("navigate_to_pose", "NavigateToPose")
    target = Pose2D(2.0, 3.0, 0.0)
    status, result = world.run(client, nav_goal(client, target))
    assert status == SUCCEEDED
    assert getattr(result, "error_code", 0) == 0
    assert world.robot.body.pose.distance(target) < 0.05
    told = [feedback for _, feedback in client.feedback]
    left = [feedback.distance_remaining for feedback in told]
    assert left[0] > 3.0
    assert left[-1] < 0.3
    assert left == sorted(left, reverse=True)
    assert {feedback.current_pose.header.frame_id for feedback in told} == {"map"}
    seconds = [feedback.navigation_time.sec for feedback in told]
    assert seconds == sorted(seconds)
    assert seconds[-1] > 2


def test_a_pose_that_cannot_be_reached_is_aborted_with_the_reason(nav2: Any) -> None:
    world = nav2()
    client = world.client("navigate_to_pose", "NavigateToPose")
    for goal, why in (
        (nav_goal(client, Pose2D(0.5, 5.0, 0.0)), "in a wall"),
        (nav_goal(client, Pose2D(1.0, 0.0, 0.0), "nowhere"), "goal frame: got 'nowhere'"),
        (nav_goal(client, Pose2D(math.nan, 0.0, 0.0)), "no finite numbers"),
    ):
        status, result = world.run(client, goal)
        assert (status, result.error_code) == (ABORTED, 9000)
        assert why in result.error_msg
    assert world.robot.odometer == 0.0


def test_a_cancel_stops_it(nav2: Any) -> None:
    world = nav2()
    client = world.client("navigate_to_pose", "NavigateToPose")
    uuid = world.send(client, nav_goal(client, Pose2D(2.0, 3.0, 0.0)))
    pending = client.result(uuid)
    world.clock.sleep(5.0)
    assert world.robot.body.speed > 1.0
    assert client.cancel(uuid).code == 0
    assert client.end_of(pending)[0] == CANCELED
    world.clock.sleep(3.0)
    assert world.robot.body.standing


def test_a_newer_pose_takes_the_place_of_the_one_before(nav2: Any) -> None:
    world = nav2()
    client = world.client("navigate_to_pose", "NavigateToPose")
    first = client.result(world.send(client, nav_goal(client, Pose2D(2.0, 3.0, 0.0))))
    world.clock.sleep(2.0)
    target = world.robot.body.pose.then(Pose2D(1.0, 0.0, 0.0))
    status, _ = world.run(client, nav_goal(client, target))
    assert status == SUCCEEDED
    assert client.end_of(first)[0] == CANCELED


@pytest.mark.parametrize("angle", [math.pi / 2, -math.pi / 2, 2.5 * math.pi])
def test_it_spins(nav2: Any, angle: float) -> None:
    world = nav2()
    client = world.client("spin", "Spin")
    before = world.robot.body.pose
    status, result = world.run(client, client.parts.action.Goal(target_yaw=angle))
    assert status == SUCCEEDED
    assert abs(wrap_angle(world.robot.body.yaw - before.yaw - angle)) < 0.05
    assert world.robot.body.pose.distance(before) < 1e-6
    assert result.total_elapsed_time.sec >= 1
    turned = [feedback.angular_distance_traveled for _, feedback in client.feedback]
    assert turned == sorted(turned)
    assert turned[-1] == pytest.approx(abs(angle), abs=0.3)


def test_it_backs_up_as_far_as_it_was_told(nav2: Any) -> None:
    world = nav2()
    drive, client = (
        world.client("navigate_to_pose", "NavigateToPose"),
        world.client("back_up", "BackUp"),
    )
    assert world.run(drive, nav_goal(drive, Pose2D(2.0, 3.0, 0.0)))[0] == SUCCEEDED
    before = world.robot.body.pose
    goal = client.parts.action.Goal(speed=0.2)
    goal.target.x = 0.4
    status, _ = world.run(client, goal)
    assert status == SUCCEEDED
    assert world.robot.body.pose.distance(before.then(Pose2D(-0.4, 0.0, 0.0))) < 0.05
    driven = [feedback.distance_traveled for _, feedback in client.feedback]
    assert driven[-1] == pytest.approx(0.4, abs=0.1)


def test_it_backs_up_into_nothing(nav2: Any) -> None:
    world = nav2()
    client = world.client("back_up", "BackUp")
    goal = client.parts.action.Goal(speed=1.0)
    goal.target.x = 50.0
    status, result = world.run(client, goal)
    assert (status, result.error_code) == (ABORTED, 714)
    assert "in the way" in result.error_msg
    assert not world.robot.bumped


@pytest.mark.parametrize(
    ("x", "y", "speed"), [(1.0, 0.5, 0.2), (1.0, 0.0, 0.0), (math.inf, 0.0, 0.2)]
)
def test_a_way_back_that_is_none_is_refused(nav2: Any, x: float, y: float, speed: float) -> None:
    world = nav2()
    client = world.client("back_up", "BackUp")
    goal = client.parts.action.Goal(speed=speed)
    goal.target.x, goal.target.y = x, y
    status, result = world.run(client, goal)
    assert (status, result.error_code) == (ABORTED, 713)


def test_what_takes_longer_than_allowed_is_aborted(nav2: Any) -> None:
    world = nav2()
    client = world.client("spin", "Spin")
    goal = client.parts.action.Goal(target_yaw=50.0)
    goal.time_allowance.sec = 2
    began = world.clock.now()
    status, result = world.run(client, goal)
    assert (status, result.error_code) == (ABORTED, 701)
    assert world.clock.now() - began == pytest.approx(2.0, abs=0.5)
    world.clock.sleep(2.0)
    assert world.robot.body.standing


def test_another_behavior_takes_over(nav2: Any) -> None:
    world = nav2()
    drive, client = world.client("navigate_to_pose", "NavigateToPose"), world.client("spin", "Spin")
    pending = drive.result(world.send(drive, nav_goal(drive, Pose2D(2.0, 3.0, 0.0))))
    world.clock.sleep(3.0)
    assert world.run(client, client.parts.action.Goal(target_yaw=1.0))[0] == SUCCEEDED
    status, result = drive.end_of(pending)
    assert (status, result.error_code) == (ABORTED, 9000)
    assert "another behavior" in result.error_msg


def test_a_robot_that_closes_aborts_its_goal(nav2: Any) -> None:
    world = nav2()
    client = world.client("spin", "Spin")
    pending = client.result(world.send(client, client.parts.action.Goal(target_yaw=50.0)))
    world.clock.sleep(1.0)
    world.server.close()
    assert client.end_of(pending)[0] == ABORTED


def mission_of(world: Nav2) -> Node:
    """Return a node of a mission on the robot's network; its end is the test's."""
    config = Config(ros2=(Ros2(domain=DOMAIN, distro=world.distro),))
    return Node("mission", transport=world.network.session(), clock=world.clock, config=config)


def message(world: Nav2, name: str) -> Any:
    return ros2.get_message(name, world.distro)


def test_its_topics(nav2: Any, office: Any) -> None:
    world = nav2()
    with mission_of(world) as node:
        heard: dict[str, list[Any]] = {name: [] for name in ("odom", "tf", "scan", "map")}
        for name, kind in (
            ("odom", "nav_msgs/Odometry"),
            ("tf", "tf2_msgs/TFMessage"),
            ("scan", "sensor_msgs/LaserScan"),
            ("map", "nav_msgs/OccupancyGrid"),
        ):
            Subscriber(name, message(world, kind), heard[name].append, node=node)
        world.clock.sleep(3.0)
        (grid,) = heard["map"]  # published long before
        assert (grid.info.width, grid.info.height) == (office.width, office.height)
        assert list(grid.data) == office.cells.ravel().tolist()
        odom, scan = heard["odom"][-1], heard["scan"][-1]
        assert (odom.header.frame_id, odom.child_frame_id) == ("odom", "base_link")
        pose = world.robot.body.pose
        assert odom.pose.pose.position.x == pytest.approx(pose.x)
        assert len(scan.ranges) == world.robot.config.scan.rays
        assert scan.header.frame_id == "base_link"
        links = [(t.header.frame_id, t.child_frame_id) for t in heard["tf"][-1].transforms]
        assert links == [("map", "odom"), ("odom", "base_link")]
        twist = message(world, "geometry_msgs/Twist")()
        twist.angular.z = 0.5
        by_hand = Publisher("cmd_vel", type(twist), node=node)
        world.clock.sleep(0.5)
        by_hand.publish(twist)
        world.clock.sleep(0.4)
        assert world.robot.body.turn_rate > 0.2
        twist.angular.z = math.nan
        by_hand.publish(twist)
        world.clock.sleep(1.0)
        assert world.robot.body.standing
        node.transport.close()


def test_a_mission_waits_until_it_is_active(nav2: Any) -> None:
    world = nav2("jazzy")
    with mission_of(world) as node, use_node(node):
        assert nav2_active(timeout=10.0).execute() == "succeeded"
        began = world.clock.now()
        assert nav2_active(manager="nobody", timeout=10.0).execute() == "aborted"
        assert 10.0 <= world.clock.now() - began < 13.0
        node.transport.close()


def test_ready_made_states_with_ros_1_types_drive_it(nav2: Any) -> None:
    world = nav2("jazzy")
    network = Ros2(domain=DOMAIN, distro="jazzy", names=("move_base", "odom", "tf"))
    session = world.network.session()
    config = Config(ros2=(network,))
    with (
        Node("mission", transport=session, clock=world.clock, config=config) as node,
        use_node(node),
    ):
        sm = StateMachine(["succeeded", "aborted", "preempted"])
        sm.add("WHERE", locate("start"), {"valid": "GO", "invalid": "aborted"})
        sm.add("GO", drive_to(Pose2D(2.0, 3.0, 0.0)), {"succeeded": "BACK"})
        sm.add("BACK", drive_back("start"))
        start = world.robot.body.pose
        assert sm.execute() == "succeeded"
        assert world.robot.body.pose.distance(start) < 0.1
        assert world.robot.odometer > 10.0
        session.close()


@pytest.mark.slow
@pytest.mark.zenoh
def test_the_command_serves_it_behind_a_router() -> None:
    from actionlib_core.transport.zenoh import ZenohTransport

    endpoint = f"tcp/127.0.0.1:{free_port()}"
    network = Ros2(router=endpoint, domain=DOMAIN, distro="kilted")
    router = ZenohTransport(
        Config(mode="router", listen=(endpoint,), discovery="off", timestamping=True)
    )
    command = [
        sys.executable,
        "-m",
        "smachpy",
        "robot",
        "--ros2",
        endpoint,
        "--domain",
        str(DOMAIN),
    ]
    process = subprocess.Popen(
        [*command, "--distro", "kilted", "--child"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    session = ZenohTransport(Config(discovery="off").for_ros2(network))
    try:
        assert process.stdout is not None
        assert "ROS 2 kilted, domain 42" in process.stdout.readline()
        spec = ros2.get_action("nav2_msgs/Spin", "kilted")
        client = Ros2Client(session, RealClock(), "spin", spec, domain=DOMAIN)
        assert client.ready.wait(60.0)
        uuid = bytes([1] * 16)
        assert client.accepted(uuid, spec.Goal(target_yaw=0.1)) is not None
        pending = client.result(uuid)
        pending.answer(60.0)
        assert client.end_of(pending)[0] == SUCCEEDED
        client.close()
    finally:
        session.close()
        process.communicate(timeout=60.0)
        router.close()
    assert process.returncode == 0


@pytest.mark.slow
@pytest.mark.zenoh
def test_without_the_option_it_joins_no_robot_that_missions_drive() -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "smachpy", "robot", "--child"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "SMACHPY_ROS2": "tcp/127.0.0.1:9"},
    )
    assert process.stdout is not None
    assert process.stdout.readline().startswith("move_base: ready")
    process.communicate(timeout=60.0)
    assert process.returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [
    ["--ros2", "nonsense"], ["--ros2", "tcp/127.0.0.1:1", "--domain", "-1"],
    ["--ros2", "tcp/127.0.0.1:1", "--robots", "2"], ["--ros2", "tcp/127.0.0.1:1", "--distro", "foxy"],
    ["--ros2", "tcp/127.0.0.1:9"],
])  # fmt: skip
@pytest.mark.zenoh
def test_bad_input_is_one_clear_end(arguments: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "smachpy", "robot", *arguments],
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert any(word in done.stderr for word in ("expected", "choose from", "nothing answers"))


def test_it_drives_after_days_as_nothing_can_charge_it(nav2, clock):
    robot = nav2().robot
    assert robot.battery.charge(clock.now() + 1e6) == 1.0
    robot.battery.drive(clock.now(), 1.0)
    assert robot.battery.charge(clock.now() + 1e6) == 1.0


def test_robots_of_a_world_are_in_their_namespaces_and_the_doors_on_our_own_wire(clock):
    network = MemoryNetwork(clock)
    config = Config(ros2=(Ros2(domain=DOMAIN, distro="kilted"),))
    session, mine = network.session(), network.session()
    node = Node("simulation", transport=session, clock=clock, config=config)
    mission = Node("mission", transport=mine, clock=clock, namespace="robot_0", config=config)
    world = load_world(OFFICE_DOORS).build(clock.now())
    simulation = Simulation(world, node=node, on_ros2=True)
    simulation.start()
    with use_node(mission):
        opened = ServiceProxy("/doors/lab/set", SetBool)(True)
        assert opened.success
        sm = StateMachine(["succeeded", "aborted", "preempted"])
        go = navigate(17.9, 5.4)  # behind the door
        sm.add("GO", SimpleActionState("navigate_to_pose", NavigateToPose, goal=go))
        clock.sleep(4.0)
        assert sm.execute() == "succeeded"
    simulation.close()
    for each in (mission, node, mine, session):
        each.close()


def navigate(x: float, y: float) -> Any:
    goal = NavigateToPose.Goal()
    goal.pose.header.frame_id = "map"
    goal.pose.pose.position.x, goal.pose.pose.position.y = x, y
    goal.pose.pose.orientation.w = 1.0
    return goal


def test_the_reason_of_a_failure_is_the_text_of_the_status(nav2, clock):
    robot = nav2("jazzy")
    config = Config(ros2=(Ros2(domain=DOMAIN),))
    session = robot.network.session()
    with Node("mission", transport=session, clock=clock, config=config) as node:
        client = SimpleActionClient("navigate_to_pose", NavigateToPose, node=node)
        assert client.wait_for_server(10.0)
        assert client.send_goal_and_wait(navigate(-50.0, 0.0)) == GoalStatus.ABORTED
        assert "error code 9000" in client.get_goal_status_text()
        assert client.send_goal_and_wait(navigate(10.6, 7.1)) == GoalStatus.SUCCEEDED
        assert client.get_goal_status_text() == ""
    session.close()
