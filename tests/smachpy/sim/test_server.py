from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.exceptions import ServerConflictError
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped, Twist, Vector3
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.interfaces.std_srvs.srv import Empty
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import Publisher, Subscriber, wait_for_message
from smachpy.places.maps import OFFICE_ROBOT
from smachpy.places.occupancy import OCCUPIED, OccupancyMap
from smachpy.places.pose import Pose2D, wrap_angle
from smachpy.places.robot_file import load_config
from smachpy.sim.interfaces import ChargeAction, ChargeGoal
from smachpy.sim.pilot import Pilot
from smachpy.sim.server import RobotServer
from smachpy.sim.world import Robot, World
from smachpy.states import goal_at

OFFICE_1 = Pose2D(2.0, 3.0, 0.0)
OPEN_PLAN = Pose2D(16.5, 10.4, 1.57)


@pytest.fixture
def client(simulation):
    client = SimpleActionClient("move_base", MoveBaseAction)
    assert client.wait_for_server(1.0)
    return client


def drive(client, pose, frame="map"):
    client.send_goal(goal_at(pose, frame))
    assert client.wait_for_result(300.0)
    return client.get_state(), client.get_goal_status_text()


def test_it_drives_to_a_goal_and_reports_its_pose_five_times_a_second(clock, simulation, client):
    poses = []
    start = clock.now()
    client.send_goal(goal_at(OFFICE_1), feedback_cb=lambda f: poses.append((clock.now(), f)))
    client.wait_for_result()
    assert client.get_state() == GoalStatus.SUCCEEDED
    assert simulation.robot.body.pose.distance(OFFICE_1) < 0.05
    times = [t - start for t, _ in poses]
    assert times == pytest.approx([0.1 + 0.2 * i for i in range(len(times))], abs=0.06)
    base = [f.base_position for _, f in poses]
    assert {b.header.frame_id for b in base} == {"map"}
    assert base[-1].pose.position.x == pytest.approx(2.0, abs=0.05)
    assert base[0].header.stamp < base[-1].header.stamp


@pytest.mark.parametrize(
    ("pose", "frame", "text"),
    [
        (Pose2D(0.5, 5.0, 0), "map", "in a wall"),
        (Pose2D(99, 0, 0), "map", "outside the map"),
        (Pose2D(0.75, 5.0, 0), "map", "too near to a wall"),
        (Pose2D(1, 0, 0), "odom", "goal frame: got 'odom'; expected 'map' or 'base_link'"),
        (Pose2D(1, 0, 0), "", "goal frame: got ''"),
    ],
)
def test_an_impossible_goal_is_aborted_with_the_reason_and_nothing_moves(
    simulation, client, pose, frame, text
):
    status, why = drive(client, pose, frame)
    assert status == GoalStatus.ABORTED
    assert text in why
    assert simulation.robot.odometer == 0.0


def test_a_goal_that_is_no_number_is_aborted(simulation, client):
    goal = goal_at(OFFICE_1)
    goal.target_pose.pose.position.x = math.nan
    client.send_goal_and_wait(goal)
    assert client.get_state() == GoalStatus.ABORTED
    assert "no finite numbers" in client.get_goal_status_text()
    assert simulation.robot.odometer == 0.0


def test_an_orientation_of_zeros_is_refused(client):
    client.send_goal_and_wait(MoveBaseGoal(target_pose=PoseStamped()))
    assert "all zeros are no rotation" in client.get_goal_status_text()


def test_a_goal_in_the_robots_own_frame_is_relative(simulation, client):
    before = simulation.robot.body.pose
    assert drive(client, Pose2D(1, 0, 0), "/base_link")[0] == GoalStatus.SUCCEEDED
    expected = before.then(Pose2D(1, 0, 0))
    assert simulation.robot.body.pose.distance(expected) < 0.05
    assert abs(wrap_angle(simulation.robot.body.yaw - expected.yaw)) < 0.05


def test_cancel_stops_it_within_its_braking_distance(clock, simulation, client):
    client.send_goal(goal_at(OFFICE_1))
    clock.sleep(5.0)
    body = simulation.robot.body
    assert body.speed > 1.0
    before, allowed = body.pose, body.braking_distance() + body.speed * 0.1
    client.cancel_goal()
    client.wait_for_result(5.0)
    assert client.get_state() == GoalStatus.PREEMPTED
    assert body.standing
    assert body.pose.distance(before) <= allowed


def test_a_newer_goal_takes_over_without_a_stop(clock, simulation, client):
    other = SimpleActionClient("move_base", MoveBaseAction)
    client.send_goal(goal_at(OFFICE_1))
    clock.sleep(4.0)
    speed = simulation.robot.body.speed
    other.send_goal(goal_at(Pose2D(4.6, 10.6, 0)))
    clock.sleep(0.11)
    assert client.get_state() == GoalStatus.PREEMPTED
    assert simulation.robot.body.speed > speed / 2
    other.wait_for_result()
    assert other.get_state() == GoalStatus.SUCCEEDED
    assert simulation.robot.body.pose.distance(Pose2D(4.6, 10.6, 0)) < 0.05


def test_a_newer_goal_that_is_impossible_stops_it(clock, simulation, client):
    client.send_goal(goal_at(OFFICE_1))
    clock.sleep(4.0)
    other = SimpleActionClient("move_base", MoveBaseAction)
    other.send_goal_and_wait(goal_at(Pose2D(0.5, 5.0, 0)))
    assert other.get_state() == GoalStatus.ABORTED
    assert simulation.robot.body.standing


def test_the_way_is_planned_anew_when_it_is_blocked(clock, simulation, client):
    client.send_goal(goal_at(OPEN_PLAN))
    clock.sleep(1.0)
    simulation.world.add_obstacle(13.0, 7.8, 0.4)
    client.wait_for_result()
    assert client.get_state() == GoalStatus.SUCCEEDED


def test_a_way_that_stays_blocked_is_given_up(simulation, client):
    for y in (6.9, 7.6, 8.3):
        simulation.world.add_obstacle(6.0, y, 0.4)
    status, why = drive(client, OFFICE_1)
    assert status == GoalStatus.ABORTED
    assert "every path is blocked; gave up after 3 recoveries" in why


def test_closing_the_server_aborts_the_goal(clock, simulation, client):
    client.send_goal(goal_at(OFFICE_1))
    clock.sleep(2.0)
    simulation.server.close()
    assert client.wait_for_result(1.0)
    assert client.get_state() == GoalStatus.ABORTED


def test_an_empty_battery_stops_it(office_robot, simulate):
    battery = replace(office_robot.battery, charge=0.05)
    with simulate(replace(office_robot, battery=battery)) as simulation:
        client = SimpleActionClient("move_base", MoveBaseAction)
        client.wait_for_server()
        status, why = drive(client, OFFICE_1)
        assert (status, why) == (GoalStatus.ABORTED, "the battery is empty")
        assert simulation.robot.body.standing


def test_odometry_and_battery_can_be_watched_at_rest_and_on_the_way(clock, simulation, client):
    odometry = wait_for_message("odom", Odometry, 1.0)
    assert odometry.pose.pose.position.x == pytest.approx(9.8)
    assert (odometry.header.frame_id, odometry.child_frame_id) == ("odom", "base_link")
    battery = wait_for_message("battery", BatteryState, 1.0)
    assert battery.percentage == pytest.approx(1.0, abs=1e-3)
    assert battery.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    seen = []
    with Subscriber("odom", Odometry, lambda message: seen.append(message)):
        drive(client, OFFICE_1)
        clock.sleep(0.1)
    assert max(m.twist.twist.linear.x for m in seen) > 1.0
    assert seen[-1].twist.twist.linear.x == pytest.approx(0.0, abs=1e-6)


def test_the_first_odometry_of_who_comes_later_is_not_old(clock, simulation, client):
    client.send_goal(goal_at(OFFICE_1))
    for _ in range(7):
        clock.sleep(0.53)
        pose = wait_for_message("odom", Odometry, 1.0).pose.pose.position
        body = simulation.robot.body
        assert math.hypot(pose.x - body.x, pose.y - body.y) <= 0.3 * abs(body.speed) + 0.05


# -- charging --------------------------------------------------------------------------------------


@pytest.fixture
def charger(office_robot, simulate):
    battery = replace(office_robot.battery, charge=0.2)
    with simulate(replace(office_robot, battery=battery)) as simulation:
        client = SimpleActionClient("charge", ChargeAction)
        assert client.wait_for_server(1.0)
        yield simulation, client


def test_it_charges_at_its_dock(clock, charger):
    simulation, client = charger
    seen, start = [], clock.now()
    client.send_goal(ChargeGoal(until=0.9), feedback_cb=seen.append)
    client.wait_for_result()
    assert client.get_state() == GoalStatus.SUCCEEDED
    assert client.get_result().charge == pytest.approx(0.9, abs=1e-3)
    config = simulation.robot.config.battery
    assert clock.now() - start == pytest.approx(
        0.7 * config.capacity * 3600 / config.charge_power, abs=0.01
    )
    assert [f.charge for f in seen] == sorted(f.charge for f in seen)
    assert simulation.robot.battery.power < 0


def test_charging_can_be_stopped(clock, charger):
    simulation, client = charger
    client.send_goal(ChargeGoal(until=0.9))
    clock.sleep(1.2)
    start = clock.now()
    client.cancel_goal()
    client.wait_for_result()
    assert client.get_state() == GoalStatus.PREEMPTED
    assert clock.now() == start
    assert 0.2 < client.get_result().charge < 0.9
    assert simulation.robot.battery.power < 0


@pytest.mark.parametrize(("until", "text"), [(0.0, "expected more than 0"), (1.5, "at most 1")])
def test_a_charge_that_cannot_be_reached_is_refused(charger, until, text):
    _, client = charger
    client.send_goal_and_wait(ChargeGoal(until=until))
    assert client.get_state() == GoalStatus.ABORTED
    assert text in client.get_goal_status_text()


def test_it_charges_only_at_the_dock(charger):
    simulation, client = charger
    simulation.robot.body.x += 3.0
    client.send_goal_and_wait(ChargeGoal(until=0.9))
    assert "3.0 m away from its dock; drive to (9.80, 7.10) first" in client.get_goal_status_text()


def test_driving_off_ends_the_charging(clock, charger):
    simulation, client = charger
    move = SimpleActionClient("move_base", MoveBaseAction)
    client.send_goal(ChargeGoal(until=1.0))
    clock.sleep(1.0)
    move.send_goal(goal_at(OFFICE_1))
    client.wait_for_result()
    assert client.get_state() == GoalStatus.ABORTED
    assert client.get_goal_status_text() == "the robot left the dock"
    assert simulation.robot.battery.power < 0
    move.cancel_goal()
    move.wait_for_result()


def test_without_a_dock_there_is_no_charging(office_robot, simulate):
    with simulate(replace(office_robot, dock=None)):
        client = SimpleActionClient("charge", ChargeAction)
        client.wait_for_server()
        client.send_goal_and_wait(ChargeGoal(until=0.9))
        assert client.get_goal_status_text() == "this robot has no dock"


# -- by hand ---------------------------------------------------------------------------------------


@pytest.fixture
def teleop(clock, simulation):
    """Sends a speed ten times a second for some seconds."""
    with Publisher("cmd_vel", Twist) as publisher:

        def send(speed, turn_rate, seconds):
            for _ in range(round(seconds * 10)):
                publisher.publish(Twist(linear=Vector3(x=speed), angular=Vector3(z=turn_rate)))
                clock.sleep(0.1)

        yield send


def test_it_is_driven_by_hand_within_its_acceleration(clock, simulation, teleop):
    body, limits = simulation.robot.body, simulation.robot.config.robot
    before = body.pose
    teleop(0.5, 0.0, 0.2)
    assert 0.0 < body.speed <= 0.3 * limits.acceleration
    teleop(0.5, 0.0, 1.0)
    assert body.speed == pytest.approx(0.5)
    clock.sleep(2.0)
    assert body.standing
    ahead = before.then(Pose2D(before.distance(body.pose), 0, 0))
    assert body.pose.distance(ahead) < 1e-6
    assert 0.5 * 1.2 < before.distance(body.pose) < 0.5 * (1.2 + 0.5 + 0.4)


def test_it_stops_half_a_second_after_the_last_message(clock, simulation, teleop):
    teleop(0.4, 0.0, 0.5)
    clock.sleep(0.35)
    assert simulation.robot.body.speed == pytest.approx(0.4)
    clock.sleep(0.5)
    assert simulation.robot.body.standing


def test_it_turns_by_hand(clock, simulation, teleop):
    before = simulation.robot.body.yaw
    teleop(0.0, 0.5, 2.0)
    clock.sleep(1.0)
    turned = wrap_angle(simulation.robot.body.yaw - before)
    assert turned == pytest.approx(0.5 * 2.4, abs=0.12)
    assert simulation.robot.odometer == 0.0


@pytest.mark.parametrize("speed", [5.0, 0.3])
def test_driven_by_hand_it_stops_before_a_wall_without_a_bump(simulation, teleop, speed):
    bumps = []
    step = simulation.robot.step

    def watch(*arguments):
        step(*arguments)
        bumps.append(simulation.robot.bumped)

    simulation.robot.step = watch
    teleop(speed, 0.0, 8.0)
    body = simulation.robot.body
    assert body.standing
    assert len(bumps) > 50
    assert not any(bumps)
    nose = body.pose.then(Pose2D(0.25 + 0.12, 0, 0))
    row, column = simulation.world.map.cell(nose.x, nose.y)
    assert (simulation.world.map.cells[row - 2 : row + 3, column - 2 : column + 3] == 100).any()


@pytest.mark.parametrize("speed", [0.05, 0.5])
def test_it_is_driven_by_hand_on_a_coarse_map_too(speed):
    hall = OccupancyMap(np.zeros((20, 20), np.int8), 0.5, Pose2D(0, 0, 0))
    robot = Robot(World(hall), load_config(OFFICE_ROBOT), Pose2D(5, 5, 0), 0.0)
    pilot = Pilot(robot)
    for i in range(40):
        pilot.override(0.05 * i, (speed, 0.0))
        pilot.step(0.05 * i, 0.05)
    assert robot.body.speed == pytest.approx(speed)


@pytest.mark.parametrize("command", [(100.0, 1000.0), (1e200, 1e201), (-1e200, 1e201)])
def test_a_command_beyond_its_limits_is_looked_at_within_them(monkeypatch, command):
    """It looked ahead on a circle for as long as the braking distance, and the world stood."""
    hall = OccupancyMap(np.zeros((100, 100), np.int8), 0.1, Pose2D(0, 0, 0))
    robot = Robot(World(hall), load_config(OFFICE_ROBOT), Pose2D(5, 5, 0), 0.0)
    looks = iter(range(1000))
    monkeypatch.setattr(robot, "_hits", lambda *_: next(looks) < 0)
    pilot = Pilot(robot)
    pilot.override(0.0, command)
    for i in range(10):
        pilot.step(0.05 * i, 0.05)
    assert math.copysign(1.0, robot.body.speed) == math.copysign(1.0, command[0])
    assert not robot.body.standing


@pytest.mark.parametrize("cell", [0.05, 0.1])
@pytest.mark.parametrize("ahead", [i / 90 for i in range(10)])
def test_where_it_was_driven_by_hand_it_can_be_sent_again(cell, ahead):
    config = load_config(OFFICE_ROBOT)
    hall = OccupancyMap(np.zeros((100, 100), np.int8), cell, Pose2D(0, 0, 0))
    hall.cells[:, 60:] = OCCUPIED
    robot = Robot(World(hall), config, Pose2D(60 * cell - 1.0 - ahead, 50 * cell, 0.0), 0.0)
    pilot = Pilot(robot)
    for i in range(100):
        pilot.override(0.05 * i, (0.5, 0.0))
        pilot.step(0.05 * i, 0.05)
    assert robot.body.standing
    robot.check_place(robot.body.x, robot.body.y)
    assert robot.body.x > 60 * cell - 0.25 - 4 * cell


def test_a_goal_waits_while_somebody_drives_by_hand_and_goes_on_afterwards(
    clock, simulation, client, teleop
):
    client.send_goal(goal_at(OFFICE_1))
    clock.sleep(2.0)
    teleop(-0.2, 0.0, 3.0)
    assert simulation.robot.body.speed == pytest.approx(-0.2)
    assert client.get_state() == GoalStatus.ACTIVE
    client.wait_for_result()
    assert client.get_state() == GoalStatus.SUCCEEDED
    assert simulation.robot.body.pose.distance(OFFICE_1) < 0.05


def test_a_cancel_does_not_wait_for_the_hand(clock, simulation, client, teleop):
    client.send_goal(goal_at(OFFICE_1))
    clock.sleep(2.0)
    teleop(0.1, 0.0, 1.0)
    client.cancel_goal()
    clock.sleep(0.2)
    assert client.get_state() == GoalStatus.PREEMPTED
    assert simulation.robot.body.speed == pytest.approx(0.1)


@pytest.mark.parametrize("topic", ["odom", "battery", "tf_static", "map", "scan", "plan"])
def test_a_listener_of_another_type_does_not_stop_the_robot(clock, simulation, client, topic):
    """The thread that moves all robots ended, and so did no goal."""
    Subscriber(topic, Twist, lambda _: None)
    clock.sleep(20.0)
    assert drive(client, OFFICE_1) == (GoalStatus.SUCCEEDED, "arrived")


def test_a_speed_that_is_no_number_stops_it(clock, simulation, teleop, caplog):
    teleop(0.4, 0.0, 1.0)
    teleop(math.nan, 0.0, 0.1)
    clock.sleep(0.5)
    assert simulation.robot.body.standing
    assert "cmd_vel: got a speed that is no finite number" in caplog.text


# -- the costmap -----------------------------------------------------------------------------------


def test_clear_costmaps_forgets_obstacles_that_went_unseen(clock, simulation, client):
    world, robot = simulation.world, simulation.robot
    obstacles = [world.add_obstacle(6.0, y, 0.4) for y in (6.9, 7.6, 8.3)]
    assert drive(client, OFFICE_1)[0] == GoalStatus.ABORTED
    assert drive(client, Pose2D(11.5, 8.0, 0))[0] == GoalStatus.SUCCEEDED
    for obstacle in obstacles:
        world.remove_obstacle(obstacle)
    assert set(robot.known_obstacles) == set(obstacles)
    ServiceProxy("move_base/clear_costmaps", Empty)()
    assert robot.known_obstacles == ()
    start = robot.body.pose
    client.send_goal(goal_at(OFFICE_1))
    clock.sleep(4.0)
    assert robot.body.pose.distance(start) > 1.0
    client.wait_for_result()
    assert client.get_state() == GoalStatus.SUCCEEDED


def test_clear_costmaps_sees_at_once_what_is_still_there(simulation):
    obstacle = simulation.world.add_obstacle(11.5, 7.8, 0.3)
    ServiceProxy("move_base/clear_costmaps", Empty)()
    assert simulation.robot.known_obstacles == (obstacle,)


# -- names -----------------------------------------------------------------------------------------


def test_two_robots_of_one_name_are_refused(simulation):
    with pytest.raises(ServerConflictError, match="two servers"):
        RobotServer(simulation.robot, node=simulation.node).start()


def test_a_namespace_holds_its_own_robot(office_robot, simulate):
    with simulate(office_robot, namespace="robot_1") as simulation:
        client = SimpleActionClient("/robot_1/move_base", MoveBaseAction, node=simulation.node)
        assert client.wait_for_server(1.0)
        client.send_goal_and_wait(goal_at(Pose2D(0.5, 0, 0), "robot_1/base_link"))
        assert client.get_state() == GoalStatus.SUCCEEDED
        client.send_goal_and_wait(goal_at(Pose2D(0.5, 0, 0), "robot_2/base_link"))
        assert "expected 'map' or 'robot_1/base_link'" in client.get_goal_status_text()
