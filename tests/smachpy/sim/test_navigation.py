from __future__ import annotations

import itertools
import math

import pytest

from smachpy.places.exceptions import NavigationError
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.occupancy import load_map
from smachpy.places.pose import Pose2D, wrap_angle
from smachpy.places.robot_file import load_config
from smachpy.sim.navigation import brake, drive_to
from smachpy.sim.world import Robot, World

DT = 0.05
START = Pose2D(9.8, 7.1, math.pi / 2)


@pytest.fixture(scope="module")
def grid():
    return load_map(OFFICE_MAP)


@pytest.fixture(scope="module")
def config():
    return load_config(OFFICE_ROBOT)


@pytest.fixture
def world(grid):
    return World(grid)


@pytest.fixture
def robot(world, config):
    return Robot(world, config, START, 0.0)


def run(robot, commands, events=None, longest=4000, poses=None):
    """Step through the commands; events: step -> callable. Returns the poses."""
    poses = [] if poses is None else poses
    for step, command in enumerate(commands):
        if events and step in events:
            events[step]()
        robot.step(step * DT, DT, command)
        poses.append(robot.body.pose)
        assert step < longest
    return poses


@pytest.mark.parametrize(
    "goal",
    [
        Pose2D(2.0, 3.0, 0.0),
        Pose2D(24.3, 10.5, math.pi),
        Pose2D(9.8, 7.1, -math.pi / 2),
        Pose2D(9.75, 7.2, 0.3),
        Pose2D(25.0, 2.5, -2.0),
        Pose2D(8.0, 10.0, 3.0),
    ],
)
def test_it_arrives_at_rest_within_the_tolerances(robot, config, goal):
    poses = run(robot, drive_to(robot, goal))
    assert robot.body.standing
    assert robot.body.pose.distance(goal) <= config.control.xy_tolerance
    assert abs(wrap_angle(robot.body.yaw - goal.yaw)) <= config.control.yaw_tolerance
    assert not any(robot.planner.costmap.touches(p.x, p.y) for p in poses)


@pytest.mark.parametrize("ahead", [0.0, 0.004, 0.05, -0.1])
def test_a_robot_in_full_speed_stops_at_a_goal_where_it_is(robot, config, ahead):
    commands = drive_to(robot, Pose2D(2.0, 3.0, 0.0))
    run(robot, itertools.islice(commands, round(3.0 / DT)))
    assert robot.body.speed > 0.3
    x, y, yaw = robot.body.pose
    goal = Pose2D(x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), yaw)
    run(robot, drive_to(robot, goal))
    assert robot.body.standing
    assert robot.body.pose.distance(goal) <= config.control.xy_tolerance


def test_it_does_not_swing_about_the_way(robot):
    poses = run(robot, drive_to(robot, Pose2D(16.5, 10.4, 0)))
    turns = [wrap_angle(b.yaw - a.yaw) for a, b in itertools.pairwise(poses)]
    changes = sum(1 for a, b in itertools.pairwise(turns) if a * b < -1e-7)
    assert changes <= 12


def test_the_same_drive_twice_is_the_same(grid, config):
    drives = []
    for _ in range(2):
        robot = Robot(World(grid), config, START, 0.0)
        drives.append(run(robot, drive_to(robot, Pose2D(2.0, 3.0, 0))))
    assert drives[0] == drives[1]


def test_a_goal_in_a_wall_is_refused_at_once(robot):
    with pytest.raises(NavigationError, match="in a wall"):
        next(drive_to(robot, Pose2D(0.5, 5.0, 0)))


def test_it_drives_around_an_obstacle_that_appears(world, robot):
    run(
        robot,
        drive_to(robot, Pose2D(16.5, 10.4, 0)),
        {30: lambda: world.add_obstacle(13, 7.8, 0.4)},
    )
    assert robot.body.pose.distance(Pose2D(16.5, 10.4, 0)) < 0.05
    assert robot.known_obstacles == world.obstacles


def test_it_stops_before_something_put_right_in_front(world, robot, config):
    bumps = []

    def drop():
        ahead = Pose2D(*robot.body.pose).then(Pose2D(0.75, 0, 0))
        world.add_obstacle(ahead.x, ahead.y, 0.2)

    commands = drive_to(robot, Pose2D(16.5, 10.4, 0))
    for step, command in enumerate(commands):
        if step == 60:
            drop()
        robot.step(step * DT, DT, command)
        bumps.append(robot.bumped)
        for o in world.obstacles:
            assert robot.body.pose.distance(Pose2D(o.x, o.y, 0)) >= 0.2 + config.robot.radius
        assert step < 4000
    assert robot.body.pose.distance(Pose2D(16.5, 10.4, 0)) < 0.05


def block_corridor(world):
    return [world.add_obstacle(6.0, y, 0.4) for y in (6.9, 7.6, 8.3)]


def test_a_blocked_way_is_given_up_after_its_recoveries(world, robot, config):
    block_corridor(world)
    poses = []
    with pytest.raises(NavigationError, match=r"no way to .*; gave up after 3 recoveries"):
        run(robot, drive_to(robot, Pose2D(2.0, 3.0, 0)), poses=poses)
    turned = sum(abs(wrap_angle(b.yaw - a.yaw)) for a, b in itertools.pairwise(poses))
    assert turned > 3 * 2 * math.pi
    assert not any(robot.planner.costmap.touches(p.x, p.y) for p in poses)


def test_it_goes_on_when_the_way_is_free_again(world, robot):
    obstacles = block_corridor(world)

    def clear():
        for obstacle in obstacles:
            world.remove_obstacle(obstacle)

    goal = Pose2D(2.0, 3.0, 0)
    run(robot, drive_to(robot, goal), {200: clear})
    assert robot.body.pose.distance(goal) < 0.05
    assert robot.known_obstacles == ()


def test_braking_ends_within_the_braking_distance(robot, config):
    commands = drive_to(robot, Pose2D(2.0, 3.0, 0))
    for step in range(100):
        robot.step(step * DT, DT, next(commands))
    assert robot.body.speed > 1.0
    start, allowed = robot.body.pose, robot.body.braking_distance()
    run(robot, brake(robot))
    assert robot.body.standing
    assert robot.body.pose.distance(start) <= allowed + 0.01


def test_a_robot_cannot_start_in_a_wall(world, config):
    with pytest.raises(NavigationError, match=r"start pose: \(0.50, 5.00\) is in a wall"):
        Robot(world, config, Pose2D(0.5, 5.0, 0), 0.0)


def test_the_battery_drains_with_the_distance(robot, config):
    before = robot.battery.charge(0.0)
    poses = run(robot, drive_to(robot, Pose2D(2.0, 3.0, 0)))
    seconds = len(poses) * DT
    used = (before - robot.battery.charge(seconds)) * config.battery.capacity * 3600
    full = config.battery.drive_power / config.robot.max_speed
    expected = config.battery.idle_power * seconds + full * robot.odometer
    assert used == pytest.approx(expected, rel=0.02)


def test_a_way_that_comes_back_to_where_it_was_does_not_keep_it_turning(world, config):
    """It begins nearer to a chair than a way may be, so the way first leads out and back."""
    robot = Robot(world, config, Pose2D(14.0, 15.9, 0.0), 0.0)
    robot.body.x, robot.body.y, robot.body.yaw = 13.952, 15.848, 0.277
    run(robot, drive_to(robot, Pose2D(9.75, 14.65, -2.877)), longest=round(30 / DT))
    assert math.hypot(robot.body.x - 9.75, robot.body.y - 14.65) < config.control.xy_tolerance
