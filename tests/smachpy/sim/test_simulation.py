from __future__ import annotations

import contextlib
import math
from dataclasses import replace

import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.exceptions import ServerConflictError
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import Empty, SetBool
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import Subscriber, wait_for_message
from actionlib_core.transport.memory import MemoryNetwork
from smachpy.exceptions import MissionError
from smachpy.places.exceptions import NavigationError
from smachpy.places.pose import Pose2D
from smachpy.sim.interfaces import ChargeAction, ChargeGoal
from smachpy.sim.server import RobotServer
from smachpy.sim.simulation import simulation
from smachpy.sim.world import Robot, World
from smachpy.sim.world_file import place_robots
from smachpy.states import goal_at

NORTH = math.pi / 2


@pytest.fixture
def network(clock):
    return MemoryNetwork(clock)


@pytest.fixture
def node(network, clock):
    with Node("test", transport=network.session(), clock=clock) as node, use_node(node):
        yield node


@pytest.fixture
def strong(office_robot):
    """The office robot with a battery that lasts."""
    return replace(office_robot, battery=replace(office_robot.battery, capacity=100.0, charge=1.0))


@pytest.fixture
def world(office):
    return World(office)


@pytest.fixture
def add(world, strong, clock):
    def add(name, x, y, yaw=0.0, **battery):
        config = replace(strong, battery=replace(strong.battery, **battery))
        return Robot(world, config, Pose2D(x, y, yaw), clock.now(), name)

    return add


@contextlib.contextmanager
def mover(name):
    client = SimpleActionClient(f"{name}/move_base".lstrip("/"), MoveBaseAction)
    assert client.wait_for_server(1.0)
    yield client


def watch_gaps(clock, world, until):
    """Let time pass until `until()`; returns the smallest gap between two bodies."""
    smallest = math.inf
    while not until():
        clock.sleep(0.05)
        for i, a in enumerate(world.discs):
            for b in world.discs[:i]:
                gap = math.hypot(a.x - b.x, a.y - b.y) - a.radius - b.radius
                smallest = min(smallest, gap)
        assert clock.now() < 120.0
    return smallest


def test_each_robot_has_its_own_namespace(clock, node, add, world):
    add("robot_0", 9.8, 7.1)
    add("robot_1", 12.0, 7.6)
    with simulation(world):
        for name, x in (("robot_0", 9.8), ("robot_1", 12.0)):
            message = wait_for_message(f"{name}/odom", Odometry, 1.0)
            assert message.pose.pose.position.x == pytest.approx(x)
        with mover("robot_1") as client:
            client.send_goal_and_wait(goal_at(Pose2D(1, 0, 0), "base_link"))
            assert client.get_state() == GoalStatus.SUCCEEDED
        assert world.robots[1].body.x == pytest.approx(13.0, abs=0.05)
        assert world.robots[0].odometer == 0.0


def test_two_who_meet_in_a_corridor_pass_without_touching(clock, node, add, world):
    left, right = add("robot_0", 3.0, 7.7), add("robot_1", 12.0, 7.7, math.pi)
    with simulation(world), mover("robot_0") as one, mover("robot_1") as two:
        one.send_goal(goal_at(Pose2D(12.0, 7.7, 0)))
        two.send_goal(goal_at(Pose2D(3.0, 7.7, math.pi)))
        done = (GoalStatus.SUCCEEDED, GoalStatus.ABORTED)
        gap = watch_gaps(clock, world, lambda: one.get_state() in done and two.get_state() in done)
        assert [c.get_state() for c in (one, two)] == [GoalStatus.SUCCEEDED] * 2
    assert gap > 0.0
    assert clock.now() < 30.0
    assert left.body.x > 11.9
    assert right.body.x < 3.1


def test_two_who_meet_in_a_doorway_both_get_through(clock, node, add, world):
    add("robot_0", 9.0, 10.5, -NORTH)
    add("robot_1", 9.0, 7.4, NORTH)
    with simulation(world), mover("robot_0") as one, mover("robot_1") as two:
        one.send_goal(goal_at(Pose2D(9.0, 7.3, -NORTH)))
        two.send_goal(goal_at(Pose2D(9.0, 10.5, NORTH)))
        gap = watch_gaps(
            clock,
            world,
            lambda: one.get_state() == two.get_state() == GoalStatus.SUCCEEDED,
        )
    assert gap > 0.0


def test_it_drives_around_a_robot_that_stands_in_its_way(clock, node, add, world):
    add("robot_0", 3.0, 7.7)
    standing = add("robot_1", 7.0, 7.7)
    with simulation(world), mover("robot_0") as client:
        client.send_goal(goal_at(Pose2D(12.0, 7.7, 0)))
        gap = watch_gaps(clock, world, lambda: client.get_state() == GoalStatus.SUCCEEDED)
    assert gap > 0.0
    assert standing.odometer == 0.0


def test_a_goal_where_somebody_stands_is_aborted_with_the_name(clock, node, add, world, strong):
    quick = replace(strong, recovery=replace(strong.recovery, traffic_patience=2.0, attempts=1))
    Robot(world, quick, Pose2D(3.0, 7.7, 0), clock.now(), "robot_0")
    add("robot_1", 7.0, 7.7)
    with simulation(world), mover("robot_0") as client:
        client.send_goal_and_wait(goal_at(Pose2D(7.0, 7.7, 0)))
        assert client.get_state() == GoalStatus.ABORTED
        assert "robot_1 stands in the way at (7.00, 7.70)" in client.get_goal_status_text()


def test_a_moving_obstacle_walks_waits_for_robots_and_is_driven_around(clock, node, add, world):
    add("robot_0", 3.0, 7.7)
    walker = world.add_mover("visitor", [(12.0, 7.7), (2.0, 7.7)], radius=0.25, speed=0.6)
    with simulation(world), mover("robot_0") as client:
        client.send_goal(goal_at(Pose2D(12.0, 7.7, 0)))
        gap = watch_gaps(clock, world, lambda: client.get_state() == GoalStatus.SUCCEEDED)
        assert gap > 0.0
        assert walker.x < 11.0


def test_a_moving_obstacle_goes_back_and_forth(clock, node, world):
    walker = world.add_mover("visitor", [(3.0, 7.7), (6.0, 7.7)], speed=1.0)
    with simulation(world):
        clock.sleep(3.0)
        assert walker.x == pytest.approx(5.5, abs=0.3)
        clock.sleep(2.5)
        turned = walker.x
        clock.sleep(0.5)
        assert walker.x < turned


def test_what_moved_is_remembered_where_it_was_seen_until_the_costmap_is_cleared(
    clock, node, add, world
):
    robot = add("robot_0", 9.0, 7.7)
    walker = world.add_mover("visitor", [(9.0, 10.2)])
    with simulation(world) as made:
        clear = ServiceProxy("robot_0/move_base/clear_costmaps", Empty)
        clear()
        assert [seen.name for seen in robot.traffic.values()] == ["visitor"]
        with made.stepper.lock:
            robot.body.x, walker.x = 11.0, 20.0  # behind the wall of the corridor
            robot.look()
        assert [(seen.x, seen.y) for seen in robot.traffic.values()] == [(9.0, 10.2)]
        clear()
        assert robot.traffic == {}


def test_what_moved_on_is_forgotten_when_its_place_is_seen_empty(node, add, world):
    robot = add("robot_0", 9.0, 7.7)
    walker = world.add_mover("visitor", [(11.0, 7.7)])
    robot.forget()
    assert [seen.x for seen in robot.traffic.values()] == [11.0]
    walker.x = 20.0
    robot.look()
    assert robot.traffic == {}


def test_walls_hide_what_moves(node, add, world):
    robot = add("robot_0", 9.0, 7.7)
    world.add_mover("visitor", [(7.4, 9.8)])
    robot.forget()
    assert robot.traffic == {}


# -- doors -----------------------------------------------------------------------------------------

DOORWAY = (3.9, 8.8, 4.9, 8.8)  # of the kitchen, which has no other
KITCHEN = Pose2D(4.6, 10.6, NORTH)


def test_a_door_opens_in_its_time_and_says_so(clock, node, world):
    world.add_door("kitchen", DOORWAY, travel=3.0)
    told = []
    with simulation(world), Subscriber("doors/kitchen/open", Bool, lambda m: told.append(m.data)):
        clock.sleep(0.1)
        answer = ServiceProxy("doors/kitchen/set", SetBool)(True)
        assert (answer.success, answer.message) == (True, "door kitchen opens")
        clock.sleep(2.5)
        assert told == [False]
        clock.sleep(1.0)
        assert told == [False, True]
        answer = ServiceProxy("doors/kitchen/set", SetBool)(True)
        assert (answer.success, answer.message) == (True, "door kitchen is open")
        ServiceProxy("doors/kitchen/set", SetBool)(False)
        clock.sleep(0.6)
        assert told == [False, True, False]


def test_a_closed_door_is_in_the_way_until_it_is_open(clock, node, add, world):
    robot = add("robot_0", 4.4, 7.6, NORTH)
    world.add_door("kitchen", DOORWAY, travel=2.0)
    with simulation(world), mover("robot_0") as client:
        client.send_goal_and_wait(goal_at(KITCHEN))
        assert client.get_state() == GoalStatus.ABORTED
        assert "every path is blocked; closed: door kitchen" in client.get_goal_status_text()
        assert robot.body.y < 8.5
        ServiceProxy("doors/kitchen/set", SetBool)(True)
        clock.sleep(2.2)
        client.send_goal_and_wait(goal_at(KITCHEN))
        assert client.get_state() == GoalStatus.SUCCEEDED


def test_a_closed_door_is_driven_around_when_there_is_another_way(clock, node, add, world):
    add("robot_0", 9.0, 7.6, NORTH)
    world.add_door("meeting", (8.5, 8.8, 9.5, 8.8))
    with simulation(world), mover("robot_0") as client:
        client.send_goal_and_wait(goal_at(Pose2D(9.0, 10.4, NORTH)))
        assert client.get_state() == GoalStatus.SUCCEEDED
        assert world.robots[0].odometer > 10.0


def test_a_robot_that_waits_goes_on_when_the_door_opens(clock, node, add, world):
    add("robot_0", 4.4, 7.6, NORTH)
    world.add_door("kitchen", DOORWAY, travel=2.0)
    with simulation(world), mover("robot_0") as client:
        client.send_goal(goal_at(KITCHEN))
        clock.sleep(3.0)
        ServiceProxy("doors/kitchen/set", SetBool)(True)
        client.wait_for_result(60.0)
        assert client.get_state() == GoalStatus.SUCCEEDED


def test_a_door_does_not_close_on_a_robot(clock, node, add, world):
    add("robot_0", 4.4, 8.8, NORTH)
    door = world.add_door("kitchen", DOORWAY, is_open=True)
    with simulation(world):
        answer = ServiceProxy("doors/kitchen/set", SetBool)(False)
        assert not answer.success
        assert answer.message == "door kitchen: robot_0 stands in the doorway; try again later"
        assert door.is_open


# -- docks -----------------------------------------------------------------------------------------


def test_a_dock_charges_one_robot_and_refuses_the_other(clock, node, add, world):
    add("robot_0", 9.8, 7.1, charge=0.5, capacity=1.0)
    add("robot_1", 10.4, 7.1, charge=0.5, capacity=1.0)
    world.add_dock("middle", Pose2D(9.8, 7.1, 0))
    with simulation(world):
        first = SimpleActionClient("robot_0/charge", ChargeAction)
        second = SimpleActionClient("robot_1/charge", ChargeAction)
        assert first.wait_for_server(1.0)
        assert second.wait_for_server(1.0)
        first.send_goal(ChargeGoal(until=0.9))
        second.send_goal_and_wait(ChargeGoal(until=0.9))
        assert second.get_state() == GoalStatus.ABORTED
        assert "robot_0 holds it" in second.get_goal_status_text()
        assert first.wait_for_result(60.0)
        assert first.get_state() == GoalStatus.SUCCEEDED


# -- the whole -------------------------------------------------------------------------------------


def test_the_office_has_robots_by_number(clock, node):
    with simulation(robots=5) as made:
        assert list(made.robots) == [f"robot_{i}" for i in range(5)]
        bodies = [robot.body for robot in made.world.robots]
        for i, a in enumerate(bodies):
            for b in bodies[:i]:
                assert a.pose.distance(b.pose) > 0.9


def test_more_robots_than_places_are_refused(office, office_robot):
    with pytest.raises(NavigationError, match=r"got 9000 robots; expected \d+ at most"):
        place_robots(office, office_robot, 9000)


def test_a_removed_robot_is_off_the_network_and_the_floor(clock, node, add, world):
    add("robot_0", 3.0, 7.7)
    add("robot_1", 7.0, 7.7)
    with simulation(world) as made, mover("robot_1") as client:
        client.send_goal(goal_at(Pose2D(12, 7.7, 0)))
        clock.sleep(1.0)
        made.remove("robot_1")
        client.wait_for_result(1.0)
        assert client.get_state() in {GoalStatus.ABORTED, GoalStatus.LOST}
        assert [robot.name for robot in world.robots] == ["robot_0"]
        assert len(world.discs) == 1


def test_two_robots_of_one_name_are_refused(clock, network, node, add, office, strong, world):
    add("robot_0", 3.0, 7.7)
    with simulation(world):
        other = World(office)
        Robot(other, strong, Pose2D(3.0, 7.7, 0), 0.0, "robot_0")
        with Node("other", transport=network.session(), clock=clock) as second:
            with pytest.raises(ServerConflictError):
                with simulation(other, node=second):
                    pass


def test_a_robot_that_finds_an_older_one_later_ends_the_whole(node, add, world):
    add("robot_0", 3.0, 7.7)
    add("robot_1", 6.0, 7.7)
    with simulation(world) as made:
        error = ServerConflictError("robot_1/move_base", ("a", "1"), ("b", "2"))
        made.servers["robot_1"]._move.action_server.keeper.on_conflict(error)
        with pytest.raises(ServerConflictError, match="'robot_1/move_base': two servers"):
            made.wait()


def test_the_same_world_twice_is_the_same(office, strong):
    def run():
        with VirtualClock(seed=3) as clock, use_clock(clock):
            session = MemoryNetwork(clock).session()
            with Node("test", transport=session, clock=clock) as node, use_node(node):
                with simulation(robots=4) as made:
                    clients = []
                    for i, name in enumerate(made.robots):
                        client = SimpleActionClient(f"{name}/move_base", MoveBaseAction)
                        client.wait_for_server(1.0)
                        client.send_goal(goal_at(Pose2D(3.0 + 2.0 * i, 7.7, 0.0)))
                        clients.append(client)
                    for client in clients:
                        client.wait_for_result(60.0)
                    return clock.now(), [robot.body.pose for robot in made.world.robots]

    assert run() == run()


def test_robots_of_different_rates_are_refused(clock, node, add, world, strong):
    add("robot_0", 3.0, 7.7)
    fast = replace(strong, control=replace(strong.control, rate=50.0))
    Robot(world, fast, Pose2D(6.0, 7.7, 0), 0.0, "robot_1")
    with pytest.raises(MissionError, match=r"robot_1: control\.rate: got 50 Hz; expected 20 Hz"):
        with simulation(world):
            pass


def test_a_robot_cannot_start_where_another_stands(clock, node, add):
    add("robot_0", 3.0, 7.7)
    with pytest.raises(NavigationError, match=r"\(3.20, 7.70\) is taken by robot_0"):
        add("robot_1", 3.2, 7.7)


def test_robots_that_stand_take_no_steps(clock, node, add, world, monkeypatch):
    for i in range(5):
        add(f"robot_{i}", 3.0 + i, 7.7)
    steps = []
    monkeypatch.setattr(Robot, "step", lambda *_: steps.append(1))
    with simulation(world):
        clock.sleep(60.0)
    assert steps == []


def test_a_server_alone_steps_itself(clock, node, add):
    robot = add("robot_0", 3.0, 7.7)
    server = RobotServer(robot, node=node)
    server.start()
    with mover("") as client:
        client.send_goal_and_wait(goal_at(Pose2D(4.0, 7.7, 0)))
        assert client.get_state() == GoalStatus.SUCCEEDED
    server.close()
